"""`notchflex simulate`: pull the tendons through a series of loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.loads import (
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
from notchflex.cli.options import (
    OUTPUT,
    CsvFile,
    JsonFile,
    PlotFile,
    RobotName,
    Settings,
    chosen_robot,
    robot_files,
)
from notchflex.cli.spec import load_columns, parse_vector
from notchflex.errors import InputError
from notchflex.results.files import (
    STANDARD_OUTPUT,
    check_distinct,
    check_output,
    check_picture,
)

if TYPE_CHECKING:
    from notchflex.statics import Path

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
    json: JsonFile = None,
    csv: CsvFile = None,
    plot: PlotFile = None,
) -> int:
    """Pull the tendons of a robot through a series of tensions or strokes.

    The steps are one path with memory: friction keeps what earlier steps did, so a tension that
    is let go differs from the same tension pulled. Prints a table of every step (thinned if it is
    long) unless `--json -` or `--csv -` prints something else.
    """
    inputs = robot_files(robot)
    check_distinct({"--json": json, "--csv": csv, "--plot": plot, "--save-state": save_state})
    for option, target in (("--json", json), ("--csv", csv), ("--save-state", save_state)):
        if target is not None:
            check_output(target, option, inputs=inputs)
    if plot is not None:
        check_picture(plot, "--plot", inputs=inputs)
    chosen = chosen_robot(robot, settings)
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
    finer = _refinement(refinement)
    turn = np.zeros(3)
    if base_rotation is not None:
        turn = np.radians(parse_vector(base_rotation, "--base-rotation", "angles in deg"))

    with terminal.working(f"solving {len(tensions)} steps of {chosen.name}"):
        from notchflex import statics
        from notchflex.cli.compile_cache import use_compile_cache

        use_compile_cache()
        start = None if from_state is None else statics.State.load(from_state)
        pulled = statics.LoadPath(tension=tensions, stroke=strokes, base_rotation=turn)
        path = statics.simulate(chosen, put_on(pulled, loads), from_state=start, refinement=finer)
    _write(path, json=json, csv=csv, plot=plot, save_state=save_state)
    if STANDARD_OUTPUT not in (json, csv):
        from notchflex.cli.path_table import print_path

        print_path(path)
    return _say_what_matters(path)


def _refinement(text: str) -> int:
    if text not in ("0", "1", "2", "3"):
        raise InputError(f"--refinement {text}: give a whole number from 0 to 3.")
    return int(text)


def _write(
    path: Path, *, json: str | None, csv: str | None, plot: str | None, save_state: str | None
) -> None:
    if json is not None:
        from notchflex.results.json import path_document, write_json

        write_json(json, path_document(path))
    if csv is not None:
        from notchflex.results.csv import write_path_csv

        write_path_csv(csv, path)
    if plot is not None:
        with terminal.working(f"drawing {plot}"):
            from notchflex.plot import path_figure, save

            save(path_figure(path), plot)
    if save_state is not None:
        from notchflex.results.files import replacing

        with replacing(save_state) as temporary:
            path.state.save(temporary)


def _say_what_matters(path: Path) -> int:
    """Tell warnings and failures; return the exit code."""
    from notchflex.cli.app import DONE, NOT_CONVERGED
    from notchflex.results.warnings import path_warnings

    for sentence in path_warnings(path):
        terminal.warn(sentence)
    failed = np.flatnonzero(~np.asarray(path.converged))
    if not len(failed):
        return DONE
    first = int(failed[0])
    terminal.error(f"not converged: step {first + 1} of {len(path)}: {path.reason[first]}.")
    return NOT_CONVERGED
