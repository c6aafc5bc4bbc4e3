"""`notchflex simulate`: pull the tendons through a series of loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.beside import beside_files, beside_robots
from notchflex.cli.arguments.loads import (
    BodyForces,
    Following,
    Gravity,
    TipForce,
    TipMass,
    TipMoment,
    TipPoint,
    parse_loads,
    put_on,
)
from notchflex.cli.arguments.options import (
    OUTPUT,
    CsvFile,
    JsonFile,
    MovingPlotFile,
    NetcdfFile,
    ParquetFile,
    Quiet,
    RobotName,
    Settings,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.arguments.spec import load_columns, parse_vector
from notchflex.cli.simulate_files import check_files, write_files
from notchflex.errors import InputError
from notchflex.results.files.writing import STANDARD_OUTPUT

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath, SavedState

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
        tuple[str, ...],
        Parameter(
            negative=(),
            show_default=False,
            allow_leading_hyphen=True,
            help=f"Tension at the base of a tendon [N], step by step. {SPEC}",
        ),
    ] = (),
    stroke: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            show_default=False,
            allow_leading_hyphen=True,
            help="Tendon length drawn out at the base [mm], step by step; written as --tension.",
        ),
    ] = (),
    base_rotation: Annotated[
        str | None,
        Parameter(
            allow_leading_hyphen=True,
            help="Turn the base by a rotation vector RX,RY,RZ [deg], for example `90,0,0`.",
        ),
    ] = None,
    tip_force: TipForce = None,
    tip_moment: TipMoment = None,
    tip_point: TipPoint = None,
    body_force: BodyForces = (),
    tip_mass: TipMass = None,
    gravity: Gravity = None,
    following: Following = False,
    refinement: Annotated[
        str,
        Parameter(
            allow_leading_hyphen=True,
            help="0 to 3: more strain modes in every notch. A result that stays the same can be "
            "trusted.",
        ),
    ] = "0",
    settings: Settings = (),
    from_state: Annotated[
        str | None,
        Parameter(help="Go on from a state that `--save-state` wrote, with its friction."),
    ] = None,
    save_state: Annotated[
        str | None,
        Parameter(group=OUTPUT, help="Write the last state to this file, to go on from it later."),
    ] = None,
    beside: Annotated[
        tuple[str, ...],
        Parameter(
            name="--beside",
            negative=(),
            show_default=False,
            help="Also pull another robot in the same way: `ROBOT`, `LABEL: ROBOT`, or this one "
            "with other values, `LABEL: PATH=VALUE, PATH=VALUE`. May be given up to four times. "
            "Table, picture and JSON have all of them, other files the first.",
        ),
    ] = (),
    columns: Annotated[
        str | None,
        Parameter(
            group=OUTPUT,
            help="Quantities that the table shows, joined by commas, such as "
            "`tension,notch_angle,gap`. A wrong name lists all names.",
        ),
    ] = None,
    every_row: Annotated[
        bool,
        Parameter(
            name="--all",
            group=OUTPUT,
            negative=(),
            show_default=False,
            help="Show every step in the table; without it a path of more than 60 steps is "
            "thinned.",
        ),
    ] = False,
    json: JsonFile = None,
    csv: CsvFile = None,
    nc: NetcdfFile = None,
    parquet: ParquetFile = None,
    plot: MovingPlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Pull the tendons of a robot through a series of tensions or strokes.

    The steps are one path with friction history: at the same tension, unloading differs from
    loading. Prints a table as wide as the terminal (the variable COLUMNS says otherwise) unless
    `--json -` or `--csv -` prints something else.
    """
    from notchflex.cli.tables.path_columns import parse_columns

    terminal.be_quiet(quiet)
    named = () if columns is None else parse_columns(columns)
    chosen = chosen_robot(robot, settings)
    title = changed_title(chosen, settings)
    robots = beside_robots(chosen, robot, beside)
    loads = parse_loads(
        tip_force=tip_force,
        tip_moment=tip_moment,
        tip_point=tip_point,
        body_force=body_force,
        tip_mass=tip_mass,
        gravity=gravity,
        following=following,
    )
    if loads and not tension and not stroke:  # the tendons hang slack, in one step
        tensions = strokes = np.full((1, chosen.number_of_tendons), np.nan)
    else:
        tensions, strokes = load_columns(tension, stroke, chosen.number_of_tendons)
    outputs = {
        "--json": json,
        "--csv": csv,
        "--nc": nc,
        "--parquet": parquet,
        "--plot": plot,
        "--save-state": save_state,
    }
    inputs = [*robot_files(robot), *(file for text in beside for file in beside_files(text))]
    check_files(outputs, inputs, steps=len(tensions), several=bool(beside))
    finer = _refinement(refinement)
    turn = np.zeros(3)
    if base_rotation is not None:
        turn = np.radians(parse_vector(base_rotation, "--base-rotation", "angles in deg"))

    with terminal.counting(f"solving {len(tensions)} steps of {chosen.name}") as counted:
        from notchflex import analysis
        from notchflex.cli.compile_cache import use_compile_cache
        from notchflex.loads import LoadPath

        use_compile_cache()
        start = None if from_state is None else _start(from_state)
        pulled = LoadPath(tension=tensions, stroke=strokes, base_rotation=turn)
        pulled = put_on(pulled, loads)
        paths: dict[str, EquilibriumPath] = {}
        for number, (label, one) in enumerate(robots.items()):
            if number:
                counted(number, len(robots))
            state = None if number else start
            paths[label] = analysis.simulate(one, pulled, from_state=state, refinement=finer)
    write_files(paths, outputs, title)
    if STANDARD_OUTPUT not in (json, csv) and not quiet:
        from notchflex.cli.tables.path_table import print_beside, print_path

        shown: dict[str, Any] = {"columns": named, "every_row": every_row}
        print_path(next(iter(paths.values())), title, **shown)
        if beside:
            print_beside(paths, **shown)
    codes = [_say_what_matters(path, label if beside else "") for label, path in paths.items()]
    return max(codes)


def _start(file: str) -> SavedState:
    """Read the state to go on from; warn where nothing shows which robot it belongs to."""
    from notchflex.results import State

    state = State.load(file)
    if state.description is None:
        terminal.warn(
            f"{file} was written by an older notchflex and does not hold the values of its robot; "
            "make sure that they are the same. --save-state writes a file that does."
        )
    return state


def _refinement(text: str) -> int:
    if text not in ("0", "1", "2", "3"):
        raise InputError.OUT_OF_RANGE(f"--refinement {text}: give a whole number from 0 to 3.")
    return int(text)


def _say_what_matters(path: EquilibriumPath, label: str) -> int:
    """Tell warnings and failures, of one of several with its label; return the exit code."""
    from notchflex.cli.app import DONE, NOT_CONVERGED
    from notchflex.results.warnings import path_warnings

    whose = f"{label}: " if label else ""
    for sentence in path_warnings(path):
        terminal.warn(f"{whose}{sentence}")
    failed = np.flatnonzero(~np.asarray(path.converged))
    if not len(failed):
        return DONE
    first = int(failed[0])
    terminal.error(f"{whose}not converged: step {first + 1} of {len(path)}: {path.reason[first]}.")
    return NOT_CONVERGED
