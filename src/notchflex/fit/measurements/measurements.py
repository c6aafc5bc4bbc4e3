"""Measurements of a robot, with the loads under which they were made; simulated ones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from notchflex import EquilibriumPath, InputError, Load, LoadPath, Robot, Settings
from notchflex.analysis import axis_points
from notchflex.analysis.forward_model import ForwardModel
from notchflex.fit.measurements.loading_order import branches, commands_of
from notchflex.support import DEGREES, load_path

# Arrays of any shape, which docstrings tell.
Numbers = Float[np.ndarray, "..."]
Integers = Int[np.ndarray, "..."]
Flags = Bool[np.ndarray, "..."]


class MeasuredQuantity(NamedTuple):
    """What can be measured: its title, its columns in a file, and what the model has for it."""

    title: str
    columns: str
    output: str

    @property
    def unit(self) -> str:
        """Unit in files and tables."""
        return self.columns.rpartition("_")[2]

    @property
    def scale(self) -> float:
        """Factor from rad, mm or N to that unit."""
        return DEGREES if self.unit == "deg" else 1.0

    @property
    def per(self) -> tuple[str, ...]:
        """What its columns are counted by: notches, tendons, points, axes."""
        return fields_in(self.columns)

    @property
    def is_vector(self) -> bool:
        """Whether its numbers are the three coordinates of points, or of a rotation."""
        return self.per[-1:] == ("axis",)


MEASURED = {
    "notch_angle": MeasuredQuantity("notch angle", "notch_{notch}_deg", "notch_angle"),
    "total_angle": MeasuredQuantity("total bending angle", "total_deg", "total_angle"),
    "edge_angle": MeasuredQuantity("edge angle", "notch_{notch}_edge_deg", "edge_angle"),
    "total_edge_angle": MeasuredQuantity("total edge angle", "total_edge_deg", "edge_angle"),
    "tip_position": MeasuredQuantity("tip position", "tip_{axis}_mm", "tip_position"),
    "tip_rotation": MeasuredQuantity("tip rotation", "tip_r{axis}_deg", "tip_rotation"),
    "tip_tension": MeasuredQuantity(
        "tension at the tip", "tendon{tendon}_tip_force_N", "span_tension"
    ),
    "drive_tension": MeasuredQuantity(
        "tension of the drive", "tendon{tendon}_drive_force_N", "tension"
    ),
    "drive_stroke": MeasuredQuantity(
        "way of the drive", "tendon{tendon}_drive_displacement_mm", "stroke"
    ),
    "axis_points": MeasuredQuantity("points on the axis", "axis_{point}_{axis}_mm", "axis_points"),
}
"""Quantities that can be measured, by name."""
OBSERVED = tuple(MEASURED)
NOTCH_ANGLES = ("notch_angle", "edge_angle")

_TOTAL_OF = {"total_angle": "notch_angle", "total_edge_angle": "edge_angle"}
_ROUNDING_OF_SUMS = 1e-4  # rad; angles are not measured to that


def fields_in(pattern: str) -> tuple[str, ...]:
    """Return the names between the braces of a pattern."""
    return tuple(re.findall(r"{(\w+)}", pattern))


@dataclass(frozen=True, eq=False, repr=False)
class Measurements:
    """P rows of measurements of a robot of n notches and t tendons. Units mm, N, rad.

    Attributes:
        source: Where they come from.
        load: Loads of the model, P steps: tension or stroke of every tendon, NaN where the other is
            given; external loads. A measured tension below 0 is the offset of a sensor, and 0 N
            in the model.
        pull: Label of the pull of every row, P of them.
        from_rest: True if every row is a pull from rest; False if the rows of a pull, in their
            order, are one path with friction history.
        observed: Measured quantities by name, rows as leading axis, NaN where not measured:
            "notch_angle" (P, n) and "total_angle" (P,) rad, between the faces of notches
            "edge_angle" (P, n) and their sum "total_edge_angle" (P,) rad, "tip_position" (P, 3) mm,
            "tip_rotation" (P, 3) as rotation vectors in the world rad, "tip_tension" (P, t) N in
            the last span of every tendon, "drive_tension" (P, t) N and "drive_stroke" (P, t) mm of
            drives that are commanded the other, "axis_points" (P, m, 3) mm on the tube axis.
        deviation: Their standard deviations, in the same shapes; NaN, or left out, if unknown.
        axis_at: Distances of the points on the axis from the base of the straight robot, mm, (m,).
        measured_tension: Tensions as measured, N, (P, t); those of `load` by default.
        ignored: Columns of the file that were not used.
        order: How the order of the rows was understood if neither the file nor the caller says
            whether they are from rest; "" if there is nothing to say.
        renamed: Columns that have another name in the file, to that name.

    Raises:
        InputError: Shapes that do not match, numbers that are not finite, a standard deviation
            that is not positive.

    Example:
        >>> from notchflex import pull
        >>> angles = np.radians([[0.5, 0.6], [4.1, 4.3]])
        >>> Measurements(
        ...     "by hand", pull(0.0, 0.5, steps=2), ("1", "1"), True, {"notch_angle": angles}
        ... )
        <Measurements of by hand: 2 rows of 1 pull, each from rest; notch_angle>
    """

    source: str
    load: LoadPath
    pull: tuple[str, ...]
    from_rest: bool
    observed: dict[str, Numbers]
    deviation: dict[str, Numbers] = field(default_factory=dict)
    axis_at: Numbers = field(default_factory=lambda: np.zeros(0))
    measured_tension: Numbers = field(default_factory=lambda: np.zeros((0, 0)))
    ignored: tuple[str, ...] = ()
    order: str = ""
    renamed: Mapping[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        """Check everything, and convert it to arrays of floats."""
        rows, values = len(self.load), vars(self)
        values["axis_at"] = np.array(self.axis_at, float, ndmin=1)
        tension = np.array(self.measured_tension, float, ndmin=2)
        tension = values["measured_tension"] = tension if tension.size else self.load.tension
        if not np.array_equal(np.maximum(tension, 0.0), self.load.tension, equal_nan=True):
            raise InputError.CONFLICT(
                "the measured tensions are not those of the load; it has the same, 0 N where they "
                "are negative"
            )
        values["pull"] = check_labels(self.pull, rows, "rows")
        for name in ("observed", "deviation"):
            check_quantities(values[name])
            tables = {key: np.array(value, float) for key, value in values[name].items()}
            for key, table in tables.items():
                quantity = MEASURED[key]
                fits = table.ndim == 1 + len(quantity.per) and len(table) == rows
                if not fits or (quantity.is_vector and table.shape[-1] != 3):
                    raise InputError.WRONG_SHAPE(
                        f"{key} of {rows} rows cannot have the shape {table.shape}"
                    )
                if np.isinf(table).any():
                    raise InputError.NOT_FINITE(
                        f"{key} holds an infinite number; give NaN where nothing was measured"
                    )
            values[name] = tables
        if not self.values:
            raise InputError.NO_DATA(f"nothing is measured; give some of {', '.join(OBSERVED)}")
        points = self.observed.get("axis_points", np.zeros((0, 0))).shape[1]
        if points != len(self.axis_at):
            raise InputError.MISSING_VALUE(
                "axis_points need axis_at, how far from the base each of them lies on the straight "
                "robot, mm"
            )
        for name, value in self.deviation.items():
            if name not in self.observed or value.shape != self.observed[name].shape:
                raise InputError.WRONG_SHAPE(
                    f"the deviation of {name} must have the shape of what is observed"
                )
            if (value <= 0.0).any():
                raise InputError.OUT_OF_RANGE(
                    f"a standard deviation of {name} is {np.nanmin(value):g}; give it above 0, or "
                    "NaN where it is not known"
                )

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.load)

    def __eq__(self, other: object) -> bool:
        """Whether loads and measurements are the same; the source does not matter."""
        if not isinstance(other, Measurements):
            return NotImplemented
        arrays, others = self._arrays, other._arrays
        return (
            (self.pull, self.from_rest, self.load.external)
            == (other.pull, other.from_rest, other.load.external)
            and arrays.keys() == others.keys()
            and all(np.array_equal(arrays[name], others[name], equal_nan=True) for name in arrays)
        )

    @property
    def _arrays(self) -> dict[str, Numbers]:
        return {
            "tension": self.measured_tension,
            "stroke": self.load.stroke,
            "base_rotation": self.load.base_rotation,
            "axis_at": self.axis_at,
            **self.observed,
            **{f"{name} deviation": value for name, value in self.deviation.items()},
        }

    def __repr__(self) -> str:
        """Return how many rows and pulls there are, and what was measured."""
        rows, pulls = (
            f"{count} {what}{'' if count == 1 else 's'}"
            for count, what in ((len(self), "row"), (len(self.pulls), "pull"))
        )
        way = "each from rest" if self.from_rest else "each pull one path"
        deviations = f"; deviations of {', '.join(self.deviation)}" if self.deviation else ""
        measured = ", ".join(self.observed)
        return f"<Measurements of {self.source}: {rows} of {pulls}, {way}; {measured}{deviations}>"

    @property
    def pulls(self) -> tuple[str, ...]:
        """Labels of the pulls, each once, in their order."""
        return tuple(dict.fromkeys(self.pull))

    @property
    def pull_number(self) -> Integers:
        """Number of the pull of every row, from 0, (P,)."""
        return np.array([self.pulls.index(label) for label in self.pull])

    @property
    def command(self) -> Numbers:
        """What is commanded in every row, tension or stroke, summed over the tendons, (P,)."""
        return np.nansum(np.fmax(self.measured_tension, self.load.stroke), axis=1)

    @property
    def branches(self) -> Integers:
        """Loading rows (1) and unloading rows (-1) by the order of the rows in their pull, (P,)."""
        return branches(commands_of(self.measured_tension, self.load.stroke), self.pull)

    @property
    def negative_forces(self) -> int:
        """Number of rows with a negative force: the offset of a sensor, 0 N in the model."""
        return int((self.measured_tension < 0.0).any(axis=1).sum())

    @property
    def values(self) -> int:
        """Number of measured numbers."""
        return sum(int(np.isfinite(value).sum()) for value in self.observed.values())

    def is_sum(self, name: str) -> bool:
        """Return whether a quantity is a total that was added up from the notches."""
        parts = self.observed.get(_TOTAL_OF.get(name, ""))
        if parts is None or name not in self.observed:
            return False
        return np.allclose(parts.sum(1), self.observed[name], rtol=0.0, atol=_ROUNDING_OF_SUMS)

    def as_edge_angles(self) -> Measurements:
        """Return the same with angles of notches taken as those between their faces.

        A total angle that was added up from them is taken so too.

        Raises:
            InputError: Angles between faces were measured beside those of the rings.
        """
        names = {"notch_angle": "edge_angle"}
        if self.is_sum("total_angle"):
            names["total_angle"] = "total_edge_angle"
        if "notch_angle" not in self.observed:
            raise InputError.CONFLICT(
                f"{self.source} has no columns such as notch_1_deg to be read as edge angles"
            )
        if any(name in self.observed for name in names.values()):
            raise InputError.CONFLICT(
                f"{self.source} has angles of rings and of faces (notch_1_edge_deg); leave out "
                "one of them, or read each as its column says"
            )
        observed, deviation = (
            {names.get(name, name): table for name, table in tables.items()}
            for tables in (self.observed, self.deviation)
        )
        return replace(self, observed=observed, deviation=deviation)

    def taken(self, rows: ArrayLike | slice) -> Measurements:
        """Return some of the rows.

        Args:
            rows: Their numbers from 0, a slice, or a truth value for every row.

        Raises:
            InputError: No row is left, or nothing was measured in those left.
        """
        if not isinstance(rows, slice):
            rows = np.asarray(rows) if np.size(rows) else slice(0)
        chosen = np.arange(len(self))[rows]
        if not len(chosen):
            raise InputError.NO_DATA(f"no row of {self.source} is left; take at least one")
        return replace(
            self,
            load=self.load[chosen],
            pull=tuple(self.pull[row] for row in chosen),
            observed={name: value[chosen] for name, value in self.observed.items()},
            deviation={name: value[chosen] for name, value in self.deviation.items()},
            measured_tension=self.measured_tension[chosen],
        )

    def of_pulls(self, labels: Sequence[str]) -> Measurements:
        """Return the rows of some of the pulls.

        Raises:
            InputError: There is no pull of such a label.
        """
        for label in labels:
            if label not in self.pulls:
                raise InputError.UNKNOWN_NAME(
                    f"{self.source} has no pull {label!r}; it has {', '.join(self.pulls)}"
                )
        return self.taken([label in labels for label in self.pull])


def check_labels(labels: Iterable[object], count: int, what: str) -> tuple[str, ...]:
    """Return the labels of the pulls; raise InputError unless every row has one."""
    texts = tuple(map(str, labels))
    if len(texts) != count:
        raise InputError.WRONG_SHAPE(
            f"{count} {what} need a label of their pull each; got {len(texts)}"
        )
    return texts


def check_quantities(names: Iterable[str]) -> None:
    """Raise InputError if a quantity cannot be measured."""
    for name in names:
        if name not in MEASURED:
            raise InputError.UNKNOWN_NAME(
                f"`{name}` is nothing that is measured; there are {', '.join(OBSERVED)}"
            )


@dataclass(frozen=True, eq=False)
class MeasuredRows:
    """The model under the loads of P rows, from rest or as steps of the paths of their pulls."""

    robot: Robot
    load: LoadPath
    pull: Sequence[str]
    from_rest: bool
    settings: Settings = Settings()  # noqa: RUF009 - frozen

    @cached_property
    def order(self) -> Integers:
        """Rows in the order in which they are solved, pull by pull."""
        first = {label: number for number, label in reversed([*enumerate(self.pull)])}
        return np.argsort([first[label] for label in self.pull], kind="stable")

    @cached_property
    def model(self) -> ForwardModel:
        """The robot under the loads in that order."""
        labels = np.array(self.pull)[self.order]
        from_rest = np.append(True, labels[1:] != labels[:-1]) | self.from_rest
        return ForwardModel(self.robot, self.load[self.order], self.settings, from_rest=from_rest)

    def solve(self) -> EquilibriumPath:
        """Solve the rows in that order."""
        return self.model.solve(self.robot, self.model.load)

    def sorted_back(self, values: Any, axis: int = 0) -> Any:
        """Return values of the solved steps in the order of the rows."""
        return np.take(values, np.argsort(self.order), axis)


def reading(name: str, values: Numbers) -> Numbers:
    """Return what is measured of an output of the model, or of its derivatives."""
    if name == "tip_tension":
        spans = np.isfinite(values).any(axis=tuple(range(values.ndim - 2))).sum(axis=-1)
        return values[..., np.arange(len(spans)), spans - 1]
    return values.sum(axis=-1) if name == "total_edge_angle" else values


def modelled(path: EquilibriumPath, name: str, axis_at: ArrayLike = ()) -> Numbers:
    """Return what would be measured on solved states, as in `Measurements.observed`."""
    if name == "axis_points":
        return axis_points(path, axis_at)
    values = reading(name, np.asarray(getattr(path, MEASURED[name].output)))
    return Rotation.from_matrix(values).as_rotvec() if name == "tip_rotation" else values


def simulate_measurements(
    robot: Robot,
    load: Load | LoadPath | Iterable[Load],
    *,
    observed: Sequence[str] = ("notch_angle",),
    deviation: Mapping[str, float] | None = None,
    seed: int | np.random.Generator = 0,
    axis_at: ArrayLike = (),
    pull: Sequence[str] | None = None,
    from_rest: bool = True,
) -> Measurements:
    """Simulate measurements with the model, with Gaussian noise.

    Args:
        robot: The robot.
        load: The loads, P steps.
        observed: What is measured, by the names of `Measurements.observed`.
        deviation: Standard deviation of the noise, rad, mm or N, by the same names; 0 by default.
        seed: Seed of the noise, or a random generator.
        axis_at: Distances of the points on the axis from the base, mm; for "axis_points".
        pull: Label of the pull of every step; one pull by default.
        from_rest: True if every step is a pull from rest, False if each pull is one path.

    Raises:
        InputError: An unknown name, a deviation that is not positive, a point beyond the robot.
        ConvergenceError: A step has no equilibrium.

    Example:
        >>> from notchflex import load_robot, pull
        >>> wrist = load_robot("pacheco2021-a")
        >>> simulate_measurements(wrist, pull(0.2, 1.0, steps=5), deviation={"notch_angle": 0.005})
        <Measurements of synthetic: 5 rows of 1 pull, each from rest; notch_angle; deviations of
        notch_angle>
    """
    noise = dict(deviation or {})
    check_quantities((*observed, *noise))
    for name, size in noise.items():
        if name not in observed or not 0.0 < size < np.inf:
            raise InputError.OUT_OF_RANGE(
                f"the deviation of {name} must be positive and {name} be observed; got {size:g}"
            )
    steps = load_path(load, robot.number_of_tendons)
    labels = check_labels(("1",) * len(steps) if pull is None else pull, len(steps), "steps")
    random = np.random.default_rng(seed)
    rows = MeasuredRows(robot, steps, labels, from_rest)
    path = rows.solve().raise_if_failed()
    values: dict[str, Numbers] = {}
    deviations: dict[str, Numbers] = {}
    for name in observed:
        exact = rows.sorted_back(modelled(path, name, axis_at))
        noisy = exact + noise.get(name, 0.0) * random.standard_normal(exact.shape)
        values[name] = _as_read(noisy, name)
        if name in noise:
            deviations[name] = np.full(exact.shape, _as_read(noise[name], name))
    axis_at = np.array(axis_at, float) if "axis_points" in observed else np.zeros(0)
    return Measurements("synthetic", steps, labels, from_rest, values, deviations, axis_at)


def _as_read(value: Any, name: str) -> Any:
    """A value as it is read from a file: an angle that a number of degrees gives exactly."""
    return np.radians(np.degrees(value)) if MEASURED[name].unit == "deg" else value
