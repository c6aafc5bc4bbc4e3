"""Objectives and constraints of a design, resolved against the robot and its loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from notchflex import InputError, Robot
from notchflex.designing.model.point import Point
from notchflex.designing.model.quantities import (
    CLOSING,
    COMPLIANCE,
    CURVE,
    OF_ROBOTS,
    OF_STATES,
    Reading,
    quantity_names,
    taken,
    target_points,
)
from notchflex.designing.model.variables import Direction
from notchflex.designing.specification import (
    DesignConstraint,
    DesignObjective,
    DesignQuantity,
    DesignSpec,
    TargetCurve,
)
from notchflex.specification import check_percent, chosen_entries, known, placed
from notchflex.support import AXES, axis_sizes, described_at, nearest, numbers_at

Source = Point
Read = Callable[[Source, Any], Reading]
"""Takes a quantity from a solved robot, at a load if it depends on one."""


@dataclass(frozen=True)
class Wish:
    """One objective or constraint, resolved.

    Attributes:
        asked: As it stands in the specification.
        title: What messages and tables call it.
        unit: Its unit.
        parts: What its numbers are called, such as "notch 3"; before they are made one.
        rows: Which of the quantity's numbers are meant.
        read: Takes the quantity from a source, at a load.
        curve: The target curve that it is about.
    """

    asked: DesignQuantity
    title: str
    unit: str
    parts: tuple[str, ...]
    rows: np.ndarray
    read: Read
    curve: TargetCurve | None = None

    @property
    def take(self) -> str:
        """Reduction of several numbers to one; "" where an objective must name one."""
        asked = self.asked
        if isinstance(asked, DesignConstraint):
            return "steps" if asked.order is not None else asked.take or "each"
        usual = "mean" if "." in asked.quantity else ""  # values of the robot file
        return asked.take or ("each" if len(self.rows) == 1 else usual)

    def every(self, source: Source) -> Reading:
        """Return its numbers, before they are made one."""
        reading = self.read(source, self.asked.load).pick(self.rows)
        if self.asked.minus is not None:
            reading = reading.minus(self.read(source, self.asked.minus).pick(self.rows))
        return reading

    def measure(self, source: Source) -> Reading:
        """Return its numbers, made one or few as asked."""
        return taken(self.every(source), self.take)

    @property
    def direction(self) -> Direction:
        """Direction of its tip compliance, of length 1."""
        return direction_of(self.asked)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the numbers of `measure`; "" for a single one."""
        if self.take == "each" and len(self.parts) > 1:
            return self.parts
        if self.take == "steps":
            pairs = zip(self.parts, self.parts[1:], strict=False)
            return tuple(f"{before} to {after.split()[-1]}" for before, after in pairs)
        return ("",)


def direction_of(asked: DesignQuantity) -> Direction:
    """Return the direction of a tip compliance, of length 1."""
    given = np.array(asked.direction)
    x, y, z = (given / np.linalg.norm(given)).tolist()
    return x, y, z


def wishes_of(spec: DesignSpec, robot: Robot) -> tuple[Wish, ...]:
    """Resolve every objective and constraint; target curves that nothing asks of become objectives.

    Raises:
        InputError: An unknown name, a choice that does not fit the quantity, or a contradiction.
    """
    loads = {one.name: one for one in spec.load}
    curves = {f"{CURVE}{one.name}": one for one in spec.curve}
    for number, curve in enumerate(spec.curve, start=1):
        with placed(f"`curve[{number}]`"):
            known(curve.load, loads, "load")
            if curves[f"{CURVE}{curve.name}"] is not curve:
                raise InputError.CONFLICT(f"another curve is called {curve.name}; rename one.")
    asked = [
        (f"`{key}[{number}]`", one)
        for key, group in (("objective", spec.objective), ("constraint", spec.constraint))
        for number, one in enumerate(group, start=1)
    ]
    names = {one.quantity for _, one in asked}
    asked += [
        (name, DesignObjective(name, take="rms", goal="minimise"))
        for name in curves
        if name not in names
    ]
    wishes: list[Wish] = []
    for place, one in asked:
        with placed(place):
            wishes.append(_resolved(one, robot, loads, curves))
    _check_contradictions(wishes)
    return tuple(wishes)


