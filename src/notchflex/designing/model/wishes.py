"""Objectives and constraints of a design, resolved against the robot and its states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from notchflex import InputError, Robot
from notchflex.designing.model.quantities import (
    CLOSING,
    COMPLIANCE,
    CURVE,
    OF_ROBOTS,
    OF_STATES,
    Reading,
    quantity_names,
    taken,
)
from notchflex.designing.model.variables import Direction
from notchflex.designing.specification import (
    DesignConstraint,
    DesignObjective,
    DesignSpec,
    DesignState,
    Measured,
    TargetCurve,
)
from notchflex.support import described_at, nearest, numbers_at
from notchflex.tolerancing.spec import check_percent


class Source(Protocol):
    """Source of readings: a robot solved under its states."""

    def of_state(self, name: str, state: str) -> Reading:
        """Return a quantity of a state, flat, in the unit of the edges."""
        ...

    def closings(self) -> Reading:
        """Return closing tensions, N."""
        ...

    def of_robot(self, name: str) -> Reading:
        """Return a quantity of the robot alone."""
        ...

    def value(self, path: str) -> Reading:
        """Return the values of the robot file."""
        ...

    def compliance(self, state: str, direction: Direction) -> Reading:
        """Return the tip compliance, mm/N."""
        ...

    def curve(self, curve: TargetCurve) -> Reading:
        """Return the distances of the points of a curve, mm."""
        ...

    def offsets(self, curve: TargetCurve) -> Reading:
        """Return the vectors from the points of a curve to the axis, mm."""
        ...


@dataclass(frozen=True)
class Wish:
    """One objective or constraint, resolved.

    Attributes:
        asked: As it stands in the specification.
        title: What messages and tables call it.
        unit: Its unit.
        parts: What its numbers are called, such as "notch 3"; before they are made one.
        rows: Which of the quantity's numbers are meant.
        read: Takes the quantity from a source, at a state.
        curve: The target curve that it is about.
    """

    asked: Measured
    title: str
    unit: str
    parts: tuple[str, ...]
    rows: np.ndarray
    read: Callable[[Source, str | None], Reading]
    curve: TargetCurve | None = None

    @property
    def take(self) -> str:
        """Reduction of several numbers to one."""
        if isinstance(self.asked, DesignConstraint) and self.asked.order is not None:
            return "steps"
        return self.asked.take or ("each" if len(self.rows) == 1 else self._usual)

    @property
    def _usual(self) -> str:
        if isinstance(self.asked, DesignConstraint):
            return "each"
        return "mean" if "." in self.asked.quantity else ""  # values of the robot file

    def every(self, source: Source) -> Reading:
        """Return its numbers, before they are made one."""
        reading = self.read(source, self.asked.state).pick(self.rows)
        if self.asked.minus is not None:
            reading = reading.minus(self.read(source, self.asked.minus).pick(self.rows))
        return reading

    def measure(self, source: Source) -> Reading:
        """Return its numbers, made one or few as asked."""
        return taken(self.every(source), self.take)

    @property
    def direction(self) -> Direction:
        """Direction of its tip compliance, of length 1."""
        return unit_vector(self.asked)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the numbers of `measure`; "" for a single one."""
        if self.take == "each":
            return self.parts if len(self.parts) > 1 else ("",)
        if self.take == "steps":
            pairs = zip(self.parts, self.parts[1:], strict=False)
            return tuple(f"{before} to {after.split()[-1]}" for before, after in pairs)
        return ("",)


def unit_vector(asked: Measured) -> Direction:
    """Return the direction of a tip compliance, of length 1.

    Raises:
        InputError: It has no length.
    """
    given = asked.direction or (0.0, 0.0, 0.0)
    size = float(np.linalg.norm(given))
    if not 1e-9 < size < 1e9:
        raise InputError.OUT_OF_RANGE("`direction` must be a vector that is not zero.")
    x, y, z = (np.array(given) / size).tolist()
    return x, y, z


_AXES = ("x", "y", "z")


