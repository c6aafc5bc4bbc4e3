"""Drives that bring the tip of a session's robot to a point, from the state it is in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.control import Limits, TargetSearch, reach
from notchflex.control.limits import Drive
from notchflex.loads import Load
from notchflex.viewer.controls import POINTING, STROKE, TENSION, ControlRanges, Controls
from notchflex.viewer.session import Session

# Finer than a screen shows, and never longer than an update may take.
_SEARCH = TargetSearch(tolerance=1e-3, solves=8)


class Steered(NamedTuple):
    """Settings that bring the tip to a point, or next to it.

    Attributes:
        controls: The settings.
        error: Distance of the tip from the point, mm.
        reached: Whether the tip is there.
    """

    controls: Controls
    error: float
    reached: bool


def steer(session: Session, ends: ControlRanges, point: Float[np.ndarray, " 3"]) -> Steered:
    """Find settings of the tendons that bring the tip to a point, within their sliders.

    Tendons that are pulled by tension are driven, all others held; where there are none, all
    strokes. Where the tip is at the point already, nothing moves: a smaller tension that friction
    lets hold the tip would only make the robot creep while the mouse rests.

    Args:
        session: The robot in its present state, with its friction history.
        ends: Ends of the sliders.
        point: Where the tip is to be, in the world, mm.
    """
    controls, robot = session.controls, session.robot
    away = float(np.linalg.norm(session.solved.tip_position - point))
    if away <= _SEARCH.tolerance:
        return Steered(controls, away, True)
    drive: Drive = TENSION if TENSION in controls.by else STROKE
    driven = [by == drive for by in controls.by]
    held = [None if free else value for free, value in zip(driven, controls.value, strict=True)]
    none = [None] * len(held)
    load = Load(
        tension=none if drive == TENSION else held,
        stroke=held if drive == TENSION else none,
        tip_force=controls.tip_force,
        tip_mass=controls.tip_mass,
        base_rotation=POINTING[session.pointing],
    )
    low, high = zip(*(ends.ends(tendon, drive) for tendon in range(len(held))), strict=True)
    limits = Limits(tension=(low, high)) if drive == TENSION else Limits(stroke=(low, high))
    state = session.solved.state
    reached = reach(
        robot,
        point,
        state=state,
        load=load,
        drive=drive,
        limits=limits,
        approach="direct",
        search=_SEARCH,
    )
    path = reached.following.load
    values = (path.tension if drive == TENSION else path.stroke)[-1]
    numbers = controls.numbers
    count = len(held)
    numbers[:count] = np.where(driven, values, numbers[:count])
    return Steered(controls.with_numbers(numbers), reached.error, reached.reached)
