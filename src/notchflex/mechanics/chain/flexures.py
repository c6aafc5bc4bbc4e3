"""One flexure of a chain: the rod of a notch with the modes that the loads need, and its fibres."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from notchflex._arrays import cached
from notchflex._jax import constant
from notchflex.mechanics.flexure import Rod, Site, free_pose, rod_at, section_fibres, with_level
from notchflex.mechanics.material import Fibres
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.section.fibres import FIBRES, fitted
from notchflex.robot import Tube
from notchflex.robot.kinds import Notch


def with_fibres(rod: Rod, notch: Any, tube: Tube, refinement: int = 0) -> Rod:
    """Return the rod of a notch with the fibres of its sections; refinement takes more of them."""
    count = FIBRES * (1 + refinement)
    section = rod.section
    points = section_fibres(notch, tube)(section.edge_near, section.edge_spine, count)
    points = fitted(points, section.area, section.second_moment_weak)
    fibres = Fibres(*map(constant, points))
    return dataclasses.replace(rod, section=dataclasses.replace(section, fibres=fibres))


FlexureOf = Callable[..., tuple[Rod, Motion]]
"""Makes a flexure, and its pose in the free robot; for the arguments see `flexure`."""


@cached(512)
def flexure(
    notch: Notch, site: Site | None, tube: Tube, level: str, refinement: int, by_fibres: bool
) -> tuple[Rod, Motion]:
    """Make a flexure without its factor on stiffness, and its pose in the free robot; cached.

    Args:
        notch: The notch.
        site: Its surroundings, where its ends are elastic.
        tube: The tube that it is cut into.
        level: For which loads, as for `assemble`.
        refinement: As for `assemble`.
        by_fibres: Whether the material needs the fibres of sections.
    """
    rod = with_level(rod_at(site, notch, tube, refinement), level)
    rod = with_fibres(rod, notch, tube, refinement) if by_fibres else rod
    return rod, free_pose(rod)
