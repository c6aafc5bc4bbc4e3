"""What the rings beside an arc notch add to its compliance: `ends_of(robot, i)`.

The numbers are the library's: tests/mechanics/ends holds them against references and finite
elements. What a notch makes of them is computed anew (`arcs.py`).
"""

from __future__ import annotations

from typing import NamedTuple

import notchflex as nf
from notchflex.mechanics.chain import sites_of
from notchflex.mechanics.ends import notch_stiffness

from .sections import outer_depth


class Ends(NamedTuple):
    """Lengths of an arc notch with its rings, and how it flattens.

    Attributes:
        weak: Length h + δ of the bending, mm.
        strong: That of the bending sideways.
        torsion: Length of free torsion.
        coupling: b_c, mm²; of the last notch also by the pull of its tendon.
        shear_centre: Distance of the shear centre from the tube axis, mm.
        push: Compliance of the shear in the plane times Young's modulus, 1/mm.
        sway: The same sideways.
        odd: α/2, 1/rad.
        even: β/2, 1/rad².
        warped: Part of `odd` by the rings, which follows the moment.
    """

    weak: float
    strong: float
    torsion: float
    coupling: float
    shear_centre: float
    push: float
    sway: float
    odd: float
    even: float
    warped: float = 0.0


def ends_of(robot: nf.Robot, i: int) -> Ends:
    """Return the ends of arc notch i (from 0)."""
    notch, tube, site = robot.notches[i], robot.tubes[i + 1], sites_of(robot)[i]
    depth = outer_depth(notch, tube)
    law = notch_stiffness(
        tube.outer_radius,
        tube.inner_radius,
        notch.cut,
        depth,
        notch.height,
        site.poisson_ratio,
        site.proximal,
        site.distal,
    )
    return Ends(
        weak=law.weak,
        strong=law.strong,
        torsion=law.torsion,
        coupling=law.coupling,
        shear_centre=law.shear_centre,
        push=law.shear,
        sway=law.sway,
        odd=law.alpha / 2,
        even=law.beta / 2,
        warped=law.alpha_rings / 2,
    )
