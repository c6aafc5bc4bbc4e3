"""Cameras: what they must see is in their picture, and fills it."""

import numpy as np
import pytest

from notchflex.viewer.scene import FOV, first_eye, framed


def seen(eye, points, aspect, fov):
    """Where points are in the picture: from -1 to 1 across and down."""
    x, y, depth = ((points - eye.position) @ eye.rotation).T
    assert depth.min() > 0.0
    slope = np.tan(0.5 * fov)
    return x / depth / slope / aspect, y / depth / slope


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.4])
@pytest.mark.parametrize("fov", [0.3, FOV])
def test_points_fill_the_picture_and_none_is_cut_off(aspect, fov):
    source = np.random.default_rng(4)
    for _ in range(20):
        points = source.normal(size=(30, 3)) * [1.0, 3.0, 8.0]
        toward = source.normal(size=3)
        eye = framed(points, toward, aspect, fov)
        x, y = seen(eye, points, aspect, fov)
        assert max(np.abs(x).max(), np.abs(y).max()) == pytest.approx(1.0, abs=1e-9)
        away = eye.position - eye.target
        assert away / np.linalg.norm(away) == pytest.approx(toward / np.linalg.norm(toward))


@pytest.mark.parametrize("direction_deg", [0.0, 90.0, 200.0])
def test_from_the_side_is_at_right_angles_to_the_plane_of_bending(direction_deg):
    eye = first_eye(direction_deg, 20.0, np.eye(3), side=True, aspect=1.0)
    way = eye.position - eye.target
    angle = np.radians(direction_deg)
    plane = np.array([[np.cos(angle), np.sin(angle), 0.0], [0.0, 0.0, 1.0]])
    assert plane @ way == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_picture_is_upright():
    eye = framed(np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]), np.array([1.0, -2.0, 0.5]), 1.0)
    assert np.linalg.det(eye.rotation) == pytest.approx(1.0)
    assert eye.rotation[2, 0] == pytest.approx(0.0)  # right is level
    assert eye.rotation[2, 1] < 0.0  # down is down
