"""One load on a robot: its tendons pulled or drawn, external loads."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import lru_cache, partial
from math import hypot, isfinite, isnan
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.robot import Robot

# Checks of values that a user gives in loads: the value converted, or an `InputError`.

# Offsets of sensors of tension: so large, N, or such a part of the largest tension.
_OFFSET, _PART = 0.05, 0.1


def check_number(value: Any, what: str, form: str = "a number") -> float:
    """Return a number as a float; text and truth values are refused."""
    if type(value) is float:  # as most often
        return value
    try:
        if isinstance(value, str | bytes | bytearray | bool | np.bool_):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(f"{what} must be {form}; got {short_repr(value)}") from None


def check_integer(value: Any, what: str) -> int:
    """Return a whole number."""
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise InputError.WRONG_TYPE(
            f"{what} must be a whole number; got {short_repr(value)}"
        ) from None


def check_bool(value: Any, what: str) -> bool:
    """Return True or False."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError.WRONG_TYPE(f"{what} must be True or False; got {short_repr(value)}")


def check_vector(value: Any, what: str, form: str) -> tuple[float, float, float]:
    """Return three finite numbers.

    Example:
        >>> check_vector([0, 0, 1], "tip_force", "N")
        (0.0, 0.0, 1.0)
    """
    several = np.asarray(value).tolist() if hasattr(value, "__array__") else value
    numbers: list[float] = []
    if isinstance(several, Sequence) and not isinstance(several, str | bytes | bytearray):
        with suppress(InputError):
            numbers = [check_number(entry, what) for entry in several]
    if len(numbers) != 3 or not all(map(isfinite, numbers)):
        raise InputError.NOT_FINITE(
            f"{what} needs three finite numbers ({form}); got {short_repr(value)}"
        )
    return numbers[0], numbers[1], numbers[2]


def check_table(value: Any, what: str) -> np.ndarray:
    """Return numbers, steps by tendons; None within them is NaN."""
    try:
        if value is None or np.asarray(value).dtype.kind not in "iufO":
            raise TypeError
        return np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(
            f"{what} of a load path must be numbers, steps by tendons; got {short_repr(value)}"
        ) from None


def check_pulls(tension: np.ndarray, minimum: float = 0.0, source: str = "") -> None:
    """Refuse measured tensions of a tendon that are all negative.

    Small ones are a sensor's offset, of a slack tendon or among others that are pulled.

    Args:
        tension: Tensions by rows and tendons, N, NaN where not measured.
        minimum: Negative tensions up to this are an offset, N, if it is more than 0.05 N.
        source: The file, for the message.

    Raises:
        InputError: The sign or the zero of the sensor is wrong.
    """
    largest = float(np.nanmax(np.abs(tension), initial=0.0))
    minimum = max(minimum, _OFFSET, _PART * largest)
    prefix = f"{source}: " if source else ""
    for tendon, values in enumerate(tension.T, 1):
        finite = values[np.isfinite(values)]
        if len(finite) and finite.max() < 0.0 and finite.min() < -minimum:
            raise InputError.OUT_OF_RANGE(
                f"{prefix}all tensions of tendon {tendon} are negative, down to {finite.min():g} "
                "N, but a tendon only pulls; change their sign, or take away the sensor's offset"
            )


def one_or_several(value: Any, kind: type, what: str) -> list[Any]:
    """Return one value of a kind, or several in order, as a list; the entries are not checked."""
    try:
        return [value] if isinstance(value, kind) else list(value)
    except TypeError:
        raise InputError.WRONG_TYPE(f"{what}; got {short_repr(value)}") from None


def check_is_robot(value: Any) -> Robot:
    """Return a robot."""
    if not isinstance(value, Robot):
        raise InputError.WRONG_TYPE(
            'a notchflex.Robot is needed, such as load_robot("pacheco2021-a"); '
            f"got {short_repr(value)}"
        )
    return value


