"""`notchflex follow`: tensions or strokes that bring the tip to one target after the other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter

from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_LOADS,
    Columns,
    ExternalLoads,
    PathOutputs,
    StateFile,
    named_columns,
    number,
)
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import DEGREES

if TYPE_CHECKING:
    from notchflex.control import Following

_MOST_ROWS = 60
"""More targets than this are thinned in the table."""


def _at_least(what: str, least: float = 0.0) -> Parameter:
    form = f"a finite number of {what}, {'greater than 0' if least else '0 or more'}"
    return number(form, "X", least)


_ABOVE_ZERO = math.ulp(0.0)
"""The smallest number greater than 0."""


def follow(
    robot: RobotName,
    targets: str,
    /,
    *,
    column: Columns = (),
    drive: Literal["tension", "stroke"] = "tension",
    approach: Literal["direct", "loading", "unloading", "least"] = "direct",
    least_tension: Annotated[float, _at_least("N")] = 0.0,
    most_tension: Annotated[float | None, _at_least("N")] = None,
    most_stroke: Annotated[float | None, _at_least("mm")] = None,
    rate: Annotated[float | None, _at_least("N or mm", _ABOVE_ZERO)] = None,
    most_strain: Annotated[float | None, _at_least("1")] = None,
    least_gap: Annotated[float | None, _at_least("mm")] = None,
    tolerance: Annotated[float, _at_least("mm", _ABOVE_ZERO)] = 0.05,
    angle_tolerance: Annotated[float, _at_least("deg", _ABOVE_ZERO)] = 0.2,
    external: ExternalLoads = NO_LOADS,
    settings: Settings = (),
    from_state: StateFile = None,
    outputs: PathOutputs = PathOutputs(),
) -> int:
    """Find the tensions or strokes that bring the tip to one target after the other.

    Each target is approached from the state that the one before left, with its friction history.
    Where a target cannot be met, the nearest is commanded and the exit code is 1.

    Args:
        targets: CSV of targets, one per row, with some of the columns `tip_x_mm`, `tip_y_mm`,
            `tip_z_mm`, `total_deg`, `notch_1_deg`, `tip_direction_x` and others that
            `notchflex simulate --csv` writes. An empty entry is free.
        drive: What is commanded: tensions or strokes.
        approach: How a target is approached: directly; with rising (`loading`) or falling
            (`unloading`) drives at the end; or with the smallest drives (`least`). All but `direct`
            may overshoot on the way.
        least_tension: Smallest tension of a tendon, the pretension of antagonists [N].
        most_tension: Largest tension of a tendon [N].
        most_stroke: Largest stroke of a tendon [mm].
        rate: Largest change of a drive from target to target [N or mm].
        most_strain: Largest peak strain of a notch.
        least_gap: Smallest gap of a notch [mm].
        tolerance: Distance from lengths of a target at which it counts as met [mm].
        angle_tolerance: Angle from angles of a target at which it counts as met [deg].
    """
    outputs.check([*robot_files(robot), targets, *([from_state] if from_state else [])])
    chosen = chosen_robot(robot, settings)
    from notchflex import Load, State, control

    limits = control.Limits(
        tension=(least_tension, most_tension),
        stroke=(None, most_stroke),
        rate=rate,
        strain=most_strain,
        gap=least_gap,
    )
    goals = control.read_targets(targets, chosen, named_columns(column))
    start = None if from_state is None else State.load(from_state)
    with terminal.progress(f"following {len(goals)} targets with {chosen.name}"):
        following = control.follow(
            chosen,
            goals,
            state=start,
            load=Load(**external.arguments()),
            drive=drive,
            limits=limits,
            approach=approach,
            search=control.TargetSearch(near=tolerance, near_angle=math.radians(angle_tolerance)),
        )
    _write(following, outputs, changed_title(chosen, settings))
    if not following.path.converged.all():
        terminal.error(f"not converged: {next(text for text in following.path.reason if text)}.")
        return NOT_CONVERGED
    missed = np.flatnonzero(~np.asarray(following.reached))
    if not len(missed):
        return DONE
    terminal.error(
        f"{len(missed)} of {len(following)} targets not met, first target {missed[0] + 1}: "
        f"{following.reason[missed[0]]}."
    )
    return NOT_CONVERGED


def _write(following: Following, outputs: PathOutputs, title: str) -> None:
    from notchflex.control.following import following_columns, following_document
    from notchflex.support import write_path_csv

    def picture() -> Any:
        from notchflex.plotting import following_picture

        return following_picture(following, title=title)

    outputs.write(lambda: following_document(following), lambda: _print(following), picture=picture)
    if outputs.csv:
        write_path_csv(outputs.csv, following.path, following_columns(following))
    outputs.write_state(following.state)


def _print(following: Following) -> None:
    """Print drives, tip and error of every target; of many targets some."""
    console = terminal.output(terminal.width())
    met = int(np.count_nonzero(following.reached))
    console.print(f"{following.robot.name}: {met} of {len(following)} targets met", soft_wrap=True)
    shown, stride = tables.shown_of(len(following), _MOST_ROWS)
    columns: dict[str, Any] = {"target": [row + 1 for row in shown]}
    for name, unit in (("tension", "N"), ("stroke", "mm")):
        drives = getattr(following, name)[shown].T.tolist()
        for tendon, drive in enumerate(drives, start=1):
            columns[f"{name}_{unit}" if len(drives) == 1 else f"{name}_{tendon}_{unit}"] = drive
    tips = following.tip_position[shown].T.tolist()
    columns |= {f"tip_{axis}_mm": tip for axis, tip in zip("xyz", tips, strict=True)}
    angle = following.path.total_angle[following.step] * DEGREES
    columns["angle_deg"] = angle[shown].tolist()
    for name in ("error_mm", "error_deg"):
        if getattr(following, name).any():
            columns[name] = getattr(following, name)[shown].tolist()
    vias = np.diff(following.step, prepend=-1) > 1
    columns[""] = [("overshoot " if vias[i] else "") + following.code[i] for i in shown]
    forms = {name: ".4f" for name in columns if name.endswith(("_N", "_mm"))}
    forms |= {"error_mm": ".2g", "error_deg": ".2g"}
    console.print(tables.table(tables.frame(columns, **forms)))
    if stride > 1:
        terminal.note(f"every {stride}th target is shown; --csv FILE writes all.")
