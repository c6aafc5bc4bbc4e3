"""The design as a problem of optimisation: objectives and constraints as sums and rows of limits.

Variables run from 0 to 1 between their limits. The largest of several numbers is not smooth: where
it is minimised, an epigraph variable above all of them replaces it.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Robot
from notchflex.designing.solver import (
    CLOSING,
    COMPLIANCE,
    CURVE,
    OF_ROBOTS,
    OF_STATES,
    Point,
    Reading,
    Solver,
    distances,
    quantity_names,
    taken,
    target_points,
)
from notchflex.designing.specification import (
    DesignConstraint,
    DesignObjective,
    DesignQuantity,
    DesignSpec,
    TargetCurve,
)
from notchflex.designing.variables import Direction
from notchflex.search.slsqp import TOLERANCE, Linearisation, NonlinearProgram, Vector, violation
from notchflex.specification import check_percent, chosen_entries, known, placed
from notchflex.support import AXES, axis_sizes, described_at, nearest, numbers_at

MINIMISE, MAXIMISE = "as small as possible", "as great as possible"


def _labels(take: str, parts: Sequence[str]) -> list[str]:
    """Return what numbers are called that were taken of several; "" for a single one."""
    match take:
        case "each" if len(parts) > 1:
            return list(parts)
        case "pairs":
            return [f"{a} less {b}" for a, b in itertools.permutations(parts, 2)]
        case "steps":
            return [f"{a} to {b.split()[-1]}" for a, b in itertools.pairwise(parts)]
        case _:
            return [""]


@dataclass(frozen=True)
class Wish:
    """One objective or constraint, resolved.

    Attributes:
        asked: As it stands in the specification.
        title: What messages and tables call it.
        unit: Its unit.
        parts: What its numbers are called, such as "notch 3"; before they are made one.
        take: Reduction of several numbers to one.
        read: Takes its numbers from a solved robot, before they are made one.
        curve: The target curve that it is about.
    """

    asked: Any
    title: str
    unit: str
    parts: tuple[str, ...]
    take: str
    read: Callable[[Point], Reading]
    curve: TargetCurve | None

    def measure(self, point: Point) -> Reading:
        """Return its numbers, made one or few as asked."""
        return taken(self.read(point), self.take)

    @property
    def labels(self) -> list[str]:
        """Labels of the numbers of `measure`; "" for a single one."""
        return _labels(self.take, self.parts)

    def amount(self, number: str) -> str:
        """Return a number with the unit."""
        return f"{number} {self.unit}".rstrip()


@dataclass(frozen=True)
class ObjectiveWish(Wish):
    """An objective: a quantity to minimise, to maximise or to bring near a value."""

    asked: DesignObjective

    @property
    def words(self) -> str:
        """What was asked."""
        if self.asked.target is not None:
            return self.amount(f"near {self.asked.target:g}")
        return MINIMISE if self.asked.goal == "minimise" else MAXIMISE

    @property
    def is_square(self) -> bool:
        """Whether it is to come near to something."""
        is_mean_square = self.take == "rms" and self.asked.goal == "minimise"
        return self.asked.target is not None or is_mean_square

    def residuals(self, point: Point) -> Reading:
        """Return the numbers whose squares it adds up: distances from a target or curve."""
        weight, target = self.asked.weight, self.asked.target
        if target is None:  # the mean square, which is smooth where it is 0
            reading = self.read(point) if self.curve is None else point.offsets(self.curve)
            return np.sqrt(weight / len(self.parts)) * reading
        off = self.measure(point)
        return np.sqrt(weight) * np.column_stack([off[:, 0] - target, off[:, 1:]])

    def term(self, point: Point) -> Reading:
        """Return what it adds to the sum that is minimised, in the units of the user."""
        if self.is_square:
            off = self.residuals(point)
            return off[:, :1].T @ np.column_stack([off[:, 0], 2.0 * off[:, 1:]])
        # Several numbers that each count are added up.
        reading = taken(self.read(point), "sum" if self.take == "each" else self.take)
        return (1.0 if self.asked.goal == "minimise" else -1.0) * self.asked.weight * reading

    @property
    def bounds(self) -> list[tuple[ObjectiveWish, float]]:
        """Variables of the search for the largest or smallest of several numbers.

        Each is above (sign 1) or below (-1) all of them.
        """
        signs = {
            ("largest", "minimise"): [1.0],
            ("smallest", "maximise"): [-1.0],
            ("range", "minimise"): [1.0, -1.0],
        }
        return [(self, sign) for sign in signs.get((self.take, self.asked.goal or ""), [])]


@dataclass(frozen=True)
class Row:
    """One constraint on one number: which one, "" for the only one, and its limits."""

    wish: Wish
    label: str
    lower: float
    upper: float

    @property
    def title(self) -> str:
        """Name in messages."""
        return f"{self.wish.title}, {self.label}" if self.label else self.wish.title

    @property
    def unit(self) -> str:
        """Unit of its limits."""
        return self.wish.unit

    @property
    def size(self) -> float:
        """The greater of its limits; 0 where none has a size."""
        return max((abs(end) for end in (self.lower, self.upper) if np.isfinite(end)), default=0.0)


@dataclass(frozen=True)
class ConstraintWish(Wish):
    """A constraint."""

    asked: DesignConstraint

    @property
    def words(self) -> str:
        """What was asked, such as "at most 0.06"."""
        asked = self.asked
        if asked.order is not None:
            by = f" by {self.amount(f'{asked.margin:g}')} or more" if asked.margin else ""
            way = "falling" if asked.order == "tip-first" else "rising"
            return f"{asked.order}: {way} toward the tip{by}"
        if asked.equal is not None:
            return self.amount(f"{asked.equal:g}")
        part = asked.wanted_yield
        return asked.words(self.unit) + (f" for {100.0 * part:g} % of robots" if part else "")

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest value; of ordered numbers, of the steps from notch to notch."""
        asked = self.asked
        if asked.order is not None:
            is_falling = asked.order == "tip-first"
            return (-np.inf, -asked.margin) if is_falling else (asked.margin, np.inf)
        return asked.ends if asked.equal is None else (asked.equal, asked.equal)

    @cached_property
    def _searched(self) -> tuple[str, float, float]:
        """How the search takes it, smooth where that asks for the same, and limits."""
        take, (low, high) = self.take, self.ends
        if (take == "largest" and low == -np.inf) or (take == "smallest" and high == np.inf):
            return "each", low, high
        if take == "range" and low <= 0.0:
            return ("pairs", -np.inf, high) if high > 0.0 else ("steps", 0.0, high)
        return take, low, high

    @cached_property
    def rows(self) -> list[Row]:
        """Its rows as the search takes it."""
        take, low, high = self._searched
        return [Row(self, label, low, high) for label in _labels(take, self.parts)]

    def row_numbers(self, point: Point) -> Reading:
        """Return the numbers of its rows."""
        return taken(self.read(point), self._searched[0])


