"""Fibres of the sections of a rod, for materials that sum up their stresses."""

from __future__ import annotations

import dataclasses
from functools import lru_cache, singledispatch
from typing import Any

import numpy as np

from notchflex._jax import constant
from notchflex.mechanics.flexure import Rod
from notchflex.mechanics.material import Fibres
from notchflex.mechanics.section.fibres import (
    Points,
    fitted,
    rectangle_fibres,
    reduced,
    sector_fibres,
    segment_fibres,
)
from notchflex.robot import ArcNotch, Tube

_OF_CUT = {"on-axis": sector_fibres, "off-axis": segment_fibres}


@singledispatch
def section_fibres(notch: Any, tube: Tube) -> Points | None:
    """Fibres of the section of a notch, about any axis; None where it is a rectangle.

    Args:
        notch: A notch description.
        tube: The tube it is cut into.
    """
    del notch, tube
    return None


@section_fibres.register
def _(notch: ArcNotch, tube: Tube) -> Points | None:
    return _of_cut(notch.cut, tube.outer_radius, tube.inner_radius, notch.section_depth(tube))


@lru_cache(maxsize=1024)  # the same for all sites and heights
def _of_cut(cut: str, outer: float, inner: float, depth: float) -> Points:
    return reduced(_OF_CUT[cut](outer, inner, depth))


def with_fibres(rod: Rod, notch: Any, tube: Tube) -> Rod:
    """Return the rod of a notch with the fibres of its sections."""
    points, section = section_fibres(notch, tube), rod.section
    numbers = section.edge_near, section.edge_spine, section.area, section.second_moment_weak
    every = [
        fitted(points or reduced(rectangle_fibres(near, spine)), area, second_moment)
        for near, spine, area, second_moment in np.stack(numbers, axis=-1)
    ]
    arm, area = (constant(np.stack(part)) for part in zip(*every, strict=True))
    return dataclasses.replace(rod, section=dataclasses.replace(section, fibres=Fibres(arm, area)))


__all__ = ["section_fibres", "with_fibres"]
