"""`notchflex simulate`: pull the tendons through a series of loads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import simulate_files, terminal
from notchflex.cli.arguments.conversion import converted, flag, texts
from notchflex.cli.arguments.loads import ExternalLoads, tendon_command
from notchflex.cli.arguments.robots import (
    RobotName,
    Settings,
    beside_files,
    beside_robots,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.outputs import (
    OUTPUT,
    CsvFile,
    JsonFile,
    MovingPlotFile,
    Outputs,
    Quiet,
    output_file,
)
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import (
    BROWSER,
    MOVING,
    PAPER,
    TendonCommand,
    Vector,
    load_columns,
    parse_vector,
    parse_whole,
)

if TYPE_CHECKING:
    from notchflex import Bands, EquilibriumPath, LoadPath, Robot, State

SPEC = (
    "Values or `start:stop:count` ranges joined by commas: `2`, `0,1,2.5`, `0:3:31,3:0:31`. "
    "For one of several tendons `1=SPEC`, given once for each tendon; tendons that are not named "
    "hang slack."
)


def simulate(
    robot: RobotName,
    /,
    *,
    tension: Annotated[
        tuple[TendonCommand, ...],
        tendon_command("--tension"),
        Parameter(help=f"Tension at the base of a tendon [N], step by step. {SPEC}"),
    ] = (),
    stroke: Annotated[
        tuple[TendonCommand, ...],
        tendon_command("--stroke", negative=True),
        Parameter(
            help="Tendon length drawn out at the base [mm], step by step; written as --tension.",
        ),
    ] = (),
    base_rotation: Annotated[
        Vector | None,
        converted(parse_vector("angles in deg"), "RX,RY,RZ"),
        Parameter(help="Turn the base by a rotation vector RX,RY,RZ [deg], for example `90,0,0`."),
    ] = None,
    external: ExternalLoads = ExternalLoads(),  # noqa: B008 - frozen
    refinement: Annotated[
        int,
        converted(parse_whole(0, 3), "N"),
        Parameter(help="0 to 3: more strain modes and fibres, to check the accuracy."),
    ] = 0,
    settings: Settings = (),
    uncertain: Annotated[
        bool,
        flag(
            "Carry the tolerances of the robot (its [tolerance] table, else assumed ones) through "
            "all steps: table, picture, CSV and JSON have the 5th, 50th and 95th percentile."
        ),
    ] = False,
    draws: Annotated[
        int | None,
        converted(parse_whole(2, 100_000), "N"),
        Parameter(
            help="How many robots `--uncertain` draws within the tolerances; 256 if not given."
        ),
    ] = None,
    from_state: Annotated[
        str | None,
        Parameter(
            metavar="FILE",
            help="Continue from a state that `--save-state` wrote, with its friction history.",
        ),
    ] = None,
    save_state: Annotated[
        str | None,
        output_file("--save-state", "Write the last state to this file, for `--from-state`."),
    ] = None,
    beside: Annotated[
        tuple[str, ...],
        texts(
            "--beside",
            "ROBOT",
            "Also simulate another robot under the same load: `ROBOT`, `LABEL: ROBOT`, or this one "
            "with other values, `LABEL: PATH=VALUE, PATH=VALUE`. May be given up to four times. "
            "Table, picture and JSON have all of them, other files the first.",
        ),
    ] = (),
    columns: Annotated[
        str | None,
        Parameter(
            group=OUTPUT,
            metavar="NAMES",
            help="Quantities that the table shows, joined by commas, such as "
            "`tension,notch_angle,gap`. A wrong name lists all names.",
        ),
    ] = None,
    every_row: Annotated[
        bool,
        flag(
            "Show every step in the table; without it a path of more than 60 steps is thinned.",
            name="--all",
            group=OUTPUT,
        ),
    ] = False,
    json: JsonFile = None,
    csv: CsvFile = None,
    nc: Annotated[
        str | None,
        output_file(
            "--nc",
            "Write the whole result as NetCDF to this file (extra `data`); "
            "`notchflex.read_path` reads it back.",
        ),
    ] = None,
    parquet: Annotated[
        str | None,
        output_file(
            "--parquet",
            "Write the columns of the CSV as a Parquet table to this file (extra `data`).",
        ),
    ] = None,
    plot: MovingPlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Pull the tendons of a robot through a series of tensions or strokes.

    The steps are one path with friction history: at the same tension, unloading differs from
    loading. Prints a table as wide as the terminal (the variable COLUMNS overrides it) unless
    `--json -` or `--csv -` prints something else.
    """
    import numpy as np

    from notchflex import LoadPath
    from notchflex.cli.tables.path_table import parse_columns

    terminal.be_quiet(quiet)
    shown = () if columns is None else parse_columns(columns)
    chosen = chosen_robot(robot, settings)
    title = changed_title(chosen, settings)
    robots = beside_robots(chosen, robot, beside)
    if external and not tension and not stroke:
        tension = (TendonCommand("--tension", 1, [math.nan]),)  # all hang slack, in one step
    _check_bands(uncertain, draws, beside, from_state)
    tensions, strokes = load_columns(tension, stroke, chosen.number_of_tendons)
    outputs = Outputs(
        [*robot_files(robot), *beside_files(beside)],
        quiet=quiet,
        pictures=PAPER + BROWSER + (() if beside else MOVING),  # several robots do not move
        json=json,
        csv=csv,
        nc=nc,
        parquet=parquet,
        plot=plot,
        save_state=save_state,
    )
    if plot is not None and len(tensions) < 2 and simulate_files.is_animation(plot):
        raise InputError.FILE_FORMAT(
            f"--plot {plot}: one step cannot be animated; write a .png, .svg or .pdf."
        )
    with terminal.counting(f"solving {len(tensions)} steps of {chosen.name}") as counted:
        terminal.use_compile_cache()
        start = None if from_state is None else _start(from_state)
        turn = np.radians(base_rotation or (0.0, 0.0, 0.0))
        load = external.on(LoadPath(tensions, strokes, turn))
        bands = None
        if uncertain:
            from notchflex import analysis
            from notchflex.analysis.bands import DRAWS

            bands = analysis.uncertain(
                chosen,
                load,
                outputs=analysis.band_names(shown),
                draws=draws or DRAWS,
                refinement=refinement,
                progress=counted,
            )
            paths = {chosen.name: bands.path}
        else:
            paths = _solve(robots, load, start, refinement, counted)
    simulate_files.write(paths, outputs, title, bands)
    if bands is not None:
        for sentence in bands.warnings():
            terminal.warn(sentence)
    if outputs.prints_tables:
        _print(paths, bands, title, columns=shown, every_row=every_row)
    return max(_report(path, label if beside else "") for label, path in paths.items())