def wishes_of(spec: DesignSpec, robot: Robot) -> list[Wish]:
    """Resolve every objective and constraint; target curves that nothing asks of become objectives.

    Raises:
        InputError: An unknown name, a choice that does not fit the quantity, or a contradiction.
    """
    loads = {load.name: load for load in spec.load}
    curves = {f"{CURVE}{curve.name}": curve for curve in spec.curve}
    for number, curve in enumerate(spec.curve, start=1):
        with placed(f"`curve[{number}]`"):
            known(curve.load, loads, "load")
            if curves[f"{CURVE}{curve.name}"] is not curve:
                raise InputError.CONFLICT(f"another curve is called {curve.name}; rename one.")
    asked = [
        (f"`{key}[{number}]`", each)
        for key, group in (("objective", spec.objective), ("constraint", spec.constraint))
        for number, each in enumerate(group, start=1)
    ]
    names = {each.quantity for _, each in asked}
    asked += [
        (name, DesignObjective(name, take="rms", goal="minimise"))
        for name in curves
        if name not in names
    ]
    wishes: list[Wish] = []
    for place, each in asked:
        with placed(place):
            wishes.append(_resolved(each, robot, loads, curves))
    _check_contradictions(wishes)
    return wishes


def _resolved(
    asked: Any,
    robot: Robot,
    loads: Mapping[str, Any],
    curves: Mapping[str, TargetCurve],
) -> Wish:
    name, load, minus = asked.quantity, asked.load, asked.minus
    unit, per, parts, read = _readable(asked, robot, curves)
    if name in OF_STATES or name == COMPLIANCE:
        if load is None:
            raise InputError.MISSING_VALUE(
                f"{name} depends on the load; give `load`, one of {', '.join(loads) or 'none'}."
            )
        for each in (load, minus or load):
            known(each, loads, "load")
    elif load is not None or minus is not None:
        raise InputError.CONFLICT(f"{name} does not depend on a load; leave `load` out.")
    if (name == COMPLIANCE) != (asked.direction is not None):
        needs = "needs" if name == COMPLIANCE else "takes no"
        raise InputError.CONFLICT(f"{name} {needs} `direction`; see tip_compliance.")
    entries = chosen_entries(asked, per, [len(parts)] * len(per))
    rows = [sum(entry) for entry in entries]  # along the one axis, or of the single number

    def numbers(point: Point) -> Reading:
        reading = read(point, load)[rows]
        return reading if minus is None else reading - read(point, minus)[rows]

    words = [
        asked.take if asked.take not in (None, "each", "steps") else "",
        name,
        parts[rows[0]] if len(rows) == 1 < len(parts) else "",
        f"at {load}" if load else "",
        f"less {minus}" if minus else "",
    ]
    kind: Any = ObjectiveWish
    take = asked.take
    if isinstance(asked, DesignConstraint):
        kind, take = ConstraintWish, "steps" if asked.order is not None else take or "each"
    elif take is None:  # several numbers need a word, but for values of the robot file
        take = "each" if len(rows) == 1 else "mean" if "." in name else ""
    chosen = tuple(parts[row] for row in rows)
    wish = kind(asked, " ".join(filter(None, words)), unit, chosen, take, numbers, curves.get(name))
    _check_taken(wish)
    return wish


