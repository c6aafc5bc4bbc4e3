"""Slopes of all arrays of a robot by several of its numbers.

Slopes by the depths of 27 notches need 162 flexures, which plain Python assembles one by one. They
are values of few smooth functions: one of the depth for all notches whose other numbers are equal.
These are interpolated to rounding at Chebyshev points; where that fails, as at a kink, flexures are
assembled one by one.

JAX cannot trace the validation of a robot and its conversion to arrays. The arrays are smooth
functions of the numbers; everything after them is differentiated exactly.

A dimension of a notch changes what belongs to that notch, and little beside it. Numbers that change
different entries of the vector are moved together, and each takes the slopes of its own entries
(Curtis, Powell & Reid 1974, J. Inst. Maths Applics 13:117). Which entries a number changes is
observed once. One difference with all numbers moved, each by an amount of its own, checks them.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from notchflex._jax import jax
from notchflex.analysis.derivatives.tangent import Change
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.mechanics.chain import Chain, FlexureOf, chain_averages, flexure
from notchflex.mechanics.flexure import Rod, Site
from notchflex.mechanics.motion import Motion
from notchflex.robot import Robot, Tube
from notchflex.robot.kinds import Notch
from notchflex.robot.value_names import number_at
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout

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


# Width of a difference relative to the number, by order of accuracy. A short formula is accurate to
# rounding and allows a small width; integrals and special functions do not.
_WIDTHS = {2: 5e-6, 6: 1.3e-3}


def slope(
    vector_of: Callable[[float], Float[np.ndarray, "*m"]], value: float, *, order: int = 6
) -> Float[np.ndarray, "*m"]:
    """Differentiate by a number.

    Args:
        vector_of: The arrays of a value; entries may be infinite, and count as constant.
        value: Where. At the end of its range, such as a friction of 0, the derivative is inward.
        order: Order of accuracy: 6, or 2 with a third of the evaluations, for plain formulas.

    Returns:
        The derivative, accurate to about 1e-10.

    Raises:
        InputError: The number cannot be varied.
    """
    per_width = differences(lambda moved: vector_of(float(moved)), value, order)
    return per_width / width_at(value, order)


def differences(
    vector_of: Callable[[Float[np.ndarray, "*k"]], Float[np.ndarray, "*m"]],
    values: ArrayLike,
    order: int,
) -> Float[np.ndarray, "*m"]:
    """Differentiate by numbers that vary together, each in multiples of its `width_at`.

    Args:
        vector_of: As for `slope`.
        values: Where, one number or several.
        order: As for `slope`.

    Returns:
        The derivative per width.

    Raises:
        InputError: The numbers cannot be varied.
    """
    width = width_at(values, order)
    for side in (0, 1, -1):
        points, weights = _stencil(order, side)
        try:
            vectors = np.stack([vector_of(values + width * point) for point in points])
        except InputError:  # out of range
            continue
        vectors = np.where(np.isfinite(vectors), vectors, 0.0)
        # Constant entries give exactly 0, without rounding errors.
        return np.tensordot(weights, vectors - vectors[0], 1)
    raise InputError.OUT_OF_RANGE(f"the number cannot be varied around {np.ravel(values)[0]:g}")


def width_at(values: ArrayLike, order: int) -> Float[np.ndarray, "*k"]:
    """Return the widths of differences: relative to the numbers, or to 1 for 0."""
    size = np.abs(values)
    return _WIDTHS[order] * np.where(size == 0.0, 1.0, size)


@lru_cache
def _stencil(order: int, side: int) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return points, in widths, and weights of the slope at 0 of their interpolant."""
    half = order // 2
    central = np.concatenate([np.arange(-half, 0.0), np.arange(1.0, half + 1.0)])
    points = side * np.arange(order + 1.0) if side else central
    powers = np.vander(points, increasing=True).T
    return points, np.linalg.solve(powers, np.eye(len(points))[1])


# Rounding errors, relative to the largest number of a part.
_ROUNDING_OF_SLOPES = 1e-13

# Check of slopes: step in widths of a difference, and allowed relative error. It separates the
# error of a two-point difference from a slope that belongs to another number.
_CHECKED, _AGREEMENT = 0.1, 1e-2
_GOLDEN_RATIO = 0.5 * (1.0 + 5.0**0.5)

Vector = Callable[[Float[np.ndarray, " k"]], Float[np.ndarray, " m"]]