def _check_bands(
    uncertain: bool, draws: int | None, beside: Sequence[str], from_state: str | None
) -> None:
    """Refuse options that `--uncertain` excludes or needs."""
    if uncertain and (beside or from_state is not None):
        other = "--beside" if beside else "--from-state"
        raise InputError.CONFLICT(
            f"--uncertain draws robots that start from rest; leave out {other}, or --uncertain."
        )
    if draws is not None and not uncertain:
        raise InputError.CONFLICT("--draws counts the robots of --uncertain; give both or neither.")


def _print(
    paths: Mapping[str, EquilibriumPath],
    bands: Bands | None,
    title: str,
    *,
    columns: Sequence[str],
    every_row: bool,
) -> None:
    """Print the table of the bands, or of the first path and then of all beside each other."""
    from notchflex.cli.tables.path_table import print_bands, print_beside, print_path

    if bands is not None:
        print_bands(bands, title, columns=columns, every_row=every_row)
        return
    print_path(next(iter(paths.values())), title, columns=columns, every_row=every_row)
    if len(paths) > 1:
        print_beside(paths, columns=columns, every_row=every_row)


def _solve(
    robots: Mapping[str, Robot],
    load: LoadPath,
    start: State | None,
    refinement: int,
    counted: terminal.Counted,
) -> dict[str, EquilibriumPath]:
    """Return the path of every robot; only the first starts from a saved state."""
    from notchflex import analysis

    paths: dict[str, EquilibriumPath] = {}
    for number, (label, robot) in enumerate(robots.items()):
        if number:
            counted(number, len(robots))
        state = None if number else start
        paths[label] = analysis.simulate(robot, load, from_state=state, refinement=refinement)
    return paths


def _start(file: str) -> State:
    """Read the state to continue from; warn where nothing shows which robot it belongs to."""
    from notchflex import State

    state = State.load(file)
    if state.description is None:
        terminal.warn(
            f"{file} was written by an older notchflex and does not contain the values of its "
            "robot; make sure that they are the same. --save-state writes a file that does."
        )
    return state


def _report(path: EquilibriumPath, label: str) -> int:
    """Write warnings and the first failure, after the label if given; return the exit code."""
    from notchflex.results.path import path_warnings

    prefix = f"{label}: " if label else ""
    for sentence in path_warnings(path):
        terminal.warn(f"{prefix}{sentence}")
    failed = [row for row, converged in enumerate(path.converged) if not converged]
    if not failed:
        return DONE
    first = failed[0]
    terminal.error(f"{prefix}not converged: step {first + 1} of {len(path)}: {path.reason[first]}.")
    return NOT_CONVERGED
