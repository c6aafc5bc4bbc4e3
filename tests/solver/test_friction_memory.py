"""Friction remembers: unloading and partial loops against the play operator.

At contact i the tension beyond is T_i = clip(T_i before, T_{i-1} e^{-c_i}, T_{i-1} e^{+c_i})
with c_i the friction coefficient times the turning, marched from the base to the tip. The oracle
solves it with one scalar root per notch (tests/oracles/wrist.py) and knows nothing of contacts
that stick or slide.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import notchflex as nf
from loads import tensions
from margins import Margin
from oracles.wrist import SPECIMENS, WRISTS, Wrist
from robots import of_wrist, ready

FORCE = 1e-7  # N
QUIET = Margin(lambda *_: None)  # one line for each of many examples is too many
ORACLES = {
    "A": WRISTS["A"],
    "A, half the turning at either edge": WRISTS["A"].with_(wrap="geometric"),
    "A specimen": SPECIMENS["A"],
    "C specimen, half the turning at either edge": SPECIMENS["C"].with_(wrap="geometric"),
}


def compare(
    wrist: Wrist, robot: nf.Robot, tension: Sequence[float], margin, what: str
) -> nf.EquilibriumPath:
    """Assert that a history of base tensions [N] leaves the package where the oracle is."""
    path = nf.simulate(robot, tensions(tension))
    assert path.converged.all(), [r for r in path.reason if r]
    margin.note(f"{what}: residual {path.residual.max():.1e}, iterations {path.iterations.max()}")
    states = wrist.march(tension)
    spans = path.span_tension[:, 0]
    gap = np.array([state.gap_tension for state in states])
    body = np.array([state.body_tension for state in states])
    margin.within(f"{what}: gap tensions", spans[:, 1::2] - gap, FORCE, "N")
    margin.within(f"{what}: body tensions", spans[:, 2::2] - body[:, :-1], FORCE, "N")
    margin.within(f"{what}: base tension", spans[:, 0] - tension, 1e-12, "N")
    # The loosest notch of these wrists turns by 0.2 rad/N, and by 0.7 where it is superelastic.
    angle = np.array([state.angle for state in states])
    margin.within(f"{what}: angles", path.notch_angle - angle, 3e-11, "rad")
    return path


@pytest.mark.parametrize("name", ORACLES)
def test_pull_and_release(name, margin):
    up = np.linspace(0.0, 3.0, 31)
    path = compare(ORACLES[name], of_wrist(ORACLES[name]), [*up, *up[::-1]], margin, name)
    pulled, released = path.total_angle[:31], path.total_angle[31:][::-1]
    assert (released - pulled > -1e-9).all(), "a wrist let go stays bent, it never lags ahead"
    assert (released - pulled)[5:16].min() > np.radians(1.0), "there is no hysteresis to see"


@st.composite
def histories(draw) -> np.ndarray:
    """Base tensions [N] that turn round at random, always 48 steps so that one program serves."""
    turns = draw(st.lists(st.floats(0.0, 3.0), min_size=2, max_size=8))
    lengths = [len(part) for part in np.array_split(np.arange(48), len(turns))]
    legs, last = [], 0.0
    for turn, count in zip(turns, lengths, strict=True):
        legs.append(np.linspace(last, turn, count + 1)[1:])
        last = turn
    return np.concatenate(legs)


@pytest.mark.parametrize("name", ORACLES)
def test_random_partial_loops(name):
    robot = of_wrist(ORACLES[name])

    @settings(
        deadline=None,
        max_examples=15,
        derandomize=True,
        suppress_health_check=[HealthCheck.too_slow],
    )
    @given(histories())
    def holds(tension: np.ndarray) -> None:
        compare(ORACLES[name], robot, tension, QUIET, name)

    holds()


@settings(deadline=None, max_examples=15, derandomize=True)
@given(st.lists(st.floats(0.0, 3.0), min_size=12, max_size=12))
def test_random_jumps(tension):
    """Steps of any size: what is remembered does not depend on how finely a leg is cut."""
    compare(WRISTS["A"], ready("A"), tension, QUIET, "jumps")


@pytest.mark.parametrize("wrap", ["geometric", "whole-before"])
def test_inner_loop_closes(wrap, margin):
    """Return-point memory: pulled back to 2 N after 1 N, the wrist is where it was at 2 N."""
    robot = ready("A").replace(friction=nf.Capstan(0.13, wrap=wrap))
    turns = (2.0, 1.0, 2.0, 1.0)
    path = nf.simulate(robot, tensions(turns))
    margin.within("shape at the return", path.notch_angle[2] - path.notch_angle[0], 1e-11, "rad")
    margin.within("shape at the second", path.notch_angle[3] - path.notch_angle[1], 1e-11, "rad")
    assert path.total_angle[1] - nf.solve(robot, nf.Load(tension=1.0)).total_angle > 0.1


def test_history_continues_from_a_state(tmp_path, margin):
    """Cut anywhere, also through a file, a history ends where the whole one does."""
    tension = np.array([1.0, 2.5, 1.2, 0.4, 1.7, 0.9])
    whole = nf.simulate(ready("A"), tensions(tension))
    first = nf.simulate(ready("A"), tensions(tension[:3]))
    first.state.save(tmp_path / "state.json")
    for state in (first.state, nf.State.load(tmp_path / "state.json"), whole.state_at(2)):
        rest = nf.simulate(ready("A"), tensions(tension[3:]), from_state=state)
        margin.within("angles", rest.notch_angle - whole.notch_angle[3:], 1e-11, "rad")
        margin.within("tensions", rest.span_tension - whole.span_tension[3:], 1e-11, "N")
