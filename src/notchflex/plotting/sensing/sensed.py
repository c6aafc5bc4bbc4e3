"""The picture of a sensed force: every component with its interval along the readings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BESIDE, Area, Curve, Mark, Panel, dots, stack
from notchflex.plotting.style import BLACK, BLUE, GREEN, GREY, ORANGE

if TYPE_CHECKING:
    from notchflex.sensing import SensedForce


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
