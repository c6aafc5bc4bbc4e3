"""Every kind of notch states the fibres of its section; nothing is guessed for others."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax
from notchflex.mechanics.chain import flexure, with_fibres
from notchflex.mechanics.flexure import rod
from notchflex.mechanics.material import section_law

TUBE = nf.Tube(1.62, 1.40)
ARC = nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2)
STRIP = nf.StripNotch(0.7, 0.3, 1.3, uncut_length=1.2)
LINK = nf.ULink(0.08, 0.2, 0.6, "away")


@pytest.mark.parametrize("notch", [STRIP, LINK], ids=["strip", "link"])
def test_fibres_of_strips_are_those_of_a_rectangle(notch: nf.StripNotch | nf.ULink) -> None:
    section = with_fibres(rod(notch, TUBE), notch, TUBE).section
    half = np.asarray(section.edge_spine)
    assert section.fibres is not None
    arm, area = np.asarray(section.fibres.arm), np.asarray(section.fibres.area)
    for power in (2, 4, 6):  # moments of h over 2 b h: h^n / (n + 1) of the half thickness
        mean = np.sum(area * arm**power, axis=-1) / np.sum(area, axis=-1)
        np.testing.assert_allclose(mean, half**power / (power + 1), rtol=1e-9)


def test_refinement_takes_more_fibres(margin):
    """A yielding section against very many fibres, all of them to rounding."""
    wrist = nf.load_robot("pacheco2021-a-true")
    law = section_law(wrist.material)
    curvatures, moments = np.linspace(0.02, 0.55, 54), []
    for refinement in (0, 1, 3, 7):
        made, _ = flexure(wrist.notches[0], None, wrist.tube, "tendons", refinement, True)
        section = jax.tree.map(lambda leaf: leaf[0], made.section)
        moments.append([float(law.moment(one, section)) for one in curvatures.tolist()])
    *coarse, fine = np.array(moments)
    # Of the angle at a given moment.
    tangent = np.gradient(fine, curvatures)
    errors = [(one - fine) / (tangent * curvatures) for one in coarse]
    for name, error, most in zip("013", errors, (1e-3, 4e-4, 1e-4), strict=True):
        margin.within(f"rms at refinement {name}", np.sqrt(np.mean(error**2)), most)
    margin.within("largest at refinement 0", errors[0], 3e-3)
