"""Fibres of the sections of a rod, for materials that sum up their stresses."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from notchflex._jax import constant
from notchflex.mechanics.flexure import Rod, section_fibres
from notchflex.mechanics.material import Fibres
from notchflex.mechanics.section.fibres import fitted
from notchflex.robot import Tube


def with_fibres(rod: Rod, notch: Any, tube: Tube) -> Rod:
    """Return the rod of a notch with the fibres of its sections."""
    points_at, section = section_fibres(notch, tube), rod.section
    numbers = section.edge_near, section.edge_spine, section.area, section.second_moment_weak
    every = [
        fitted(points_at(near, spine), area, second_moment)
        for near, spine, area, second_moment in np.stack(numbers, axis=-1)
    ]
    arm, area = (constant(np.stack(part)) for part in zip(*every, strict=True))
    return dataclasses.replace(rod, section=dataclasses.replace(section, fibres=Fibres(arm, area)))


__all__ = ["with_fibres"]
