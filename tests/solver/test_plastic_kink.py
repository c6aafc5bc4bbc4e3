"""The law is flat just beyond the plastic strain: exp(b / x) vanishes there with its slope."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.closing_loads import moment_arms
from notchflex.mechanics.chain import assemble

YORK = nf.load_robot("york2015")


def loads(low: float, high: float, count: int) -> list[nf.Load]:
    """Tensions from rest."""
    return [nf.Load(tension=float(value)) for value in np.linspace(low, high, count)]


def test_every_load_around_the_kink_converges() -> None:
    """The plateau left a mode without a pivot: 2 or 3 of these loads came to nothing."""
    path = nf.solve_each(YORK, loads(2.7, 4.4, 2000))
    assert path.converged.all()
    assert path.iterations.max() <= 15  # one took 674
    assert path.run.substeps.max() == 1  # type: ignore[union-attr]


def test_the_state_on_the_plateau_is_an_equilibrium() -> None:
    """The regularised slope steers the search alone: the balance that is met is the exact one."""
    load = nf.Load(tension=float(np.linspace(2.7, 4.4, 2000)[66]))
    state = nf.solve(YORK, load)
    law = YORK.material
    assert isinstance(law, nf.Superelastic)
    flat = state.outer_strain - law.plastic_strain
    assert ((flat > 0.0) & (flat < 5e-4)).any()
    section = state.path.chain.rods.section
    edge = np.asarray(section.edge_spine)[:, 0]
    lever = moment_arms(assemble(YORK, flat=False))[:, 0]
    plastic = np.maximum(flat, 1e-300)
    stress = (
        law.elastic_modulus * law.transition_strain
        + law.superelastic_modulus
        * (np.minimum(state.outer_strain, law.plastic_strain) - law.transition_strain)
        + np.where(flat > 0.0, law.plastic_modulus * np.exp(law.plastic_exponent / plastic), 0.0)
    )
    moment = np.asarray(section.second_moment_weak)[:, 0] / edge * stress
    pulled = state.span_tension[0, 1::2] * lever
    assert moment == pytest.approx(pulled, rel=1e-11)
