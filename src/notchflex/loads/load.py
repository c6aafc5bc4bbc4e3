"""One load on a robot: its tendons pulled or drawn, external loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from math import hypot, isfinite, isnan
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.loads.external import NO_VECTOR, ExternalLoad
from notchflex.loads.validation import check_number, check_vector, short_repr

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

    A tendon of which neither tension nor stroke is commanded hangs slack (0 N).

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
        ordered = sorted(fields(self), key=lambda one: bool(one.kw_only))
        words = ((one.name, repr(getattr(self, one.name)), repr(one.default)) for one in ordered)
        given = (f"{name}={value}" for name, value, default in words if value != default)
        return f"Load({', '.join(given)})"

    def __post_init__(self) -> None:
        """Check the numbers and keep them as tuples, which the caller cannot change."""
        super().__post_init__()
        given = vars(self)
        for name in ("tension", "stroke"):
            if given[name] is not None:
                given[name] = _commanded(given[name], name)
        if self.base_rotation is not NO_VECTOR:
            given["base_rotation"] = check_turn(self.base_rotation)

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


def _commanded(value: Any, what: str) -> float | tuple[float | None, ...]:
    """Return a command as a finite number, or as one per tendon and None where there is none."""
    if type(value) is float and isfinite(value):
        return value  # as most often
    if hasattr(value, "__array__"):
        value = np.asarray(value).tolist()
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return tuple(None if entry is None else _finite(entry, what) for entry in value)
    return _finite(value, what)


def _finite(value: Any, what: str) -> float:
    number = check_number(value, what, _PER_TENDON)
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
    from notchflex._jax import constant  # not before it is needed: importing JAX takes a second
    from notchflex.mechanics.motion import rotation_about

    rotation = np.array(rotation_about(constant(vector)))
    rotation.setflags(write=False)
    return rotation


def entries_of(values: np.ndarray) -> float | list[float | None] | None:
    """Return an entry per tendon as a `Load` takes them: a number for a single tendon."""
    entries = [None if isnan(value) else value for value in values.tolist()]
    if entries.count(None) == len(entries):
        return None
    return entries[0] if len(entries) == 1 else entries
