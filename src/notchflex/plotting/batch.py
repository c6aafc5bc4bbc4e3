"""The picture of a batch: every quantity it holds over its rows, and where its tips lie."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from notchflex.errors import InputError
from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BESIDE, Cell, Item, Line, Panel
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.analysis import Batch

MOST_COLUMNS = 12
"""Entries of a quantity, such as its notches, that are drawn; of more, some spread evenly."""

_LEFT_OUT = ("converged", "reason", "iterations", "tip_position", "stable")


def batch_picture(
    batch: Batch,
    *,
    against: ArrayLike | None = None,
    label: str = "row [number]",
    title: str = "batch",
) -> Picture:
    """Describe what a batch returned.

    Every quantity with one number, or one for each tendon or notch, in a panel over the rows, or
    over what was changed from row to row; and the tips from the side, where they were asked for.
    Of a batch of paths the last step of each is drawn. Rows that did not converge are left out of
    the curves and marked in red among the tips.

    Args:
        batch: What `solve_batch` or `simulate_batch` returned.
        against: What the rows differ in, (rows,), such as the tensions; the row numbers if None.
        label: What the axis of it is called, with its unit.
        title: Heading.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.

    Raises:
        InputError: As many values as rows are needed; or the batch has nothing to draw.

    Example:
        >>> import numpy as np
        >>> import notchflex as nf
        >>> found = nf.solve_batch(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=20))
        >>> picture = batch_picture(found, against=np.linspace(0.0, 2.0, 20), label="tension [N]")
        >>> picture.cells[-1].panel.x_label
        'tip position x [mm]'
    """
    first = next(iter(batch.values()))
    rows = len(first)
    x = np.arange(1.0, rows + 1.0) if against is None else np.asarray(against, float)
    if x.shape != (rows,):
        raise InputError.WRONG_SHAPE(
            f"the batch has {rows} rows, and against has the shape {x.shape}; give one value a row."
        )
    good = _last(batch, "converged")
    good = np.ones(rows, bool) if good is None else good.astype(bool)
    panels = [
        panel
        for name in batch
        if name in QUANTITIES and name not in _LEFT_OUT
        if (panel := _over_rows(batch, name, x, label, good)) is not None
    ]
    tips = _last(batch, "tip_position")
    if tips is not None:
        panels.append(_tips(tips, good))
    if not panels:
        raise InputError.NO_DATA(
            "the batch holds nothing that can be drawn; ask for outputs such as total_angle, "
            "notch_angle or tip_position."
        )
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    cells = [
        Cell(panel, (row, row + 1), (column, column + 1))
        for panel, (row, column) in zip(panels, np.ndindex(lines, columns), strict=False)
    ]
    return Picture(title, 1.0 + 4.4 * columns, 0.6 + 3.2 * lines, cells)


def _last(batch: Batch, name: str) -> NDArray[Any] | None:
    """What a batch has of a quantity, of paths at their last step; None if it has it not."""
    if name not in batch:
        return None
    values = np.asarray(batch[name])
    quantity = QUANTITIES[name]
    return values[:, -1] if values.ndim > 1 + len(quantity.per) else values


def _over_rows(
    batch: Batch, name: str, x: NDArray[np.float64], label: str, good: NDArray[np.bool_]
) -> Panel | None:
    quantity = QUANTITIES[name]
    values = _last(batch, name)
    if values is None or values.dtype.kind not in "fi" or values.ndim > 2:
        return None
    table = np.where(good[:, None], values.reshape(len(values), -1) * quantity.scale, np.nan)
    if not np.isfinite(table).any():
        return None
    count = table.shape[1]
    shown = np.unique(np.linspace(0, count - 1, min(count, MOST_COLUMNS)).round().astype(int))
    order = np.argsort(x, kind="stable")
    items: list[Item] = []
    for column, colour in zip(shown, sequence_colours(len(shown)), strict=True):
        one = f"{quantity.per[0]} {column + 1}" if quantity.per and count > 1 else ""
        points = np.stack([x[order], table[order, column]], axis=1)
        options: dict[str, Any] = {"marker": "o", "size": 2.0, "width": 0.8, "told": True}
        items.append(Line(points, colour if count > 1 else BLUE, name=one, group=one, **options))
    return Panel(items, label, quantity.label, legend=BESIDE if count > 1 else "")


def _tips(tips: NDArray[np.float64], good: NDArray[np.bool_]) -> Panel:
    quantity = QUANTITIES["tip_position"]
    mark: dict[str, Any] = {"dash": None, "marker": "o", "size": 2.5}
    items: list[Item] = [Line(tips[good][:, [0, 2]], BLUE, told=True, group="tip", **mark)]
    if not good.all():
        bad = tips[~good][:, [0, 2]]
        items.append(Line(bad, VERMILLION, name="not converged", group="not converged", **mark))
    unit = f"[{quantity.unit}]"
    return Panel(
        items,
        f"{quantity.title} x {unit}",
        f"{quantity.title} z {unit}",
        equal=True,
        legend="" if good.all() else BESIDE,
    )
