"""Every robot under tendons, tip force, tip moment and gravity at once: it balances and is stable.

All is recomputed in numpy from what the result reports (tests/balance.py). Loads are not in the
plane of bending, and the base is turned.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

import notchflex as nf
from balance import cone_used, left_over

EXACT = 1e-9


class Case(NamedTuple):
    """Tensions (N) first pulled, then changed to, and the sizes of force (N) and moment (N mm)."""

    pulled: tuple[float, ...]
    changed: tuple[float, ...]
    force: float
    moment: float


CASES = {
    "pacheco2021-a": Case((0.8,), (0.7,), 0.01, 0.02),
    "pacheco2021-b": Case((0.8,), (0.75,), 0.01, 0.02),
    "two-axis-wrist": Case((0.8, 0.5, 0.2, 0.3), (0.6, 0.6, 0.2, 0.25), 0.01, 0.02),
    "liu2022": Case((5.0, 1.0), (4.0, 1.5), 0.2, 1.0),
    "gao2017": Case((8.0,), (7.0,), 0.05, 0.5),
}
# Those that take longest to compile.
LINKS, STRIPS, BOTH_AXES = (
    pytest.param(name, marks=pytest.mark.nightly)
    for name in ("gao2017", "liu2022", "two-axis-wrist")
)
ROBOTS = [*(name for name in CASES if name not in ("gao2017", "liu2022")), LINKS, STRIPS]


@cache
def loaded(name: str, refinement: int = 0) -> list[nf.EquilibriumPath]:
    """Pulled under all loads; then tendons and loads changed, the tendons keeping in mind."""
    case, robot = CASES[name], nf.load_robot(name)
    assert robot.material.density is not None
    paths, state = [], None
    for tension, part in ((case.pulled, 1.0), (case.changed, 1.2)):
        force, moment = part * case.force, part * case.moment
        load = nf.Load(
            tension=tension,
            base_rotation=(0.3, -0.2, 0.5),
            tip_force=(0.6 * force, -0.5 * force, 0.4 * force),
            tip_moment=(-0.3 * moment, 0.6 * moment, 0.2 * moment),
            tip_point=(0.3, -0.2, 0.1),
            following=True,
            body_forces=[nf.BodyForce(2, (0.0, force, -force), (moment, 0, 0), (0.2, 0.1, 0.3))],
            gravity=(3.0, -5.0, -7.8),
        )
        # One load at a time, so that both run the same small program.
        paths.append(nf.simulate(robot, load, from_state=state, refinement=refinement))
        state = paths[-1].state
    return paths


@pytest.mark.parametrize("name", ROBOTS)
def test_converges_and_balances(name, margin):
    for path in loaded(name):
        assert path.converged.all(), path.reason
        force, moment = left_over(path)
        margin.within("force left over", force, EXACT)
        margin.within("moment left over", moment, EXACT)


@pytest.mark.parametrize("name", ROBOTS)
def test_friction_keeps_within_its_cone(name, margin):
    pulled, changed = (cone_used(path) for path in loaded(name))
    for used in (pulled, changed):
        margin.within("friction beyond its cone", np.maximum(used, 1.0) - 1.0, EXACT)
    # Pulled from rest a tendon slides all along; after a small change some of it sticks.
    assert pulled.max() > 1.0 - EXACT
    assert changed.min() < 1.0 - 1e-3
    margin.note(f"least friction in use after the change: {changed.min():.3f} of what can be")


@pytest.mark.parametrize(
    "name",
    ["pacheco2021-a", "pacheco2021-b", BOTH_AXES, LINKS, STRIPS],
)
def test_stability_is_known(name, margin):
    path = loaded(name)[0]
    margin.note(f"smallest eigenvalue: {path.smallest_eigenvalue[0]:.4g}")
    assert path.stable.all()


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["pacheco2021-a", "liu2022"])
def test_moments_are_met_better_by_more_modes(name, margin):
    """The largest |EI kappa - M| over the largest |M|; Gao's robot has a test of its own."""
    usual, more = (loaded(name, refinement)[0].moment_error[0] for refinement in (0, 1))
    margin.note(f"moment error: {usual:.1e}, with more modes {more:.1e}")
    margin.within("usual modes", usual, 2e-3)
    margin.within("more modes over usual modes", more / usual, 0.5)
