"""The picture of targets that were followed: the way of the tip, the drives, and the errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BELOW, BESIDE, Cell, Curve, Mark, Panel, Span, dots, stack
from notchflex.plotting.style import BLUE, GREY, ORANGE, VERMILLION, sequence_colours
from notchflex.results.quantities.registry import AXES, QUANTITIES

if TYPE_CHECKING:
    from notchflex.control import Following

_NUMBER = "target [number]"
# Errors below this are drawn at it: zero has no place on a logarithmic axis.
_MIN_ERROR = 1e-16
# Out of a plane by less than this (mm) is in it.
_IN_PLANE = 1e-6


def following_picture(found: Following, *, title: str = "") -> Picture:
    """Describe targets that were followed.

    Left the path of the tip with the target positions; right the tension of every tendon over the
    targets, and how far each target was missed.

    Args:
        found: The result of `notchflex.follow`.
        title: Heading; the name of the robot where not given.

    Example:
        >>> import notchflex as nf
        >>> found = nf.follow(nf.load_robot("pacheco2021-a"), [(2.1, 0, 9.5), (2.4, 0, 9.3)])
        >>> [cell.panel.y_label for cell in following_picture(found).cells][1]
        'tendon tension $T$ [N]'
    """
    cells = [Cell(_tips(found), 0, 0, 2), *stack([_drives(found), _errors(found)], 1)]
    return Picture(title or f"Targets followed by {found.robot.name}", 9.6, 5.0, cells)


def _tips(following: Following) -> Panel:
    """Positions of the tip and targets, in a plane if they lie in one."""
    every, goals = following.path.tip_position, following.targets.values.get("tip_position")
    spread = np.ptp(every, axis=0)
    flat = int(np.argmin(spread[:2])) if spread[:2].min() < _IN_PLANE else None
    axes = [axis for axis in range(3) if axis != flat]
    via = np.setdiff1d(np.arange(len(every)), following.step)
    items: list[Mark] = [Curve(every[:, axes], BLUE, name="tip")]
    if goals is not None:
        items.append(dots(goals[:, axes], GREY, 4.0, hollow=True, name="target", layer=1))
    if len(via):
        items.append(dots(every[via][:, axes], ORANGE, name="overshoot", layer=3))
    not_reached = ~following.reached
    if not_reached.any():
        ends = following.tip_position[not_reached][:, axes]
        items.append(dots(ends, VERMILLION, 4.0, name="nearest", layer=4))
    tip = QUANTITIES["tip_position"]
    if flat is not None:
        labels = [f"{tip.title} {AXES[axis]} [{tip.unit}]" for axis in axes]
        return Panel(items, *labels, equal=True, legend=BELOW)
    # In space the labels stand close to each other, and the upright one needs room beside it.
    labels = [f"{axis} [{tip.unit}]" for axis in AXES]
    return Panel(items, *labels, equal=True, legend=BESIDE)


def _drives(following: Following) -> Panel:
    number, tendons = np.arange(1.0, len(following) + 1.0), following.tension.shape[1]
    items: list[Mark] = [
        Curve(
            np.stack([number, following.tension[:, tendon]], axis=1),
            colour,
            name=f"tendon {tendon + 1}" if tendons > 1 else "",
            hover=True,
        )
        for tendon, colour in enumerate(sequence_colours(tendons))
    ]
    label = QUANTITIES["tension"].label
    return Panel(items, _NUMBER, label, legend=BESIDE if tendons > 1 else "", shared="x")


def _errors(following: Following) -> Panel:
    number = np.arange(1.0, len(following) + 1.0)
    size = np.log10(np.maximum(following.error, _MIN_ERROR))
    points = np.stack([number, size], axis=1)
    items: list[Mark] = [Curve(points, BLUE, marker="o", size=2.0, hover=True)]
    tolerance = float(np.log10(following.tolerance))
    items.append(Span("y", tolerance, tolerance, GREY, name="tolerance"))
    return Panel(items, _NUMBER, "log10 of the error [mm, rad]", legend=BESIDE, shared="x")