def _readable(
    asked: DesignQuantity, robot: Robot, curves: Mapping[str, TargetCurve]
) -> tuple[str, tuple[str, ...], Sequence[str], Callable[[Point, Any], Reading]]:
    """Return how a quantity is read.

    Returns:
        Its unit, what its numbers stand for, what they are called ("" for a single one), and how it
        is taken from a solved robot at a load.

    Raises:
        InputError: There is no such quantity.
    """
    name, counts = asked.quantity, axis_sizes(robot.number_of_notches, robot.number_of_tendons)

    def numbered(per: tuple[str, ...]) -> Sequence[str]:
        if per == ("axis",):
            return AXES
        return [f"{axis} {number}" for axis in per for number in range(1, counts[axis] + 1)] or [""]

    if name in OF_STATES:
        unit, per = OF_STATES[name].unit, OF_STATES[name].per
        return unit, per, numbered(per), lambda point, load: point.of_load(name, load)
    if name == CLOSING:
        return "N", ("notch",), numbered(("notch",)), lambda point, _: point.closings
    if name in OF_ROBOTS:
        unit, per, formula = OF_ROBOTS[name]
        if not np.isfinite(formula(robot)).all():
            raise InputError.UNSUPPORTED(f"{name} is not defined for the notches of this robot.")
        return unit, per, numbered(per), lambda point, _: point.of_robot(formula)
    if name == COMPLIANCE:
        return "mm/N", (), [""], lambda point, load: point.compliance(load, direction_of(asked))
    if name.startswith(CURVE):
        curve = known(name, curves, "curve")
        counts["point"] = len(target_points(curve))
        return "mm", ("point",), numbered(("point",)), lambda p, _: distances(p.offsets(curve))
    if "." not in name:
        names = quantity_names()
        raise InputError.UNKNOWN_NAME(
            f"there is no quantity `{name}`{nearest(name, names)}; there are {', '.join(names)}, "
            "curve.NAME, and paths of the robot file such as notch.height."
        )
    paths, unit = list(numbers_at(robot, name)), described_at(robot, name).unit
    of_notches = paths[0].startswith("notch[") and len(paths) == robot.number_of_notches
    per = () if len(paths) == 1 else ("notch",) if of_notches else ("value",)
    parts = paths if per == ("value",) else numbered(per)
    return unit, per, parts, lambda point, _: point.value(name)


