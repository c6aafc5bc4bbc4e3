"""The bending of a robot over a range of tension: what a simulator's joints are fitted to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from notchflex.analysis import closing, simulate
from notchflex.errors import InputError
from notchflex.loads import pull
from notchflex.loads.validation import check_number
from notchflex.robot import Robot

_STEPS = 121
_BEYOND_CLOSING = 1.1
# Far beyond the closing of all notches nearly all samples would be at rest.
_MAX_BEYOND = 3.0
# A notch that turns by less in one step does not slip there, rad.
_AT_REST = 1e-7


class PullSamples(NamedTuple):
    """States of a robot while one tendon is pulled and released (s steps, n notches).

    Attributes:
        tendon: Which tendon, from 0.
        tension: Its tension at the base, N.
        loading: Whether the tension rises.
        angle: Notch angles less those of the free robot, rad.
        position: Origins of the bodies, mm.
        rotation: Rotations of the bodies.
        tip: Tip position, mm.
        slips: Whether the notch turns in the step, so that the friction before it is at its limit
            and its lips are open.
    """

    tendon: int
    tension: Float[np.ndarray, " s"]
    loading: Bool[np.ndarray, " s"]
    angle: Float[np.ndarray, "s n"]
    position: Float[np.ndarray, "s bodies 3"]
    rotation: Float[np.ndarray, "s bodies 3 3"]
    tip: Float[np.ndarray, "s 3"]
    slips: Bool[np.ndarray, "s n"]


def load_range(robot: Robot, largest_tension: float | None = None) -> float:
    """Return the largest tension of the range that joints are fitted over, N.

    Args:
        robot: The robot.
        largest_tension: The tension that the user asks for, N. None for 1.1 times the tension that
            closes the last notch or, where some notch never closes, the one that closes the first.

    Raises:
        InputError: The tension is not positive, or none is given and no notch closes.
    """
    if largest_tension is not None:
        top = check_number(largest_tension, "the largest tension")
        if not (np.isfinite(top) and top > 0.0):
            raise InputError.OUT_OF_RANGE(
                f"the largest tension must be positive and finite; got {top:g}, give it in N"
            )
        return top
    tension = closing(robot).tension
    closes = np.isfinite(tension)
    if not closes.any():
        raise InputError.MISSING_VALUE(
            f"no notch of {robot.name} closes, so the export needs the largest tension in N"
        )
    return float(_BEYOND_CLOSING * tension.max() if closes.all() else tension[closes].min())


def pull_samples(robot: Robot, tendon: int, top: float, steps: int = _STEPS) -> PullSamples:
    """Pull one tendon from rest to a tension and release it.

    Args:
        robot: The robot.
        tendon: Which tendon, from 0.
        top: Largest tension, N.
        steps: Steps up, and as many down.

    Raises:
        InputError: A step did not converge.
    """
    path = simulate(robot, pull(0.0, top, steps, tendon=tendon + 1).release())
    if not path.converged.all():
        last = float(path.commanded_tension[path.converged, tendon].max(initial=0.0))
        raise InputError.NOT_CONVERGED(
            f"tendon {tendon + 1} of {robot.name} has no equilibrium found beyond {last:.4g} N: "
            f"give a smaller largest tension than {top:.4g} N"
        )
    closed_from = np.flatnonzero(path.closed[:steps].all(axis=1))
    if len(closed_from) and _MAX_BEYOND * path.tension[closed_from[0], tendon] < top:
        all_closed = float(path.tension[closed_from[0], tendon])
        raise InputError.OUT_OF_RANGE(
            f"every notch of {robot.name} has closed at {all_closed:.4g} N: the largest tension "
            f"may be at most {_MAX_BEYOND * all_closed:.4g} N; got {top:g} N"
        )
    angle = path.notch_angle - path.notch_angle[0]
    turned = np.abs(np.diff(angle, axis=0, prepend=angle[:1])) > _AT_REST
    return PullSamples(
        tendon=tendon,
        tension=np.concatenate([np.linspace(0.0, top, steps), np.linspace(top, 0.0, steps)]),
        loading=np.arange(2 * steps) < steps,
        angle=angle,
        position=path.body_position,
        rotation=path.body_rotation,
        tip=path.tip_position,
        slips=turned & ~path.closed,
    )
