"""A robot does not know where it is held: the base turned, or all of it turned about its axis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import notchflex as nf
from oracles import frames
from oracles.wrist import A
from robots import of_frames, specimen

EXACT = 1e-12  # rad and, as the robots are about 10 mm long, mm
TENSION = (0.5, 0.25, 0.35, 0.1)
UNEVEN = A.with_(
    height=(0.8, 0.6, 1.0, 0.7),
    uncut=(1.2, 1.0, 0.5, 2.0),
    depth=(1.40, 1.30, 1.36, 1.42),
    precurvature=(0.02, 0.0, 0.05, -0.01),
    wrap="geometric",
)


def robot_turned(by: float) -> nf.Robot:
    """Four tendons and four notches all round, everything turned about the axis [rad]."""
    tendons = frames.Tendons(
        np.array([0.7, 0.6, 0.7, 0.7]), np.radians([10.0, 130.0, 250.0, 310.0]) + by
    )
    direction = np.radians([0.0, 75.0, 190.0, 300.0]) + by
    return of_frames(frames.Robot(UNEVEN, direction, tendons))


def assert_same_shape_turned(state, reference, rotation: np.ndarray, margin) -> None:
    """`rotation` takes the reference shape to the shape of `state`."""
    margin.within("angles", state.notch_angle - reference.notch_angle, EXACT, "rad")
    span = state.span_tension - reference.span_tension
    margin.within("tensions", span[np.isfinite(span)], EXACT, "N")
    margin.within("tip", state.tip_position - rotation @ reference.tip_position, EXACT, "mm")
    bodies = reference.body_position @ rotation.T
    margin.within("bodies", state.body_position - bodies, EXACT, "mm")


@pytest.mark.parametrize("vector", [(1.0, -2.0, 0.7), (0, np.pi, 0)])
def test_base_turned(vector, margin):
    robot = robot_turned(0.0)
    reference = nf.solve(robot, nf.Load(tension=TENSION))
    state = nf.solve(robot, nf.Load(tension=TENSION, base_rotation=vector))
    assert state.converged, state.reason
    rotation = Rotation.from_rotvec(vector).as_matrix()
    assert_same_shape_turned(state, reference, rotation, margin)
    turned = rotation @ reference.body_rotation
    margin.within("body rotations", state.body_rotation - turned, EXACT)


@pytest.mark.parametrize("by_deg", [90.0, 123.4, -3210.0])
def test_notches_and_tendons_turned(by_deg, margin):
    by = np.radians(by_deg)
    reference = nf.solve(robot_turned(0.0), nf.Load(tension=TENSION))
    state = nf.solve(robot_turned(by), nf.Load(tension=TENSION))
    assert state.converged, state.reason
    rotation = Rotation.from_euler("z", by).as_matrix()
    assert_same_shape_turned(state, reference, rotation, margin)
    turned = rotation @ reference.body_rotation @ rotation.T
    margin.within("body rotations", state.body_rotation - turned, EXACT)


@settings(deadline=None, max_examples=10, derandomize=True)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.floats(-180.0, 180.0), st.floats(0.0, 3.0))
def test_wrist_held_anyhow(vector, by_deg, tension):
    robot = specimen("A")
    turned = robot.with_value("notch[*].direction_deg", by_deg)
    turned = turned.with_value("tendon[1].direction_deg", by_deg)
    reference = nf.solve(robot, nf.Load(tension=tension))
    state = nf.solve(turned, nf.Load(tension=tension, base_rotation=vector))
    assert state.converged, state.reason
    rotation = Rotation.from_rotvec(vector) * Rotation.from_euler("z", by_deg, degrees=True)
    expected = rotation.as_matrix() @ reference.tip_position
    np.testing.assert_allclose(state.notch_angle, reference.notch_angle, rtol=0, atol=EXACT)
    np.testing.assert_allclose(state.tip_position, expected, rtol=0, atol=EXACT)


def test_base_turned_along_a_path(margin):
    up = nf.pull(0.0, 2.0, steps=9).release()
    reference = nf.simulate(specimen("A"), up)
    vector = (0.4, -1.1, 0.2)
    held = nf.LoadPath(tension=up.tension, stroke=up.stroke, base_rotation=vector)
    path = nf.simulate(specimen("A"), held)
    rotation = Rotation.from_rotvec(vector).as_matrix()
    margin.within("angles", path.notch_angle - reference.notch_angle, EXACT, "rad")
    margin.within("tips", path.tip_position - reference.tip_position @ rotation.T, EXACT, "mm")
