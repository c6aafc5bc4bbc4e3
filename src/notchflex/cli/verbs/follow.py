"""`notchflex follow`: tensions or strokes that bring the tip to one target after the other."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted
from notchflex.cli.arguments.loads import ExternalLoads
from notchflex.cli.arguments.robots import (
    Columns,
    RobotName,
    Settings,
    changed_title,
    chosen_robot,
    named_columns,
    robot_files,
)
from notchflex.cli.outputs import CsvFile, JsonFile, Outputs, PlotFile, Quiet, output_file
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import parse_number

if TYPE_CHECKING:
    from notchflex.control import Following


def _at_least(what: str, least: float = 0.0) -> Parameter:
    form = f"a finite number of {what}, {'greater than 0' if least else '0 or more'}"
    return converted(partial(parse_number, form=form, least=least), "X")


_ABOVE_ZERO = math.ulp(0.0)


def follow(
    robot: RobotName,
    targets: Annotated[
        str,
        Parameter(
            help="CSV of targets, one per row, with some of the columns `tip_x_mm`, `tip_y_mm`, "
            "`tip_z_mm`, `total_deg`, `notch_1_deg`, `tip_direction_x` and others that "
            "`notchflex simulate --csv` writes. An empty entry is free."
        ),
    ],
    /,
    *,
    column: Columns = (),
    drive: Annotated[
        Literal["tension", "stroke"], Parameter(help="What is commanded: tensions or strokes.")
    ] = "tension",
    approach: Annotated[
        Literal["direct", "loading", "unloading", "least"],
        Parameter(
            help="How a target is approached: directly; with rising (`loading`) or falling "
            "(`unloading`) drives at the end; or with the smallest drives (`least`). All but "
            "`direct` may overshoot on the way."
        ),
    ] = "direct",
    least_tension: Annotated[
        float,
        _at_least("N"),
        Parameter(help="Smallest tension of a tendon, the pretension of antagonists [N]."),
    ] = 0.0,
    most_tension: Annotated[
        float | None, _at_least("N"), Parameter(help="Largest tension of a tendon [N].")
    ] = None,
    most_stroke: Annotated[
        float | None, _at_least("mm"), Parameter(help="Largest stroke of a tendon [mm].")
    ] = None,
    rate: Annotated[
        float | None,
        _at_least("N or mm", _ABOVE_ZERO),
        Parameter(help="Largest change of a drive from target to target [N or mm]."),
    ] = None,
    most_strain: Annotated[
        float | None, _at_least("1"), Parameter(help="Largest peak strain of a notch.")
    ] = None,
    least_gap: Annotated[
        float | None, _at_least("mm"), Parameter(help="Smallest gap of a notch [mm].")
    ] = None,
    tolerance: Annotated[
        float,
        _at_least("mm", _ABOVE_ZERO),
        Parameter(help="Distance from lengths of a target at which it counts as met [mm]."),
    ] = 0.05,
    angle_tolerance: Annotated[
        float,
        _at_least("deg", _ABOVE_ZERO),
        Parameter(help="Angle from angles of a target at which it counts as met [deg]."),
    ] = 0.2,
    external: ExternalLoads = ExternalLoads(),  # noqa: B008 - frozen
    settings: Settings = (),
    from_state: Annotated[
        str | None,
        Parameter(
            metavar="FILE",
            help="Start from a state that `--save-state` wrote, with its friction history.",
        ),
    ] = None,
    save_state: Annotated[
        str | None,
        output_file("--save-state", "Write the last state to this file, for `--from-state`."),
    ] = None,
    json: JsonFile = None,
    csv: CsvFile = None,
    plot: PlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Find the tensions or strokes that bring the tip to one target after the other.

    Each target is approached from the state that the one before left, with its friction history.
    Where a target cannot be met, the nearest is commanded and the exit code is 1.
    """
    outputs = Outputs(
        [*robot_files(robot), targets, *([from_state] if from_state else [])],
        quiet=quiet,
        json=json,
        csv=csv,
        plot=plot,
        save_state=save_state,
    )
    chosen = chosen_robot(robot, settings)
    from notchflex import Load, LoadPath, State, control

    limits = control.Limits(
        tension=(least_tension, most_tension),
        stroke=(None, most_stroke),
        rate=rate,
        strain=most_strain,
        gap=least_gap,
    )
    goals = control.read_targets(targets, chosen, named_columns(column))
    start = None if from_state is None else State.load(from_state)
    with terminal.working(f"following {len(goals)} targets with {chosen.name}"):
        terminal.use_compile_cache()
        nothing: Any = [[float("nan")] * chosen.number_of_tendons]
        load = external.on(LoadPath(nothing, nothing))[0] if external else Load()
        following = control.follow(
            chosen,
            goals,
            state=start,
            load=load,
            drive=drive,
            limits=limits,
            approach=approach,
            search=control.TargetSearch(near=tolerance, near_angle=math.radians(angle_tolerance)),
        )
        path = following.path
    _write(following, outputs, changed_title(chosen, settings))
    if outputs.prints_tables:
        from notchflex.cli.tables.follow_table import print_following

        print_following(following)
    if not path.converged.all():
        terminal.error(f"not converged: {next(text for text in path.reason if text)}.")
        return NOT_CONVERGED
    return _report(following)


def _write(following: Following, outputs: Outputs, title: str) -> None:
    from notchflex.control.following import following_columns, following_document
    from notchflex.support import replacing, write_path_csv

    def picture() -> Any:
        from notchflex.plotting import following_picture

        return following_picture(following, title=title)

    outputs.write_json(lambda: following_document(following))
    if target := outputs.targets.get("csv"):
        write_path_csv(target, following.path, following_columns(following))
    outputs.save_picture(picture)
    if target := outputs.targets.get("save_state"):
        with replacing(target) as temporary:
            following.state.save(temporary)


def _report(following: Following) -> int:
    """Write which targets are not met; return the exit code."""
    not_reached = [index for index, reached in enumerate(following.reached) if not reached]
    if not not_reached:
        return DONE
    first = not_reached[0]
    terminal.error(
        f"{len(not_reached)} of {len(following)} targets not met, first target {first + 1}: "
        f"{following.reason[first]}."
    )
    return NOT_CONVERGED
