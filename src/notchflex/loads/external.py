"""External loads: forces and moments on bodies, a mass that hangs at the tip, gravity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from operator import itemgetter
from typing import Any

from notchflex.errors import InputError
from notchflex.loads.validation import (
    check_bool,
    check_integer,
    check_number,
    check_vector,
    short_repr,
)

# Standard gravity in the world, m/s^2: what a mass hangs by where no gravity is given.
HANGING = (0.0, 0.0, -9.81)

NO_VECTOR = (0.0, 0.0, 0.0)


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
        InputError: The body is not a whole number >= 0, or a vector is not three finite numbers.

    Example:
        >>> from notchflex import Load
        >>> side = BodyForce(3, force=(0.01, 0.0, 0.0), point=(0.81, 0.0, 0.6))
        >>> Load(tension=0.5, body_forces=[side]).body_forces[0].force
        (0.01, 0.0, 0.0)
    """

    body: int
    force: Sequence[float]
    moment: Sequence[float] = NO_VECTOR
    point: Sequence[float] = NO_VECTOR
    following: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        body = check_integer(self.body, "the body of a BodyForce")
        if body < 0:
            raise InputError.OUT_OF_RANGE(f"bodies are counted from 0, the base; got {body}")
        given = vars(self)
        given["body"] = body
        for what, form in (("force", "N"), ("moment", "N mm"), ("point", "mm, from the body")):
            given[what] = check_vector(given[what], f"the {what} of a BodyForce", form)
        given["following"] = check_bool(self.following, "following of a BodyForce")


@dataclass(frozen=True, kw_only=True)
class ExternalLoad:
    """External loads at one step; none by default.

    Args:
        tip_force: Force at the tip, N; this and all others as in `Load`.
        tip_moment: Moment at the tip, N mm.
        tip_point: Point of the tip force and the tip mass, mm.
        following: Whether tip force and tip moment turn with the tip.
        body_forces: Forces and moments on single bodies.
        tip_mass: Mass that hangs at the tip point, g.
        gravity: Acceleration of gravity in the world, m/s^2.

    Raises:
        InputError: An invalid value, one that is not finite, or a negative mass.

    Example:
        >>> ExternalLoad(tip_mass=20.0).weight(20.0)
        (0.0, 0.0, -0.1962)
    """

    tip_force: Sequence[float] = NO_VECTOR
    tip_moment: Sequence[float] = NO_VECTOR
    tip_point: Sequence[float] = NO_VECTOR
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
    def external(self) -> ExternalLoad:
        """The external loads alone, without what else a load may command."""
        numbers = _numbers_of(vars(self))
        if numbers == _NOTHING:
            return NOTHING
        load = object.__new__(ExternalLoad)
        vars(load).update(zip(EXTERNAL, numbers, strict=True))  # checked already
        return load

    @property
    def pulls_down(self) -> bool:
        """Whether gravity acts: given and not zero, or assumed for a mass at the tip."""
        return self.tip_mass > 0.0 if self.gravity is None else any(self.gravity)

    @property
    def is_nothing(self) -> bool:
        """Whether no load acts, whatever the robot weighs."""
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
    mass = check_number(value, "tip_mass", "a number of grams")
    if not 0.0 <= mass < float("inf"):
        raise InputError.NOT_FINITE(f"tip_mass must be finite and 0 g or more; got {mass:g}")
    return mass


def _body_forces(value: Any) -> tuple[BodyForce, ...]:
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    if not several or not all(isinstance(one, BodyForce) for one in value):
        raise InputError.WRONG_TYPE(
            "body_forces must be a list of notchflex.BodyForce(body, force); "
            f"got {short_repr(value)}"
        )
    return tuple(value)


_CHECKS: dict[str, Callable[[Any], Any]] = {
    **{
        name: partial(check_vector, what=name, form=form)
        for name, form in (
            ("tip_force", "N"),
            ("tip_moment", "N mm"),
            ("tip_point", "mm, from the tip"),
            ("gravity", "m/s^2, in the world"),
        )
    },
    "following": partial(check_bool, what="following"),
    "body_forces": _body_forces,
    "tip_mass": _mass,
}
EXTERNAL = tuple(one.name for one in fields(ExternalLoad))
_DEFAULTS = tuple((one.name, one.default) for one in fields(ExternalLoad))
NOTHING = ExternalLoad()
_numbers_of = itemgetter(*EXTERNAL)
_NOTHING = _numbers_of(vars(NOTHING))


def external_of_steps(external: Any, steps: int) -> tuple[ExternalLoad, ...]:
    """Return the external loads of every step of a load path, checked."""
    try:
        given: tuple[Any, ...] = tuple(external)
    except TypeError:
        given = (None,)
    different = {id(one): one for one in given}.values()
    if not all(isinstance(one, ExternalLoad) for one in different):
        raise InputError.WRONG_TYPE(
            "external of a load path must hold one ExternalLoad per step; "
            f"got {short_repr(external)}; LoadPath.loaded(tip_force=...) puts a load on all steps"
        )
    if given and len(given) != steps:
        raise InputError.WRONG_SHAPE(
            f"external of a load path has {len(given)} entries, but there are {steps} steps; "
            "give one per step"
        )
    if any(type(one) is not ExternalLoad for one in different):
        given = tuple(one.external for one in given)
    return given or (NOTHING,) * steps
