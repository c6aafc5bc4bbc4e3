"""One robot of a design, solved under its loads: quantities and target curves, with slopes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import compress
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from notchflex import EquilibriumPath, InputError, Robot, batch, closing
from notchflex.analysis.forward_model import ForwardModel, slope
from notchflex.analysis.kinematics import axis_places, axis_point_changes, points_on_axis
from notchflex.designing.specification import TargetCurve
from notchflex.designing.variables import PROBE, Direction, LoadSteps, Variables, Vector
from notchflex.support import (
    DEGREES,
    QUANTITIES,
    REGISTERED,
    Change,
    changes,
    derivatives,
    load_change,
    number_at,
    numbers_at,
)

OF_STATES = {
    name: quantity
    for name, quantity in QUANTITIES.items()
    if quantity.kind is float
    and quantity.title
    and quantity.source in ("solve", "state", "derived")
    and quantity.per in ((), ("notch",), ("tendon",), ("axis",))
}
"""Quantities of solved states that can be differentiated."""

CLOSING, COMPLIANCE, CURVE = "closing_tension", "tip_compliance", "curve."


def _closed_length(robot: Robot) -> np.ndarray:
    # A closed notch bends about its lips on the outer surface, at the outer radius from the axis.
    geometry = robot.geometry
    travel = geometry.closing_angle - geometry.free_angle
    return np.array([geometry.body_length.sum() + robot.tube.outer_radius * travel.sum()])


def _spine(robot: Robot) -> np.ndarray:
    cuts = [notch.spine_cut for notch in robot.notches]
    return np.array([np.nan if cut is None else robot.tube.outer_diameter - cut[0] for cut in cuts])


def _free_bore(robot: Robot) -> np.ndarray:
    radii = robot.tube.inner_radius, *(tendon.radius for tendon in robot.tendon)
    return 2.0 * np.array([min(radii)])


Formula = Callable[[Robot], Float[np.ndarray, " k"]]

OF_ROBOTS: dict[str, tuple[str, tuple[str, ...], Formula]] = {
    "length": ("mm", (), lambda robot: np.array([robot.geometry.length])),
    "closing_angle": ("deg", ("notch",), lambda robot: DEGREES * robot.geometry.closing_angle),
    "closed_length": ("mm", (), _closed_length),
    "spine": ("mm", ("notch",), _spine),
    "web": ("mm", ("notch",), lambda robot: robot.geometry.body_length[1:]),
    "free_bore": ("mm", (), _free_bore),
}
"""Quantities of the robot alone by name: unit, what its numbers stand for, and formula."""


def quantity_names() -> list[str]:
    """Return every name that a design file may give as `quantity`, beside paths of robot files."""
    return [*OF_STATES, CLOSING, COMPLIANCE, *OF_ROBOTS]


Reading = Float[np.ndarray, "k 1+v"]
"""Numbers of a robot, a row for each: the number, then its slopes with what varies, if any."""


def read(values: np.ndarray, slopes: Iterable[np.ndarray] = ()) -> Reading:
    """Return a quantity of any shape with its slopes, those by one variable after the other."""
    table = np.stack([values, *slopes])
    return table.reshape(len(table), -1).T


def taken(reading: Reading, take: str) -> Reading:
    """Make several numbers one; `each` leaves them, `steps` takes each from the next."""
    values, unit = reading[:, 0], np.eye(len(reading))
    match take:
        case "each":
            return reading
        case "steps":
            weights = unit[1:] - unit[:-1]
        case "pairs":  # each less every other one
            first, second = np.nonzero(1.0 - unit)
            weights = unit[first] - unit[second]
        case "sum":
            weights = np.ones(len(values))
        case "mean":
            weights = np.full(len(values), 1.0 / len(values))
        case "rms":
            size = np.sqrt(np.mean(values**2))
            weights = values / (len(values) * size if size > 0.0 else 1.0)
        case "range":
            weights = unit[np.argmax(values)] - unit[np.argmin(values)]
        case _:
            weights = unit[np.argmax(values) if take == "largest" else np.argmin(values)]
    return np.atleast_2d(weights) @ reading


# Stations of the axis between which the nearest point is searched.
_STATIONS = 481
# Points of a curve that is given by its curvature, and steps of its integration between two.
_POINTS, _FINE = 20, 50
# How far to both sides of a point the direction of the axis is taken, mm.
_ASIDE = 1e-3


def target_points(curve: TargetCurve) -> Float[np.ndarray, "m 3"]:
    """Return the points of a target curve, mm, in the frame of the base."""
    if curve.points is not None:
        return np.array(curve.points)
    given = np.array(curve.curvature)
    s = np.linspace(0.0, given[-1, 0], _POINTS * _FINE + 1)
    curvature = np.interp(s, given[:, 0], given[:, 1])
    # The turning is the exact integral of straight lines; the points follow to 1e-6.
    turning = cumulative_trapezoid(curvature, s, initial=0.0)
    along = np.stack([np.sin(turning), np.zeros_like(s), np.cos(turning)], axis=1)
    return CubicSpline(s, along).antiderivative()(s[_FINE::_FINE])


def offsets(
    robot: Robot,
    bodies: Sequence[np.ndarray],
    points: Float[np.ndarray, "m 3"],
    slopes: Sequence[np.ndarray],
    lengths: Float[np.ndarray, "v bodies"],
) -> Reading:
    """Return the vector from each point to the nearest of the axis, from the last one to the tip.

    Args:
        robot: The robot.
        bodies: Positions (mm) and rotations of its bodies.
        points: The points.
        slopes: Slopes of the bodies, what varies as leading axis; none for values only.
        lengths: Slopes of the lengths of the bodies.

    Returns:
        The vectors one after the other, mm; their slopes across the axis, as the nearest point
        slides along.
    """
    poses: Any = bodies

    def axis(stations: np.ndarray) -> np.ndarray:
        return np.asarray(points_on_axis(axis_places(robot, stations), *poses))

    stations = np.linspace(0.0, robot.geometry.length, _STATIONS)
    line = axis(stations)
    # The nearest point of each straight piece between two stations, and of these the nearest.
    piece = np.diff(line, axis=0)
    part = np.sum((points[:, None] - line[:-1]) * piece, axis=-1) / np.sum(piece**2, axis=-1)
    part = np.clip(part, 0.0, 1.0)
    far = np.linalg.norm(line[:-1] + part[..., None] * piece - points[:, None], axis=-1)
    nearest, row = far.argmin(axis=1), np.arange(len(points))
    place = stations[nearest] + part[row, nearest] * stations[1]
    place[-1] = stations[-1]
    off = axis(place) - points
    if not slopes:
        return read(off)
    before, after = (np.clip(place + side, 0.0, stations[-1]) for side in (-_ASIDE, _ASIDE))
    along = axis(after) - axis(before)
    along /= np.linalg.norm(along, axis=1)[:, None]
    along[-1] = 0.0  # the tip does not slide
    moved = axis_point_changes(axis_places(robot, place), bodies, slopes, lengths)
    return read(off, moved - np.sum(moved * along, axis=-1)[..., None] * along)


def distances(off: Reading) -> Reading:
    """Return the lengths of the vectors of `offsets`, mm."""
    vectors = off[:, 0].reshape(-1, 3)
    size = np.linalg.norm(vectors, axis=1)
    toward = vectors / np.where(size > 0.0, size, 1.0)[:, None]
    return np.einsum("ma,mav->mv", toward, off.reshape(len(size), 3, -1))


BODIES = ("body_position", "body_rotation")


@dataclass(frozen=True, eq=False)
class Point:
    """A robot, and what was solved of it.

    Slopes are by the ranges of the variables, then by the standard deviations of what deviates.

    Attributes:
        x: The vector of variables.
        robot: Its robot.
        steps: The steps of its loads.
        arrays: Quantities of every step, in the units of Python.
        slopes: Their slopes, what varies as leading axis; empty for values only.
        names: Single numbers of the robot that vary.
        along: By how much each of them does; no rows for values only.
        closed: Closing tensions, N, where they are known without the robot.
    """

    x: Vector
    robot: Robot
    steps: LoadSteps
    arrays: Mapping[str, np.ndarray]
    slopes: Mapping[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    names: tuple[str, ...] = ()
    along: Float[np.ndarray, "v names"] = field(default_factory=lambda: np.zeros((0, 0)))
    closed: Float[np.ndarray, " n"] | None = None

    def of_load(self, name: str, load: str) -> Reading:
        """Return a quantity under a load, flat, in the unit of files."""
        return OF_STATES[name].scale * self._at(name, self.steps.last[load])

    def _at(self, name: str, step: int) -> Reading:
        return read(self.arrays[name][step], self.slopes[name][:, step] if self.slopes else ())

    @cached_property
    def closings(self) -> Reading:
        """Closing tensions, N; NaN for a notch that does not close."""
        if self.closed is not None:
            return read(self.closed)
        table = closing(self.robot)
        if not len(self.along):
            return read(table.tension)
        return read(table.tension, self.along @ table.jacobian(self.names)["tension"].T)

    def of_robot(self, formula: Formula) -> Reading:
        """Return a quantity of the robot alone."""
        numbers = np.array([number_at(self.robot, name) for name in self.names])

        def moved(part: float, row: np.ndarray) -> np.ndarray:
            values = dict(zip(self.names, (numbers + part * row).tolist(), strict=True))
            changed = {name: values[name] for name in compress(self.names, row)}
            return formula(self.robot.with_values(changed) if changed else self.robot)

        slopes = [slope(partial(moved, row=row), 0.0, order=2) for row in self.along]
        return read(formula(self.robot), slopes)

    def value(self, path: str) -> Reading:
        """Return the values of the robot file."""
        numbers = numbers_at(self.robot, path)
        by = [self.along @ [float(name == each) for each in self.names] for name in numbers]
        return np.column_stack([[*numbers.values()], by])

    def compliance(self, load: str, direction: Direction) -> Reading:
        """Return tip compliance along a direction, mm/N: a force to either side, and its travel."""
        plus, minus = (
            self._at("tip_position", self.steps.last[load, direction, side]) for side in (1, -1)
        )
        return np.array([direction]) / (2.0 * PROBE) @ (plus - minus)

    def offsets(self, curve: TargetCurve) -> Reading:
        """Return the vectors from the points of a curve to the axis, mm."""
        step = self.steps.last[curve.load]
        bodies = [self.arrays[name][step] for name in BODIES]
        slopes = [self.slopes[name][:, step] for name in BODIES] if self.slopes else []
        lengths = self.of_robot(lambda robot: robot.geometry.body_length)[:, 1:].T
        return offsets(self.robot, bodies, target_points(curve), slopes, lengths)


@dataclass(frozen=True, eq=False)
class Solver:
    """Solves robots of one form under the loads of a design.

    Attributes:
        variables: The variables.
        steps: The steps of the loads.
        outputs: Quantities of states that are needed.
        counts: How many robots were solved, and how many differentiated.
    """

    variables: Variables
    steps: LoadSteps
    outputs: tuple[str, ...]
    counts: dict[str, int] = field(default_factory=lambda: {"solves": 0, "gradients": 0})

    def path(self, x: Vector) -> EquilibriumPath | None:
        """Return the states of the robot of a vector; None if there are none."""
        if not self.steps.steps:
            return None
        robot, load = self.variables.robot_at(x), self.steps.path(self.variables.drives_at(x))
        return ForwardModel(robot, load, from_rest=self.steps.from_rest).solve(robot, load)

    def point(self, x: Vector) -> Point:
        """Solve the robot of a vector, and differentiate it.

        Raises:
            InputError: No robot can have these values, or a state does not converge.
        """
        x = self.variables.on_grid(x)
        robot = self.variables.robot_at(x)
        self.counts["solves"] += 1
        names, along = self.variables.varied(robot)
        path = self.path(x)
        if path is None:
            return Point(x, robot, self.steps, {}, {}, names, along)
        if not path.converged.all():
            raise InputError.NOT_CONVERGED(path.failures[int(np.argmin(path.converged))][1])
        self.counts["gradients"] += 1
        arrays = {name: np.asarray(path.quantity(name)) for name in self.outputs}
        directions = changes(path, names, along)
        for number, column in enumerate(self.variables.columns):
            if column.drive is not None:  # loads are linear in it
                more = x + np.eye(len(x))[number] * self.variables.span
                moved = self.steps.path(self.variables.drives_at(more))
                directions[number] = Change(load_change(path, moved), None)
        slopes = derivatives(path, directions, self.outputs)
        for name, by in slopes.items():
            is_known = np.isfinite(by[:, np.isfinite(arrays[name])]).all()
            if REGISTERED[name].kind is float and not is_known:
                raise InputError.NOT_CONVERGED(
                    f"a step was so hard that the derivatives of {name} are not known; "
                    "give the load more `steps`"
                )
        return Point(x, robot, self.steps, arrays, slopes, names, along)

    def points(self, vectors: Sequence[np.ndarray]) -> list[Point | InputError]:
        """Solve the robots of several vectors at once, for values only; an error says why not."""
        robots: dict[int, Robot] = {}
        points: dict[int, Point | InputError] = {}
        for number, x in enumerate(vectors):
            try:
                robots[number] = self.variables.robot_at(x)
            except InputError as error:
                points[number] = error
        self.counts["solves"] += len(robots)
        arrays, converged = self.rows([*robots.values()], [vectors[k] for k in robots], {})
        for row, (number, robot) in enumerate(robots.items()):
            states = {name: values[row] for name, values in arrays.items()}
            points[number] = (
                Point(vectors[number], robot, self.steps, states)
                if converged[row]
                else InputError.NOT_CONVERGED("a state does not converge")
            )
        return [points[number] for number in range(len(vectors))]

    def rows(
        self,
        robots: Robot | Sequence[Robot],
        vectors: Sequence[np.ndarray],
        numbers: Mapping[str, np.ndarray],
    ) -> tuple[dict[str, np.ndarray], Bool[np.ndarray, " robots"]]:
        """Solve robots by batches.

        Args:
            robots: The robots.
            vectors: The vector of each, or one for all, of which the loads are.
            numbers: Numbers of each by name, where they are not those of `robots`.

        Returns:
            Quantities of every step of all robots, and whether all their steps converged.
        """
        if robots == [] or not self.steps.steps:
            return {}, np.ones(len(next(iter(numbers.values()), vectors)), bool)
        loads = [self.steps.path(self.variables.drives_at(x)) for x in vectors]
        ends = np.cumsum(self.steps.lengths)
        pieces = [
            batch(robots, numbers, [path[start:end] for path in loads], outputs=self.outputs)
            for start, end in zip(ends - self.steps.lengths, ends, strict=True)
        ]
        arrays = {name: np.concatenate([one[name] for one in pieces], axis=1) for name in pieces[0]}
        return arrays, np.asarray(arrays["converged"].all(axis=1))
