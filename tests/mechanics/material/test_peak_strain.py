"""The largest strain of a section, against sums over fibres that cover all of it."""

import dataclasses

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.flexure import rod
from notchflex.mechanics.material import SectionStrain, peak_strain

TUBE = nf.Tube(1.62, 1.40)
WIDE = nf.Tube(10.0, 6.0)
NOTCHES = {
    "deep sector": (nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2), TUBE),
    "shallow sector": (nf.ArcNotch("on-axis", 0.5, 0.8, uncut_length=1.2), TUBE),
    "deep segment": (nf.ArcNotch("off-axis", 1.40, 0.8, uncut_length=1.2), TUBE),
    "shallow segment": (nf.ArcNotch("off-axis", 0.5, 0.8, uncut_length=1.2), TUBE),
    "strip": (nf.StripNotch(height=3.5, strip_thickness=1.5, depth=6.9), WIDE),
}


def outline(notch, tube) -> np.ndarray:
    """Points (x toward the spine, y) of what is left, about the tube axis; corners included."""
    outer, inner = tube.outer_radius, tube.inner_radius
    if isinstance(notch, nf.StripNotch):
        middle, half = 0.5 * (outer + inner), 0.25 * notch.wall_width_in(tube)
        x, y = 0.5 * notch.strip_thickness, np.array([middle - half, middle + half])
        return np.array([(a, b) for a in (x, -x) for b in (*y, *-y)])
    plane = notch.depth - outer
    angle = np.linspace(-np.pi, np.pi, 400_001)
    rings = [r * np.stack([np.cos(angle), np.sin(angle)], axis=-1) for r in (outer, inner)]
    if notch.cut == "on-axis":
        half = np.arccos(plane / outer)
        ends = np.array([-half, half])
        left = [ring[np.abs(angle) <= half] for ring in rings]
        corners = [r * np.stack([np.cos(ends), np.sin(ends)], axis=-1) for r in (outer, inner)]
        return np.concatenate([*left, *corners])
    chord = np.sqrt(outer**2 - plane**2)
    left = [ring[ring[:, 0] >= plane] for ring in rings]
    return np.concatenate([*left, [[plane, chord], [plane, -chord]]])


@pytest.mark.parametrize("name", NOTCHES)
def test_no_fibre_has_more(name, margin):
    notch, tube = NOTCHES[name]
    section = rod(notch, tube).section
    points = outline(notch, tube)
    # Positions about the neutral axis: the farthest fibre on the side of the cut is known.
    points = points - [points[:, 0].min() + np.asarray(section.edge_near)[0], 0.0]
    first = dataclasses.replace(
        section, **{
            name: np.asarray(getattr(section, name))[0]
            for name in ("edge_near", "edge_spine", "edge_across", "outer_radius", "half_angle")
        },
    )  # fmt: skip
    random = np.random.default_rng(3)
    size, errors = np.abs(points).max(), []
    for _ in range(60):
        stretch, curvature, sideways = random.normal(size=3) * random.integers(0, 2, 3)
        wanted = np.abs(stretch + (curvature * points[:, 0] + sideways * points[:, 1]) / size).max()
        strain = SectionStrain(
            stretch, np.float64(curvature / size), np.float64(abs(sideways) / size)
        )
        found = float(peak_strain(strain, first))
        # The points lie 1.6e-5 rad apart: the cosine's maximum is known to 3e-11 of the strain.
        errors.append(found - wanted)
    margin.within("largest strain", np.array(errors), 1e-9, "of order 1")


@pytest.mark.parametrize("ends", ["rigid", "shell"])
def test_it_is_the_strain_of_the_moment(ends, margin):
    """Elastic ends take their share of the bend: the section bends as its moment says."""
    wrist = nf.load_robot("pacheco2021-a").replace(material=nf.Linear(60_000.0))
    wrist = wrist.replace(notch=tuple(dataclasses.replace(one, ends=ends) for one in wrist.notch))
    state = nf.solve(wrist, nf.Load(tension=1e-4))
    section = rod(wrist.notches[0], wrist.tube).section
    farthest = max(float(section.edge_near[0]), float(section.edge_spine[0]))
    wanted = state.notch_moment * farthest / (60_000.0 * float(section.second_moment_weak[0]))
    margin.within("strain of the moment", state.peak_strain / wanted - 1.0, 1e-4)


@pytest.mark.parametrize("moment", [0.01, -0.01])
def test_a_link_strains_most_where_it_is_weakest(moment, margin):
    """A moment alone is the same along a link, so the largest strain is M max(z / I) / E."""
    robot = nf.load_robot("gao2017")
    state = nf.solve(robot, nf.Load(tension=0.0, tip_moment=(0.0, moment, 0.0)))
    section = rod(robot.notches[0], robot.tube).section
    farthest = np.asarray(section.edge_near / section.second_moment_weak).max()
    wanted = abs(moment) * farthest / robot.material.elastic_modulus
    margin.within("strain of the moment", state.peak_strain / wanted - 1.0, 1e-8)