def direction_of(asked: DesignQuantity) -> Direction:
    """Return the direction of a tip compliance, of length 1."""
    direction = np.array(asked.direction)
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    return x, y, z


def _check_taken(wish: Wish) -> None:
    """Refuse what can hold for no robot, such as a strain in percent, or says too little."""
    asked = wish.asked
    limits = ("target", "equal", "lower", "upper")
    check_percent(asked.quantity, *(getattr(asked, limit, None) for limit in limits))
    if wish.take == "steps" and len(wish.parts) < 2:
        raise InputError.CONFLICT(f"{wish.title} is a single number, and has no steps or order.")
    if not wish.take:
        raise InputError.MISSING_VALUE(
            f"{asked.quantity} has {len(wish.parts)} numbers here; choose one by `notch`, `tendon` "
            'or `axis`, or write take = "largest", "sum" or another.'
        )


def _check_contradictions(wishes: Sequence[Wish]) -> None:
    """Refuse two constraints on the same numbers of which one excludes the other."""
    limits: dict[Any, tuple[float, float, int]] = {}
    constraints = (wish for wish in wishes if isinstance(wish, ConstraintWish))
    for number, wish in enumerate(constraints, start=1):
        asked = wish.asked
        if asked.order is not None:
            continue
        key = (asked.quantity, asked.load, asked.minus, asked.direction, wish.take)
        for part in wish.parts if wish.take == "each" else [wish.parts]:
            (low, high), place = wish.ends, (key, part)
            least, most, before = limits.get(place, (-np.inf, np.inf, number))
            if low > most or high < least:
                raise InputError.CONFLICT(
                    f"`constraint[{before}]` and `constraint[{number}]` exclude each other: "
                    f"{wish.title} cannot be in both ranges; leave one out."
                )
            limits[place] = max(low, least), min(high, most), number


Progress = Callable[[str, int, int], None]
"""Called with the stage, how much of it is done, and how much there is."""


def limits_of(rows: Sequence[Row]) -> Float[np.ndarray, "m 2"]:
    """Return the limits of some rows."""
    return np.reshape([(row.lower, row.upper) for row in rows], (-1, 2))


@dataclass(frozen=True, eq=False)
class DesignEvaluation:
    """A design at one vector of scaled variables.

    Attributes:
        z: The vector.
        point: The robot solved.
        objective: The sum that is minimised, without terms replaced by epigraph variables.
        rows: The numbers of all constraints.
        bounded: The numbers that each epigraph variable is above or below.
        total: The whole sum, the largest of several numbers taken as it is.
    """

    z: Vector
    point: Point
    objective: Reading
    rows: Reading
    bounded: tuple[Reading, ...]
    total: float


