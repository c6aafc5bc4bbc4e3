"""Section laws: their curves, tangents by finite differences, energy by integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import notchflex as nf
from fibre_sections import PLAIN as SECTION
from fibre_sections import energy, tangent
from notchflex.mechanics.material import SectionLaw, section_law

LAWS = {
    "linear": nf.Linear(60000.0),
    "superelastic": nf.Superelastic(10000.0, 3000.0, 0.028),
}


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def law(request: pytest.FixtureRequest) -> SectionLaw:
    return section_law(request.param)


def pacheco_stress(strain: float) -> float:
    """Pacheco 2021, eq. 13, with E_p 1 GPa, beta -0.01, eps_p 0.10, odd in strain."""
    size = abs(strain)
    if size <= 0.028:
        stress = 10000.0 * size
    elif size <= 0.10:
        stress = 280.0 + (size - 0.028) * 3000.0
    else:
        stress = 280.0 + 0.072 * 3000.0 + 1000.0 * np.exp(-0.01 / (size - 0.10))
    return float(np.sign(strain)) * stress


@pytest.mark.parametrize("strain", [0.0, 0.01, 0.028, 0.05, 0.0999, 0.1, 0.101, 0.12, 0.2])
def test_superelastic_curve(strain: float) -> None:
    law = section_law(LAWS["superelastic"])
    for sign in (1.0, -1.0):
        assert float(law.stress(np.asarray(sign * strain))) == pytest.approx(
            pacheco_stress(sign * strain), rel=1e-14, abs=1e-14
        )


def test_superelastic_moment_is_that_of_the_outer_fibre(law: SectionLaw) -> None:
    curvature = 0.6
    moment = law.respond(np.array([0.0, curvature, 0.0, 0.0, 0.0, 0.0]), SECTION, ()).resultants[1]
    if hasattr(law, "stress"):
        stress = pacheco_stress(curvature * SECTION.edge_spine)
        expected = SECTION.second_moment_weak * stress / SECTION.edge_spine
    else:
        expected = 60000.0 * SECTION.second_moment_weak * curvature
    assert float(moment) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("curvature", [0.05, 0.4, -0.9, 1.1])
def test_tangent_is_the_finite_difference(law: SectionLaw, curvature: float) -> None:
    strain = np.array([0.01, curvature, -0.02, 0.001, 0.002, -0.001])
    slope = tangent(law, strain, SECTION)
    step = 1e-6
    for column in range(6):
        change = np.zeros(6)
        change[column] = step
        ahead = law.respond(strain + change, SECTION, ()).resultants
        behind = law.respond(strain - change, SECTION, ()).resultants
        np.testing.assert_allclose(
            (ahead - behind) / (2 * step), slope[:, column], rtol=1e-6, atol=1e-6
        )


@pytest.mark.parametrize("curvature", [0.1, 0.5, -0.5, 0.9, 1.2])
def test_energy_is_the_work_of_the_moment(law: SectionLaw, curvature: float) -> None:
    def moment(value: float) -> float:
        strain = np.array([0.0, value, 0.0, 0.0, 0.0, 0.0])
        return float(law.respond(strain, SECTION, ()).resultants[1])

    kinks = [sign * e / SECTION.edge_spine for e in (0.028, 0.1) for sign in (1, -1)]
    inside = [kink for kink in kinks if min(0, curvature) < kink < max(0, curvature)]
    work = quad(moment, 0.0, curvature, points=inside or None, epsabs=1e-13, epsrel=1e-12)[0]
    stored = energy(law, np.array([0.0, curvature, 0.0, 0.0, 0.0, 0.0]), SECTION, ())
    assert float(stored) == pytest.approx(work, rel=1e-9)
