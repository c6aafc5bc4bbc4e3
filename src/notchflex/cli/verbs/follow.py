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
    number,
    save_state,
)
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files
from notchflex.cli.terminal import DONE
from notchflex.support import DEGREES

if TYPE_CHECKING:
    from notchflex.control import Following


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
    from notchflex.control import following as files
    from notchflex.support import write_path_csv

    limits = control.Limits(
        tension=(least_tension, most_tension),
        stroke=(None, most_stroke),
        rate=rate,
        strain=most_strain,
        gap=least_gap,
    )
    goals = control.read_targets(targets, chosen, dict(column))
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
    outputs.write(
        following,
        files.following_document,
        _print,
        title=changed_title(chosen, settings),
        csv=lambda result, file: write_path_csv(file, result.path, files.following_columns(result)),
        save_state=save_state,
    )
    if not following.path.converged.all():
        return terminal.failed(f"not converged: {next(filter(None, following.path.reason))}.")
    missed = np.flatnonzero(~np.asarray(following.reached))
    if not len(missed):
        return DONE
    return terminal.failed(
        f"{len(missed)} of {len(following)} targets not met, first target {missed[0] + 1}: "
        f"{following.reason[missed[0]]}."
    )


def _print(following: Following) -> None:
    """Print drives, tip and error of every target; of many targets some."""
    met = int(np.count_nonzero(following.reached))
    terminal.line(f"{following.robot.name}: {met} of {len(following)} targets met")
    columns: dict[str, Any] = {"target": range(1, 1 + len(following))}
    for name, unit, vectors in (
        ("tension", "N", following.tension),
        ("stroke", "mm", following.stroke),
        ("tip", "mm", following.tip_position),
    ):
        count = vectors.shape[1]
        labels = "_x _y _z" if name == "tip" else " ".join(f"_{n}" for n in range(1, 1 + count))
        columns |= {
            f"{name}{label if count > 1 else ''}_{unit}": vector
            for label, vector in zip(labels.split(), vectors.T, strict=True)
        }
    columns["angle_deg"] = following.path.total_angle[following.step] * DEGREES
    columns |= {name: getattr(following, name) for name in ("error_mm", "error_deg")}
    vias = np.diff(following.step, prepend=-1) > 1
    columns[""] = np.char.add(np.where(vias, "overshoot ", ""), following.code)
    tables.show(columns, wide=True, most=60)
