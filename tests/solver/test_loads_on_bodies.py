"""Loads beside the tendons: closed forms, loads that no shape bears, going on from states."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import notchflex as nf
from gao2017 import robot as gao_robot

# Strip of Liu 2022: l, EI.
LENGTH, STIFFNESS = 8.0, 1000.406 * 1.125


@pytest.fixture(scope="module")
def one_strip() -> nf.Robot:
    robot = nf.load_robot("liu2022")
    return robot.replace(
        notch=(dataclasses.replace(robot.notch[0], repeat=1),),
        tendon=(dataclasses.replace(robot.tendon[0], end_body=1),),
    )


@pytest.mark.parametrize("force", [2.0, 12.0])
@pytest.mark.parametrize("following", [False, True])
def test_force_on_the_end_of_a_strip_is_the_elastica(one_strip, force, following, margin) -> None:
    """The strip's free end lies 4 mm beside the axis and 1.5 mm below the tip."""
    load = nf.Load(tip_force=(0.0, 0.0, -force), tip_point=(4.0, 0.0, -1.5), following=following)
    state = nf.solve(one_strip, load).raise_if_failed()
    reading = {"follower" if following else "clamp_angle": 0.5 * np.pi}
    beam = nf.elastica(force, LENGTH, STIFFNESS, **reading)
    margin.within("slope at the end", state.notch_angle[0] - beam.tip_slope, 1e-7, "rad")
    margin.within("chord", state.chord_angle[0] - beam.chord_angle, 1e-7, "rad")
    end = state.tip_position + state.tip_rotation @ np.array([4.0, 0.0, -1.5])
    expected = [-4.0 + beam.tip_along, 0.0, 3.5 - beam.tip_across]
    margin.within("end", end - expected, 1e-6, "mm")


def test_moment_on_a_strip_is_a_circle(one_strip, margin) -> None:
    state = nf.solve(one_strip, nf.Load(tip_moment=(0.0, 40.0, 0.0))).raise_if_failed()
    turned = 40.0 * LENGTH / STIFFNESS
    margin.within("turn", state.notch_angle[0] - turned, 1e-12, "rad")
    end = state.tip_position + state.tip_rotation @ np.array([4.0, 0.0, -1.5])
    radius = LENGTH / turned
    expected = [radius * np.sin(turned) - 4.0, 0.0, 3.5 - radius * (1.0 - np.cos(turned))]
    margin.within("end", end - expected, 1e-11, "mm")


def test_compression_that_buckles_is_told() -> None:
    """Pushed along its axis Gao's robot is straight and stable at first, later it is not."""
    loads = [nf.Load(tip_force=(0.0, 0.0, -push)) for push in (0.1, 0.5, 1.0, 2.0, 3.0, 6.0)]
    path = nf.simulate(gao_robot(), loads)
    for step, reason in enumerate(path.reason):
        assert path.converged[step] or reason
    good = path.converged & path.stable
    assert good[0]
    assert not good[-1]
    assert np.isfinite(path.tip_position).all()


def test_going_on_with_loads_from_a_state_without(margin) -> None:
    """A state of tendons alone has fewer modes than one with loads; nothing is lost on the way."""
    wrist = nf.load_robot("pacheco2021-a")
    first = [nf.Load(tension=value) for value in (0.6, 1.2, 0.9)]
    then = [nf.Load(tension=0.9, tip_force=(push, 0.0, 0.0)) for push in (0.01, 0.03, -0.01)]
    whole = nf.simulate(wrist, [*first, *then]).raise_if_failed()
    before = nf.simulate(wrist, first).raise_if_failed()
    after = nf.simulate(wrist, then, from_state=before.state).raise_if_failed()
    assert before.chain.rods.modes < after.chain.rods.modes
    margin.within("angles", after.notch_angle - whole.notch_angle[3:], 2e-11, "rad")
    margin.within("tensions", after.span_tension - whole.span_tension[3:], 3e-11, "N")


@pytest.mark.parametrize(
    ("name", "tension", "force"),
    [("two-axis-wrist", [0.3, 0.1], (0.02, 0.01, 0.0)), ("gao2017", [6.0], (0.4905, 0.0, 0.0))],
)
def test_loads_come_before_the_tendons(name, tension, force, margin) -> None:
    """The state in between, which is solved less exactly, leaves no trace in the friction."""
    robot, follows = nf.load_robot(name), len(tension) > 1  # as in test_balance.py
    both = nf.Load(tension=tension, tip_force=force, following=follows)
    at_once = nf.solve(robot, both).raise_if_failed()
    first = nf.Load(tip_force=force, following=follows)
    in_turn = nf.simulate(robot, [first, both])[-1].raise_if_failed()
    margin.within("tip", at_once.tip_position - in_turn.tip_position, 1e-11, "mm")
    friction = at_once.contact_log_ratio - in_turn.contact_log_ratio
    margin.within("log ratios", friction[np.isfinite(friction)], 1e-11)


def test_opposite_tendon_is_the_mirror_image(margin) -> None:
    """Slots that begin on the other side, and the tendon there: the same robot, turned over."""
    left = gao_robot()
    right = left.replace(
        notch=(dataclasses.replace(left.notch[0], proximal_slot="toward"),),
        tendon=(dataclasses.replace(left.tendon[0], direction_deg=180.0),),
    )
    one, other = (nf.solve(robot, nf.Load(tension=7.0)) for robot in (left, right))
    mirrored = other.tip_position * np.array([-1.0, 1.0, 1.0])
    margin.within("tip", one.tip_position - mirrored, 1e-11, "mm")
    margin.within("tensions", one.span_tension - other.span_tension, 3e-11, "N")


def test_what_the_modes_cannot_follow_is_no_result() -> None:
    """A load a thousand times too large finds a balance of the few modes, but no shape."""
    with pytest.warns(nf.InputWarning, match="tip_force"):
        state = nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tip_force=(1000.0, 0.0, 0.0)))
    assert not state.converged
    assert state.reason
    assert np.isfinite(state.tip_position).all()
