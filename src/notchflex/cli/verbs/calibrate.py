"""`notchflex calibrate`: from measurements to constants with confidence intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.data_sources import DataSources, Sources
from notchflex.cli.arguments.fit import BeyondFit, FitOptions, ParameterSpec
from notchflex.cli.arguments.pieces import InPieces
from notchflex.cli.arguments.robots import Columns, MeasuredAs, OnePath, Settings, read_data
from notchflex.cli.outputs import OUTPUT, JsonFile, Outputs, PlotFile
from notchflex.cli.terminal import BAD_INPUT, DONE, NOT_CONVERGED
from notchflex.support import check_folder, load_columns

if TYPE_CHECKING:
    from notchflex.fit import Calibration


def calibrate(
    *pairs: Sources,
    search: FitOptions,
    path: OnePath = None,
    measured: MeasuredAs = "ring",
    column: Columns = (),
    beyond: BeyondFit = BeyondFit(),  # noqa: B008 - frozen
    settings: Settings = (),
    pieces: InPieces = InPieces(),  # noqa: B008 - frozen
    output: Annotated[
        str | None,
        Parameter(
            name=("--output", "-o"),
            group=OUTPUT,
            metavar="FOLDER",
            help="Write the fitted robots into this folder, LABEL.toml each, with their comments.",
        ),
    ] = None,
    json: JsonFile = None,
    plot: PlotFile = None,
) -> int:
    """Find constants of robots from measurements, with confidence intervals.

    Prints every constant with its 95 % interval (profile likelihood; `open` where the data do not
    bound it), what the data cannot determine, and the errors of every notch beside their
    repeatability.
    """
    sources = DataSources.of(pairs)
    constants = search.constants()
    beyond.check(sources, search.objective)
    outputs = Outputs(sources.files, files=_fitted_files(sources, output), json=json, plot=plot)
    robots = sources.load(settings)
    folder = pieces.chosen("calibration", sources.files)
    candidates = None
    if beyond.next:
        robot = robots[beyond.next_robot or next(iter(robots))]
        candidates = load_columns(beyond.next, (), robot.number_of_tendons)

    with terminal.working("loading the solver"):
        terminal.use_compile_cache()
        import notchflex.fit as fitting

    _check_sensor(constants)
    data = {
        label: [read_data(file, robots[label], path, measured, column) for file in files]
        for label, files in sources.data.items()
    }
    with terminal.bars() as progress:
        fit = fitting.calibrate(
            robots,
            data,
            [fitting.Constant(*one) for one in constants],
            starts=search.starts,
            objective=search.fit_objective(),
            priors=search.priors,
            seed=search.seed,
            progress=progress,
            folder=folder,
        )
        analyses, problems = _analyse(fit, beyond, candidates, search.seed, progress)
    if output is not None:
        files = fitting.write_fitted(fit, output, inputs=sources.files)
        terminal.note(f"written: {', '.join(map(str, files))}.")
    _write(fit, analyses, outputs)
    for problem in problems:
        terminal.error(problem)
    if not fit.converged:
        terminal.error(f"not converged: {fit.reason}. Try --starts or --bounds.")
    return BAD_INPUT if problems else DONE if fit.converged else NOT_CONVERGED


def _check_sensor(constants: Sequence[ParameterSpec]) -> None:
    """Refuse an unknown constant of the measurement, which is in no robot file."""
    from notchflex.fit import SENSOR

    for name, *_ in constants:
        path = name.rpartition(":")[2]
        if path.startswith("sensor.") and path not in SENSOR:
            raise InputError.UNKNOWN_NAME(f"--fit {name}: give one of {', '.join(SENSOR)}.")


def _fitted_files(sources: DataSources, folder: str | None) -> dict[str, str]:
    """Return the files of `--output`, checked, by what messages call them."""
    if folder is None:
        return {}
    names = [f"{label}.toml" for label in sources.robots]
    files = check_folder(folder, names, "--output", inputs=sources.files)
    return {f"--output ({file.name})": str(file) for file in files}


def _analyse(
    fit: Calibration,
    beyond: BeyondFit,
    candidates: tuple[Any, Any] | None,
    seed: int,
    progress: Callable[[str, int, int], None] | None,
) -> tuple[dict[str, Any], list[str]]:
    """Make the analyses beyond the fit; one that fails must not lose the fit.

    Returns:
        The results by their options, and what failed.
    """
    import notchflex.fit as fitting
    from notchflex import LoadPath

    results: dict[str, Any] = {}
    problems: list[str] = []

    def attempt(option: str, analysis: Callable[..., object], **arguments: Any) -> None:
        try:
            results[option] = analysis(fit, **arguments)
        except InputError as problem:
            problems.append(f"{option}: {problem}")

    if by := beyond.leave_out:
        part = fitting.PHOTOGRAPH if beyond.photograph else None
        attempt(
            "--leave-out",
            fitting.leave_out,
            by=by,
            photograph=part,
            seed=seed,
            progress=progress,
        )
    if candidates is not None:
        attempt(
            "--next",
            fitting.next_measurement,
            candidates=LoadPath(*candidates),
            robot=beyond.next_robot,
            narrow=beyond.narrow,
        )
    if beyond.posterior:
        attempt(
            "--posterior",
            fitting.sample_posterior,
            draws=beyond.draws,
            seed=seed,
            progress=progress,
        )
    return results, problems


def _write(fit: Calibration, analyses: dict[str, Any], outputs: Outputs) -> None:
    import notchflex.fit as documents
    from notchflex.cli.tables import calibrate_tables as tables

    formats: dict[str, tuple[str, Callable[[Any], Any], Callable[[Any], None]]] = {
        "--leave-out": ("left_out", documents.left_out_document, tables.print_left_out),
        "--next": ("next_measurement", documents.next_measurement_document, tables.print_next),
        "--posterior": ("posterior", documents.posterior_document, tables.print_posterior),
    }

    def document() -> dict[str, Any]:
        parts = {formats[one][0]: formats[one][1](value) for one, value in analyses.items()}
        return documents.calibration_document(fit) | parts

    outputs.write_json(document)
    outputs.draw(fit)
    if outputs.prints_tables:
        tables.print_calibration(fit)
        for option, value in analyses.items():
            formats[option][2](value)