def wishes_of(spec: DesignSpec, robot: Robot) -> tuple[Wish, ...]:
    """Resolve every objective and constraint; target curves that nothing asks of become objectives.

    Raises:
        InputError: An unknown name, a choice that does not fit the quantity, or a contradiction.
    """
    states = {one.name: one for one in spec.state}
    curves = {one.name: one for one in spec.curve}
    for number, curve in enumerate(spec.curve, start=1):
        if curves[curve.name] is not curve:
            raise InputError.CONFLICT(f"`curve[{number}]`: another curve is called {curve.name}.")
        _check_state(curve.state, states, f"`curve[{number}].state`: ")
    wishes: list[Wish] = []
    for key, group in (("objective", spec.objective), ("constraint", spec.constraint)):
        for number, asked in enumerate(group, start=1):
            shown = f"`{key}[{number}]`: "
            try:
                wish = _resolved(asked, robot, states, curves)
                if isinstance(asked, DesignObjective) and not wish.take:
                    raise InputError.MISSING_VALUE(
                        f"{asked.quantity} has {len(wish.rows)} numbers here; choose one by "
                        '`notch`, `tendon` or `axis`, or write take = "largest", "sum" or '
                        "another."
                    )
                _check_limits(wish)
            except InputError as error:
                raise InputError(f"{shown}{error}", error.code) from None
            wishes.append(wish)
    asked_of = {wish.asked.quantity for wish in wishes}
    for curve in spec.curve:
        if f"{CURVE}{curve.name}" not in asked_of:
            name = f"{CURVE}{curve.name}"
            asked = DesignObjective(quantity=name, take="rms", goal="minimise")
            wishes.append(_resolved(asked, robot, states, curves))
    _check_contradictions(wishes)
    return tuple(wishes)


def _resolved(
    asked: Measured,
    robot: Robot,
    states: Mapping[str, DesignState],
    curves: Mapping[str, TargetCurve],
) -> Wish:
    name = asked.quantity
    unit, parts, read = _quantity(asked, robot, curves)
    needs_state = name in OF_STATES or name == COMPLIANCE
    if needs_state:
        if asked.state is None:
            raise InputError.MISSING_VALUE(
                f"{name} depends on the load; give `state`, one of {', '.join(states) or 'none'}."
            )
        _check_state(asked.state, states, "`state`: ")
    elif asked.state is not None or asked.minus is not None:
        raise InputError.CONFLICT(f"{name} does not depend on a state; leave `state` out.")
    if asked.minus is not None:
        _check_state(asked.minus, states, "`minus`: ")
    if (name == COMPLIANCE) != (asked.direction is not None):
        text = "needs" if name == COMPLIANCE else "takes no"
        raise InputError.CONFLICT(f"{name} {text} `direction`; see tip_compliance.")
    rows = _rows(asked, parts)
    at = f" at {asked.state}" if asked.state else ""
    at += f" less {asked.minus}" if asked.minus else ""
    curve = curves.get(name.removeprefix(CURVE)) if name.startswith(CURVE) else None
    chosen_parts = tuple(parts[i] for i in rows)
    wish = Wish(asked, f"{name}{at}", unit, chosen_parts, rows, read, curve)
    chosen = " ".join(wish.parts) if len(rows) == 1 and len(parts) > 1 else ""
    take = asked.take if asked.take not in (None, "each", "steps") else ""
    title = " ".join(one for one in (take, name, chosen) if one) + at
    return replace(wish, title=title)


