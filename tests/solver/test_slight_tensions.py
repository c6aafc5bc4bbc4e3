"""Tendons that are all but slack, on robots that other tendons bend."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf

SLIGHT = (5e-324, 3e-17, 1e-8)
"""Tensions, N: denormal, below what the solver resolves, and above."""


def wander(robot: nf.Robot, seed: int, slight: float, steps: int = 40) -> np.ndarray:
    """Tensions (N) that bend the robot to wandering sides; where they would push, slight ones."""
    random = np.random.default_rng(seed)
    toward = np.radians([tendon.direction_deg for tendon in robot.tendon])
    side = random.uniform(0.0, 2.0 * np.pi) + np.cumsum(random.normal(0.0, 0.25, steps))
    size = np.abs(1.2 + np.cumsum(random.normal(0.0, 0.15, steps)))
    tension = size[:, None] * np.cos(side[:, None] - toward) + random.uniform(0.0, 0.4)
    slack = tension < 0.02
    return np.where(slack, slight * random.integers(0, 2, slack.shape), tension)


def follow(robot: nf.Robot, tension: np.ndarray) -> nf.EquilibriumPath:
    return nf.simulate(robot, nf.LoadPath(tension, np.full_like(tension, np.nan)))


@pytest.mark.parametrize("slight", SLIGHT)
def test_every_load_of_two_axes_is_solved(slight):
    robot = nf.load_robot("two-axis-wrist").with_value("friction.coefficient", 0.2)
    compared = 0
    for seed in (0, 5, 8, 16):
        path = follow(robot, wander(robot, seed, slight))
        assert path.converged.all(), (seed, path.reason)
        if slight <= 3e-17:
            slack = follow(robot, wander(robot, seed, 0.0))
            # A load taken in parts is another path for the friction than the same load at once.
            alike = np.cumprod(path.run.substeps == slack.run.substeps) > 0
            difference = (path.notch_angle - slack.notch_angle)[alike]
            compared += int(alike.sum())
            assert np.abs(difference).max(initial=0.0) < 1e-9
    assert compared > 60 or slight > 3e-17


@pytest.mark.parametrize("name", ["pacheco2021-a", "liu2022", "gao2017"])
def test_ready_robots_with_slight_tensions(name):
    robot = nf.load_robot(name)
    tendons = robot.number_of_tendons
    for slight in SLIGHT:
        first, last = [1.0] * tendons, [slight] * tendons
        mixed = [1.0, *[slight] * (tendons - 1)]
        path = nf.simulate(robot, [nf.Load(tension=one) for one in (last, first, mixed, last)])
        assert path.converged.all(), (slight, path.reason)
        assert np.isfinite(path.span_tension[:, :, 0]).all()
        slack = nf.solve(robot, nf.Load(tension=[0.0] * tendons)).notch_angle
        assert np.abs(path.notch_angle[0] - slack).max() <= max(1e-12, 10.0 * slight)