def short_repr(value: Any) -> str:
    """Return a value as Python writes it, at most 60 characters."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of thousands of digits
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


# External loads: forces and moments on bodies, a mass that hangs at the tip, gravity.

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
        values = vars(self)
        values["body"] = body
        for what, form in (("force", "N"), ("moment", "N mm"), ("point", "mm, from the body")):
            values[what] = check_vector(values[what], f"the {what} of a BodyForce", form)
        values["following"] = check_bool(self.following, "following of a BodyForce")


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
        temperature: Temperature of the robot, deg C.
        sheath_bend_deg: Total angle by which all sheaths are bent, deg; None as in the robot file.

    Raises:
        InputError: An invalid value, one that is not finite, or a negative mass or bend.

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
    temperature: float | None = None
    sheath_bend_deg: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers and keep them as tuples, so that equal loads are found equal."""
        values = vars(self)
        for name, default in _DEFAULTS:
            value = values[name]
            if value is not default:
                values[name] = _CHECKS[name](value)

    @property
    def external(self) -> ExternalLoad:
        """The external loads alone, without what else a load may command."""
        numbers = _external_values(vars(self))
        if numbers == _external_values(vars(NOTHING)):
            return NOTHING
        load = object.__new__(ExternalLoad)
        vars(load).update(zip(EXTERNAL, numbers, strict=True))  # checked already
        return load

    @property
    def is_nothing(self) -> bool:
        """Whether no load acts, whatever the robot weighs."""
        # Gravity acts where it is given and not zero, or assumed for a mass at the tip.
        pulls = self.tip_mass > 0.0 if self.gravity is None else any(self.gravity)
        return not (
            pulls
            or any(self.tip_force)
            or any(self.tip_moment)
            or self.temperature is not None
            or any(any(load.force) or any(load.moment) for load in self.body_forces)
        )

    @property
    def follows(self) -> bool:
        """Whether anything turns with a body."""
        tip = self.following and (any(self.tip_force) or any(self.tip_moment))
        return tip or any(load.following for load in self.body_forces)

    def weight(self, mass: float) -> tuple[float, float, float]:
        """Weight of a mass (g) in the world, N."""
        x, y, z = HANGING if self.gravity is None else self.gravity
        return 1e-3 * mass * x, 1e-3 * mass * y, 1e-3 * mass * z


def _not_negative(value: Any, what: str, unit: str, most: float = float("inf")) -> float:
    number = check_number(value, what, f"a number in {unit}")
    if not 0.0 <= number < float("inf"):
        raise InputError.NOT_FINITE(f"{what} must be finite and 0 {unit} or more; got {number:g}")
    if number > most:  # as in robot files
        raise InputError.OUT_OF_RANGE(f"{what} must be at most {most:g} {unit}; got {number:g}")
    return number


def _body_forces(value: Any) -> tuple[BodyForce, ...]:
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    if not several or not all(isinstance(entry, BodyForce) for entry in value):
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
    "temperature": lambda value: _finite(value, "temperature", "a number of deg C"),
    "tip_mass": partial(_not_negative, what="tip_mass", unit="g"),
    "sheath_bend_deg": partial(_not_negative, what="sheath_bend_deg", unit="deg", most=3600.0),
}
EXTERNAL = tuple(field.name for field in fields(ExternalLoad))
_DEFAULTS = tuple((field.name, field.default) for field in fields(ExternalLoad))
_external_values = operator.itemgetter(*EXTERNAL)
NOTHING = ExternalLoad()


def distinct_objects(values: Iterable[Any]) -> dict[int, Any]:
    """Return each of many objects once, by its identity."""
    return {id(value): value for value in values}


def external_of_steps(external: Any, steps: int) -> tuple[ExternalLoad, ...]:
    """Return the external loads of every step of a load path, checked."""
    try:
        loads: tuple[Any, ...] = tuple(external)
    except TypeError:
        loads = (None,)
    different = distinct_objects(loads).values()
    if not all(isinstance(load, ExternalLoad) for load in different):
        raise InputError.WRONG_TYPE(
            "external of a load path must hold one ExternalLoad per step; "
            f"got {short_repr(external)}; LoadPath.loaded(tip_force=...) puts a load on all steps"
        )
    if loads and len(loads) != steps:
        raise InputError.WRONG_SHAPE(
            f"external of a load path has {len(loads)} entries, but there are {steps} steps; "
            "give one per step"
        )
    if any(type(load) is not ExternalLoad for load in different):
        loads = tuple(load.external for load in loads)
    return loads or (NOTHING,) * steps


_LARGEST_TURN = 1e6  # rad; of more, rounding leaves an angle worse than 1e-10 rad

_PER_TENDON = "a number, or one entry per tendon with None where nothing is commanded"


