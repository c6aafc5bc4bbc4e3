"""Solids that bodies of the tube are made of: its wall, and prisms across it (manifold3d)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from manifold3d import Manifold

    from notchflex.robot import Tube

Points = NDArray[np.float64]


def tube_wall(tube: Tube, ends: tuple[float, float], sides: int, *, fair: bool = False) -> Manifold:
    """Return the wall of a tube along z.

    Args:
        tube: The tube.
        ends: Its lower and its upper end [mm].
        sides: Flat sides of each surface.
        fair: Whether the sides lie half inside and half outside the round surface, so that the
            volume is that of the round tube; otherwise their corners lie on it.
    """
    from manifold3d import Manifold

    grown = fair_growth(sides) if fair else 1.0
    outer, inner = (
        Manifold.cylinder(ends[1] - ends[0], grown * radius, circular_segments=sides)
        for radius in (tube.outer_radius, tube.inner_radius)
    )
    return (outer - inner).translate((0.0, 0.0, ends[0]))


def fair_growth(sides: int) -> float:
    """Return the factor by which a polygon's corners lie outside the circle of equal area."""
    part = 2.0 * math.pi / sides
    return math.sqrt(part / math.sin(part))


def prism(polygon: Points, view: float, depth: float) -> Manifold:
    """Return the prism of a polygon (across, along) seen from the side.

    Args:
        polygon: Corners [mm], (k, 2): across toward the direction `view`, and along z.
        view: Direction about z that the first coordinate has [rad].
        depth: Length of the prism across that plane, half of it on each side [mm].
    """
    from manifold3d import CrossSection, FillRule, Manifold

    solid = Manifold.extrude(CrossSection([polygon], FillRule.NonZero), depth)
    across = np.array([math.cos(view), math.sin(view), 0.0])
    along = np.array([0.0, 0.0, 1.0])
    axes = np.stack([across, along, np.cross(across, along)], axis=1)
    middle = axes @ np.array([0.0, 0.0, -0.5 * depth])
    return solid.transform(np.concatenate([axes, middle[:, None]], axis=1))
