"""Fits that are started from a chain whose points a person dragged."""

import cv2
import numpy as np
import pytest

import notchflex as nf
from notchflex.photographs.measure import measure_picture
from notchflex.photographs.outline import (
    NUMBERS,
    PlanarRobot,
    axis_points,
    on_axis_points,
    straight_chain,
)
from photographs.renderer import Scene, render
from refusals import refused

ROBOT = nf.load_robot("pacheco2021-a")
TABLE = PlanarRobot(ROBOT)
ANGLES = np.radians([14.0, 22.0, 18.0, 9.0, 16.0])
SCENE = Scene(
    size=(720, 620), scale=46.0, place=(450.0, 150.0), direction=75.0, roll=8.0, tilt=5.0, seed=3
)
BY_HAND = np.array(
    [[436, 112], [455, 146], [450, 240], [436, 303], [376, 370], [326, 437], [246, 463]], float
)
"""Points clicked on the axis of the tube in that photograph, to about 6 px."""


def numbers_of(direction, scale, roll, angles):
    return np.array([30.0, -20.0, direction, np.log(scale), roll, 0, 0, 0, 0, *angles])


@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_a_chain_lies_on_its_own_points(turn):
    truth = numbers_of(2.6, 40.0, turn, ANGLES)
    points = axis_points(TABLE, truth)
    best = min(
        on_axis_points(TABLE, points),
        key=lambda one: float(np.abs(one[NUMBERS:] - ANGLES).max()),
    )
    np.testing.assert_allclose(axis_points(TABLE, best), points, atol=3.0)
    np.testing.assert_allclose(best[NUMBERS:], ANGLES, atol=np.radians(3.0))
    assert best[3] == pytest.approx(np.log(40.0), abs=0.02)


def test_the_last_points_are_those_of_the_library():
    """Seen from far away and straight from the side: positions of the bodies, scaled."""
    points = axis_points(TABLE, numbers_of(0.0, 10.0, 0.0, ANGLES))
    tip, _ = nf.tip_from_angles(ROBOT, ANGLES[None])
    x, _, z = tip[0] - [0.0, 0.0, ROBOT.tube.base_length]
    np.testing.assert_allclose(points[-1], [30.0 + 10.0 * z, -20.0 + 10.0 * x], atol=1e-6)


def test_a_straight_chain_lies_in_the_photograph():
    points = straight_chain(TABLE, 400, 300)
    assert points.shape == (7, 2)
    assert (points > 0.0).all()
    assert (points < [400.0, 300.0]).all()


def test_points_that_are_no_chain():
    good = BY_HAND - 300.0
    bad = good.copy()
    bad[2, 1] = np.nan
    for points in (good[:-1], bad, np.zeros((7, 2)), good.ravel()):
        with refused("OUT_OF_RANGE"):
            on_axis_points(TABLE, points)


def cluttered():
    """The photograph with a rod lying across the tube."""
    picture = render(ROBOT, ANGLES, SCENE)
    cv2.line(picture, (20, 300), (700, 300), 60, 12)
    return np.repeat(picture[..., None], 3, axis=2)


def test_a_fit_from_points_dragged_by_hand():
    found = measure_picture(cluttered(), TABLE, "wrist", chain=BY_HAND)
    assert found.reason == ""
    np.testing.assert_allclose(found.notch_angle, ANGLES, atol=np.radians(0.15))
    assert np.abs(found.chain - BY_HAND).max() < 12.0


@pytest.mark.nightly
def test_points_are_needed_where_something_lies_across():
    """Without them the rod is taken for the tube, and the photograph is refused."""
    assert measure_picture(cluttered(), TABLE, "wrist").reason
