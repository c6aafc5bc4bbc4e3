"""Several robots, or one robot under several models, beside each other under the same loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex.errors import InputError
from notchflex.plotting.along import SLACK
from notchflex.plotting.curves import LINE, failures, solved_only
from notchflex.plotting.drive import LOADING, UNLOADING, abscissa, branches, drive, way_of
from notchflex.plotting.fits.comparison import MODEL_COLOURS
from notchflex.plotting.output import Picture
from notchflex.plotting.path import plane_of, shape_panel
from notchflex.plotting.shapes.wrist import telling_steps
from notchflex.plotting.sheet import BELOW, Cell, Colour, Item, Line, Note, Panel
from notchflex.plotting.style import GREY, rgb
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.results.quantities.spans import spans_of

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

MOST = len(MODEL_COLOURS)
"""More robots than this cannot be told apart by colour."""

_SHAPES = 3


def beside_picture(paths: Mapping[str, EquilibriumPath], *, title: str = "") -> Picture:
    """Describe several solved paths beside each other: other robots, or other models of one.

    Every robot to scale at a few loads, in the colour that it has in the curves too: total angle
    and travel of the tip over the loads, and at the most bent state of each the angle of every
    notch and the tension along the first pulled tendon. Solid lines are loading, dashed ones
    unloading.

    Args:
        paths: Label to path, two to five of them.
        title: Heading.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.

    Raises:
        InputError: Too few or too many paths.

    Example:
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> loop = nf.pull(0.0, 2.0, steps=5).release()
        >>> slick = wrist.with_value("friction.coefficient", 0.0)
        >>> paths = {"mu 0.13": nf.simulate(wrist, loop), "mu 0": nf.simulate(slick, loop)}
        >>> [cell.panel.title for cell in beside_picture(paths).cells[:2]]
        ['mu 0.13', 'mu 0']
    """
    if not 2 <= len(paths) <= MOST:
        raise InputError.OUT_OF_RANGE(
            f"a picture shows 2 to {MOST} robots beside each other; got {len(paths)}."
        )
    colours = dict(zip(paths, MODEL_COLOURS, strict=False))
    cells: list[Cell] = []
    for column, (label, path) in enumerate(paths.items()):
        steps = telling_steps(path, most=_SHAPES)
        shades = [_pale(colours[label], part) for part in np.linspace(0.55, 0.0, len(steps))]
        panel = shape_panel(path, steps, plane_of(path), label, shades, BELOW)
        cells.append(Cell(panel, (0, 2), (column, column + 1)))
    curves = [_angles(paths, colours), _notches(paths, colours)]
    curves += [_travel(paths, colours), _tensions(paths, colours)]
    for index, panel in enumerate(curves):
        row, column = index % 2, len(paths) + index // 2
        cells.append(Cell(panel, (row, row + 1), (column, column + 1)))
    legend = [Line([], colours[label], name=label, group=label) for label in paths]
    if any(len(way_of(path)) > 1 for path in paths.values()):
        legend += [Line([], GREY, LINE[way], name=way) for way in (LOADING, UNLOADING)]
    heading = title or "; ".join(dict.fromkeys(path.robot.name for path in paths.values()))
    return Picture(heading, 1.2 + 3.6 * (len(paths) + 2), 6.8, cells, legend)


def most_bent(path: EquilibriumPath) -> int | None:
    """Return the converged step at which the notches are bent most; None without any."""
    steps = telling_steps(path)
    return steps[-1] if steps else None


def _pale(colour: Colour, part: float) -> Colour:
    return tuple(one + part * (1.0 - one) for one in rgb(colour))


def _angles(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["total_angle"]
    items: list[Item] = []
    labels: list[str] = []
    for label, path in paths.items():
        x, x_label = abscissa(path)
        labels.append(x_label)
        y = solved_only(path, path.total_angle * quantity.scale)
        items += _loop(path, np.stack([x, y], axis=1), label, colours[label])
        items += failures(path, x)
    # One name for all, where they are drawn against the same.
    together = labels[0] if len(set(labels)) == 1 else "load of each"
    return Panel(items, together, quantity.label)


def _travel(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["tip_position"]
    items: list[Item] = []
    for label, path in paths.items():
        tip = solved_only(path, path.tip_position)
        items += _loop(path, tip[:, [0, 2]], label, colours[label])
        where = most_bent(path)
        if where is not None:
            mark: dict[str, Any] = {"dash": None, "marker": "o", "size": 4.0, "group": label}
            items.append(Line(tip[where : where + 1, [0, 2]], colours[label], **mark))
    unit = f"[{quantity.unit}]"
    return Panel(items, f"{quantity.title} x {unit}", f"{quantity.title} z {unit}", equal=True)


def _dots(points: np.ndarray, colours: Mapping[str, Colour], label: str, size: float) -> Line:
    """A line with a dot at every point, which tells its numbers."""
    return Line(points, colours[label], marker="o", size=size, group=label, told=True)


def _notches(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["notch_angle"]
    items: list[Item] = []
    least = 0.0
    for label, path in paths.items():
        step = most_bent(path)
        if step is None:
            continue
        angle = path.notch_angle[step] * quantity.scale
        least = min(least, float(angle.min()))
        points = np.stack([np.arange(1, len(angle) + 1), angle], axis=1)
        items.append(_dots(points, colours, label, size=2.5))
    return Panel(
        items or [Note("no step was solved")],
        "notch [number], 1 at the base",
        quantity.label,
        title="where bent most" if items else "",
        y_range=(0.0, None) if least >= 0.0 and items else None,
        whole_x=True,
    )


def _tensions(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["span_tension"]
    items: list[Item] = []
    for label, path in paths.items():
        step = most_bent(path)
        if step is None or not (path.tension[step] > SLACK).any():
            continue
        tendon = int(np.argmax(path.tension[step] > SLACK))
        number = np.arange(spans_of(path, tendon))
        points = np.stack([number, path.span_tension[step, tendon, : len(number)]], axis=1)
        items.append(_dots(points, colours, label, size=1.8))
    return Panel(
        items or [Note("no tendon is pulled")],
        "span [number], first pulled tendon",
        quantity.label,
        title="where bent most" if items else "",
        y_range=(0.0, None) if items else None,
        whole_x=True,
    )


def _loop(path: EquilibriumPath, points: np.ndarray, label: str, colour: Colour) -> list[Item]:
    return [
        Line(
            points[part],
            colour,
            LINE[LOADING if growing else UNLOADING],
            marker="o" if part.stop - part.start == 1 else "",
            group=label,
            told=True,
        )
        for part, growing in branches(drive(path))
    ]