def _resolved(
    asked: DesignQuantity,
    robot: Robot,
    loads: Mapping[str, Any],
    curves: Mapping[str, TargetCurve],
) -> Wish:
    name = asked.quantity
    unit, per, read = _readable(asked, robot, curves)
    if name in OF_STATES or name == COMPLIANCE:
        if asked.load is None:
            raise InputError.MISSING_VALUE(
                f"{name} depends on the load; give `load`, one of {', '.join(loads) or 'none'}."
            )
        known(asked.load, loads, "load")
        known(asked.minus or asked.load, loads, "load")
    elif asked.load is not None or asked.minus is not None:
        raise InputError.CONFLICT(f"{name} does not depend on a load; leave `load` out.")
    if (name == COMPLIANCE) != (asked.direction is not None):
        needs = "needs" if name == COMPLIANCE else "takes no"
        raise InputError.CONFLICT(f"{name} {needs} `direction`; see tip_compliance.")
    parts = _parts(name, per, robot, curves)
    entries = chosen_entries(asked, per, [len(parts)] * len(per))
    rows = [sum(entry) for entry in entries]  # along the one axis, or of the single number
    at = f" at {asked.load}" if asked.load else ""
    at += f" less {asked.minus}" if asked.minus else ""
    chosen = parts[rows[0]] if len(rows) == 1 < len(parts) else ""
    take = asked.take if asked.take not in (None, "each", "steps") else ""
    title = " ".join(word for word in (take, name, chosen) if word) + at
    chosen_parts = tuple(parts[row] for row in rows)
    wish = Wish(asked, title, unit, chosen_parts, np.array(rows), read, curves.get(name))
    _check_taken(wish)
    return wish


def _readable(
    asked: DesignQuantity, robot: Robot, curves: Mapping[str, TargetCurve]
) -> tuple[str, tuple[str, ...], Read]:
    """Return the unit of a quantity, what its numbers stand for, and how it is read.

    Raises:
        InputError: There is no such quantity.
    """
    name = asked.quantity
    if name in OF_STATES:
        one = OF_STATES[name]
        return one.unit, one.per, lambda source, load: source.of_state(name, load)
    if name == CLOSING:
        return "N", ("notch",), lambda source, _: source.closings()
    if name in OF_ROBOTS:
        of = OF_ROBOTS[name]
        if not np.isfinite(of.formula(robot)).all():
            raise InputError.UNSUPPORTED(f"{name} is not defined for the notches of this robot.")
        return of.unit, ("notch",) * of.by_notch, lambda source, _: source.of_robot(name)
    if name == COMPLIANCE:
        return "mm/N", (), lambda source, load: source.compliance(load, direction_of(asked))
    if name.startswith(CURVE):
        curve = known(name, curves, "curve")
        return "mm", ("point",), lambda source, _: source.curve(curve)
    if "." not in name:
        raise InputError.UNKNOWN_NAME(
            f"there is no quantity `{name}`{nearest(name, quantity_names())}; there are "
            f"{', '.join(quantity_names())}, curve.NAME, and paths of the robot file such as "
            "notch.height."
        )
    paths = list(numbers_at(robot, name))
    of_notches = paths[0].startswith("notch[") and len(paths) == robot.number_of_notches
    per = () if len(paths) == 1 else ("notch",) if of_notches else ("value",)
    return described_at(robot, name).unit, per, lambda source, _: source.value(name)


def _parts(
    name: str, per: tuple[str, ...], robot: Robot, curves: Mapping[str, TargetCurve]
) -> Sequence[str]:
    """Return what the numbers of a quantity are called, "" for a single one."""
    if per == ("axis",):
        return AXES
    if per == ("value",):
        return list(numbers_at(robot, name))
    sizes = axis_sizes(robot.number_of_notches, robot.number_of_tendons)
    if name in curves:
        sizes["point"] = len(target_points(curves[name]))
    return [f"{axis} {number}" for axis in per for number in range(1, sizes[axis] + 1)] or [""]


def _check_taken(wish: Wish) -> None:
    """Refuse what can hold for no robot, such as a strain in percent, or says too little."""
    asked = wish.asked
    if isinstance(asked, DesignObjective):
        check_percent(asked.quantity, asked.target)
    elif isinstance(asked, DesignConstraint):
        check_percent(asked.quantity, asked.equal, asked.lower, asked.upper)
    if wish.take == "steps" and len(wish.rows) < 2:
        raise InputError.CONFLICT(f"{wish.title} is a single number, and has no steps or order.")
    if not wish.take:
        raise InputError.MISSING_VALUE(
            f"{asked.quantity} has {len(wish.rows)} numbers here; choose one by `notch`, `tendon` "
            'or `axis`, or write take = "largest", "sum" or another.'
        )


def _check_contradictions(wishes: Sequence[Wish]) -> None:
    """Refuse two constraints on the same numbers of which one excludes the other."""
    limits: dict[Any, tuple[float, float, int]] = {}
    constraints = (wish for wish in wishes if isinstance(wish.asked, DesignConstraint))
    for number, wish in enumerate(constraints, start=1):
        asked: Any = wish.asked
        if asked.order is not None:
            continue
        low, high = asked.ends if asked.equal is None else (asked.equal, asked.equal)
        key = (asked.quantity, asked.load, asked.minus, asked.direction, wish.take)
        for row in wish.rows.tolist() if wish.take == "each" else [tuple(wish.rows.tolist())]:
            least, most, before = limits.get((key, row), (-np.inf, np.inf, number))
            if low > most or high < least:
                raise InputError.CONFLICT(
                    f"`constraint[{before}]` and `constraint[{number}]` exclude each other: "
                    f"{wish.title} cannot be in both ranges; leave one out."
                )
            limits[key, row] = max(low, least), min(high, most), number
