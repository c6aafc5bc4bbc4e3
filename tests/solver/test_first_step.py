"""The first step from rest, where every tendon is straight: it knows the friction already."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from margins import Margin
from notchflex._jax import jax


@pytest.mark.parametrize(
    ("name", "tension", "most"),
    [("gao2017", 2.0, 3), ("gao2017", 6.0, 4), ("pacheco2021-a", 1.0, 3)],
)
def test_friction_costs_no_iteration(name: str, tension: float, most: int) -> None:
    """With contacts that turn by 0 in the first step there is one more."""
    assert nf.solve(nf.load_robot(name), nf.Load(tension=tension)).iterations <= most


def test_turning_at_rest_has_the_slope_of_a_pull(margin: Margin) -> None:
    robot, step = nf.load_robot("pacheco2021-a"), 1e-6
    bend = nf.differentiable(
        robot, nf.pull(0.0, 0.0, steps=1), ["tension"], outputs=("contact_turning",)
    )
    pulled = {"tension": np.ones_like(bend.start["tension"])}
    slope = np.asarray(jax.jvp(bend, (bend.start,), (pulled,))[1]["contact_turning"])[0]
    difference = nf.solve(robot, nf.Load(tension=step)).contact_turning / step
    assert np.max(difference) > 1e-3
    margin.within("slope of the turning at rest", slope - difference, 1e-6)
