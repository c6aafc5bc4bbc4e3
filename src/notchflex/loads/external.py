"""What acts on a robot from outside: forces and moments on its bodies, a hung mass, gravity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

from notchflex.errors import InputError
from notchflex.loads.validation import number, shown, truth, vector, whole

# Standard gravity in the world, m/s^2: what a mass hangs by where no gravity is given.
HANGING = (0.0, 0.0, -9.81)

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class BodyForce:
    """A force and a moment on one rigid body of a robot.

    Args:
        body: Which body: 0 is the base, j the one beyond notch j.
        force: Force, N.
        moment: Moment about the point, N mm.
        point: Where the force acts, in the frame of the body (on the tube axis at its proximal
            face, z along the tube, x toward direction 0), mm.
        following: Whether force and moment turn with the body; they are then given in its frame,
            otherwise in the world.

    Raises:
        InputError: Not a whole number of 0 or more for the body, or not three finite numbers.

    Example:
        >>> from notchflex import Load
        >>> side = BodyForce(3, force=(0.01, 0.0, 0.0), point=(0.81, 0.0, 0.6))
        >>> Load(tension=0.5, body_forces=[side]).body_forces[0].force
        (0.01, 0.0, 0.0)
    """

    body: int
    force: Sequence[float]
    moment: Sequence[float] = _NONE
    point: Sequence[float] = _NONE
    following: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        body = whole(self.body, "the body of a BodyForce")
        if body < 0:
            raise InputError.OUT_OF_RANGE(f"bodies are counted from 0, the base; got {body}")
        object.__setattr__(self, "body", body)
        for what, form in (("force", "N"), ("moment", "N mm"), ("point", "mm, from the body")):
            taken = vector(getattr(self, what), f"the {what} of a BodyForce", form)
            object.__setattr__(self, what, taken)
        following = truth(self.following, "following of a BodyForce")
        object.__setattr__(self, "following", following)


@dataclass(frozen=True, kw_only=True)
class ExternalLoad:
    """All that acts from outside at one step; nothing unless it is given.

    Args:
        tip_force: Force at the tip, N; in the world, or in the tip's frame if `following`.
        tip_moment: Moment at the tip, N mm; in the same frame.
        tip_point: Where the tip force acts and the tip mass hangs, from the tip (the end of the
            last uncut length, on the tube axis), in the tip's frame, mm.
        following: Whether tip force and tip moment turn with the tip.
        body_forces: Forces and moments on single bodies.
        tip_mass: Mass that hangs at the tip point, g.
        gravity: Acceleration of gravity in the world, m/s^2. Given, the robot's own weight counts
            where its material has a density. Not given, a tip mass hangs along (0, 0, -9.81).

    Raises:
        InputError: A value is not of this form, not finite, or the mass is negative.

    Example:
        >>> ExternalLoad(tip_mass=20.0).weight(20.0)
        (0.0, 0.0, -0.1962)
    """

    tip_force: Sequence[float] = _NONE
    tip_moment: Sequence[float] = _NONE
    tip_point: Sequence[float] = _NONE
    following: bool = False
    body_forces: Sequence[BodyForce] = ()
    tip_mass: float = 0.0
    gravity: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Check the numbers and keep them as tuples, so that equal loads are found equal."""
        given = vars(self)
        for name, default in _DEFAULTS:
            value = given[name]
            if value is not default:
                given[name] = _CHECKS[name](value)

    @property
    def _is_default(self) -> bool:
        """Whether no field was given, as in most loads: then there is nothing to check."""
        given = vars(self)
        return all(given[name] is default for name, default in _DEFAULTS)

    @property
    def external(self) -> ExternalLoad:
        """What acts from outside, without what else a load may command."""
        if self._is_default:
            return NOTHING
        found = object.__new__(ExternalLoad)
        given = vars(self)
        vars(found).update({name: given[name] for name in EXTERNAL})  # checked already
        return found

    @property
    def pulls_down(self) -> bool:
        """Whether there is gravity at all: given and not zero, or assumed for a hung mass."""
        return self.tip_mass > 0.0 if self.gravity is None else any(self.gravity)

    @property
    def is_nothing(self) -> bool:
        """Whether nothing acts, whatever the robot weighs."""
        acting = any(self.tip_force) or any(self.tip_moment) or self.pulls_down
        return not acting and not any(any(one.force) or any(one.moment) for one in self.body_forces)

    @property
    def follows(self) -> bool:
        """Whether anything turns with a body."""
        tip = self.following and (any(self.tip_force) or any(self.tip_moment))
        return tip or any(one.following for one in self.body_forces)

    def weight(self, mass: float) -> tuple[float, float, float]:
        """Weight of a mass (g) in the world, N."""
        x, y, z = HANGING if self.gravity is None else self.gravity
        return 1e-3 * mass * x, 1e-3 * mass * y, 1e-3 * mass * z


def _mass(value: Any) -> float:
    mass = number(value, "tip_mass", "a number of grams")
    if not 0.0 <= mass < float("inf"):
        raise InputError.NOT_FINITE(f"tip_mass must be finite and 0 g or more; got {mass:g}")
    return mass


def _body_forces(value: Any) -> tuple[BodyForce, ...]:
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    if not several or not all(isinstance(one, BodyForce) for one in value):
        raise InputError.WRONG_TYPE(
            f"body_forces must be a list of notchflex.BodyForce(body, force); got {shown(value)}"
        )
    return tuple(value)


_CHECKS: dict[str, Callable[[Any], Any]] = {
    "tip_force": partial(vector, what="tip_force", form="N"),
    "tip_moment": partial(vector, what="tip_moment", form="N mm"),
    "tip_point": partial(vector, what="tip_point", form="mm, from the tip"),
    "following": partial(truth, what="following"),
    "body_forces": _body_forces,
    "tip_mass": _mass,
    "gravity": partial(vector, what="gravity", form="m/s^2, in the world"),
}
EXTERNAL = tuple(one.name for one in fields(ExternalLoad))
_DEFAULTS = tuple((one.name, one.default) for one in fields(ExternalLoad))
NOTHING = ExternalLoad()

__all__ = ["EXTERNAL", "HANGING", "NOTHING", "BodyForce", "ExternalLoad"]
