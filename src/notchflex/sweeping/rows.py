"""The rows of a sweep: numbers from the plan alone, solved and summed up in pieces.

What a row gives depends on the plan alone: not on the process, on the rows before, or on cores.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import qmc

from notchflex import ErrorCode, InputError, Robot, simulate
from notchflex.pieces.sobol import SobolPart
from notchflex.specification import Criterion, entry_names, limited_numbers, placed, read_load
from notchflex.support import number_at
from notchflex.sweeping.plan import Sampling, SweepPlan, SweepVariable
from notchflex.tolerancing.study import SAMPLE, PieceStudy

_MAX_LATIN = 20_000_000
"""A Latin hypercube is made whole: so many numbers fit into memory beside all else."""


def axis_values(variable: SweepVariable) -> Float[np.ndarray, " k"]:
    """Return the values of a variable of the grid.

    Args:
        variable: A variable with `values` or `count`.
    """
    if variable.values is not None:
        return np.array(variable.values)
    make = np.geomspace if variable.spacing == "log" else np.linspace
    return make(variable.lower, variable.upper, variable.count)  # pyright: ignore


def limits_of(variable: SweepVariable) -> tuple[float, float]:
    """Return the least and the greatest value of a variable."""
    if variable.values is not None:
        return min(variable.values), max(variable.values)
    assert variable.lower is not None
    assert variable.upper is not None
    return variable.lower, variable.upper


@dataclass(eq=False)
class Points:
    """Numbers of rows by name; the sampled points change fastest, then the last axis of the grid.

    It keeps the place in the sequence that it reached, so that rows in order are quick; it belongs
    to one thread.

    Args:
        plan: The plan.
    """

    plan: SweepPlan

    def __post_init__(self) -> None:
        """Check what does not fit into memory."""
        sampling = self.plan.sampling
        if sampling is not None and sampling.method == "latin-hypercube":
            numbers = sampling.points * len(self.plan.sampled)
            if numbers > _MAX_LATIN:
                raise InputError.OUT_OF_RANGE(
                    f"a Latin hypercube is made whole, and {sampling.points} points of "
                    f"{len(self.plan.sampled)} variables are more than {_MAX_LATIN} numbers; take "
                    'fewer points, or method = "sobol".'
                )

    @cached_property
    def _axes(self) -> list[Float[np.ndarray, " k"]]:
        return [axis_values(one) for one in self.plan.grid]

    @property
    def _each(self) -> int:
        return 1 if self.plan.sampling is None else self.plan.sampling.points

    def rows(self, start: int, stop: int) -> dict[str, Float[np.ndarray, " k"]]:
        """Return the numbers of rows by name, in the order of the plan.

        Args:
            start: First row, from 0.
            stop: The row behind the last one.
        """
        indices = np.arange(start, stop)
        levels = self._levels(indices) if self.plan.sampled else None
        return self._numbers(indices // self._each, levels)

    def sample(self, count: int) -> dict[str, Float[np.ndarray, " k"]]:
        """Return the numbers of some rows: the first points, at places all over the grid.

        Args:
            count: So many rows, or fewer if there are fewer.
        """
        count = min(count, self.plan.rows)
        indices = np.random.default_rng(0).integers(0, self.plan.rows // self._each, count)
        if not self.plan.sampled:
            return self._numbers(indices, None)
        points = np.arange(count) % self._each
        return self._numbers(indices, self._levels(np.arange(min(count, self._each)))[points])

    def _numbers(
        self, rest: Int[np.ndarray, " k"], levels: Float[np.ndarray, "k d"] | None
    ) -> dict[str, Float[np.ndarray, " k"]]:
        """Return numbers by name at places of the grid and sampled levels."""
        numbers: dict[str, np.ndarray] = {}
        for variable, values in zip(self.plan.grid[::-1], self._axes[::-1], strict=True):
            numbers[variable.value] = values[rest % len(values)]
            rest = rest // len(values)
        if levels is not None:
            for number, variable in enumerate(self.plan.sampled):
                numbers[variable.value] = _at_level(variable, levels[:, number])
        return {one.value: numbers[one.value] for one in self.plan.variable}

    def _levels(self, indices: np.ndarray) -> Float[np.ndarray, "k d"]:
        """Return the sampled levels between 0 and 1 of rows in a line."""
        sampling, dimension = self.plan.sampling, len(self.plan.sampled)
        assert sampling is not None
        points = indices % self._each
        if sampling.method == "latin-hypercube":
            return _latin(sampling, dimension)[points]
        if self._each <= len(indices):  # all points, more than once
            return self._sobol.between(0, self._each)[points]
        turns = np.flatnonzero(np.diff(points) < 0) + 1  # where the sequence begins anew
        parts = np.split(points, turns)
        return np.concatenate([self._sobol.between(int(one[0]), int(one[-1]) + 1) for one in parts])

    @cached_property
    def _sobol(self) -> SobolPart:
        sampling = self.plan.sampling
        assert sampling is not None
        seed = sampling.seed
        return SobolPart(
            len(self.plan.sampled), lambda: np.random.default_rng(seed), sampling.points
        )


@lru_cache(maxsize=1)
def _latin(sampling: Sampling, dimension: int) -> Float[np.ndarray, "k d"]:
    engine = qmc.LatinHypercube(dimension, rng=np.random.default_rng(sampling.seed))  # pyright: ignore
    return engine.random(sampling.points)


def _at_level(variable: SweepVariable, level: Float[np.ndarray, " k"]) -> np.ndarray:
    low, high = limits_of(variable)
    if variable.spacing == "log":
        return np.clip(low * (high / low) ** level, low, high)
    return np.clip(low + (high - low) * level, low, high)


@dataclass(frozen=True, eq=False)
class SweepModel(PieceStudy):
    """A study of the robots of a sweep."""

    @cached_property
    def columns(self) -> dict[str, Criterion]:
        """The kept numbers by the names of their columns."""
        named = len(self.paths) > 1
        return {column_name(one, named): one for one in self.criteria}


def model_of(plan: SweepPlan, robot: Robot) -> SweepModel:
    """Make the model of a plan.

    Args:
        plan: The plan.
        robot: The robot that is varied.

    Raises:
        InputError: The robot has no such number, load, quantity or entry.
    """
    between = {one.value: limits_of(one) for one in plan.variable}
    base = _middle(robot.replace(tolerance=None), between)
    for name in between:
        number_at(base, name)
    loads = {name: read_load(table, name, base) for name, table in plan.load.items()}
    paths = {name: simulate(base, load, refinement=plan.refinement) for name, load in loads.items()}
    criteria: dict[str, Criterion] = {}
    for number, one in enumerate(plan.keep, start=1):
        with placed(f"`keep[{number}]`"):
            for entry in limited_numbers(one.in_python, paths):
                if entry.name in criteria:
                    raise InputError.CONFLICT(f"{entry.name} is kept twice; keep it once.")
                criteria[entry.name] = entry
    if not criteria:
        raise InputError.NO_DATA("no number is kept: the quantities have none for this robot.")
    return SweepModel(
        base, (), paths, tuple(criteria.values()), None, plan.refinement, 1,
        sample=Points(plan).sample(SAMPLE),
    )  # fmt: skip


def _middle(robot: Robot, between: Mapping[str, tuple[float, float]]) -> Robot:
    """Return the robot in the middle of the ranges.

    Raises:
        InputError: It has no such number, or the numbers make no valid robot.
    """
    try:
        return robot.with_values(
            {name: 0.5 * (low + high) for name, (low, high) in between.items()}
        )
    except InputError as problem:
        message = f"in the middle of all variables there must be a valid robot: {problem}"
        invalid = problem.code is ErrorCode.INVALID_ROBOT
        raise type(problem)(message if invalid else str(problem), problem.code) from None


def column_name(one: Criterion, named: bool) -> str:
    """Return the name of a column, such as `notch_angle_3_deg_at_pulled_step_2`.

    Args:
        one: The kept number.
        named: Whether there are several loads.
    """
    labels = entry_names(one.quantity.per, one.index)
    unit = one.quantity.unit.replace(" ", "")
    step = [f"step_{one.step + 1}"] if "step " in one.name else []
    return "_".join(
        part
        for part in [
            one.quantity.name,
            *labels,
            unit,
            *([f"at_{one.load}"] if named else []),
            *step,
        ]
        if part
    )
