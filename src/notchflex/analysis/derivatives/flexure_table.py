"""Flexures of notches that differ in one number only, as polynomials of that number.

Slopes by the depths of 27 notches need 162 flexures, which plain Python assembles one by one. They
are values of few smooth functions: one of the depth for all notches whose other numbers are equal.
These are interpolated to rounding at Chebyshev points; where that fails, as at a kink, flexures are
assembled one by one.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.polynomial import chebyshev

from notchflex.errors import InputError
from notchflex.mechanics.chain import flexure
from notchflex.mechanics.flexure import Rod, Site
from notchflex.mechanics.motion import Motion
from notchflex.robot import Tube
from notchflex.robot.kinds import Notch
from notchflex.solver.programs.pytree_layout import PytreeLayout

BuiltFlexure = tuple[Rod, Motion]
# Points of an interpolation, and halves of its range, of the number: the second where a number is
# near one at which flexures are not smooth. The coefficients of wrist A's depth and of the links'
# dimensions end at rounding with them.
_POINTS = 16
_HALF_WIDTHS = (0.1, 0.03)
_NODES = chebyshev.chebpts1(_POINTS)
# Coefficients below this fraction of the largest number of their array are rounding.
_ROUNDING = 1e-14
# Requests of a family before it is interpolated: as many as the interpolation takes.
_MIN_REQUESTS = _POINTS
# Number of families whose polynomials are cached.
_MAX_FAMILIES = 64


class Family(tuple[Any, ...]):
    """Notches with their surroundings that differ in one number only."""


@dataclass(frozen=True, eq=False)
class Polynomial:
    """All numbers of a flexure as a polynomial of one number of its notch.

    Attributes:
        middle: Middle of its range.
        half: Half of its range.
        layout: Layout of the flexure in a vector.
        coefficients: Of Chebyshev's polynomials.
    """

    middle: float
    half: float
    layout: PytreeLayout
    coefficients: Float[np.ndarray, "degrees m"]

    def at(self, value: float) -> BuiltFlexure | None:
        """Return the flexure of a value; None beyond the range."""
        part = (value - self.middle) / self.half
        if abs(part) > 1.0:
            return None
        degree = len(self.coefficients) - 1
        return self.layout.unpack(chebyshev.chebvander(part, degree)[0] @ self.coefficients)


class FlexureTable:
    """Makes flexures, many of notches that differ in one number; for arguments see `flexure`."""

    def __init__(self) -> None:
        """Create an empty table."""
        self._flexures: dict[Any, BuiltFlexure] = {}
        self._requests: defaultdict[Family, list[float]] = defaultdict(list)
        self._polynomials: dict[Family, list[Polynomial]] = {}

    def forget(self) -> None:
        """Clear the single flexures, which only one task requests repeatedly."""
        self._flexures.clear()
        self._requests.clear()

    def __call__(
        self,
        notch: Notch,
        site: Site | None,
        tube: Tube,
        level: str,
        refinement: int,
        by_fibres: bool,
    ) -> BuiltFlexure:
        """Return a flexure and its pose in the free robot."""
        key = (notch, site, tube, level, refinement, by_fibres)
        if key not in self._flexures:
            self._flexures[key] = self._interpolated(key) or flexure(*key)
        return self._flexures[key]

    def _interpolated(self, key: tuple[Any, ...]) -> BuiltFlexure | None:
        for name, value, family in _families(key):
            for polynomial in self._polynomials.get(family, ()):
                if (built := polynomial.at(value)) is not None:
                    return built
            requests = self._requests[family]
            requests.append(value)
            nearby = [one for one in requests if abs(one - value) <= min(_HALF_WIDTHS) * abs(value)]
            if len(nearby) > _MIN_REQUESTS:
                requests.clear()
                new = _interpolate(key, name, float(np.mean(nearby)))
                if new is not None:
                    if len(self._polynomials) >= _MAX_FAMILIES:
                        del self._polynomials[next(iter(self._polynomials))]
                    self._polynomials.setdefault(family, []).append(new)
                    return new.at(value)
        return None


def _families(key: tuple[Any, ...]) -> Iterator[tuple[str, float, Family]]:
    """Yield every number of a notch with its value, and its family."""
    notch, *around = key
    values = {one.name: getattr(notch, one.name) for one in dataclasses.fields(notch)}
    for name, value in values.items():
        if isinstance(value, float) and value:
            others = tuple(other for one, other in values.items() if one != name)
            yield name, value, Family((type(notch), name, others, *around))


def _interpolate(key: tuple[Any, ...], name: str, middle: float) -> Polynomial | None:
    """Interpolate a family around a value; None where it is not smooth or not defined."""
    notch, *around = key
    for half in (part * abs(middle) for part in _HALF_WIDTHS):
        values = middle + half * _NODES
        try:
            notches = [dataclasses.replace(notch, **{name: float(value)}) for value in values]
        except InputError:
            continue
        built = [flexure(one, *around) for one in notches]
        layout = PytreeLayout.of(built[0])
        if any(PytreeLayout.of(one) is not layout for one in built):
            continue
        rows = np.stack([layout.pack(one) for one in built])
        constant = (rows == rows[:1]).all(axis=0)
        coefficients = np.linalg.solve(chebyshev.chebvander(_NODES, _POINTS - 1), rows)
        coefficients[0, constant], coefficients[1:, constant] = rows[0, constant], 0.0
        counts = _counts(coefficients, rows, layout)
        if not counts[-2:].any():
            degrees = int(np.flatnonzero(counts)[-1]) + 1
            return Polynomial(middle, half, layout, coefficients[:degrees])
    return None


def _counts(
    coefficients: Float[np.ndarray, "points m"],
    rows: Float[np.ndarray, "points m"],
    layout: PytreeLayout,
) -> Bool[np.ndarray, " points"]:
    """Return which degrees exceed rounding."""
    counts = np.zeros(len(coefficients), bool)
    for indices in layout.indices:
        own = indices.ravel()
        largest = np.abs(rows[:, own]).max(initial=0.0)
        counts |= (np.abs(coefficients[:, own]) > _ROUNDING * largest).any(axis=1)
    return counts


__all__ = ["FlexureTable"]
