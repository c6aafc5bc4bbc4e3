"""From the description of a notch to its rod.

A notch shape lives in a file of its own in this folder and registers itself for its description;
the package imports every file of the folder, so no list is kept.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any, NamedTuple

from notchflex.mechanics.ends import Side
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.registration import unregistered
from notchflex.mechanics.section.fibres import FibresAt
from notchflex.robot import Tube


class Site(NamedTuple):
    """What surrounds a notch whose ends are elastic.

    Attributes:
        proximal: The ring toward the base.
        distal: The ring toward the tip.
        poisson_ratio: Poisson's ratio of the tube.
    """

    proximal: Side
    distal: Side
    poisson_ratio: float


@singledispatch
def rod(notch: Any, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    """Rod of one notch.

    Args:
        notch: A notch description, such as `notchflex.ArcNotch(...)`.
        tube: The tube it is cut into.
        refinement: 0 has the modes that serve for usual loads; 1, 2 ... has more.
        site: What surrounds it, where its ends are elastic (`Notch.has_elastic_ends`).

    Returns:
        The rod, in mm and rad.

    Raises:
        TypeError: There is no rod for this kind of description.
    """
    del tube, refinement, site
    raise unregistered("rod", notch, "flexure", "rod")


def rod_at(site: Site | None, notch: Any, tube: Tube, refinement: int = 0) -> Rod:
    """Make the rod of a notch where it stands; kinds whose ends are rigid need not know of sites.

    Args:
        site: What surrounds it; None where its ends are rigid.
        notch: A notch description.
        tube: The tube it is cut into.
        refinement: As for `rod`.
    """
    return rod(notch, tube, refinement) if site is None else rod(notch, tube, refinement, site)


@singledispatch
def section_fibres(notch: Any, tube: Tube) -> FibresAt:
    """Fibres of the sections of a notch, for materials that sum up stresses.

    Args:
        notch: A notch description.
        tube: The tube it is cut into.

    Returns:
        The fibres about any axis, as a function of the distances of the edges of the section
        from its neutral axis (`edge_near`, `edge_spine`), mm, and of their number.

    Raises:
        TypeError: The fibres of this kind of notch are not stated.
    """
    del tube
    raise unregistered("section of fibres", notch, "flexure", "section_fibres")


@singledispatch
def validity_warnings(notch: Any, tube: Tube, site: Site) -> list[str]:
    """List where the law of a notch with elastic ends was not checked.

    Args:
        notch: A notch description.
        tube: The tube it is cut into.
        site: What surrounds it.

    Returns:
        A sentence for each dimension outside the range that finite elements cover.
    """
    del notch, tube, site
    return []
