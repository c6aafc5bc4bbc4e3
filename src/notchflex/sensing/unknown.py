"""Which force is looked for: its directions, and the body and point where it acts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.loads.external import BodyForce, ExternalLoad
from notchflex.loads.load import BASE_TURN, NO_TURN
from notchflex.loads.validation import check_integer, check_vector, short_repr
from notchflex.mechanics.chain import bending_normal
from notchflex.results.quantities.registry import AXES
from notchflex.robot import Robot


@dataclass(frozen=True, eq=False)
class UnknownForce:
    """A force of d unknown components, dead in the world, beside known external loads.

    Attributes:
        names: Names of the components.
        directions: Their unit vectors in the world, (d, 3).
        known: The other external loads.
        base_rotation: Rotation vector of the base in the world, rad.
        body: Body at whose origin it acts; None for the tip.
    """

    names: tuple[str, ...]
    directions: Float[np.ndarray, "d 3"]
    known: ExternalLoad
    base_rotation: tuple[float, float, float] = NO_TURN
    body: int | None = None

    def load(self, components: Float[np.ndarray, " d"]) -> ExternalLoad:
        """Return the external loads with some components of the force, N."""
        force = components @ self.directions
        if self.body is None:
            at_tip = np.asarray(self.known.tip_force, float) + force
            return replace(self.known, tip_force=tuple(at_tip.tolist()))
        more = BodyForce(self.body, tuple(force.tolist()))
        return replace(self.known, body_forces=(*self.known.body_forces, more))

    def on(self, body: int | None) -> UnknownForce:
        """Return the same force on another body."""
        return replace(self, body=body)


def unknown_force(
    robot: Robot, components: str | None, place: int | str, known: ExternalLoad | None
) -> UnknownForce:
    """Check which force is looked for.

    Raises:
        InputError: Axes other than x, y and z, one given twice, no such body, known loads of
            another kind.
    """
    if known is not None and not isinstance(known, ExternalLoad):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            f"known must be a notchflex.Load with the other loads; got {short_repr(known)}"
        )
    letters = _default_axes(robot) if components is None else components
    wrong = not isinstance(letters, str) or not letters or len(set(letters)) < len(letters)  # pyright: ignore
    if wrong or set(letters) - set(AXES):
        raise InputError.UNKNOWN_NAME(
            f"components names the axes along which the force is looked for, such as x, xz or xyz; "
            f"got {short_repr(letters)}"
        )
    letters = "".join(axis for axis in AXES if axis in letters)
    directions = np.eye(3)[[AXES.index(axis) for axis in letters]]
    loads = ExternalLoad() if known is None else known.external
    turn = check_vector(getattr(known, "base_rotation", NO_TURN), *BASE_TURN)
    return UnknownForce(tuple(letters), directions, loads, turn, _body(robot, place))


def _default_axes(robot: Robot) -> str:
    """Axes across the straight tube in the plane in which the robot bends, or both."""
    normal = bending_normal(robot)
    if normal is None:
        return "xy"
    across: Sequence[str] = [
        axis for axis, part in zip("yx", normal, strict=False) if abs(part) > 1e-9
    ]
    return "".join(sorted(across))


def _body(robot: Robot, place: int | str) -> int | None:
    if place in ("tip", "search"):
        return None
    if isinstance(place, str):
        raise InputError.UNKNOWN_NAME(
            f'place is "tip", "search" or the number of a body; got {short_repr(place)}'
        )
    body = check_integer(place, "place")
    if not 1 <= body <= robot.number_of_notches:
        raise InputError.OUT_OF_RANGE(
            f"place must be a body from 1 to {robot.number_of_notches}; got {body}"
        )
    return body
