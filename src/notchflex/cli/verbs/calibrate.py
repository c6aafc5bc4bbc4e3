"""`notchflex calibrate`: from measurements to constants with error bars."""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.calibrate_words import (
    PAIR,
    Given,
    check_beyond,
    check_options,
    check_sensor,
    parse_fit,
    parse_pairs,
    robots_of,
)
from notchflex.cli.arguments.measured import OnePath, from_rest, note_table
from notchflex.cli.arguments.options import OUTPUT, JsonFile, PlotFile, Settings, robot_files
from notchflex.cli.arguments.spec import load_columns
from notchflex.errors import InputError
from notchflex.results.files.writing import (
    STANDARD_OUTPUT,
    check_distinct,
    check_folder,
    check_output,
    check_picture,
)

if TYPE_CHECKING:
    from notchflex.fit import Calibration, LeftOut, NextMeasurement, Posterior
    from notchflex.fit.estimation.objective import FitObjective

MORE = Group("Beyond the fit", sort_key=8)

_MANY: Any = Parameter(negative=(), show_default=False)
Named = Annotated[tuple[str, ...], _MANY]


def calibrate(
    *pairs: Annotated[
        str,
        Parameter(
            help=f"{PAIR}: a robot (ready, or a file) and what was measured of it (the columns of "
            "`notchflex.read_measurements`). The same robot again adds more data; a label tells "
            "two robots of one file apart."
        ),
    ],
    fit: Annotated[
        Named,
        Parameter(
            help="Constants to find, joined by commas: values of the robot file, shared by all "
            "robots; `LABEL:` before one for a single robot, `each:` for one in every robot, "
            "`notch[each].` for one in every notch; `sensor.force_offset`, `sensor.stroke_slack`."
        ),
    ],
    bounds: Annotated[
        Named, Parameter(help="Limits of a constant, `NAME=LOW:HIGH`, in its unit.")
    ] = (),
    prior: Annotated[
        Named, Parameter(help="What is known of a constant beforehand, `NAME=MEAN+-SD`.")
    ] = (),
    objective: Annotated[
        Literal["least-squares", "robot-errors", "distances"],
        Parameter(
            help="What is made small: squares over their noise; eq. 17 of Pacheco 2021; the sum of "
            "distances of points (Gao 2017, eq. 27). Only the first gives intervals."
        ),
    ] = "least-squares",
    huber: Annotated[
        float | None,
        Parameter(help="Outliers beyond so many standard deviations count less; about 1.5."),
    ] = None,
    starts: Annotated[int, Parameter(help="From how many places to search.")] = 4,
    seed: Annotated[int, Parameter(help="Of the places.")] = 0,
    path: OnePath = None,
    leave_out: Annotated[
        Literal["pull", "robot"] | None,
        Parameter(group=MORE, help="Also fit without each pull or robot, and try that on it."),
    ] = None,
    next_: Annotated[
        Named,
        Parameter(
            name="--next",
            group=MORE,
            help="Candidates for the next measurement: tensions [N] as in `simulate --tension`. "
            "Tells which narrows the intervals most.",
        ),
    ] = (),
    next_robot: Annotated[
        str | None,
        Parameter(group=MORE, help="Label of the robot of `--next`; the first if left out."),
    ] = None,
    narrow: Annotated[
        Named,
        Parameter(
            group=MORE, help="Constant that `--next` is to narrow; all together if left out."
        ),
    ] = (),
    posterior: Annotated[
        bool,
        Parameter(negative=(), group=MORE, help="Also draw from the posterior (extra `bayes`)."),
    ] = False,
    draws: Annotated[
        int, Parameter(group=MORE, help="Draws of each of the two chains of `--posterior`.")
    ] = 500,
    settings: Settings = (),
    output: Annotated[
        str | None,
        Parameter(
            name=("--output", "-o"),
            group=OUTPUT,
            help="Write the fitted robots into this folder, LABEL.toml each, with their comments.",
        ),
    ] = None,
    json: JsonFile = None,
    plot: PlotFile = None,
) -> int:
    """Find constants of robots from measurements, with how far to trust them.

    Prints every constant with its 95 % interval (profile likelihood; `open` where the data set no
    end), what the data cannot tell, and the errors of every notch beside how well it repeats.
    """
    given = parse_pairs(pairs)
    wanted = parse_fit(fit, bounds, prior)
    check_options(objective, huber, starts, seed, next_, next_robot, narrow, given)
    check_beyond(objective, posterior, draws, leave_out, given)
    inputs = _inputs(given)
    _check_targets(given, inputs, output, json, plot)
    robots = robots_of(given, settings)
    candidates = None
    if next_:
        one = robots[next_robot or next(iter(robots))]
        candidates = load_columns(next_, (), one.number_of_tendons, option="--next")

    with terminal.working("loading the solver"):
        from notchflex.cli.compile_cache import use_compile_cache

        use_compile_cache()
        import notchflex.fit as fitting
        from notchflex.loads import LoadPath

    check_sensor([one.name for one in wanted])
    measured = {
        label: [
            fitting.read_measurements(file, robots[label], from_rest=from_rest(path))
            for file in files
        ]
        for label, files in given.data.items()
    }
    for one in (one for every in measured.values() for one in every):
        note_table(one)
    constants = [fitting.Constant(*one) for one in wanted]
    aim = _objective(objective, huber)
    told: NextMeasurement | None = None
    drawn: Posterior | None = None
    left: LeftOut | None = None
    with terminal.bars() as progress:
        ways: dict[str, Any] = {"objective": aim, "seed": seed, "progress": progress}
        found = fitting.calibrate(robots, measured, constants, starts=starts, **ways)
        # What the fit turns out not to allow beyond it must not lose the fit.
        undone: list[str] = []
        if leave_out is not None:
            with _noting(undone, "--leave-out"):
                left = fitting.leave_out(found, by=leave_out, seed=seed, progress=progress)
        if candidates is not None:
            loads = LoadPath(*candidates)
            with _noting(undone, "--next"):
                told = fitting.next_measurement(found, loads, robot=next_robot, narrow=narrow)
        if posterior:
            with _noting(undone, "--posterior"):
                drawn = fitting.sample_posterior(found, draws=draws, seed=seed, progress=progress)
    _write(found, left, told, drawn, inputs, output=output, json=json, plot=plot)
    if json != STANDARD_OUTPUT:
        _print(found, left, told, drawn)
    code = _say_what_matters(found)
    if not undone:
        return code
    from notchflex.cli.app import BAD_INPUT

    for problem in undone:
        terminal.error(problem)
    return BAD_INPUT


