"""The asymmetric notch of a wrist: the wall that is left bends to an arc (Pacheco 2021, eq. 1-3).

The rod runs along the neutral axis, ybar from the tube axis toward the spine, and keeps its length
h there; s = h - ybar theta at the tube axis (eq. 3) and the closing angle h / (r_o + ybar) follow.
Under a tendon along the wall its moment is constant, so one mode of bending is exact and its
amplitude is the elastic angle; for a straight tendon refinement adds more. Other loads add a linear
part of bending, both for the strong axis, and torsion about the shear centre. Shear and stretch,
small in a short arc, are left out.

With elastic ends (`ends = "shell"`) the compliance of the rings is spread over the arc, and the
neutral axis moves to where an axial force and bending do not couple. A force across the tube also
shifts the rings against each other: the linear part of each bending carries a constant shear, in
the ratio in which one force causes both.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from notchflex._arrays import plain_number, xp
from notchflex._jax import constant
from notchflex.mechanics.cuts import SECTION_OF_CUT, STRIPS_OF_CUT, cut_fibres
from notchflex.mechanics.ends import NotchStiffness, left_ranges, notch_stiffness
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    about_neutral_axis,
    build_rod,
    legendre_modes,
    rod_quadrature,
    shifted,
)
from notchflex.mechanics.flexure.rod import (
    Rod,
    Site,
    law_error,
    rod,
    section_fibres,
    validity_warnings,
)
from notchflex.mechanics.law_errors import Place, covered, law_error_at
from notchflex.mechanics.material import NotchEnds
from notchflex.mechanics.section import FibresAt, Points, Section, gauss_on, gauss_rule
from notchflex.robot import ArcNotch, Tube


@rod.register
def _(notch: ArcNotch, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    shape = tube.outer_radius, tube.inner_radius, notch.section_depth(tube)
    cut = SECTION_OF_CUT[notch.cut](*shape)
    centroid, section = plain_number(cut.centroid), about_neutral_axis(cut)
    closure, stop = tube.outer_radius + centroid, 0.0
    shear = (0.0, 0.0)
    if site is not None:
        outer, inner, depth = shape
        law = notch_stiffness(
            outer, inner, notch.cut, depth, notch.height,
            site.poisson_ratio, site.proximal, site.distal,
        )  # fmt: skip
        if notch.closing == "elastic":
            closure, stop = closure / law.closing_factor, 1.0 / law.closed_ratio
            if notch.ends == "rigid":  # the ratio is over a notch with its ends
                stop *= law.weak / notch.height
        if notch.ends == "shell":
            centroid -= law.coupling / law.weak
            centre = constant(law.shear_centre - centroid)
            ends, shear = _ends(law, notch.height, cut, site.poisson_ratio)
            section = dataclasses.replace(section, shear_centre=centre, ends=ends)
    # Smooth all along: one piece, with a node in its middle. With six nodes a notch that bends by a
    # radian in its plane is right to 1e-15; the turns of one that also bends sideways and twists
    # need ten for 3e-8.
    points = rod_quadrature((0.0, notch.height), (7 + 4 * refinement,), (10 + 3 * refinement,))
    bending, twist = 2 + refinement, 1 + refinement
    centre = plain_number(section.shear_centre)
    modes = legendre_modes(
        points,
        bending,
        bending,
        twist,
        tendon_modes=1 if refinement == 0 else bending,
        shear_centre=centre,
        shear=shear,
    )
    free = STRAIGHT + xp.radians(notch.precurvature_deg) * modes.basis[..., 0]
    axis = NeutralAxis(points, start=shifted(-centroid), end=shifted(centroid), strain=free)
    return build_rod(
        axis, section, modes, closure, stop_flexibility=stop, direction_deg=notch.direction_deg
    )


def _ends(
    stiffness: NotchStiffness, height: float, cut: Section, poisson_ratio: float
) -> tuple[NotchEnds, tuple[float, float]]:
    """Refer the effective lengths and the softening to the arc, over which they are spread."""
    bending = (stiffness.weak, stiffness.strong)
    seconds = (plain_number(cut.second_moment_weak), plain_number(cut.second_moment_strong))
    # Beyond what the linear part of the bending gives: h^2 l/(12 I).
    shear = [
        total - height**2 * length / (12.0 * second)
        for total, length, second in zip(
            (stiffness.shear, stiffness.sway), bending, seconds, strict=True
        )
    ]
    area, ratio = plain_number(cut.area), 2.0 * (1.0 + poisson_ratio)
    push, sway = (compliance * area / (ratio * height) - 1.0 for compliance in shear)
    ends = NotchEnds(
        weak=stiffness.weak / height - 1.0,
        strong=stiffness.strong / height - 1.0,
        axial=stiffness.axial / height - 1.0,
        torsion=stiffness.torsion / height - 1.0,
        odd=0.5 * stiffness.alpha * height,
        warped=0.5 * stiffness.alpha_rings * height,
        even=0.5 * stiffness.beta * height**2,
        material_share=_MATERIAL_SHARE,
        sway=sway,
        push=push,
    )
    # M = E I kappa h/l changes by the force: 2 E I/(h l) where kappa = P_1/h. It shifts the rings
    # in the plane and sideways, mm.
    in_plane, sideways = (
        2.0 * second / (height * length) * compliance
        for compliance, length, second in zip(shear, bending, seconds, strict=True)
    )
    return ends, (in_plane, sideways)


# Strain of the fibre farthest on the cut side at the edge of a ring, over that far from it, less 1;
# and the part of the mean radius over which it fades, which is that of the distortion by the rings
# (mechanics/flattening.py) in notches 0.8 to 0.9 outer diameters deep. By that distortion the first
# is 0.27; it was fitted, as the share of the ends that follows the material, to finite elements of
# six wrists of nitinol, plateaus of 3 to 8.5 GPa; six more, of the same shapes, were kept back.
_CONCENTRATION, _FADING, _MATERIAL_SHARE = 0.36, 0.25, 0.18


@section_fibres.register
def _(notch: ArcNotch, tube: Tube) -> FibresAt:
    shape = tube.outer_radius, tube.inner_radius, notch.section_depth(tube)

    def fibres(_near: Any, _spine: Any, count: int) -> Points:
        if notch.ends == "rigid":
            return cut_fibres(notch.cut, *shape, count)
        # Beside a ring the section does not stay plane: the edges of the arc strain more than the
        # spine, by a part that neither stretches nor bends it. The fibres stand for sections at
        # Gauss's points of half the height.
        arm, area = STRIPS_OF_CUT[notch.cut](*shape, count)
        total = xp.sum(area)
        arm = arm - arm @ area / total
        second, skew = arm**2 @ area / total, arm**3 @ area / (arm**2 @ area)
        near = SECTION_OF_CUT[notch.cut](*shape).edge_near
        warped = (arm**2 - skew * arm - second) / (near**2 + skew * near - second)
        place, weights = gauss_on(0.0, 0.5 * notch.height, 4)
        radius = 0.5 * (tube.outer_radius + tube.inner_radius)
        share = _CONCENTRATION * xp.exp(-place / (_FADING * radius))
        arms = arm[None] - (share * near)[:, None] * warped[None]
        arms = arms * xp.sqrt(second / (arms**2 @ area / total))[:, None]
        return gauss_rule(arms.ravel(), xp.outer(weights, area).ravel(), count)

    return fibres


def place_of(notch: ArcNotch, tube: Tube, site: Site, yields: bool = False) -> Place:
    """Return where a notch stands among the wrists of finite elements."""
    diameter = tube.outer_diameter
    # Between a notch and a plate right at its edge there is no ring.
    rings = [
        side.length
        for side in (site.proximal, site.distal)
        if side.length or side.boundary != "clamped"
    ]
    return Place(
        (tube.outer_radius - tube.inner_radius) / diameter,
        notch.section_depth(tube) / diameter,
        notch.height / diameter,
        min(rings, default=diameter) / diameter,
        notch.cut == "on-axis",
        yields,
        site.distal.boundary == "free",
    )


@validity_warnings.register
def _(notch: ArcNotch, tube: Tube, site: Site) -> list[str]:
    depth, far_side = notch.section_depth(tube), tube.outer_radius + tube.inner_radius
    sentences: list[str] = []
    if notch.cut == "off-axis" and depth >= far_side:
        sentences.append(
            f"depth is {depth:.4g} mm, beyond the far side of the bore at {far_side:.4g} mm, where "
            "a solid strip is left: the stiffness was found wrong by up to 23 %"
        )
    place = place_of(notch, tube, site)
    for number, name in enumerate(Place._fields[:4]):
        low, high, *found = covered(number, place.last)
        known = [
            f"the stiffness was found up to {100.0 * most:.0f} % off inside, near that bound"
            for most in found
        ]
        if name == "wall":
            known[0] += ", and 85 % with a wall of 0.037 outer diameters"
        # Of higher notches the rings, and of longer rings what lies far off, are a small part.
        least, most = float(f"{low:.2g}"), float(f"{high:.2g}") if number < 2 else np.inf
        ranges = [(least, np.inf, known[0]), (0.0, most, known[1])]
        sentences += left_ranges([(f"{name} / outer diameter", place[number], ranges)])
    turned = {side.length for side in (site.proximal, site.distal) if side.turned}
    # With a ring of 1.9 outer diameters the chain agrees with finite elements to 2 %.
    return sentences + [
        f"a neighbour opens to another side of the tube, and the ring between them is {length:.3g} "
        "mm long, below 1.5 outer diameters: both were found too stiff, 1.4 times with 0.6 outer "
        "diameters and up to 2 times with 0.4"
        for length in sorted(turned)
        if length < 1.5 * tube.outer_diameter
    ]


@law_error.register
def _(notch: ArcNotch, tube: Tube, site: Site, yields: bool) -> float:
    # Papers' laws of rigid ends come with constants that were fitted by them, error included.
    if notch.ends == "rigid":
        return 0.0
    return law_error_at(place_of(notch, tube, site, yields))