@dataclass(frozen=True, eq=False)
class SparseSlopes:
    """Slopes by k numbers, with the observed sparsity: the entries that each of them changes.

    Attributes:
        order: Order of accuracy, as for `slope`.
        parts: Entries that belong together and are of one size.
        derived: Entries that follow from others and count as constant: to averages over all notches
            every number contributes.
    """

    order: int
    parts: Sequence[Int[np.ndarray, ...]]
    derived: Int[np.ndarray, " d"]

    def at(
        self, vector_of: Vector, at: Float[np.ndarray, " k"], form: bytes = b""
    ) -> list[Float[np.ndarray, " m"]]:
        """Differentiate a vector.

        Args:
            vector_of: The vector of k numbers, m finite or infinite entries.
            at: Where.
            form: Distinguishes vectors in which numbers change other entries.

        Returns:
            The slopes by each number, as `slope` finds them.

        Raises:
            InputError: A number cannot be varied.
        """
        vector = vector_of(at)
        if form not in self._changed:
            self._changed[form] = self._observed(vector_of, at, vector)
        slopes = self._compressed(vector_of, at, vector, self._changed[form])
        if slopes is None:  # a number changes more than it did where it was observed
            self._changed[form] |= self._observed(vector_of, at, vector)
            slopes = self._compressed(vector_of, at, vector, self._changed[form])
        if slopes is None or not self._agree(vector_of, at, slopes):
            return [self._alone(vector_of, at, number) for number in range(len(at))]
        return slopes

    @cached_property
    def _changed(self) -> dict[bytes, Bool[np.ndarray, "k m"]]:
        return {}

    def _observed(
        self, vector_of: Vector, at: Float[np.ndarray, " k"], vector: Float[np.ndarray, " m"]
    ) -> Bool[np.ndarray, "k m"]:
        """Observe which entries each number changes."""
        width = width_at(at, self.order)
        changed = np.empty((len(at), len(vector)), bool)
        for number in range(len(at)):
            moved = vector
            for side in (1.0, -1.0):
                try:
                    moved = vector_of(_with(at, number, at[number] + side * width[number]))
                except InputError:  # at an end of its range; `slope` raises where at both
                    continue
                break
            with np.errstate(invalid="ignore"):
                changed[number] = self._differs(moved - vector, vector)
        changed[:, self.derived] = False
        return changed

    def _differs(
        self, change: Float[np.ndarray, " m"], values: Float[np.ndarray, " m"]
    ) -> Bool[np.ndarray, " m"]:
        """Return which entries change by more than rounding; NaN, from infinite ones, does not."""
        return np.abs(change) > self._rounding(values)

    def _rounding(self, values: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        """Return the rounding error of each entry."""
        rounding = np.full(len(values), np.inf)
        for part in self.parts:
            finite = np.abs(values[part])
            largest = np.max(finite, where=np.isfinite(finite), initial=0.0)
            rounding[part] = _ROUNDING_OF_SLOPES * largest
        return rounding

    def _compressed(
        self,
        vector_of: Vector,
        at: Float[np.ndarray, " k"],
        vector: Float[np.ndarray, " m"],
        changed: Bool[np.ndarray, "k m"],
    ) -> list[Float[np.ndarray, " m"]] | None:
        """Compute slopes of numbers varied together; None where another entry changes too."""
        slopes = [np.zeros(0)] * len(at)
        for group in _groups(changed):
            try:
                together = differences(
                    lambda values, group=group: vector_of(_with(at, group, values)),
                    at[group],
                    self.order,
                )
            except InputError:  # one is at the lower end of its range, one perhaps at the upper
                for number in group:
                    slopes[number] = self._alone(vector_of, at, number)
                continue
            together[self.derived] = 0.0
            if np.any(self._differs(together, vector) & ~changed[group].any(axis=0)):
                return None
            for number in group:
                own = np.where(changed[number], together, 0.0)
                slopes[number] = own / width_at(at[number], self.order)
        return slopes

    def _agree(
        self, vector_of: Vector, at: Float[np.ndarray, " k"], slopes: list[Float[np.ndarray, " m"]]
    ) -> bool:
        """Return whether slopes agree with a difference in which all numbers vary by other amounts.

        It detects an entry whose change was attributed to the wrong number of a group. They also
        disagree at a kink, and where a number cannot vary to both sides.
        """
        if not slopes:
            return True
        amounts = 0.5 + np.arange(1, len(at) + 1) * _GOLDEN_RATIO % 1.0
        steps = _CHECKED * width_at(at, self.order) * amounts
        try:
            lower, upper = vector_of(at - steps), vector_of(at + steps)
        except InputError:
            return False
        with np.errstate(invalid="ignore"):
            change = 0.5 * (upper - lower)
        change[self.derived] = 0.0
        terms = steps[:, None] * np.stack(slopes)
        bound = _AGREEMENT * np.abs(terms).sum(axis=0) + 10.0 * self._rounding(upper)
        return not np.any(np.abs(change - terms.sum(axis=0)) > bound)

    def _alone(
        self, vector_of: Vector, at: Float[np.ndarray, " k"], number: int
    ) -> Float[np.ndarray, " m"]:
        by = slope(lambda value: vector_of(_with(at, number, value)), at[number], order=self.order)
        by[self.derived] = 0.0
        return by


def _with(at: Float[np.ndarray, " k"], numbers: Any, values: ArrayLike) -> np.ndarray:
    """Return the numbers with some replaced."""
    moved = np.array(at)
    moved[numbers] = values
    return moved


def _groups(changed: Bool[np.ndarray, "k m"]) -> list[list[int]]:
    """Group numbers that change no entry in common."""
    groups: list[list[int]] = []
    taken: list[np.ndarray] = []
    for number, own in enumerate(changed):
        for group, every in zip(groups, taken, strict=True):
            if not np.any(every & own):
                group.append(number)
                every |= own
                break
        else:
            groups.append([number])
            taken.append(own.copy())
    return groups


@dataclass(frozen=True, eq=False)
class GeometrySlopes:
    """Slopes by k numbers; numbers that change different parts of the chain are varied together.

    Attributes:
        ready: Any robot of the form.
        names: Names of the numbers.
    """

    ready: PreparedChain
    names: tuple[str, ...]

    def at(
        self,
        packed: Callable[[Robot, LoadPath, FlexureOf], np.ndarray],
        robot: Robot,
        load: LoadPath,
    ) -> list[Change]:
        """Differentiate the arrays of a robot, and its loads.

        Args:
            packed: The long chain of a robot, and its loads, as one vector; takes what makes its
                flexures.
            robot: The robot, with the values where.
            load: The loads.

        Raises:
            InputError: A number cannot be varied.
        """
        at = np.array([number_at(robot, name) for name in self.names])

        def vector_of(values: np.ndarray) -> np.ndarray:
            moved = np.flatnonzero(values != at)
            changed = {self.names[one]: float(values[one]) for one in moved}
            return packed(robot.with_values(changed), load, self._flexures)

        self._flexures.forget()
        vector = packed(robot, load, self._flexures)
        # Integers of the chain identify the notches that a tendon passes at once.
        slopes = self._slopes_of(len(vector)).at(vector_of, at, vector[self._whole].tobytes())
        size = self.ready.long.chain_layout.size
        changes: list[Change] = []
        for by_number in slopes:
            by_number[self._averaged] = self._of_averages(vector, by_number)
            changes.append(Change(by_number[size:].reshape(len(load), -1), by_number[:size]))
        return changes

    @cached_property
    def _flexures(self) -> FlexureTable:
        return FlexureTable()

    @cached_property
    def _slopes(self) -> dict[int, SparseSlopes]:
        return {}

    def _slopes_of(self, numbers: int) -> SparseSlopes:
        """Return the slopes for vectors of a size: the chain, then the loads of some steps."""
        if numbers not in self._slopes:
            form = self.ready.long.chain_layout
            parts = [*form.indices, np.arange(form.size, numbers)]
            self._slopes[numbers] = SparseSlopes(6, parts, self._averaged)
        return self._slopes[numbers]

    @cached_property
    def _indices(self) -> Chain:
        """Indices of all fields in the vector of the long chain."""
        form = self.ready.long.chain_layout
        return jax.tree.unflatten(form.structure, form.indices)

    @cached_property
    def _whole(self) -> Int[np.ndarray, " m"]:
        form = self.ready.long.chain_layout
        whole = zip(form.indices, form.kinds, strict=True)
        return np.concatenate([indices.ravel() for indices, kind in whole if kind != "f"])

    @cached_property
    def _averaged(self) -> Int[np.ndarray, " a"]:
        """Indices of the averages over the notches in the vector."""
        one = np.ones(1)
        return np.ravel([getattr(self._indices, name) for name in chain_averages(one, one)])

    def _of_averages(
        self, vector: Float[np.ndarray, " packed"], change: Float[np.ndarray, " packed"]
    ) -> Float[np.ndarray, " a"]:
        """Compute the change of the averages; differences are exact for bilinear functions."""
        count, every = self.ready.chain.flexures, self._indices
        indices = every.contact_stiffness[:count], every.rods.length[:count]

        def at(side: float) -> np.ndarray:
            stiffness, length = (vector[one] + side * change[one] for one in indices)
            return np.ravel(list(chain_averages(stiffness, length.sum(axis=-1)).values()))

        return 0.5 * (at(1.0) - at(-1.0))
