"""Limits on quantities of a state: which states count as part of a workspace."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex import InputError
from notchflex.analysis.outputs import OUTPUTS
from notchflex.support import QUANTITIES, check_number, short_repr

ALIASES = {"strain": "peak_strain", "angle": "total_angle", "force": "contact_force"}
"""Short names of quantities that are often limited."""


@dataclass(frozen=True)
class Limit:
    """Bounds of a quantity, in its unit inside Python (mm, N, rad).

    Attributes:
        name: The quantity; every entry of it is limited.
        low: Smallest value; -inf for none.
        high: Largest value; inf for none.
    """

    name: str
    low: float
    high: float

    def holds(self, values: Float[np.ndarray, "*k entries"]) -> Bool[np.ndarray, " *k"]:
        """Return whether all entries are within; NaN marks a missing entry."""
        outside = (values < self.low) | (values > self.high)
        return np.asarray(~outside.reshape(*values.shape[:2], -1).any(axis=-1))

    @property
    def text(self) -> str:
        """The limit in words, in the unit of files."""
        quantity = QUANTITIES[self.name]
        scale, unit = quantity.scale, f" {quantity.unit}".rstrip()
        ends = []
        if math.isfinite(self.low):
            ends.append(f"{self.low * scale:g}{unit} or more")
        if math.isfinite(self.high):
            ends.append(f"{self.high * scale:g}{unit} or less")
        return f"{quantity.title} {', '.join(ends)}"


def limits_of(given: Mapping[str, object] | None) -> tuple[Limit, ...]:
    """Check limits.

    Args:
        given: By name of a quantity its largest value, or its smallest and largest as a pair with
            None for none.

    Raises:
        InputError: No such quantity, a bound that is not a number, or bounds that are reversed.
    """
    if given is None:
        return ()
    if not isinstance(given, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            'limits are given by quantity, such as {"peak_strain": 0.08, "gap": (0.0, None)}; '
            f"got {short_repr(given)}"
        )
    return tuple(_limit(name, bounds) for name, bounds in given.items())


def _limit(name: object, bounds: object) -> Limit:
    full = ALIASES.get(str(name), str(name))
    allowed = [one for one in OUTPUTS if one in QUANTITIES and QUANTITIES[one].kind is float]
    if full not in allowed:
        raise InputError.UNKNOWN_NAME(
            f"there is no quantity {short_repr(name)} to limit; there are {', '.join(allowed)} "
            f"and, for short, {', '.join(ALIASES)}"
        )
    pair = tuple(bounds) if isinstance(bounds, tuple | list) else (None, bounds)
    if len(pair) != 2 or pair == (None, None):
        raise InputError.WRONG_SHAPE(
            f"the limit of {name} is its largest value, or a smallest and a largest one; "
            f"got {short_repr(bounds)}"
        )
    low, high = (
        empty if one is None else check_number(one, f"the limit of {name}")
        for one, empty in zip(pair, (-math.inf, math.inf), strict=True)
    )
    if math.isnan(low) or math.isnan(high):
        raise InputError.NOT_FINITE(f"the limit of {name} is NaN; give a number")
    if low > high:
        raise InputError.OUT_OF_RANGE(
            f"the limits of {name} are reversed: {low:g} to {high:g}; give the smaller one first"
        )
    return Limit(full, low, high)


def all_hold(
    limits: Iterable[Limit], outputs: Mapping[str, np.ndarray]
) -> Bool[np.ndarray, "rows steps"]:
    """Return which states of paths converged and keep all limits."""
    hold = np.asarray(outputs["converged"], bool)
    for limit in limits:
        hold = hold & limit.holds(outputs[limit.name])
    return hold


def in_python(
    given: Mapping[str, tuple[float | None, float | None]],
) -> dict[str, tuple[float | None, float | None]]:
    """Return limits in the units of files (deg) in those inside Python (rad)."""
    scaled: dict[str, tuple[float | None, float | None]] = {}
    for name, bounds in given.items():
        quantity = QUANTITIES.get(ALIASES.get(name, name))
        scale = 1.0 if quantity is None else quantity.scale
        low, high = (None if one is None else one / scale for one in bounds)
        scaled[name] = low, high
    return scaled
