"""Closing angle and force of every notch, their order, and the branches at 1 N.

Numbers: tests/reference/pacheco_closing.csv (bisection on the force, 1e-12 relative, printed to
ten digits), both cuts. Order and branches: Pacheco et al. 2021, fig. 2, fig. 9, section 4.3.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from loads import tensions
from reference_data import CUTS, choose, reference
from robots import ready

RELATIVE = 1e-8


def table(name: str, cut: int = 0) -> np.ndarray:
    rows = reference("pacheco_closing.csv")
    return choose(rows, cut=(0, cut), wrist=(1, "ABC".index(name)))


@pytest.mark.parametrize("cut", [0, 1])
@pytest.mark.parametrize("name", "ABC")
def test_closing_table(name, cut, margin):
    robot, rows = ready(name).with_value("notch[*].cut", CUTS[cut]), table(name, cut)
    found = nf.closing(robot)
    margin.within("closing angle", found.angle / np.radians(rows[:, 7]) - 1, RELATIVE)
    margin.within("closing tension", found.tension / rows[:, 8] - 1, RELATIVE)
    margin.within("strain at closing", found.outer_strain / rows[:, 9] - 1, RELATIVE)


@pytest.mark.parametrize("name", "ABC")
def test_notch_closes_at_its_force_and_at_no_other(name):
    robot, rows = ready(name), table(name)
    for j, force in enumerate(rows[:, 8]):
        path = nf.simulate(robot, tensions(force * np.array([1 - RELATIVE, 1 + RELATIVE])))
        assert path.converged.all(), path.reason
        assert not path.closed[0, j]
        assert path.gap[0, j] > 0
        assert path.contact_force[0, j] == 0
        assert path.closed[1, j]
        assert path.contact_force[1, j] > 0
        assert abs(path.gap[1, j]) < 1e-12


@pytest.mark.parametrize(("name", "order"), [("A", "12345"), ("B", "12345"), ("C", "4321")])
def test_closing_order(name, order):
    path = nf.simulate(ready(name), nf.pull(0.0, 3.0, steps=61))
    first_closed = path.closed.argmax(axis=0)
    assert path.closed[-1].all()
    assert "".join(str(j + 1) for j in np.argsort(first_closed, kind="stable")) == order
    assert len(set(first_closed)) == len(order), "two notches close in one step: refine it"


def test_closed_notches_stay_closed_and_press_harder(margin):
    path = nf.simulate(ready("A"), nf.pull(0.0, 3.0, steps=61))
    assert (np.diff(path.closed.astype(int), axis=0) >= 0).all()
    assert (np.diff(path.contact_force, axis=0) >= -1e-9).all()
    margin.within("gap times contact force", path.gap * path.contact_force, 1e-12, "N mm")
    assert path.gap.min() > -1e-12


def test_wrist_c_at_1_newton_is_linear_at_the_base_and_superelastic_at_the_tip():
    state = nf.solve(ready("C"), nf.Load(tension=1.0))
    assert (state.outer_strain > 0.028).tolist() == [False, False, True, True]
    np.testing.assert_allclose(
        np.degrees(state.notch_angle), [9.18, 11.80, 19.06, 31.41], rtol=0, atol=0.005
    )
