"""`notchflex calibrate`: from measurements to constants with confidence intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.fit import (
    BeyondFit,
    DataSources,
    FitOptions,
    ParameterSpec,
    Sources,
)
from notchflex.cli.arguments.loads import load_columns
from notchflex.cli.arguments.measured import OnePath, from_rest, note_table
from notchflex.cli.arguments.robots import Settings
from notchflex.cli.outputs import OUTPUT, JsonFile, Outputs, PlotFile
from notchflex.cli.terminal import BAD_INPUT, DONE, NOT_CONVERGED
from notchflex.errors import InputError
from notchflex.results.files.writing import check_folder

if TYPE_CHECKING:
    from notchflex.fit import Calibration
    from notchflex.loads import LoadPath


def calibrate(
    *pairs: Sources,
    search: FitOptions,
    path: OnePath = None,
    beyond: BeyondFit = BeyondFit(),  # noqa: B008 - frozen
    settings: Settings = (),
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
    candidates = None
    if beyond.next:
        robot = robots[beyond.next_robot or next(iter(robots))]
        candidates = load_columns(beyond.next, (), robot.number_of_tendons)

    with terminal.working("loading the solver"):
        terminal.use_compile_cache()
        import notchflex.fit as fitting
        from notchflex.loads import LoadPath

    _check_sensor(constants)
    measured = {
        label: [
            fitting.read_measurements(file, robots[label], from_rest=from_rest(path))
            for file in files
        ]
        for label, files in sources.data.items()
    }
    for one in (one for every in measured.values() for one in every):
        note_table(one)
    with terminal.bars() as progress:
        found = fitting.calibrate(
            robots,
            measured,
            [fitting.Constant(*one) for one in constants],
            starts=search.starts,
            objective=search.fit_objective(),
            seed=search.seed,
            progress=progress,
        )
        loads = None if candidates is None else LoadPath(*candidates)
        analyses, problems = _analyse(found, beyond, loads, search.seed, progress)
    if output is not None:
        from notchflex.fit.fitted_robots import write_fitted

        files = write_fitted(found, output, inputs=sources.files)
        terminal.note(f"written: {', '.join(map(str, files))}.")
    _write(found, analyses, outputs)
    for problem in problems:
        terminal.error(problem)
    if not found.converged:
        terminal.error(f"not converged: {found.reason}. Try --starts or --bounds.")
    return BAD_INPUT if problems else DONE if found.converged else NOT_CONVERGED


def _check_sensor(constants: Sequence[ParameterSpec]) -> None:
    """Refuse an unknown constant of the measurement, which is in no robot file."""
    from notchflex.fit.model.rows import SENSOR

    for name, *_ in constants:
        path = name.rpartition(":")[2]
        if path.startswith("sensor.") and path not in SENSOR:
            raise InputError.UNKNOWN_NAME(f"--fit {name}: give {' or '.join(SENSOR)}.")


def _fitted_files(sources: DataSources, folder: str | None) -> dict[str, str]:
    """Return the files of `--output`, checked, by the words that messages call them by."""
    if folder is None:
        return {}
    names = [f"{label}.toml" for label in sources.robots]
    files = check_folder(folder, names, "--output", inputs=sources.files)
    return {f"--output ({file.name})": str(file) for file in files}


def _analyse(
    found: Calibration,
    beyond: BeyondFit,
    candidates: LoadPath | None,
    seed: int,
    progress: Callable[[str, int, int], None] | None,
) -> tuple[dict[str, Any], list[str]]:
    """Make the analyses beyond the fit; one that fails must not lose the fit.

    Returns:
        The results by their JSON keys, and what failed.
    """
    import notchflex.fit as fitting

    wanted: dict[str, tuple[str, Callable[[], object]]] = {}
    if beyond.leave_out is not None:
        by = beyond.leave_out
        wanted["left_out"] = (
            "--leave-out",
            lambda: fitting.leave_out(found, by=by, seed=seed, progress=progress),
        )
    if candidates is not None:
        wanted["next_measurement"] = (
            "--next",
            lambda: fitting.next_measurement(
                found, candidates, robot=beyond.next_robot, narrow=beyond.narrow
            ),
        )
    if beyond.posterior:
        wanted["posterior"] = (
            "--posterior",
            lambda: fitting.sample_posterior(
                found, draws=beyond.draws, seed=seed, progress=progress
            ),
        )
    results: dict[str, Any] = {}
    problems: list[str] = []
    for key, (option, compute) in wanted.items():
        try:
            results[key] = compute()
        except InputError as problem:
            problems.append(f"{option}: {problem}")
    return results, problems


def _write(found: Calibration, analyses: dict[str, Any], outputs: Outputs) -> None:
    from notchflex.cli.tables import calibrate_tables as tables
    from notchflex.fit import documents

    make: dict[str, tuple[Callable[[Any], Any], Callable[[Any], None]]] = {
        "left_out": (documents.left_out_document, tables.print_left_out),
        "next_measurement": (documents.next_measurement_document, tables.print_next),
        "posterior": (documents.posterior_document, tables.print_posterior),
    }

    def picture() -> Any:
        from notchflex.plotting import calibration_picture

        return calibration_picture(found)

    outputs.write_json(
        lambda: (
            documents.calibration_document(found)
            | {key: make[key][0](value) for key, value in analyses.items()}
        )
    )
    outputs.save_picture(picture)
    if outputs.prints_tables:
        tables.print_calibration(found)
        for key, value in analyses.items():
            make[key][1](value)
