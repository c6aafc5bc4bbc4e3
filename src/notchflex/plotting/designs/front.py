"""The picture of a front between objectives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import Curve, Mark, Panel, grid
from notchflex.plotting.style import BLUE

if TYPE_CHECKING:
    from notchflex.designing import DesignFront


def front_picture(front: DesignFront, *, title: str = "") -> Picture:
    """Describe a front: every objective over the first, points numbered by the first.

    Args:
        front: The front.
        title: Heading.
    """
    values, titles = front.objectives, front.titles
    panels: list[Panel] = []
    for other in range(1, values.shape[1]):
        points = np.stack([values[:, 0], values[:, other]], axis=1)
        line = Curve(points, BLUE, None if values.shape[1] > 2 else (), marker="o", hover=True)
        items: list[Mark] = [line]
        panels.append(Panel(items, titles[0], titles[other]))
    if values.shape[1] > 2:
        points = values[:, [1, 2]]
        panels.append(Panel([Curve(points, BLUE, None, marker="o")], titles[1], titles[2]))
    name = title or f"{front.spec.name}: {len(front.points)} robots"
    return Picture(name, 1.0 + 4.4 * len(panels), 4.4, grid(panels, len(panels)), [])
