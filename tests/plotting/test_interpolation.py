"""Poses between given ones lie on the arc that a constant twist describes."""

import numpy as np
import pytest

from notchflex.plotting.shapes.robot_shape import interpolate_poses, rotation_of


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, 1.5])
def test_a_circular_arc_is_interpolated_exactly(angle):
    length = 2.0

    def pose(part):
        turn = angle * part
        x = length * part * (np.sinc(turn / (2 * np.pi)) * np.sin(turn / 2))
        z = length * part * np.sinc(turn / np.pi)
        return rotation_of(np.array([0.0, turn, 0.0])), np.array([x, 0.0, z])

    parts = np.linspace(0.0, 1.0, 5)
    rotation, position = (np.stack(one) for one in zip(*map(pose, parts), strict=True))
    found = interpolate_poses(rotation[[0, -1]], position[[0, -1]], 4)
    np.testing.assert_allclose(found[0], rotation, atol=1e-12)
    np.testing.assert_allclose(found[1], position, atol=1e-10)


def test_many_rows_are_those_of_each():
    vectors = np.linspace(-0.4, 0.5, 18).reshape(2, 3, 3)
    rotation, position = rotation_of(vectors), np.cumsum(np.abs(vectors), axis=1)
    together = interpolate_poses(rotation, position, 3)
    for row in range(2):
        own = interpolate_poses(rotation[row], position[row], 3)
        np.testing.assert_allclose(together[1][row], own[1], atol=1e-14)
    np.testing.assert_allclose(together[0][:, ::3], rotation, atol=1e-12)
    np.testing.assert_allclose(together[1][:, ::3], position, atol=1e-12)
