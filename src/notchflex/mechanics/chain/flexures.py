"""One flexure of a chain: the rod of a notch with the modes that the loads need."""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

from notchflex.mechanics.chain.fibres import with_fibres
from notchflex.mechanics.flexure import Rod, Site, free_pose, rod_at, with_level
from notchflex.mechanics.motion import Motion
from notchflex.robot import Tube
from notchflex.robot.kinds import Notch


class FlexureOf(Protocol):
    """Makes a flexure, and its pose in the free robot; for the arguments see `flexure`."""

    def __call__(
        self,
        notch: Notch,
        site: Site | None,
        tube: Tube,
        level: str,
        refinement: int,
        by_fibres: bool,
    ) -> tuple[Rod, Motion]:
        """Make a flexure, and its pose in the free robot."""
        ...


@lru_cache(maxsize=512)
def flexure(
    notch: Notch, site: Site | None, tube: Tube, level: str, refinement: int, by_fibres: bool
) -> tuple[Rod, Motion]:
    """Make a flexure, and its pose in the free robot; the last ones are cached.

    Args:
        notch: The notch.
        site: Its surroundings, where its ends are elastic.
        tube: The tube that it is cut into.
        level: For which loads, as for `assemble`.
        refinement: As for `assemble`.
        by_fibres: Whether the material needs the fibres of sections.
    """
    rod = with_level(rod_at(site, notch, tube, refinement), level)
    rod = with_fibres(rod, notch, tube) if by_fibres else rod
    return rod, free_pose(rod)


__all__ = ["FlexureOf", "flexure"]