@dataclass(eq=False)
class DesignProblem:
    """A design of robots of one form.

    Attributes:
        solver: Solves them.
        wishes: Objectives and constraints.
        failures: Why points could not be solved, and how often.
        sizes: In which violations of rows are measured.
    """

    solver: Solver
    wishes: Sequence[Any]
    failures: Counter[str] = field(default_factory=Counter[str])

    def __post_init__(self) -> None:
        """Take the sizes of the limits."""
        self.set_sizes([])

    @property
    def count(self) -> int:
        """Number of variables, without those of epigraphs."""
        return len(self.solver.variables.columns)

    @cached_property
    def objectives(self) -> list[ObjectiveWish]:
        """The objectives."""
        return [wish for wish in self.wishes if isinstance(wish, ObjectiveWish)]

    @cached_property
    def constraints(self) -> list[Any]:
        """The constraints: all that has rows."""
        return [wish for wish in self.wishes if not isinstance(wish, ObjectiveWish)]

    @cached_property
    def rows(self) -> list[Row]:
        """Every constraint on one number."""
        return [row for wish in self.constraints for row in wish.rows]

    @cached_property
    def bounds(self) -> list[tuple[ObjectiveWish, float]]:
        """The epigraph variables."""
        return [bound for wish in self.objectives for bound in wish.bounds]

    @cached_property
    def start(self) -> Vector:
        """The robot as it is, scaled."""
        variables = self.solver.variables
        return (variables.start - variables.lower) / variables.span

    @cached_property
    def initial(self) -> DesignEvaluation | None:
        """The robot as it is, solved."""
        return self.evaluate(self.start)

    def x(self, z: Vector) -> Vector:
        """Return the vector of variables of a scaled one."""
        variables = self.solver.variables
        return variables.lower + z * variables.span

    def evaluate(
        self, z: Vector, solved: Point | InputError | None = None
    ) -> DesignEvaluation | None:
        """Return the design at a scaled vector, which may be solved already; None where none is."""
        try:
            if isinstance(solved, InputError):
                raise solved
            return self.read(solved or self.solver.point(self.x(z)), z)
        except InputError as error:
            self.failures[str(error)] += 1
            return None

    def evaluate_all(self, vectors: Float[np.ndarray, "k v"]) -> list[DesignEvaluation | None]:
        """Evaluate many vectors at once, without slopes."""
        points = self.solver.points([self.x(z) for z in vectors])
        return list(map(self.evaluate, vectors, points))

    def read(self, point: Point, z: Vector) -> DesignEvaluation:
        """Return objectives and constraints of a solved robot.

        Raises:
            InputError: One of them is not a number.
        """
        width = 1 + (self.count if len(point.along) else 0)  # without slopes by what deviates

        def joined(readings: Iterable[Reading]) -> Reading:
            tables = (reading[:, :width] for reading in readings)
            return np.concatenate([np.zeros((0, width)), *tables])

        terms, total = self._terms(point, z)
        objective = joined(terms).sum(axis=0, keepdims=True)
        rows = joined(self._row_numbers(point))
        bounded = tuple(joined([wish.read(point)]) for wish, _ in self.bounds)
        if not all(np.isfinite(table).all() for table in (objective, rows, *bounded)):
            of_rows = zip(self.rows, rows[:, 0], strict=True)
            names = [row.title for row, number in of_rows if not np.isfinite(number)]
            raise InputError.NOT_FINITE(
                f"{(names or ['an objective'])[0]} is not a number, as where a notch never closes "
                "or a limit line does not reach"
            )
        return DesignEvaluation(z, point, objective, rows, bounded, total)

    def _terms(self, point: Point, z: Vector) -> tuple[list[Reading], float]:
        """Return the smooth terms of the objective, and the whole sum."""
        if not self.objectives:  # the smallest change of the robot
            off = z - self.start
            return [np.concatenate([[off @ off], 2.0 * off])[None]], float(off @ off)
        terms = [wish.term(point) for wish in self.objectives]
        smooth = [
            term for wish, term in zip(self.objectives, terms, strict=True) if not wish.bounds
        ]
        return smooth, sum(float(term[0, 0]) for term in terms)

    def _row_numbers(self, point: Point) -> Iterable[Reading]:
        """Return the numbers of the rows, in their order."""
        return [wish.row_numbers(point) for wish in self.constraints]

    def violation(self, here: DesignEvaluation) -> Float[np.ndarray, " m"]:
        """Return by how much rows are beyond their limits, in their sizes."""
        return violation(here.rows[:, 0], limits_of(self.rows), self.sizes)

    def worst(self, here: DesignEvaluation) -> float:
        """Return the largest violation."""
        return float(np.abs(self.violation(here)).max(initial=0.0))

    def merit(self, here: DesignEvaluation) -> tuple[float, float]:
        """Return the largest violation, 0 within the tolerance, and the sum; less is better."""
        worst = self.worst(here)
        return (worst if worst > TOLERANCE else 0.0), here.total

    @property
    def is_least_squares(self) -> bool:
        """Whether all that is asked is to come near to something."""
        squares = [wish.is_square for wish in self.objectives]
        return bool(squares) and not self.rows and all(squares)

    def residuals(self, here: DesignEvaluation) -> Reading:
        """Return what misses limits, in its size; without limits, what is to be 0."""
        if not self.rows:
            return np.concatenate([wish.residuals(here.point) for wish in self.objectives])
        missed = self.violation(here)[:, None]
        slopes = np.where(missed != 0.0, here.rows[:, 1:] / self.sizes[:, None], 0.0)
        return np.column_stack([missed, slopes])

    def set_sizes(self, reached: Sequence[DesignEvaluation]) -> None:
        """Take the sizes of rows without a limit of a size from what robots reach."""
        values = [np.zeros(len(self.rows)), *(np.abs(here.rows[:, 0]) for here in reached)]
        most = np.max(values, axis=0)
        sizes = np.array([row.size for row in self.rows])
        self.sizes = np.where(sizes > 0.0, sizes, np.where(most > 1e-9, most, 1.0))

    def program(self, first: DesignEvaluation) -> tuple[NonlinearProgram, Vector]:
        """Return the problem for SLSQP, its epigraphs scaled where it begins, and that start."""
        count, extra = self.count, len(self.bounds)
        signs = np.array([sign for _, sign in self.bounds])
        factors = np.array([sign * wish.asked.weight for wish, sign in self.bounds])
        pairs = [*zip(signs, first.bounded, strict=True)]
        tops = np.array([sign * (sign * reading[:, 0]).max() for sign, reading in pairs])
        sizes = np.array([np.ptp(reading[:, 0]) or 1.0 for _, reading in pairs])

        def linearised(y: Vector) -> Linearisation | None:
            is_first = len(first.point.along) and np.array_equal(y[:count], first.z)
            here = first if is_first else self.evaluate(y[:count])
            if here is None:
                return None
            ends, units = tops + sizes * y[count:], np.diag(sizes)
            rows = [np.pad(here.rows, ((0, 0), (0, extra)))]
            for sign, end, unit, reading in zip(signs, ends, units, here.bounded, strict=True):
                apart = np.concatenate([[end], np.zeros(count), unit])
                rows.append(sign * (apart - np.pad(reading, ((0, 0), (0, extra)))))
            table, (total, *gradient) = np.concatenate(rows), here.objective[0]
            value = float(total + factors @ ends)
            gradient = np.append(gradient, factors * sizes)
            return Linearisation(value, gradient, table[:, 0], table[:, 1:], here)

        numbers = [len(reading) for _, reading in pairs]
        above = np.tile([0.0, np.inf], (sum(numbers), 1))
        bounds = np.repeat([[0.0, 1.0], [-np.inf, np.inf]], [count, extra], axis=0)
        program = NonlinearProgram(
            linearised,
            bounds,
            np.concatenate([limits_of(self.rows), above]),
            np.append(self.sizes, np.repeat(sizes, numbers)),
        )
        return program, np.append(first.z, np.zeros(extra))
