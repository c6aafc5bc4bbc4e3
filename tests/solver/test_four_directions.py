"""Notches at 0, 90, 180, 270 deg under four tendons, against a product of matrix exponentials.

A tendon at the angle Delta from the bend of a notch is h - theta (ybar + r cos Delta) long in it
(Pacheco 2021, eq. 3, for any side of the wall). The oracle is tests/oracles/frames.py.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from levels import simulate_at
from oracles import frames
from oracles.wrist import A
from robots import of_frames

EXACT = 1e-10  # rad, mm, N
QUARTERS = np.radians([0.0, 90.0, 180.0, 270.0])
TENSIONS = [
    (0.6, 0.2, 0.35, 0.3),
    (0.1, 0.9, 0.05, 0.15),
    (0.4, 0.4, 0.4, 0.4),
    (0.0, 0.0, 0.8, 0.0),
    (0.9, 0.0, 0.0, 0.25),
]
EQUAL = A.with_(height=(0.8,) * 4, uncut=(1.2,) * 4, depth=(1.40,) * 4, mu=0.0, wrap="geometric")
UNEVEN = EQUAL.with_(
    height=(0.8, 0.6, 1.0, 0.7),
    uncut=(1.2, 0.9, 0.5, 2.0),
    depth=(1.40, 1.30, 1.36, 1.42),
    precurvature=(0.02, 0.0, 0.05, -0.01),
)
WRISTS = {
    "equal, frictionless": EQUAL,
    "uneven, frictionless": UNEVEN,
    "uneven, friction at either edge": UNEVEN.with_(mu=0.13),
    "uneven, friction ahead of a notch": UNEVEN.with_(mu=0.13, wrap="whole-before"),
}


def oracle(kind: str) -> frames.Robot:
    return frames.Robot(WRISTS[kind], QUARTERS, frames.Tendons(np.full(4, 0.7), QUARTERS))


@pytest.mark.parametrize("tension", TENSIONS, ids=str)
@pytest.mark.parametrize("kind", WRISTS)
def test_four_tendons(kind, tension, margin):
    expected = oracle(kind)
    angle, gap_tension = expected.equilibrium(tension)
    # The notches of the oracle bend toward their own side alone.
    state = simulate_at(of_frames(expected), nf.Load(tension=tension), "tendons")[0]

    assert state.converged, state.reason
    margin.within("angles", state.notch_angle - angle, EXACT, "rad")
    margin.within("gap tensions", state.span_tension[:, 1::2].T - gap_tension, EXACT, "N")
    slid = expected.slide(angle)
    margin.within("strokes", state.stroke - slid[0, 0], EXACT, "mm")
    bodies = expected.bodies(angle)
    margin.within("tip", state.tip_position - bodies[-1, :3, 3], EXACT, "mm")
    margin.within("tip rotation", state.tip_rotation - bodies[-1, :3, :3], EXACT)
    margin.within("bodies", state.body_position - bodies[:-1, :3, 3], EXACT, "mm")
    margin.within("body rotations", state.body_rotation - bodies[:-1, :3, :3], EXACT)


def test_the_tip_leaves_every_plane():
    """The test above is one of space: no plane through the base axis holds the tip's heading."""
    state = nf.solve(of_frames(oracle("equal, frictionless")), nf.Load(tension=TENSIONS[0]))
    position, axis = state.tip_position, state.tip_rotation[:, 2]
    out_of_plane = np.cross([0.0, 0.0, 1.0], position / np.linalg.norm(position)) @ axis
    assert abs(out_of_plane) > 1e-3


def test_forward_kinematics_of_given_angles(margin):
    expected = oracle("uneven, frictionless")
    angle = np.array([[0.3, -0.1, 0.2, 0.25], [0.0, 0.0, 0.0, 0.0], [-0.4, 0.1, 1e-9, 0.3]])
    position, rotation = nf.tip_from_angles(of_frames(expected), angle)
    tips = np.array([expected.bodies(a)[-1] for a in angle])
    margin.within("tip", position - tips[:, :3, 3], 1e-12, "mm")
    margin.within("rotation", rotation - tips[:, :3, :3], 1e-12)


@pytest.mark.parametrize("end_body", [1, 2, 3])
def test_tendon_that_ends_before_the_tip(end_body, margin):
    """Beyond its end a tendon does nothing: the rest stays as it is when free."""
    robot = of_frames(oracle("uneven, friction at either edge"))
    robot = robot.with_value("tendon[1].end_body", end_body)
    state = simulate_at(robot, nf.Load(tension=(0.9, 0.0, 0.0, 0.0)), "tendons")[0]
    assert state.converged, state.reason
    start = UNEVEN.start
    margin.within("free notches", state.notch_angle[end_body:] - start[end_body:], 1e-14, "rad")
    assert (np.abs(state.notch_angle - start)[:end_body] > 1e-3).all()
    assert np.isnan(state.span_tension[0, 2 * end_body :]).all()
    assert np.isfinite(state.span_tension[0, : 2 * end_body]).all()
