"""Measurements of a robot, with the loads under which they were made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Int
from numpy.typing import ArrayLike, NDArray

from notchflex import InputError, LoadPath
from notchflex.fit.measurements.loading_order import branches, commands_of

OBSERVED = (
    "notch_angle",
    "total_angle",
    "edge_angle",
    "total_edge_angle",
    "tip_position",
    "tip_rotation",
    "tip_tension",
    "axis_points",
)
"""Quantities that can be measured."""

# Axes of their arrays, rows included, and the last axis of vectors.
_AXES = {"total_angle": 1, "total_edge_angle": 1, "axis_points": 3}
# What totals are sums of. Rounding of a sum of angles (rad); angles are not measured to that.
_SUMMED = {"total_angle": "notch_angle", "total_edge_angle": "edge_angle"}
_ADDED_UP = 1e-4
_VECTORS = ("tip_position", "tip_rotation", "axis_points")


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
            the last span of every tendon, "axis_points" (P, m, 3) mm on the tube axis.
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
    observed: dict[str, NDArray[np.float64]]
    deviation: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    axis_at: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    measured_tension: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    ignored: tuple[str, ...] = ()
    order: str = ""
    renamed: Mapping[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        """Check everything, and convert it to arrays of floats."""
        rows = len(self.load)
        checked: dict[str, Any] = {
            "axis_at": np.array(self.axis_at, float, ndmin=1),
            "measured_tension": np.array(self.measured_tension, float, ndmin=2),
            "pull": tuple(str(label) for label in self.pull),
        }
        if not checked["measured_tension"].size:
            checked["measured_tension"] = self.load.tension
        clipped = np.maximum(checked["measured_tension"], 0.0)
        if not np.array_equal(clipped, self.load.tension, equal_nan=True):
            raise InputError.CONFLICT(
                "the measured tensions are not those of the load; it has the same, 0 N where they "
                "are negative"
            )
        check_labels(checked["pull"], rows, "rows")
        for name in ("observed", "deviation"):
            tables = getattr(self, name)
            checked[name] = {key: _checked(value, key, rows) for key, value in tables.items()}
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        self._check_numbers()

    def _check_numbers(self) -> None:
        if not any(np.isfinite(value).any() for value in self.observed.values()):
            raise InputError.NO_DATA(f"nothing is measured; give some of {', '.join(OBSERVED)}")
        points = self.observed.get("axis_points")
        if (0 if points is None else points.shape[1]) != len(self.axis_at):
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
        mine, its = self._arrays, other._arrays
        return (
            (self.pull, self.from_rest, self.load.external)
            == (other.pull, other.from_rest, other.load.external)
            and mine.keys() == its.keys()
            and all(np.array_equal(mine[name], its[name], equal_nan=True) for name in mine)
        )

    @property
    def _arrays(self) -> dict[str, NDArray[np.float64]]:
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
        way = "each from rest" if self.from_rest else "each pull one path"
        deviations = f"; deviations of {', '.join(self.deviation)}" if self.deviation else ""
        return (
            f"<Measurements of {self.source}: {_count(len(self), 'row')} of "
            f"{_count(len(self.pulls), 'pull')}, {way}; {', '.join(self.observed)}{deviations}>"
        )

    @property
    def pulls(self) -> tuple[str, ...]:
        """Labels of the pulls, each once, in their order."""
        return tuple(dict.fromkeys(self.pull))

    @property
    def branches(self) -> Int[np.ndarray, " p"]:
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
        parts = self.observed.get(_SUMMED.get(name, ""))
        if parts is None or name not in self.observed:
            return False
        return bool(np.allclose(parts.sum(1), self.observed[name], rtol=0.0, atol=_ADDED_UP))

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
        tables = (
            {names.get(name, name): table for name, table in tables.items()}
            for tables in (self.observed, self.deviation)
        )
        observed, deviation = tables
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
        which = np.arange(len(self))[rows]
        if not len(which):
            raise InputError.NO_DATA(f"no row of {self.source} is left; take at least one")
        return replace(
            self,
            load=self.load[which],
            pull=tuple(self.pull[row] for row in which),
            observed={name: value[which] for name, value in self.observed.items()},
            deviation={name: value[which] for name, value in self.deviation.items()},
            measured_tension=self.measured_tension[which],
        )

    def of_pulls(self, labels: Sequence[str]) -> Measurements:
        """Return the rows of some of the pulls.

        Raises:
            InputError: There is no pull of such a label.
        """
        missing = [label for label in labels if label not in self.pulls]
        if missing:
            raise InputError.UNKNOWN_NAME(
                f"{self.source} has no pull {missing[0]!r}; it has {', '.join(self.pulls)}"
            )
        return self.taken([label in labels for label in self.pull])


def check_labels(labels: Sequence[str], count: int, what: str) -> None:
    """Raise InputError unless every row has the label of its pull."""
    if len(labels) != count:
        raise InputError.WRONG_SHAPE(
            f"{count} {what} need a label of their pull each; got {len(labels)}"
        )


def check_quantities(names: Iterable[str]) -> None:
    """Raise InputError if a quantity cannot be measured."""
    for name in names:
        if name not in OBSERVED:
            raise InputError.UNKNOWN_NAME(
                f"`{name}` is nothing that is measured; there are {', '.join(OBSERVED)}"
            )


def _checked(value: Any, name: str, rows: int) -> NDArray[np.float64]:
    check_quantities([name])
    array = np.array(value, float)
    fits = array.ndim == _AXES.get(name, 2) and len(array) == rows
    if not fits or (name in _VECTORS and array.shape[-1] != 3):
        raise InputError.WRONG_SHAPE(f"{name} of {rows} rows cannot have the shape {array.shape}")
    if np.isinf(array).any():
        raise InputError.NOT_FINITE(
            f"{name} holds an infinite number; give NaN where nothing was measured"
        )
    return array


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