@contextlib.contextmanager
def _noting(undone: list[str], option: str) -> Generator[None]:
    """Keep what an option cannot do, to be told after the fit."""
    try:
        yield
    except InputError as problem:
        undone.append(f"{option}: {problem}")


def _inputs(given: Given) -> list[Path]:
    """The files that are read."""
    data = [Path(file) for files in given.data.values() for file in files]
    return data + [file for name in given.robot.values() for file in robot_files(name)]


def _check_targets(
    given: Given, inputs: list[Path], output: str | None, json: str | None, plot: str | None
) -> None:
    """Check where results go; no file that is read may be replaced."""
    targets = {"--json": json, "--plot": plot}
    if output is not None:
        names = [f"{label}.toml" for label in given.robot]
        files = check_folder(output, names, "--output", inputs=inputs)
        targets |= {f"--output ({file.name})": str(file) for file in files}
    check_distinct(targets)
    if json is not None:
        check_output(json, "--json", inputs=inputs)
    if plot is not None:
        check_picture(plot, "--plot", inputs=inputs)


def _objective(name: str, huber: float | None) -> FitObjective:
    from notchflex.fit import LeastSquares, SumOfDistances, SumOfRobotErrors

    if name == "robot-errors":
        return SumOfRobotErrors()
    return SumOfDistances() if name == "distances" else LeastSquares(huber)


def _write(
    found: Calibration,
    left: LeftOut | None,
    told: NextMeasurement | None,
    drawn: Posterior | None,
    inputs: list[Path],
    *,
    output: str | None,
    json: str | None,
    plot: str | None,
) -> None:
    from notchflex.fit import documents

    if output is not None:
        from notchflex.fit.fitted_robots import write_fitted

        files = write_fitted(found, output, inputs=inputs)
        terminal.note(f"written: {', '.join(map(str, files))}.")
    if json is not None:
        from notchflex.results.files.json import write_json

        document = documents.calibration_document(found)
        if left is not None:
            document["left_out"] = documents.left_out_document(left)
        if told is not None:
            document["next_measurement"] = documents.next_measurement_document(told)
        if drawn is not None:
            document["posterior"] = documents.posterior_document(drawn)
        write_json(json, document)
    if plot is not None:
        with terminal.working(f"drawing {plot}"):
            from notchflex.plotting import calibration_picture

            calibration_picture(found).save(plot)


def _print(
    found: Calibration,
    left: LeftOut | None,
    told: NextMeasurement | None,
    drawn: Posterior | None,
) -> None:
    from notchflex.cli.tables import calibrate_tables as tables

    tables.print_calibration(found)
    if left is not None:
        tables.print_left_out(left)
    if told is not None:
        tables.print_next(told)
    if drawn is not None:
        tables.print_posterior(drawn)


def _say_what_matters(found: Calibration) -> int:
    from notchflex.cli.app import DONE, NOT_CONVERGED

    if found.converged:
        return DONE
    terminal.error(f"not converged: {found.reason}. Try --starts or --bounds.")
    return NOT_CONVERGED
