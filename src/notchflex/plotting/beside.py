"""The picture of several robots, or one robot under several models, under the same loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import InputError
from notchflex.plotting.curves import (
    LINE,
    LOADING,
    NOTCH_LABEL,
    SLACK,
    TIP_LABELS,
    UNLOADING,
    abscissa,
    branch_lines,
    converged_only,
    failures,
    span_line,
    steps_by_branch,
)
from notchflex.plotting.fits.comparison import MODEL_COLOURS
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.panel import plane_of, representative_steps, shape_panel
from notchflex.plotting.sheet import BELOW, Cell, Colour, Curve, Mark, Note, Panel, dots, stack
from notchflex.plotting.style import GREY, rgb
from notchflex.support import QUANTITIES

if TYPE_CHECKING:
    from notchflex import EquilibriumPath

MAX_ROBOTS = len(MODEL_COLOURS)
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
    if not 2 <= len(paths) <= MAX_ROBOTS:
        raise InputError.OUT_OF_RANGE(
            f"a picture shows 2 to {MAX_ROBOTS} robots beside each other; got {len(paths)}."
        )
    colours = dict(zip(paths, MODEL_COLOURS, strict=False))
    cells: list[Cell] = []
    for column, (label, path) in enumerate(paths.items()):
        steps = representative_steps(path, most=_SHAPES)
        shades: list[Colour] = []
        for pale in np.linspace(0.55, 0.0, len(steps)):
            shades.append(tuple(one + pale * (1.0 - one) for one in rgb(colours[label])))
        panel = shape_panel(path, steps, plane_of(path), title=label, colours=shades, legend=BELOW)
        cells.append(Cell(panel, 0, column, 2))
    notches, tensions = _most_bent_states(paths, colours)
    cells += stack([_angles(paths, colours), notches], len(paths))
    cells += stack([_travel(paths, colours), tensions], len(paths) + 1)
    legend = [Curve([], colours[label], name=label, group=label) for label in paths]
    if any(len(steps_by_branch(path)) > 1 for path in paths.values()):
        legend += [Curve([], GREY, LINE[way], name=way) for way in (LOADING, UNLOADING)]
    heading = title or "; ".join(dict.fromkeys(path.robot.name for path in paths.values()))
    return Picture(heading, 1.2 + 3.6 * (len(paths) + 2), 6.8, cells, legend)


def _most_bent(path: EquilibriumPath) -> int | None:
    """Return the converged step with the most bent notches; None if there is none."""
    return next(reversed(representative_steps(path)), None)


def _angles(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    quantity = QUANTITIES["total_angle"]
    items: list[Mark] = []
    labels: set[str] = set()
    for name, path in paths.items():
        x, label = abscissa(path)
        labels.add(label)
        points = np.stack([x, path.total_angle * quantity.scale], axis=1)
        items += [*branch_lines(path, points, colours[name], "", group=name), *failures(path, x)]
    # One label for all, if they are drawn against the same quantity.
    return Panel(items, labels.pop() if len(labels) == 1 else "load of each", quantity.label)


def _travel(paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]) -> Panel:
    items: list[Mark] = []
    for name, path in paths.items():
        tip = converged_only(path, path.tip_position)[:, [0, 2]]
        items += branch_lines(path, tip, colours[name], "", group=name)
        step = _most_bent(path)
        if step is not None:
            items.append(dots(tip[step : step + 1], colours[name], 4.0, group=name))
    return Panel(items, *TIP_LABELS, equal=True)


def _most_bent_states(
    paths: Mapping[str, EquilibriumPath], colours: Mapping[str, Colour]
) -> tuple[Panel, Panel]:
    """Return the notch angles, and the tension along the first pulled tendon, when most bent."""
    quantity = QUANTITIES["notch_angle"]
    angles: list[Mark] = []
    tensions: list[Mark] = []
    least = 0.0
    for name, path in paths.items():
        step = _most_bent(path)
        if step is None:
            continue
        angle = path.notch_angle[step] * quantity.scale
        least = min(least, float(angle.min()))
        points = np.stack([np.arange(1, len(angle) + 1), angle], axis=1)
        style: dict[str, Any] = {"marker": "o", "size": 2.5, "group": name, "hover": True}
        angles.append(Curve(points, colours[name], **style))
        pulled = path.tension[step] > SLACK
        if pulled.any():
            tendon = int(np.argmax(pulled))
            tensions.append(span_line(path, step, tendon, colours[name], group=name))
    labels = "span [number], first pulled tendon", QUANTITIES["span_tension"].label
    return (
        _state_panel(angles, "no step was solved", NOTCH_LABEL, quantity.label, least >= 0.0),
        _state_panel(tensions, "no tendon is pulled", *labels, True),
    )


def _state_panel(items: list[Mark], note: str, x: str, y: str, positive: bool) -> Panel:
    if not items:
        return Panel([Note(note)], x, y, whole="x")
    y_range = (0.0, None) if positive else None
    return Panel(items, x, y, title="most bent state", y_range=y_range, whole="x")
