"""Limits on drives and robot that a search for a target keeps to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import InputError
from notchflex.support import check_number, short_repr

Drive = Literal["tension", "stroke"]

Range = tuple[float | Sequence[float] | None, float | Sequence[float] | None]
"""Lowest and highest value, a number or one per tendon; None for no limit."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits on drives and robot.

    Args:
        tension: Lowest and highest tension at the base of a tendon, N; each a number or one entry
            per tendon, None for no limit. The lowest is the pretension of antagonists; a tendon
            never pushes, so that it is 0 or more.
        stroke: Lowest and highest length drawn out of a tendon, mm; in the same form.
        rate: Largest change of a drive from target to target, N or mm.
        strain: Largest peak strain of a notch.
        gap: Smallest gap that is left of the opening of a notch, mm; 0 lets none be pressed
            together.

    Raises:
        InputError: A limit that is not a number, or a lowest above the highest.

    Example:
        >>> Limits(tension=(0.05, 2.0), strain=0.06).tension
        (0.05, 2.0)
    """

    tension: Range = (0.0, None)
    stroke: Range = (None, None)
    rate: float | None = None
    strain: float | None = None
    gap: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, unit in (("tension", "N"), ("stroke", "mm")):
            low, high = (self._side(name, side, None) for side in (0, 1))
            if low.size > 1 and high.size > 1 and low.shape != high.shape:
                raise InputError.WRONG_SHAPE(
                    f"the limits of {name} have {low.size} lowest and {high.size} highest values; "
                    "give one number, or one per tendon, for each"
                )
            if (low > high).any():
                raise InputError.OUT_OF_RANGE(
                    f"the lowest {name} is above the highest: {short_repr(getattr(self, name))} "
                    f"{unit}; give the lowest first"
                )
        for name, unit in (("rate", "N or mm"), ("strain", "1"), ("gap", "mm")):
            value = getattr(self, name)
            if value is None:
                continue
            number = check_number(value, f"the limit {name}")
            least_excluded = name != "gap" and number == 0.0
            if not 0.0 <= number < np.inf or least_excluded:
                raise InputError.OUT_OF_RANGE(
                    f"the limit {name} must be positive and finite ({unit}); got {number:g}"
                )
            object.__setattr__(self, name, number)

    def bounds(
        self, drive: Drive, tendons: int
    ) -> tuple[Float[np.ndarray, " t"], Float[np.ndarray, " t"]]:
        """Return the lowest and highest value of every tendon, N or mm.

        Args:
            drive: "tension" or "stroke".
            tendons: Number of tendons of the robot.
        """
        low, high = (self._side(drive, side, tendons) for side in (0, 1))
        return low, high

    def _side(self, name: str, side: int, tendons: int | None) -> np.ndarray:
        """Lowest or highest values of tension or stroke; per tendon if their number is given."""
        given: Any = getattr(self, name)
        if not isinstance(given, Sequence) or isinstance(given, str | bytes) or len(given) != 2:
            raise InputError.WRONG_TYPE(
                f"the limits of {name} are the lowest and the highest value, such as (0.05, 2.0) "
                f"or (None, 2.0); got {short_repr(given)}"
            )
        value = given[side]
        several = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
        entries = list(value) if several else [value]  # pyright: ignore[reportArgumentType]
        none = np.inf if side else -np.inf
        numbers = np.array([none if e is None else check_number(e, name) for e in entries])
        if np.isnan(numbers).any():
            raise InputError.NOT_FINITE(f"a limit of {name} is NaN; give a number, or None")
        if name == "tension":
            if side and (numbers < 0.0).any():
                raise InputError.OUT_OF_RANGE(
                    f"the highest tension is {numbers.min():g} N; a tendon only pulls, so give "
                    "0 N or more"
                )
            if not side and ((numbers < 0.0) & np.isfinite(numbers)).any():
                raise InputError.OUT_OF_RANGE(
                    f"the lowest tension is {numbers.min():g} N; a tendon only pulls, so give "
                    "0 N or more"
                )
            numbers = np.maximum(numbers, 0.0)
        if tendons is None:
            return numbers
        if several and len(numbers) != tendons:
            raise InputError.WRONG_SHAPE(
                f"the limits of {name} have {len(numbers)} entries, but the robot has {tendons} "
                "tendons; give one number, or one per tendon"
            )
        return np.broadcast_to(numbers, (tendons,)).astype(float)


class Bound(NamedTuple):
    """Limits on quantities of the solved robot beside its drives.

    Attributes:
        quantity: Its name.
        side: 1.0 where values must not exceed the limit, -1.0 where they must not fall below.
        limit: The limit of each entry.
        text: What a message calls it.
    """

    quantity: str
    side: float
    limit: Float[np.ndarray, " m"]
    text: str


def bounds_of_robot(limits: Limits, drive: Drive, tendons: int, notches: int) -> list[Bound]:
    """Return the limits that are not on the drives themselves."""
    bounds: list[Bound] = []
    other: Drive = "stroke" if drive == "tension" else "tension"
    low, high = limits.bounds(other, tendons)
    if np.isfinite(high).any():
        bounds.append(Bound(other, 1.0, high, f"the highest {other}"))
    if np.isfinite(low).any() and (other == "stroke" or low.any()):
        bounds.append(Bound(other, -1.0, low, f"the lowest {other}"))
    if limits.strain is not None:
        largest = np.full(notches, limits.strain)
        bounds.append(Bound("peak_strain", 1.0, largest, "the largest peak strain"))
    if limits.gap is not None:
        bounds.append(Bound("gap", -1.0, np.full(notches, limits.gap), "the smallest gap"))
    return bounds
