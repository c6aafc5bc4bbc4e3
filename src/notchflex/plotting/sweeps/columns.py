"""The picture of a sweep: one column over another, with what lies between its quantiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import InputError
from notchflex.plotting.axes_of_quantities import entry_label
from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BESIDE, Area, Curve, Mark, Panel, dots, grid
from notchflex.plotting.style import BLUE, ORANGE, VERMILLION
from notchflex.support import REGISTERED, described_at, nearest

if TYPE_CHECKING:
    from notchflex.sweeping import Sweep

MAX_POINTS = 2000
"""Rows that are drawn; of more, an even selection."""

_BINS = 24
_MIN_PER_BIN = 20
"""A bin with fewer rows has no quantiles."""


def sweep_picture(sweep: Sweep, x: str, y: str) -> Picture:
    """Describe one column of a sweep over another.

    Rows as points, rejected ones in another colour; where there are many, the median and the band
    that holds 95 % of them, along x. Rows without a result lie on the axis of x.

    Args:
        sweep: The sweep.
        x: A variable or a kept quantity.
        y: Another one.

    Raises:
        InputError: There is no such column, or no row.
    """
    import polars

    frame = sweep.lazy()
    columns = [one for one in frame.collect_schema().names() if one != "code"]
    for name in (x, y):
        if name == "code":
            raise InputError.UNSUPPORTED(
                "`code` is text, and text has no axis; it is shown by the colour of points."
            )
        if name not in columns:
            raise InputError.UNKNOWN_NAME(
                f'the sweep has no column "{name}"{nearest(name, columns)}; there are '
                f"{', '.join(columns)}."
            )
    if sweep.rows > MAX_POINTS and sweep.plan.output.rows:
        # Every k-th row would be a regular part of a grid or of a Sobol sequence.
        scattered = polars.col("row") % 2**31 * 2_654_435_761 % 2**32
        frame = frame.filter(scattered < 2**32 * MAX_POINTS // sweep.rows)
    table = frame.select("row", "code", polars.col(x).alias("x"), polars.col(y).alias("y"))
    table = table.collect()
    code = table["code"].cast(str).to_numpy()
    both = table.select("x", "y").cast(polars.Float64).to_numpy()
    is_finite = np.isfinite(both).all(axis=1)
    if not np.isfinite(both[:, 0]).any():
        raise InputError.NO_DATA(f"no row has a number of {x}.")
    items: list[Mark] = []
    for name, colour in (("accepted", BLUE), ("rejected", ORANGE)):
        chosen = is_finite & (code == name)
        if chosen.any():
            items.append(dots(both[chosen], colour, 1.6, name=name, group=name))
    if is_finite.sum() >= _MIN_PER_BIN * _BINS:
        items += _band(both[is_finite])
    lost = ~is_finite & np.isfinite(both[:, 0])
    if lost.any():
        floor = both[is_finite, 1].min() if is_finite.any() else 0.0
        positions = np.column_stack([both[lost, 0], np.full(lost.sum(), floor)])
        items.append(dots(positions, VERMILLION, 4.0, name="no result", group="lost", marker="X"))
    panel = Panel(items, _label(sweep, x), _label(sweep, y), legend=BESIDE)
    title = f"{sweep.plan.name}: {sweep.rows} rows"
    return Picture(title, 6.4, 4.8, grid([panel], 1))


def _band(both: np.ndarray) -> list[Mark]:
    """Return the median and the band of 95 % along x: at its values if these are few.

    Otherwise they are those of bins of equally many rows.
    """
    values, of = np.unique(both[:, 0], return_inverse=True)
    if len(values) <= _BINS:
        parts = [both[of == number] for number in range(len(values))]
    else:
        order = np.argsort(both[:, 0], kind="stable")
        parts = np.array_split(both[order], _BINS)
    middle = np.array([np.median(one[:, 0]) for one in parts])
    keep = np.concatenate([[True], np.diff(middle) > 0.0])
    low, half, high = (
        np.array([np.quantile(one[:, 1], part) for one in parts])[keep]
        for part in (0.025, 0.5, 0.975)
    )
    middle = middle[keep]
    if len(middle) < 3:
        return []
    ring = np.concatenate([np.column_stack([middle, low]), np.column_stack([middle, high])[::-1]])
    return [
        Area([ring], BLUE, BLUE, opacity=0.15, name="95 % of rows", group="band", layer=3),
        Curve(np.column_stack([middle, half]), "black", name="median", group="median", layer=4),
    ]


def _label(sweep: Sweep, name: str) -> str:
    """Return the label of an axis, with its unit."""
    variables: list[Any] = [one.value for one in sweep.plan.variable]
    if name in variables:
        unit = described_at(sweep.robot, name).unit
        return f"{name} [{unit}]" if unit else name
    kept = {one.quantity for one in sweep.plan.keep}
    fitting = [one for one in kept if f"{name}_".startswith(f"{one}_")]
    if not fitting:
        return name
    quantity = REGISTERED[max(fitting, key=len)]
    words = name.removeprefix(quantity.name).strip("_").split("_")
    entry = " ".join(
        word if axis == "axis" else f"{axis} {word}"
        for axis, word in zip(quantity.per, words, strict=False)
    )
    loads = sweep.plan.load if len(sweep.plan.load) > 1 else ()
    at = [f"at {one}" for one in loads if f"_at_{one}" in name]
    step = name.rpartition("_step_")[2] if "_step_" in name else ""
    at += [f"step {step}"] if step.isdecimal() else []
    return ", ".join([entry_label(quantity, entry), *at])
