"""The picture of several robots, or one robot under several models, under the same loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex.errors import InputError
from notchflex.plotting.branches import LOADING, UNLOADING, abscissa, steps_by_branch
from notchflex.plotting.curves import LINE, branch_lines, converged_only, failures
from notchflex.plotting.fits.comparison import MODEL_COLOURS
from notchflex.plotting.picture import Picture
from notchflex.plotting.shapes.panel import plane_of, representative_steps, shape_panel
from notchflex.plotting.sheet import BELOW, Cell, Colour, Curve, Mark, Note, Panel, dots, stack
from notchflex.plotting.style import GREY, rgb
from notchflex.plotting.tendon_profiles import SLACK, span_line
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

MOST = len(MODEL_COLOURS)
"""The number of robots that colours can distinguish."""

_SHAPES = 3


def beside_picture(paths: Mapping[str, EquilibriumPath], *, title: str = "") -> Picture:
    """Describe several solved paths: different robots, or different models of one robot.

    Every robot to scale at a few loads, in the colour of its curves: total angle and position of
    the tip over the loads, and for the most bent state the angle of every notch and the tension
    along the first pulled tendon. Solid lines are loading, dashed ones unloading.

    Args:
        paths: Label to path, two to five of them.
        title: Heading.

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
        steps = representative_steps(path, most=_SHAPES)
        shades = [_pale(colours[label], part) for part in np.linspace(0.55, 0.0, len(steps))]
        panel = shape_panel(path, steps, plane_of(path), title=label, colours=shades, legend=BELOW)
        cells.append(Cell(panel, 0, column, 2))
    curves = [_angles(paths, colours), _notches(paths, colours)]
    cells += stack(curves, len(paths))
    cells += stack([_travel(paths, colours), _tensions(paths, colours)], len(paths) + 1)
    legend = [Curve([], colours[label], name=label, group=label) for label in paths]
    if any(len(steps_by_branch(path)) > 1 for path in paths.values()):
        legend += [Curve([], GREY, LINE[way], name=way) for way in (LOADING, UNLOADING)]
    heading = title or "; ".join(dict.fromkeys(path.robot.name for path in paths.values()))
    return Picture(heading, 1.2 + 3.6 * (len(paths) + 2), 6.8, cells, legend)


def _most_bent(path: EquilibriumPath) -> int | None:
    """Return the converged step with the most bent notches; None if there is none."""
    return next(reversed(representative_steps(path)), None)


def _pale(colour: Colour, part: float) -> Colour:
    return tuple(one + part * (1.0 - one) for one in rgb(colour))


def _angles(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["total_angle"]
    items: list[Mark] = []
    labels: list[str] = []
    for label, path in paths.items():
        x, x_label = abscissa(path)
        labels.append(x_label)
        points = np.stack([x, path.total_angle * quantity.scale], axis=1)
        items += branch_lines(path, points, colours[label], "", group=label)
        items += failures(path, x)
    # One label for all, if they are drawn against the same quantity.
    return Panel(items, labels[0] if len(set(labels)) == 1 else "load of each", quantity.label)


def _travel(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["tip_position"]
    items: list[Mark] = []
    for label, path in paths.items():
        tip = converged_only(path, path.tip_position)[:, [0, 2]]
        items += branch_lines(path, tip, colours[label], "", group=label)
        step = _most_bent(path)
        if step is not None:
            items.append(dots(tip[step : step + 1], colours[label], 4.0, group=label))
    unit = f"[{quantity.unit}]"
    return Panel(items, f"{quantity.title} x {unit}", f"{quantity.title} z {unit}", equal=True)


def _notches(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["notch_angle"]
    items: list[Mark] = []
    least = 0.0
    for label, path in paths.items():
        step = _most_bent(path)
        if step is None:
            continue
        angle = path.notch_angle[step] * quantity.scale
        least = min(least, float(angle.min()))
        points = np.stack([np.arange(1, len(angle) + 1), angle], axis=1)
        look: dict[str, Any] = {"marker": "o", "size": 2.5, "group": label, "hover": True}
        items.append(Curve(points, colours[label], **look))
    return Panel(
        items or [Note("no step was solved")],
        "notch [number], 1 at the base",
        quantity.label,
        title="most bent state" if items else "",
        y_range=(0.0, None) if least >= 0.0 and items else None,
        whole="x",
    )


def _tensions(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    items: list[Mark] = []
    for label, path in paths.items():
        step = _most_bent(path)
        if step is None or not (path.tension[step] > SLACK).any():
            continue
        tendon = int(np.argmax(path.tension[step] > SLACK))
        items.append(span_line(path, step, tendon, colours[label], group=label))
    return Panel(
        items or [Note("no tendon is pulled")],
        "span [number], first pulled tendon",
        QUANTITIES["span_tension"].label,
        title="most bent state" if items else "",
        y_range=(0.0, None) if items else None,
        whole="x",
    )
