"""The picture of a batch: every quantity over its rows, and the positions of the tips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from notchflex import InputError
from notchflex.plotting.curves import TIP_LABELS
from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BESIDE, Curve, Mark, Panel, dots, grid
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.support import QUANTITIES

if TYPE_CHECKING:
    from notchflex import Batch

MAX_COLUMNS = 12
"""Entries of a quantity, such as notches, that are drawn; of more, an even selection."""

_LEFT_OUT = ("converged", "reason", "iterations", "tip_position", "stable")


def batch_picture(
    batch: Batch,
    *,
    against: ArrayLike | None = None,
    label: str = "row [number]",
    title: str = "batch",
) -> Picture:
    """Describe what a batch returned.

    A panel for every quantity with one number, or one for each tendon or notch, over the rows or
    over `against`; and the positions of the tips, if the batch has them. Of a batch of paths the
    last step of each is drawn. Rows that did not converge are gaps in the curves and red tips.

    Args:
        batch: What `solve_batch` or `simulate_batch` returned.
        against: Values for the horizontal axis, (rows,), such as tensions; row numbers if None.
        label: Label of this axis, with its unit.
        title: Heading.

    Raises:
        InputError: The number of values is not that of the rows, or there is nothing to draw.

    Example:
        >>> import numpy as np
        >>> import notchflex as nf
        >>> found = nf.solve_batch(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=20))
        >>> picture = batch_picture(found, against=np.linspace(0.0, 2.0, 20), label="tension [N]")
        >>> picture.cells[-1].panel.x_label
        'tip position x [mm]'
    """
    rows = len(next(iter(batch.values()), ()))
    x = np.arange(1.0, rows + 1.0) if against is None else np.asarray(against, float)
    if x.shape != (rows,):
        raise InputError.WRONG_SHAPE(
            f"the batch has {rows} rows, and against has the shape {x.shape}; give one value a row."
        )
    converged = _last(batch, "converged")
    converged = np.ones(rows, bool) if converged is None else converged.astype(bool)
    panels = [
        panel
        for name in batch
        if name in QUANTITIES and name not in _LEFT_OUT
        if (panel := _over_rows(batch, name, x, label, converged)) is not None
    ]
    tips = _last(batch, "tip_position")
    if tips is not None:
        panels.append(_tips(tips, converged))
    if not panels:
        raise InputError.NO_DATA(
            "the batch holds nothing that can be drawn; ask for outputs such as total_angle, "
            "notch_angle or tip_position."
        )
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    return Picture(title, 1.0 + 4.4 * columns, 0.6 + 3.2 * lines, grid(panels, columns))


def _last(batch: Batch, name: str) -> NDArray[Any] | None:
    """Return the values of a quantity, of paths at their last step; None if there are none."""
    if name not in batch:
        return None
    values = np.asarray(batch[name])
    quantity = QUANTITIES[name]
    return values[:, -1] if values.ndim > 1 + len(quantity.per) else values


def _over_rows(
    batch: Batch, name: str, x: NDArray[np.float64], label: str, converged: NDArray[np.bool_]
) -> Panel | None:
    quantity = QUANTITIES[name]
    values = _last(batch, name)
    if values is None or values.dtype.kind not in "fi" or values.ndim > 2:
        return None
    table = np.where(converged[:, None], values.reshape(len(values), -1) * quantity.scale, np.nan)
    if not np.isfinite(table).any():
        return None
    count = table.shape[1]
    shown = np.unique(np.linspace(0, count - 1, min(count, MAX_COLUMNS)).round().astype(int))
    order = np.argsort(x, kind="stable")
    items: list[Mark] = []
    for column, colour in zip(shown, sequence_colours(len(shown)), strict=True):
        one = f"{quantity.per[0]} {column + 1}" if quantity.per and count > 1 else ""
        points = np.stack([x[order], table[order, column]], axis=1)
        options: dict[str, Any] = {"marker": "o", "size": 2.0, "width": 0.8, "hover": True}
        items.append(Curve(points, colour if count > 1 else BLUE, name=one, group=one, **options))
    return Panel(items, label, quantity.label, legend=BESIDE if count > 1 else "")


def _tips(tips: NDArray[np.float64], converged: NDArray[np.bool_]) -> Panel:
    items: list[Mark] = [dots(tips[converged][:, [0, 2]], BLUE, 2.5, hover=True, group="tip")]
    if not converged.all():
        name = "not converged"
        items.append(dots(tips[~converged][:, [0, 2]], VERMILLION, 2.5, name=name, group=name))
    return Panel(items, *TIP_LABELS, equal=True, legend="" if converged.all() else BESIDE)
