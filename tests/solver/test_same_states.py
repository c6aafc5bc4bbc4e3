"""A robot, its mirror image and the same loads but for rounding have the same states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf

CASES = Path(__file__).parent / "cases"
MIRROR, MIRROR_AXIS = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])


def redirected(robot: nf.Robot, change: Callable[[float], float]) -> nf.Robot:
    """The robot with other directions of its notches and tendons."""
    notches, tendons = (
        tuple(replace(part, direction_deg=change(part.direction_deg)) for part in parts)
        for parts in (robot.notch, robot.tendon)
    )
    return replace(robot, notch=notches, tendon=tendons)


def mirrored(robot: nf.Robot) -> nf.Robot:
    """The mirror image of a robot at the x-z plane."""
    return redirected(robot, lambda direction_deg: -direction_deg)


def assert_same_states(reference: nf.EquilibriumPath, path: nf.EquilibriumPath) -> None:
    """Require that both converge at every step, to states alike but for rounding."""
    for one in (reference, path):
        assert one.converged.all(), next(filter(None, one.reason))
    np.testing.assert_allclose(path.notch_angle, reference.notch_angle, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(path.tension, reference.tension, rtol=1e-8, atol=1e-9)
    np.testing.assert_array_equal(path.closed, reference.closed)


@pytest.mark.nightly
def test_edges_on_one_side_but_for_rounding_are_one_contact():
    robot = nf.load_robot(CASES / "links_and_strips.toml")
    turned, hanging = np.array([-0.55, 0.54, 1.87]), nf.Load(tip_mass=25.0)
    tensions = np.append(np.linspace(0.0, 12.0, 9), np.linspace(11.0, 0.0, 5))

    def followed(robot: nf.Robot, base_rotation: np.ndarray, change: float = 0.0):
        scale = 1.0 + change * np.random.default_rng(0).standard_normal(len(tensions))
        loads = [
            replace(hanging, tension=tension, base_rotation=tuple(base_rotation))
            for tension in (scale * tensions).tolist()
        ]
        return nf.simulate(robot, loads)

    reference = followed(robot, turned)
    assert (reference.closed.sum(axis=1) > 1).any()
    image = followed(mirrored(robot), MIRROR_AXIS * turned)
    assert_same_states(reference, image)
    np.testing.assert_allclose(image.tip_position, MIRROR * reference.tip_position, atol=1e-8)
    assert_same_states(reference, followed(robot, turned, 1e-13))
    assert_same_states(reference, followed(mirrored(robot), MIRROR_AXIS * turned, 1e-13))


def turned(robot: nf.Robot, by_deg: float) -> nf.Robot:
    """The robot turned about its axis."""
    return redirected(robot, lambda direction_deg: direction_deg + by_deg)


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # a tendon inside the wall
def test_contacts_that_reverse_together_are_found_whatever_the_rounding():
    robot = nf.load_robot(CASES / "antagonists_on_strips.toml")
    up = 6.35476869988914 * np.arange(7) / 6
    strokes = np.concatenate([up, up[-2::-1], 4.4682904855648475 * np.arange(1, 5) / 4])

    def followed(robot: nf.Robot, change: float = 0.0, seed: int = 0) -> nf.EquilibriumPath:
        scale = 1.0 + change * np.random.default_rng(seed).standard_normal(len(strokes))
        loads = [
            nf.Load(tension=[114.2485316, None], stroke=[None, stroke])
            for stroke in (scale * strokes).tolist()
        ]
        return nf.simulate(robot, loads)

    reference = followed(robot)
    assert_same_states(reference, followed(turned(robot, 77.0)))
    for seed in range(2):
        assert_same_states(reference, followed(robot, 1e-13, seed))
