"""The rows of a sweep: numbers of robots in, kept quantities and codes out.

What a row gives depends on the plan alone: not on the process, on the rows before, or on cores.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from notchflex._quantity import REGISTERED
from notchflex.analysis.solve import simulate
from notchflex.errors import ErrorCode, InputError
from notchflex.robot import Robot
from notchflex.robot.error_messages import nearest
from notchflex.robot.value_names import number_at
from notchflex.sweeping.plan.parts import KeptQuantity, SweepPlan
from notchflex.sweeping.points import Points, limits_of
from notchflex.tolerancing.criteria import AXES, FIRST, Criterion, entries_of
from notchflex.tolerancing.piece_study import SAMPLE, PieceStudy
from notchflex.tolerancing.reading import read_load
from notchflex.tolerancing.spec import INDICES, LIMITED


@dataclass(frozen=True, eq=False)
class SweepModel(PieceStudy):
    """A study whose robots lie between limits.

    Attributes:
        between: The limits, by name.
    """

    between: Mapping[str, tuple[float, float]] = dataclasses.field(
        default_factory=dict[str, tuple[float, float]]
    )

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Between what the numbers lie, by name."""
        return dict(self.between)

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
    for one in plan.keep:
        _check(one, list(loads))
    paths = {name: simulate(base, load, refinement=plan.refinement) for name, load in loads.items()}
    criteria: dict[str, Criterion] = {}
    for one in plan.keep:
        load = one.load or next(iter(loads))
        for entry in entries_of(one, load, paths[load], len(loads) > 1, "`keep`"):
            if entry.name in criteria:
                raise InputError.CONFLICT(f"`keep` has {entry.name} twice; keep it once.")
            scale = entry.quantity.scale
            criteria[entry.name] = dataclasses.replace(
                entry, lower=entry.lower / scale, upper=entry.upper / scale
            )
    if not criteria:
        raise InputError.NO_DATA("no number is kept: the quantities have none for this robot.")
    return SweepModel(
        base, (), paths, tuple(criteria.values()), None, plan.refinement, 1,
        between=between, sample=Points(plan).sample(SAMPLE),
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


def _check(kept: KeptQuantity, loads: list[str]) -> None:
    """Check the names of a kept quantity."""
    if kept.quantity not in LIMITED:
        raise InputError.UNKNOWN_NAME(
            f'`keep` names the quantity "{kept.quantity}"{nearest(kept.quantity, LIMITED)}; '
            f"allowed: {', '.join(LIMITED)}."
        )
    per, what = REGISTERED[kept.quantity].per, f"`keep` of {kept.quantity}"
    for key in INDICES:
        if getattr(kept, key) is not None and key not in per:
            has = f"one value per {' and '.join(per)}" if per else "a single value"
            raise InputError.CONFLICT(f"{what} names one {key}, but there is {has}.")
    allowed = f"allowed: {', '.join(loads)}"
    if kept.load is None and len(loads) > 1:
        raise InputError.MISSING_VALUE(f"{what} must name one of the loads; {allowed}.")
    if kept.load is not None and kept.load not in loads:
        near = nearest(kept.load, loads)
        raise InputError.UNKNOWN_NAME(f'{what} names the load "{kept.load}"{near}; {allowed}.')


def column_name(one: Criterion, named: bool) -> str:
    """Return the name of a column, such as `notch_angle_3_deg_at_pulled_step_2`.

    Args:
        one: The kept number.
        named: Whether there are several loads.
    """
    labels = [
        AXES[number] if axis == "axis" else str(number + FIRST.get(axis, 1))
        for axis, number in zip(one.quantity.per, one.index, strict=True)
    ]
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
