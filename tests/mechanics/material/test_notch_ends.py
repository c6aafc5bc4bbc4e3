"""A section law between the ends of a notch, against closed forms and independent solutions."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import notchflex as nf
from fibre_sections import PLAIN, tangent
from notchflex._jax import jax
from notchflex.mechanics.material import FibreSection, NotchEnds, SectionLaw, section_law

ENDS = NotchEnds(
    weak=0.6,
    strong=0.3,
    axial=0.2,
    torsion=-0.4,
    odd=0.4,
    even=0.25,
    warped=0.3,
    material_share=0.25,
)
SECTION = dataclasses.replace(PLAIN, ends=ENDS)
LINEAR = section_law(nf.Linear(60000.0))
SUPERELASTIC = section_law(nf.Superelastic(10000.0, 3000.0, 0.028))


respond = jax.jit(lambda law, strain, section: law.respond(strain, section, ()).resultants)
energy = jax.jit(lambda law, strain, section: law.stored_energy_density(strain, section, ())[0])


def bending(curvature: float) -> np.ndarray:
    return np.array([0.0, curvature, 0.0, 0.0, 0.0, 0.0])


def moment(law: SectionLaw, curvature: float, section: FibreSection = SECTION) -> float:
    return float(respond(law, bending(curvature), section)[1])


def flattening(curvature: float) -> float:
    return 1.0 + 0.4 * curvature + 0.25 * curvature**2


def test_a_linear_notch_is_the_closed_form() -> None:
    for curvature in (-1.2, -0.3, 0.05, 0.9):
        q = flattening(curvature)
        expected = 60000.0 * 5.8e-4 * curvature / (1.6 * q**2)
        assert moment(LINEAR, curvature) == pytest.approx(expected, rel=1e-14)


def potential(curvature: float) -> float:
    """Energy of a linear notch: the integral of K0 kappa / q^2 in closed form."""
    b, e = 0.4, 0.25
    root = np.sqrt(4.0 * e - b**2)

    def angle(at: float) -> float:
        return 2.0 / root * np.arctan((2.0 * e * at + b) / root)

    by_q = (2.0 + b * curvature) / flattening(curvature)
    held = (2.0 - by_q - b * (angle(curvature) - angle(0.0))) / root**2
    return 60000.0 * 5.8e-4 / 1.6 * held


def test_energy_of_a_linear_notch_is_its_potential() -> None:
    for curvature in (-1.2, -0.3, 0.05, 0.9):
        held = float(energy(LINEAR, bending(curvature), SECTION))
        assert held == pytest.approx(potential(curvature), rel=1e-12)


@pytest.mark.parametrize("curvature", [-4.0, -1.6, -0.2, 0.0, 0.3, 0.7, 1.6, 2.3])
def test_a_superelastic_notch_solves_the_law_of_its_ends(curvature: float) -> None:
    def parts(own: float) -> tuple[float, float]:
        """s, and q by the angle and by the moment."""
        part = moment(SUPERELASTIC, own, PLAIN) / (10000.0 * 5.8e-4)
        bent = (1.0 + 0.25 * 0.6) * own + 0.75 * 0.6 * part
        return bent, flattening(curvature) / (1.0 + 0.3 * (bent - 1.6 * part))

    def missing(own: float) -> float:
        bent, q = parts(own)
        return bent - curvature / q

    own = brentq(missing, -2.0, 2.0, xtol=1e-15)
    expected = moment(SUPERELASTIC, own, PLAIN) / parts(own)[1]
    assert moment(SUPERELASTIC, curvature) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("exponent", [-0.001, -0.002, -0.05, -0.2])
def test_section_and_ends_bend_as_far_as_the_notch_to_rounding(exponent: float, margin) -> None:
    """A search of the curvature that has found it stays there."""
    law = section_law(nf.Superelastic(80.0, 17.0, 0.003, 0.028, 20.0, exponent))
    reduced = np.linspace(-0.5, 0.5, 2001)

    def beyond(reduced: jax.Array) -> jax.Array:
        bent = law.bent(reduced, SECTION, ())
        return law.joint(reduced, SECTION).beyond(bent.curvature, bent.moment)

    missing = jax.jit(jax.vmap(beyond))(reduced)
    margin.within("bending, relative", missing[reduced != 0.0] / reduced[reduced != 0.0], 2e-14)


@pytest.mark.parametrize("law", [LINEAR, SUPERELASTIC], ids=["linear", "superelastic"])
def test_tangents_and_energies_of_a_notch_are_those_of_its_moment(law: SectionLaw) -> None:
    step = 1e-6
    for curvature in (-1.1, 0.1, 0.8):
        ahead, behind = (moment(law, curvature + change) for change in (step, -step))
        slope = tangent(law, bending(curvature), SECTION)
        assert float(slope[1, 1]) == pytest.approx((ahead - behind) / (2 * step), rel=1e-7)
        work = quad(lambda at: moment(law, at), 0.0, curvature, limit=200, epsrel=1e-8)[0]
        # The quadrature of the flattening does not know where the material yields.
        error = 1e-9 if law is LINEAR else 1e-4
        assert float(energy(law, bending(curvature), SECTION)) == pytest.approx(work, rel=error)


def test_without_flattening_the_energy_is_exact_beyond_the_plateau_too() -> None:
    section = dataclasses.replace(
        SECTION, ends=dataclasses.replace(ENDS, odd=0.0, even=0.0, warped=0.0)
    )
    step = 1e-5
    for curvature in (0.2, 0.9, -1.3):
        ahead, behind = (
            float(energy(SUPERELASTIC, bending(curvature + change), section))
            for change in (step, -step)
        )
        slope = (ahead - behind) / (2.0 * step)
        assert slope == pytest.approx(moment(SUPERELASTIC, curvature, section), rel=1e-8)


def test_ends_divide_the_stiffness_in_every_direction() -> None:
    plain, soft = (np.asarray(LINEAR.stiffness(one)) for one in (PLAIN, SECTION))
    assert soft[0, 0] == pytest.approx(plain[0, 0] / 1.3)
    assert soft[1, 1] == pytest.approx(plain[1, 1] / 1.6)
    assert soft[5, 5] == pytest.approx(plain[5, 5] / 1.2)
    compliance = np.linalg.inv(soft)[2, 2] / np.linalg.inv(plain)[2, 2]
    assert compliance == pytest.approx(0.6)
    assert (np.linalg.eigvalsh(soft) > 0.0).all()
    np.testing.assert_allclose(soft, tangent(LINEAR, np.zeros(6), SECTION), rtol=1e-12)
