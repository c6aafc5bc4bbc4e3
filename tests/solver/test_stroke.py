"""A tendon drawn by a given stroke gives the shape of the tension that draws it so far."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from loads import strokes, tensions
from oracles.wrist import SPECIMENS, WRISTS
from robots import of_wrist, ready, specimen

ANGLE = 2e-11  # rad
# Base tension at which the last notch closes [N] (tests/reference/pacheco_closing.csv).
LAST_CLOSING = {"A": 2.1329, "B": 1.872, "C": 2.309}
BELOW = np.array([0.0, 0.02, 0.2, 0.45, 0.6, 0.75, 0.85, 0.93, 0.97, 0.999])


@pytest.mark.parametrize("make", [ready, specimen], ids=["ready", "specimen"])
@pytest.mark.parametrize("name", "ABC")
def test_stroke_gives_the_shape_of_its_tension(name, make, margin):
    robot = make(name)
    last = nf.closing(robot).tension.max()
    if make is ready:
        assert abs(last - LAST_CLOSING[name]) < 1e-3
    pulled = nf.simulate(robot, tensions(BELOW * last))
    assert pulled.converged.all(), pulled.reason
    assert pulled.closed.any(), "no notch closes below the last: nothing is tried"
    assert not pulled.closed.all(axis=1).any()

    drawn = nf.simulate(robot, strokes(pulled.stroke))
    assert drawn.converged.all(), drawn.reason
    margin.within("angles along a path", drawn.notch_angle - pulled.notch_angle, ANGLE, "rad")
    margin.within("stroke kept", drawn.stroke - pulled.stroke, 1e-11, "mm")
    for i in (1, 4, 7, 9):
        state = nf.solve(robot, nf.Load(stroke=float(pulled.stroke[i, 0])))
        assert state.converged, state.reason
        margin.within("angles from rest", state.notch_angle - pulled.notch_angle[i], ANGLE, "rad")
        margin.within("tension found", state.tension - pulled.tension[i], 5e-11, "N")


@pytest.mark.parametrize("wrap", ["geometric", "whole-before"])
def test_stroke_given_on_the_way_back(wrap, margin):
    """Let go far enough that the tendon slides at the base, a stroke fixes the tension again."""
    robot = ready("A").replace(friction=nf.Capstan(0.13, wrap=wrap))
    tension = np.array([0.5, 1.2, 1.9, 1.2, 0.8, 0.4, 0.9, 1.5])
    pulled = nf.simulate(robot, tensions(tension))
    assert pulled.converged.all(), pulled.reason
    assert (np.abs(np.diff(pulled.stroke[:, 0])) > 1e-2).all(), "a stroke that does not move"
    drawn = nf.simulate(robot, strokes(pulled.stroke))
    assert drawn.converged.all(), drawn.reason
    margin.within("angles", drawn.notch_angle - pulled.notch_angle, ANGLE, "rad")


@pytest.mark.parametrize("part", [0.5, 0.99])
@pytest.mark.parametrize("wrap", ["geometric", "whole-before"])
@pytest.mark.parametrize("name", ["A", "C specimen"])
def test_drawn_and_let_go_in_small_steps(name, wrap, part, margin):
    """At the turn the tension jumps, while nothing moves: every contact turns round at once."""
    wrist = (SPECIMENS[name[0]] if name.endswith("specimen") else WRISTS[name]).with_(wrap=wrap)
    up = np.linspace(0.0, part * wrist.stroke(wrist.closing_angle), 31)
    path = nf.simulate(of_wrist(wrist), strokes([*up, *up[::-1]]))
    assert path.converged.all(), [reason for reason in path.reason if reason]
    margin.within("stroke kept", path.stroke[:, 0] - [*up, *up[::-1]], 1e-11, "mm")

    # The oracle knows tensions only: it is asked for the one that leads to the stroke.
    def missing(tension: float, history: list[float], stroke: float) -> float:
        return wrist.stroke(wrist.march([*history, tension])[-1].angle) - stroke

    peak = brentq(missing, 0.0, 3.0, args=([], up[-1]), xtol=1e-15)
    for step in (10, 25, 35, 50):
        history = [] if step < 31 else [peak]
        stroke = float(path.stroke[step, 0])
        tension = brentq(missing, 0.0, peak, args=(history, stroke), xtol=1e-15)
        angle = wrist.march([*history, tension])[-1].angle
        margin.within("angles", path.notch_angle[step] - angle, ANGLE, "rad")


def test_a_tendon_that_was_pulled_far_is_let_go_by_its_stroke():
    """At the turn the residual first rises, as the 27 contacts leave their bounds together."""
    robot = nf.load_robot("gao2017")
    pulled = nf.simulate(robot, tensions(np.linspace(0.25, 30.0, 60))).raise_if_failed()
    end = float(pulled.stroke[-1, 0])
    drawn = nf.simulate(robot, strokes(np.arange(end, 2.0, -0.09)), from_state=pulled.state)
    assert drawn.converged.all(), [reason for reason in drawn.reason if reason]
    assert np.linalg.norm(drawn.tip_position[-1] - pulled.tip_position[-1]) > 5.0


@pytest.mark.nightly
def test_no_stroke_is_followed_to_a_tension_that_nothing_bears():
    """Beside the plane of its notches a tendon goes on bending closed notches sideways."""
    robot = ready("A").with_value("tendon[1].direction_deg", 4.0)
    path = nf.simulate(robot, strokes([3.0, 8.0]))
    assert path.converged.tolist() == [True, False]
    assert path.reason[1]
    assert path.tension.max() < 1e5 * float(path.chain.closing_force)
