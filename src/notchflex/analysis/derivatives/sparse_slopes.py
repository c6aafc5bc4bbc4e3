"""Slopes of one vector by several numbers: a sparse Jacobian by compressed differences.

A dimension of a notch changes what belongs to that notch, and little beside it. Numbers that change
different entries of the vector are moved together, and each takes the slopes of its own entries
(Curtis, Powell & Reid 1974, J. Inst. Maths Applics 13:117). Which entries a number changes is
observed once. One difference with all numbers moved, each by an amount of its own, checks them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from notchflex.analysis.derivatives.numbers import differences, slope, width_at
from notchflex.errors import InputError

# Rounding errors, relative to the largest number of a part.
_ROUNDING = 1e-13

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
            rounding[part] = _ROUNDING * np.max(finite, where=np.isfinite(finite), initial=0.0)
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


__all__ = ["SparseSlopes"]
