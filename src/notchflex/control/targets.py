"""Targets: series of values of quantities of the robot, also from a CSV file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Float, Int

from notchflex import InputError, Robot
from notchflex.specification import entry_names, known
from notchflex.support import (
    AXES,
    DEGREES,
    REGISTERED,
    AnyPath,
    axis_sizes,
    check_is_robot,
    check_number,
    nearest,
    read_data_table,
    short_repr,
)

DIRECTION = "tip_direction"
"""Unit vector along the tube at the tip, in the world: the last column of `tip_rotation`."""

LARGEST_TARGET = 1e9
"""Numbers beyond this (mm, N, rad) are refused: squares of their distances have no end."""

LARGEST_WEIGHT = 1e9
"""Weights beyond this, or below its inverse, are refused: one quantity alone would count."""

_FORMS = "x, y, z of the tip in mm, or names of quantities with their values"


@dataclass(frozen=True)
class Targets:
    """Target values of quantities, target by target.

    Attributes:
        values: By name of a quantity, its values, targets as leading axis; NaN where an entry is
            free. Units mm, N, rad. "tip_direction" is the unit vector along the tube at the tip.
    """

    values: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        """Number of targets."""
        return len(next(iter(self.values.values())))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Quantities that a solve must report for these."""
        return tuple(dict.fromkeys(map(output_of, self.values)))

    @property
    def goals(self) -> Float[np.ndarray, "k m"]:
        """All values of each target, one after the other."""
        return np.concatenate([v.reshape(len(self), -1) for v in self.values.values()], axis=1)


def output_of(name: str) -> str:
    """Return the quantity whose numbers a target is compared with."""
    return "tip_rotation" if name == DIRECTION else name


