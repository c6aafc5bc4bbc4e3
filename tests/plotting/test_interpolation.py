"""Flexures are drawn as the arcs that a constant twist describes."""

import numpy as np
import pytest

from notchflex import load_robot
from notchflex.plotting import shape_from_angles


@pytest.mark.parametrize("angle", [1e-9, 1e-7, 0.3, 0.5])
@pytest.mark.parametrize("pieces", [4, 21])
def test_a_flexure_is_a_circular_arc(angle, pieces):
    robot = load_robot("pacheco2021-a")
    shape = shape_from_angles(robot, np.full(5, angle), pieces)
    for flexure in shape.flexures:
        assert len(flexure.area) > pieces
        turn = np.linspace(0.0, angle, len(flexure.area))
        local = (flexure.position - flexure.position[0]) @ flexure.rotation[0]
        radius = np.linalg.norm(local[-1]) / (2.0 * np.sin(0.5 * angle))
        arc = radius * np.stack([1.0 - np.cos(turn), 0.0 * turn, np.sin(turn)], axis=1)
        np.testing.assert_allclose(np.abs(local), arc, atol=1e-9)
        turned = flexure.rotation[0].T @ flexure.rotation
        np.testing.assert_allclose(turned[:, 2, 2], np.cos(turn), atol=1e-12)