@dataclass(frozen=True, repr=False)
class Load(ExternalLoad):
    """One load on a robot.

    Args:
        tension: Tension at the base of every tendon, N. A single number pulls the first tendon;
            a sequence has one entry per tendon, None where its tension is not commanded.
        stroke: Tendon drawn out at the base since the free robot, mm; in the same form.
        base_rotation: Rotation vector of the base in the world, rad.
        tip_force: Force at the tip, N; in the world, or in the tip's frame if `following`.
        tip_moment: Moment at the tip, N mm; in the same frame.
        tip_point: Where the tip force acts and the tip mass hangs, from the tip (the end of the
            last uncut length, on the tube axis), in the tip's frame, mm.
        following: Whether tip force and tip moment turn with the tip.
        body_forces: Forces and moments on single bodies, each a `BodyForce`.
        tip_mass: Mass that hangs at the tip point, g.
        gravity: Acceleration of gravity in the world, m/s^2. Given, the robot's own weight counts
            where its material has a density. Not given, a tip mass hangs along (0, 0, -9.81).
        temperature: Temperature of the robot, deg C, which moves the plateaus of a material with a
            `reference_temperature`; not given, that of its material.
        sheath_bend_deg: Total angle by which all sheaths are bent, deg; not given, it is that of
            the robot file. It changes where the shaft is moved.

    With a sheath, tension and stroke are those of its drive. A tendon of which neither tension nor
    stroke is commanded hangs slack (0 N).

    Raises:
        InputError: A number that is not finite, text, an invalid external load, or a base turned
            by more than 1e6 rad; the number of tendons and the signs are checked when the robot is
            known.

    Example:
        >>> Load(tension=2.0, tip_force=(0.0, 0.1, 0.0))
        Load(tension=2.0, tip_force=(0.0, 0.1, 0.0))
    """

    tension: float | Sequence[float | None] | None = None
    stroke: float | Sequence[float | None] | None = None
    base_rotation: Sequence[float] = NO_VECTOR

    def __repr__(self) -> str:
        """Show what is given; tendons first."""
        ordered = sorted(fields(self), key=lambda field: bool(field.kw_only))
        words = (
            (field.name, repr(getattr(self, field.name)), repr(field.default)) for field in ordered
        )
        arguments = (f"{name}={value}" for name, value, default in words if value != default)
        return f"Load({', '.join(arguments)})"

    def __post_init__(self) -> None:
        """Check the numbers and keep them as tuples, which the caller cannot change."""
        super().__post_init__()
        values = vars(self)
        for name in ("tension", "stroke"):
            value = values[name]
            if value is None:
                continue
            if hasattr(value, "__array__"):
                value = np.asarray(value).tolist()
            if isinstance(value, Sequence) and not isinstance(value, str | bytes):
                values[name] = tuple(
                    None if each is None else _finite(each, name) for each in value
                )
            else:
                values[name] = _finite(value, name)
        if self.base_rotation is not NO_VECTOR:
            values["base_rotation"] = check_turn(self.base_rotation)

    def per_tendon(self, what: str, tendons: int) -> tuple[float | None, ...]:
        """Return tension (N) or stroke (mm) of every tendon, None where not commanded.

        Args:
            what: "tension" or "stroke".
            tendons: Number of tendons of the robot.

        Raises:
            InputError: Too many entries.
        """
        value = getattr(self, what)
        entries = value if type(value) is tuple else (value,)
        if len(entries) > tendons:
            raise InputError.WRONG_SHAPE(
                f"{what} has {len(entries)} entries, but the robot has {tendons} tendons; "
                f"give at most {tendons}"
            )
        return entries + (None,) * (tendons - len(entries))


def _finite(value: Any, what: str, form: str = _PER_TENDON) -> float:
    number = check_number(value, what, form)
    if not isfinite(number):
        raise InputError.NOT_FINITE(f"{what} must be finite; got {short_repr(value)}")
    return number


def check_turn(value: Any) -> tuple[float, float, float]:
    """Return the rotation vector of a base, short enough for its angle to be known."""
    turn = check_vector(value, "base_rotation", "rotation vector, rad")
    if hypot(*turn) > _LARGEST_TURN:
        raise InputError.OUT_OF_RANGE(
            f"base_rotation turns by {hypot(*turn):.4g} rad; give a rotation vector of at most "
            f"{_LARGEST_TURN:g} rad, of which one turn is 6.283"
        )
    return turn


@lru_cache(maxsize=64)
def rotation_of(vector: tuple[float, ...]) -> Float[np.ndarray, "3 3"] | None:
    """Return the rotation matrix of a rotation vector; None for the identity."""
    if not any(vector):
        return None
    from scipy.spatial.transform import Rotation  # not before it is needed: 0.1 s

    rotation = Rotation.from_rotvec(vector).as_matrix()
    rotation.setflags(write=False)
    return rotation


def entries_of(values: np.ndarray) -> float | list[float | None] | None:
    """Return an entry per tendon as a `Load` takes them: a number for a single tendon."""
    entries = [None if isnan(value) else value for value in values.tolist()]
    if entries.count(None) == len(entries):
        return None
    return entries[0] if len(entries) == 1 else entries
