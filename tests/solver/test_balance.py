"""Every robot under tendons, tip force, tip moment and gravity at once: it balances and is stable.

All is recomputed in numpy from what the result reports (tests/balance.py). Loads are not in the
plane of bending, and the base is turned.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

import notchflex as nf
from balance import cone_used, left_over

EXACT = 1e-10


class Case(NamedTuple):
    """Tensions (N) first pulled, then changed to, and the sizes of force (N) and moment (N mm)."""

    pulled: tuple[float, ...]
    changed: tuple[float, ...]
    force: float
    moment: float


CASES = {
    "pacheco2021-a": Case((0.8,), (0.7,), 0.01, 0.02),
    "two-axis-wrist": Case((0.8, 0.5, 0.2, 0.3), (0.6, 0.6, 0.2, 0.25), 0.01, 0.02),
    "liu2022": Case((5.0, 1.0), (4.0, 1.5), 0.2, 1.0),
    "gao2017": Case((8.0,), (7.0,), 0.05, 0.5),
}
QUICK = "pacheco2021-a"  # the others take long to compile


def loaded(name: str) -> list[nf.EquilibriumPath]:
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
        paths.append(nf.simulate(robot, load, from_state=state))
        state = paths[-1].state
    return paths


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.nightly] * (one != QUICK)) for one in CASES]
)
def test_it_balances_within_the_cone_of_friction_and_is_stable(name, margin):
    pulled, changed = loaded(name)
    for path in (pulled, changed):
        assert path.converged.all(), path.reason
        for what, left in zip(("force", "moment"), left_over(path), strict=True):
            margin.within(f"{what} left over", left, EXACT)
        margin.within("friction beyond its cone", np.maximum(cone_used(path), 1.0) - 1.0, EXACT)
    # Pulled from rest a tendon slides all along; after a small change some of it sticks.
    assert cone_used(pulled).max() > 1.0 - EXACT
    assert cone_used(changed).min() < 1.0 - 1e-3
    assert pulled.stable.all()
