"""What was measured on a robot, and what was done to it: the rows that constants are fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Int
from numpy.typing import ArrayLike, NDArray

from notchflex.errors import InputError
from notchflex.fit.measurements.loading_order import branches, commands_of
from notchflex.loads import LoadPath

OBSERVED = (
    "notch_angle",
    "total_angle",
    "tip_position",
    "tip_rotation",
    "tip_tension",
    "axis_points",
)
"""Quantities that can be measured."""


@dataclass(frozen=True, eq=False, repr=False)
class Measurements:
    """P rows of measurements of a robot of n notches and t tendons. Units mm, N, rad.

    Attributes:
        source: Where they came from.
        load: What was done, P steps: tension or stroke of every tendon as the model is given it,
            NaN where the other is given; the external loads of each row. A measured tension
            below 0 is the offset of a sensor, and 0 N in the model.
        pull: Label of the pull that each row belongs to, P of them.
        from_rest: True where every row is a pull from rest; False where the rows of a pull, in
            their order, are one path with memory of friction.
        observed: What was measured by name, the rows as leading axis, NaN where it was not:
            "notch_angle" (P, n) and "total_angle" (P,) rad, "tip_position" (P, 3) mm,
            "tip_rotation" (P, 3) as rotation vectors in the world rad, "tip_tension" (P, t) N in
            the last span of every tendon, "axis_points" (P, m, 3) mm on the tube axis.
        deviation: Standard deviations of what was measured, in the same shapes; NaN, or not there,
            where not known.
        axis_at: How far from the base the points on the axis lie when the robot is straight, mm,
            (m,).
        measured_tension: Tensions as they were measured, N, (P, t); those of `load` if left out.
        ignored: Columns of the file that were not used.
        order: How the order of the rows was understood, where neither the file nor the caller says
            whether they are from rest; "" where there is nothing to say.

    Raises:
        InputError: Shapes that do not fit each other, numbers that are not finite, a standard
            deviation that is not positive.

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

    def __post_init__(self) -> None:
        """Check everything, and bring it to arrays of floats."""
        rows = len(self.load)
        axis_at = np.array(self.axis_at, float, ndmin=1)
        tension = np.array(self.measured_tension, float, ndmin=2)
        if not tension.size:
            tension = self.load.tension
        clipped = np.maximum(tension, 0.0)
        if not np.array_equal(clipped, self.load.tension, equal_nan=True):
            raise InputError.CONFLICT(
                "the measured tensions are not those of the load; it has the same, 0 N where they "
                "are negative"
            )
        pull = tuple(str(label) for label in self.pull)
        if len(pull) != rows:
            raise InputError.WRONG_SHAPE(
                f"{rows} rows need a label of their pull each; got {len(pull)}"
            )
        observed = {name: _checked(value, name, rows) for name, value in self.observed.items()}
        if not any(np.isfinite(value).any() for value in observed.values()):
            raise InputError.NO_DATA(f"nothing is measured; give some of {', '.join(OBSERVED)}")
        points = observed.get("axis_points")
        if (0 if points is None else points.shape[1]) != len(axis_at):
            raise InputError.MISSING_VALUE(
                "axis_points need axis_at, how far from the base each of them lies on the straight "
                "robot, mm"
            )
        deviation = {name: _checked(value, name, rows) for name, value in self.deviation.items()}
        for name, value in deviation.items():
            if name not in observed or value.shape != observed[name].shape:
                raise InputError.WRONG_SHAPE(
                    f"the deviation of {name} must have the shape of what is observed"
                )
            if (value <= 0.0).any():
                raise InputError.OUT_OF_RANGE(
                    f"a standard deviation of {name} is {np.nanmin(value):g}; give it above 0, or "
                    "NaN where it is not known"
                )
        taken: dict[str, Any] = {
            "axis_at": axis_at,
            "measured_tension": tension,
            "pull": pull,
            "observed": observed,
            "deviation": deviation,
        }
        for name, value in taken.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.load)

    def __eq__(self, other: object) -> bool:
        """Whether the same was done and measured; where it was read from does not matter."""
        if not isinstance(other, Measurements):
            return NotImplemented
        plain = ("pull", "from_rest")
        mine, its = self._arrays, other._arrays
        return (
            all(getattr(self, name) == getattr(other, name) for name in plain)
            and self.load.external == other.load.external
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
        """How many rows and pulls, and what was measured."""
        pulls = len(self.pulls)
        way = "each from rest" if self.from_rest else "each pull one path"
        known = f"; deviations of {', '.join(self.deviation)}" if self.deviation else ""
        return (
            f"<Measurements of {self.source}: {_count(len(self), 'row')} of "
            f"{_count(pulls, 'pull')}, {way}; {', '.join(self.observed)}{known}>"
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
        """How many numbers were measured."""
        return sum(int(np.isfinite(value).sum()) for value in self.observed.values())

    def taken(self, rows: ArrayLike | slice) -> Measurements:
        """Some of the rows.

        Args:
            rows: Their numbers from 0, a slice, or a truth value for every row.

        Raises:
            InputError: No row is left, or none of which anything was measured.
        """
        if not isinstance(rows, slice) and not np.size(rows):
            rows = slice(0)
        which = np.arange(len(self))[rows if isinstance(rows, slice) else np.asarray(rows)]
        if not len(which):
            raise InputError.NO_DATA(f"no row of {self.source} is left; take at least one")
        return replace(
            self,
            load=rows_of(self.load, which),
            pull=tuple(self.pull[row] for row in which),
            observed={name: value[which] for name, value in self.observed.items()},
            deviation={name: value[which] for name, value in self.deviation.items()},
            measured_tension=self.measured_tension[which],
        )

    def of_pulls(self, labels: Sequence[str]) -> Measurements:
        """The rows of some of the pulls.

        Raises:
            InputError: There is no pull of such a label.
        """
        missing = [label for label in labels if label not in self.pulls]
        if missing:
            raise InputError.UNKNOWN_NAME(
                f"{self.source} has no pull {missing[0]!r}; it has {', '.join(self.pulls)}"
            )
        return self.taken([label in labels for label in self.pull])


def rows_of(load: LoadPath, rows: Sequence[int] | NDArray[np.intp]) -> LoadPath:
    """Return some of the steps of a load path, by their numbers from 0."""
    which = np.asarray(rows)
    external = tuple(load.external[row] for row in which)
    return LoadPath(load.tension[which], load.stroke[which], load.base_rotation, external)


def _checked(value: Any, name: str, rows: int) -> NDArray[np.float64]:
    axes = {"total_angle": 1, "axis_points": 3}
    if name not in OBSERVED:
        raise InputError.UNKNOWN_NAME(
            f"`{name}` is nothing that is measured; there are {', '.join(OBSERVED)}"
        )
    array = np.array(value, float)
    last = {"tip_position": (3,), "tip_rotation": (3,), "axis_points": (3,)}.get(name, ())
    fits = array.ndim == axes.get(name, 2) and len(array) == rows
    if not fits or (last and array.shape[-1:] != last):
        raise InputError.WRONG_SHAPE(f"{name} of {rows} rows cannot have the shape {array.shape}")
    if np.isinf(array).any():
        raise InputError.NOT_FINITE(
            f"{name} holds an infinite number; give NaN where nothing was measured"
        )
    return array


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


__all__ = ["OBSERVED", "Measurements", "rows_of"]