def weigh(
    targets: Targets, slices: Mapping[str, slice], weights: Mapping[str, float] | None
) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Return which numbers of a step have a target, and what an error of one unit counts.

    Args:
        targets: The targets.
        slices: Where each output is among the numbers of a step.
        weights: By quantity, what an error of one unit (mm, N, rad) counts; 1 where not given.

    Raises:
        InputError: A weight of what is not a target, not positive, or beyond `LARGEST_WEIGHT`.
    """
    checked = _check_weights(weights, targets)
    entries: list[np.ndarray] = []
    counts: list[np.ndarray] = []
    for name in targets.values:
        places = np.r_[slices[output_of(name)]]
        places = places[2::3] if name == DIRECTION else places  # the last column
        entries.append(places)
        counts.append(np.full(len(places), checked.get(name, 1.0)))
    return np.concatenate(entries), np.concatenate(counts)


def units_of(targets: Targets) -> tuple[str, ...]:
    """Return the unit of every entry of the targets; that of directions is deg."""
    turned = (DIRECTION, "tip_rotation")
    return tuple(
        "deg" if name in turned else REGISTERED[name].unit
        for name, values in targets.values.items()
        for _ in range(values[0].size)
    )


def _check_weights(weights: Any, targets: Targets) -> dict[str, float]:
    if weights is not None and not isinstance(weights, Mapping):
        raise InputError.WRONG_TYPE(
            f"weights are numbers by the name of a quantity; got {short_repr(weights)}"
        )
    checked: dict[str, float] = {}
    for name, weight in cast("Mapping[str, Any]", weights or {}).items():
        known(name, targets.values, "target")
        checked[name] = check_number(weight, f"the weight of {name}")
        if not 1.0 / LARGEST_WEIGHT <= checked[name] <= LARGEST_WEIGHT:
            raise InputError.OUT_OF_RANGE(
                f"the weight of {name} must be from {1.0 / LARGEST_WEIGHT:g} to "
                f"{LARGEST_WEIGHT:g}; got {checked[name]:g}"
            )
    return checked


def target_shapes(robot: Robot) -> dict[str, tuple[int, ...]]:
    """Return what may be a target, and its shape: what the solver reports as numbers."""
    sizes = axis_sizes(robot.number_of_notches, robot.number_of_tendons)
    shapes = {
        name: tuple(sizes[axis] for axis in one.per)
        for name, one in REGISTERED.items()
        if one.source != "path" and one.title and one.kind is float and set(one.per) <= set(sizes)
    }
    return {**shapes, DIRECTION: (3,)}


def make_targets(given: Any, robot: Robot, *, several: bool) -> Targets:
    """Check targets.

    Args:
        given: Positions of the tip (mm), or values by the name of a quantity, or `Targets`; an
            entry that is None is free.
        robot: The robot.
        several: Whether targets are the leading axis of all values; otherwise there is one.

    Raises:
        InputError: No such quantity, a wrong shape, or a number that is not finite.
    """
    if isinstance(given, Targets):
        return _checked(given.values, robot)
    named = given if isinstance(given, Mapping) else {"tip_position": given}
    values = {name: _numbers(value, name) for name, value in named.items()}
    return _checked({name: v if several else v[None] for name, v in values.items()}, robot)


def _checked(values: Mapping[str, np.ndarray], robot: Robot) -> Targets:
    shapes = target_shapes(robot)
    if not values:
        raise InputError.NO_DATA(f"there is no target; give {_FORMS}")
    for name, numbers in values.items():
        shape = known(name, shapes, "target")
        if not numbers.size or numbers.shape[1:] != shape or numbers.ndim != len(shape) + 1:
            wanted, got = ("×".join(map(str, size)) for size in (("k", *shape), numbers.shape))
            raise InputError.WRONG_SHAPE(
                f"k targets of {name}, at least one, have the shape {wanted} for this robot; "
                f"got {got or 'one number'}"
            )
        if (np.abs(numbers) > LARGEST_TARGET).any():
            raise InputError.OUT_OF_RANGE(
                f"a target of {name} is at most {LARGEST_TARGET:g} in size (mm, N, rad); "
                f"got {np.nanmax(np.abs(numbers)):g}"
            )
    if len({len(numbers) for numbers in values.values()}) > 1:
        raise InputError.WRONG_SHAPE(
            "all quantities need the same number of targets; got "
            + ", ".join(f"{len(numbers)} of {name}" for name, numbers in values.items())
        )
    empty = np.isnan(Targets(values).goals).all(axis=1)
    if empty.any():
        raise InputError.NO_DATA(
            f"target {int(np.argmax(empty)) + 1} has no number: all of its entries are free"
        )
    if DIRECTION in values:
        # Unit vectors; one with free entries must have them as they are meant.
        directions = values[DIRECTION]
        length = np.linalg.norm(directions, axis=1, keepdims=True)
        whole = ~np.isnan(length[:, 0])
        if (length[whole] == 0.0).any() or (np.abs(directions[~whole]) > 1.0).any():
            raise InputError.OUT_OF_RANGE(
                "tip_direction must not be zero, and no entry beside a free one may exceed 1"
            )
        units = np.where(whole[:, None], directions / length, directions)
        values = {**values, DIRECTION: units}
    return Targets(values)


def _numbers(value: Any, name: str) -> np.ndarray:
    """Numbers of a target; None within them is NaN, NaN itself is refused."""
    try:
        entries = np.asarray(value, dtype=object)
        free = np.array([one is None for one in entries.flat], bool).reshape(entries.shape)
        numbers = [check_number(0.0 if one is None else one, name) for one in entries.flat]
    except ValueError:
        raise InputError.WRONG_TYPE(
            f"a target is {_FORMS}; got {short_repr(value)} for {short_repr(name)}"
        ) from None
    if not np.isfinite(numbers).all():
        raise InputError.NOT_FINITE(
            f"a target of {name} is not finite; give finite numbers, and None where it is free"
        )
    return np.where(free, np.nan, np.reshape(numbers, entries.shape))


def read_targets(
    source: AnyPath, robot: Robot, columns: Mapping[str, str] | None = None
) -> Targets:
    r"""Read targets from a CSV file.

    Columns have the names that results have: `tip_x_mm`, `tip_y_mm`, `tip_z_mm`, `total_deg`,
    `notch_1_deg`, ...; `tip_direction_x` (and `_y`, `_z`) is the unit vector along the tube at the
    tip. An empty entry is free. Other columns are not allowed, so that a slip is not ignored.

    Args:
        source: Path of the file.
        robot: The robot that is to meet them.
        columns: Headers of the file for columns, such as `{"tip_x_mm": "x"}`.

    Returns:
        The targets, one per row.

    Raises:
        InputError: The file cannot be used; the message names line and column.

    Example:
        >>> from pathlib import Path
        >>> from notchflex import load_robot
        >>> _ = Path("targets.csv").write_text("tip_x_mm,tip_z_mm\n2.1,9.5\n2.4,9.3\n")
        >>> len(read_targets("targets.csv", load_robot("pacheco2021-a")))
        2
    """
    table = read_data_table(source, columns)
    meant, shapes = _columns(check_is_robot(robot)), target_shapes(robot)
    values: dict[str, np.ndarray] = {}
    for header in table.header:
        if header not in meant:
            usual = "tip_x_mm, total_deg, notch_1_deg and the like"
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: {short_repr(header)} is not a column of targets"
                f"{nearest(header, meant, 2) or f'; there are {usual}'}"
            )
        name, entry = meant[header]
        scale = DEGREES if header.endswith("_deg") else 1.0
        empty = np.full((len(table), *shapes[name]), np.nan)
        values.setdefault(name, empty)[(slice(None), *entry)] = (
            table.numbers(header, may_miss=True) / scale
        )
    return make_targets(Targets(values), robot, several=True)


def _columns(robot: Robot) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Return by its header the quantity and entry of every column of single numbers."""
    columns = {f"{DIRECTION}_{axis}": (DIRECTION, (i,)) for i, axis in enumerate(AXES)}
    for name, shape in target_shapes(robot).items():
        quantity = REGISTERED.get(name)
        if quantity and quantity.column and quantity.per in ((), ("axis",), ("notch",)):
            for entry in np.ndindex(shape):
                labels = zip(quantity.per, entry_names(quantity.per, entry), strict=True)
                columns[quantity.header(**dict(labels))] = name, entry
    return columns


# A position is near a robot whose straight length it is a part from the first to the second of.
_LENGTH_RATIOS = (0.2, 2.0)
# Sizes of other units, mm.
_UNITS = {"m": 1000.0, "µm": 0.001}


def unit_hint(robot: Robot, position: Float[np.ndarray, " 3"]) -> str:
    """Say in which unit a position (mm, NaN where free) out of reach would be near the robot."""
    size = float(np.sqrt(np.nansum(position**2))) / robot.geometry.length
    low, high = _LENGTH_RATIOS
    for unit, scale in _UNITS.items():
        if low <= size * scale <= high:
            return f"; positions are in mm, and this one would be near the robot in {unit}"
    return ""