def _quantity(
    asked: Measured, robot: Robot, curves: Mapping[str, TargetCurve]
) -> tuple[str, list[str], Callable[[Any, Any], Reading]]:
    """Return the unit of a quantity, what its numbers are called, and how it is read."""
    name = asked.quantity
    notches = [f"notch {number}" for number in range(1, robot.number_of_notches + 1)]
    if name in OF_STATES:
        one = OF_STATES[name]
        tendons = [f"tendon {number}" for number in range(1, robot.number_of_tendons + 1)]
        kinds: dict[tuple[str, ...], list[str]] = {
            (): [""],
            ("notch",): notches,
            ("tendon",): tendons,
            ("axis",): list(_AXES),
        }
        return one.unit, kinds[one.per], lambda source, state: source.of_state(name, state)
    if name == CLOSING:
        return "N", notches, lambda source, _: source.closings()
    if name in OF_ROBOTS:
        of = OF_ROBOTS[name]
        if not np.isfinite(of.formula(robot)).all():
            raise InputError.UNSUPPORTED(f"{name} is not defined for the notches of this robot.")
        return of.unit, notches if of.by_notch else [""], lambda source, _: source.of_robot(name)
    if name == COMPLIANCE:
        along = unit_vector(asked) if asked.direction is not None else (0.0, 0.0, 0.0)
        return "mm/N", [""], lambda source, state: source.compliance(state, along)
    if name.startswith(CURVE):
        label = name.removeprefix(CURVE)
        if label not in curves:
            raise InputError.UNKNOWN_NAME(
                f"there is no curve `{label}`{nearest(label, curves)}; there are "
                f"{', '.join(curves) or 'none'}."
            )
        from notchflex.designing.model.quantities import target_points

        curve = curves[label]
        points = [f"point {number}" for number in range(1, len(target_points(curve)) + 1)]
        return "mm", points, lambda source, _: source.curve(curve)
    if "." not in name:
        raise InputError.UNKNOWN_NAME(
            f"there is no quantity `{name}`{nearest(name, quantity_names())}; there are "
            f"{', '.join(quantity_names())}, curve.NAME, and paths of the robot file such as "
            "notch.height."
        )
    paths = list(numbers_at(robot, name))
    parts = notches if paths[0].startswith("notch[") and len(paths) == len(notches) else paths
    parts = parts if len(paths) > 1 else [""]
    return described_at(robot, name).unit, parts, lambda source, _: source.value(name)


def _rows(asked: Measured, parts: Sequence[str]) -> np.ndarray:
    """Return which numbers of a quantity are meant."""
    for key, given in (("notch", asked.notch), ("tendon", asked.tendon), ("axis", asked.axis)):
        if given is None:
            continue
        words = [given] if isinstance(given, str) else [f"{key} {number}" for number in given]
        wrong = [word for word in words if word not in parts]
        if wrong or not words:
            entries = f"{parts[0]} to {parts[-1]}" if len(parts) > 1 else "one number"
            raise InputError.OUT_OF_RANGE(
                f"{asked.quantity} has no {wrong[0] if wrong else key}; it has {entries}."
            )
        return np.array([list(parts).index(word) for word in dict.fromkeys(words)])
    return np.arange(len(parts))


def _check_state(name: str, states: Mapping[str, DesignState], shown: str) -> None:
    if name not in states:
        raise InputError.UNKNOWN_NAME(
            f"{shown}there is no state `{name}`{nearest(name, states)}; there are "
            f"{', '.join(states) or 'none'}."
        )


def _check_limits(wish: Wish) -> None:
    """Refuse what can hold for no robot, such as a strain in percent."""
    asked = wish.asked
    if isinstance(asked, DesignObjective):
        limits = [asked.target]
    else:
        assert isinstance(asked, DesignConstraint)
        limits = [asked.equal, asked.lower, asked.upper]
    check_percent(wish.asked.quantity, limits)
    if wish.take == "steps" and len(wish.rows) < 2:
        raise InputError.CONFLICT(f"{wish.title} is a single number, and has no steps or order.")


def _check_contradictions(wishes: Sequence[Wish]) -> None:
    """Refuse two constraints on the same numbers of which one excludes the other."""
    limits: dict[Any, tuple[float, float, int]] = {}
    number = 0
    for wish in wishes:
        asked = wish.asked
        if not isinstance(asked, DesignConstraint):
            continue
        number += 1
        if asked.order is not None:
            continue
        low = asked.equal if asked.lower is None else asked.lower
        high = asked.equal if asked.upper is None else asked.upper
        low, high = -np.inf if low is None else low, np.inf if high is None else high
        key = (asked.quantity, asked.state, asked.minus, asked.direction, wish.take)
        for row in wish.rows.tolist() if wish.take == "each" else [tuple(wish.rows.tolist())]:
            before = limits.get((key, row), (-np.inf, np.inf, number))
            if low > before[1] or high < before[0]:
                raise InputError.CONFLICT(
                    f"`constraint[{before[2]}]` and `constraint[{number}]` exclude each other: "
                    f"{wish.title} cannot be in both ranges; leave one out."
                )
            limits[key, row] = max(low, before[0]), min(high, before[1]), number
