"""The pictures of targets that were followed, and of sensed forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import (
    BELOW,
    BESIDE,
    Area,
    Cell,
    Curve,
    Mark,
    Panel,
    Span,
    dots,
    stack,
)
from notchflex.plotting.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILLION, sequence_colours
from notchflex.support import AXES, QUANTITIES

if TYPE_CHECKING:
    from notchflex.control import Following
    from notchflex.sensing import SensedForce


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
    of_unit = {
        "mm": (following.error_mm, following.tolerance, BLUE),
        "deg": (following.error_deg, np.degrees(following.angle_tolerance), ORANGE),
    }
    items: list[Mark] = []
    for unit in (unit for unit in of_unit if unit in following.units):
        error, tolerance, colour = of_unit[unit]
        points = np.stack([number, np.log10(np.maximum(error, _MIN_ERROR))], axis=1)
        items.append(Curve(points, colour, marker="o", size=2.0, name=f"error, {unit}", hover=True))
        level = float(np.log10(max(tolerance, _MIN_ERROR)))
        items.append(Span("y", level, level, GREY, name=f"tolerance, {unit}"))
    return Panel(items, _NUMBER, "log10 of the error [mm, deg]", legend=BESIDE, shared="x")


def sensed_picture(sensed: SensedForce, *, truth: NDArray[np.float64] | None = None) -> Picture:
    """Describe a sensed force along its readings, with the readings below.

    A panel for every component: the force, the interval that noise and stuck friction leave, the
    part of it by noise alone, and readings that show contact; below tensions and strokes.

    Args:
        sensed: The force.
        truth: The true components, N, (s, d), of a simulated history.

    Example:
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> touched = nf.simulate(wrist, nf.pull(0.1, 0.4, steps=3).loaded(tip_force=(0.02, 0, 0)))
        >>> picture = sensed_picture(nf.sense(wrist, touched.tension, touched.stroke))
        >>> picture.cells[0].panel.y_label
        'force along x [N]'
    """
    x = np.arange(1.0, len(sensed) + 1.0)
    panels = [_component(sensed, which, x, truth) for which in range(len(sensed.components))]
    if sensed.path is not None:
        panels += _readings(sensed, x)
    where = "the tip" if sensed.place is None else f"body {sensed.place}"
    title = f"Force on {where} of {sensed.robot.name}"
    return Picture(title, 7.2, 0.8 + 2.5 * len(panels), stack(panels))


def _component(
    sensed: SensedForce, which: int, x: NDArray[np.float64], truth: NDArray[np.float64] | None
) -> Panel:
    force, spread = sensed.force[:, which], 1.96 * sensed.deviation[:, which]
    spread = np.minimum(spread, sensed.largest)
    is_known = np.isfinite(force)
    whole = _band(x[is_known], sensed.low[is_known, which], sensed.high[is_known, which])
    noise = _band(x[is_known], (force - spread)[is_known], (force + spread)[is_known])
    items: list[Mark] = [
        Area([whole], ORANGE, ORANGE, opacity=0.3, name="noise and stuck friction", group="all"),
        Area([noise], BLUE, BLUE, opacity=0.25, name="noise alone, to first order", group="noise"),
        Curve(np.stack([x, force], 1), BLUE, name="sensed", group="sensed", marker="o", hover=True),
    ]
    if truth is not None:
        line = np.stack([x, np.asarray(truth)[:, which]], axis=1)
        items.append(Curve(line, BLACK, dash=(4.0, 2.0), name="true", group="true"))
    touched = sensed.contact
    if touched.any():
        points = np.stack([x[touched], force[touched]], axis=1)
        items.append(dots(points, GREEN, 5.0, name="contact shown", group="contact", layer=5))
    name = sensed.components[which]
    legend = BESIDE if which == len(sensed.components) - 1 else ""
    return Panel(items, "reading [number]", f"force along {name} [N]", legend=legend, whole="x")


def _band(
    x: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    upper, lower = np.stack([x, high], axis=1), np.stack([x, low], axis=1)[::-1]
    return np.concatenate([upper, lower])


def _readings(sensed: SensedForce, x: NDArray[np.float64]) -> list[Panel]:
    """Return the tensions of the best history."""
    assert sensed.path is not None
    shown = sensed.group[sensed.converged]
    tension = sensed.path.tension[shown]
    colours = [GREY, GREEN, ORANGE, BLUE]
    items = [
        Curve(
            np.stack([x[: len(tension)], tension[:, one]], axis=1),
            colours[one % len(colours)],
            name=f"tendon {one + 1}" if tension.shape[1] > 1 else "",
            group=f"tendon {one + 1}",
            marker="o",
        )
        for one in range(tension.shape[1])
    ]
    legend = BESIDE if len(items) > 1 else ""
    return [Panel(items, "reading [number]", "tendon tension $T$ [N]", legend=legend, whole="x")]
