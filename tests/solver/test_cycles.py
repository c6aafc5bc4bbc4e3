"""Cycles of one input, with loads beside the tendons, and random histories of all."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import notchflex as nf


@pytest.fixture(scope="module")
def robot() -> nf.Robot:
    """Wrist A, linear, with a tendon on either side."""
    wrist = nf.load_robot("pacheco2021-a")
    return wrist.replace(
        material=nf.Linear(10_000.0),
        friction=nf.Capstan(0.3),
        tendon=(nf.Tendon(0.70), nf.Tendon(0.70, direction_deg=180.0)),
    )


def run(robot: nf.Robot, first, force) -> nf.EquilibriumPath:
    """Tension of the first tendon and a force across the tip, step by step; 0.4 N on the second."""
    first, force = np.broadcast_arrays(np.atleast_1d(first), np.atleast_1d(force))
    loads = [
        nf.Load(tension=(float(pulled), 0.4), tip_force=(float(push), 0.0, 0.0))
        for pulled, push in zip(first, force, strict=True)
    ]
    return nf.simulate(robot, loads).raise_if_failed()


def ramp(*turns: float, steps: int = 12) -> np.ndarray:
    """From turn to turn in equal steps."""
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(turns)]
    return np.concatenate([[turns[0]], *parts])


def work(path: nf.EquilibriumPath, force: np.ndarray, start: int, stop: int) -> float:
    """Work of all that acts from outside from one step to another, by the trapezoid rule."""
    pulled = 0.5 * (path.tension[start + 1 : stop + 1] + path.tension[start:stop])
    drawn = np.diff(path.stroke[start : stop + 1], axis=0)
    pushed = 0.5 * (force[start + 1 : stop + 1] + force[start:stop])
    moved = np.diff(path.tip_position[start : stop + 1, 0])
    return float(np.sum(pulled * drawn) + np.sum(pushed * moved))


def test_return_point_memory_of_a_tension(robot, margin) -> None:
    """After a smaller loop inside a larger one everything is where the smaller one began."""
    tension = ramp(0.4, 1.2, 0.6, 1.0, 0.6, 1.2, 0.6)
    path = run(robot, tension, 0.02)
    for before, after in ((24, 48), (24, 72), (12, 60)):
        margin.within("angles", path.notch_angle[after] - path.notch_angle[before], 1e-11, "rad")
        margin.within("tensions", path.span_tension[after] - path.span_tension[before], 1e-11, "N")


def test_loops_of_a_force_while_the_tendons_hold_settle(robot, margin) -> None:
    """What a contact can bear goes with the tension, which the force changes: loops creep.

    So there is no return-point memory of a force (there would be, were the bounds fixed), but the
    creep dies out.
    """
    loops = 8
    path = run(robot, 0.8, ramp(0.0, 0.06, *(-0.02, 0.03) * loops, -0.02, steps=6))
    ends = path.notch_angle[12::12]
    assert (path.contact_state[:, 0] < 0).any(), "the tendon must slide for this to say anything"
    creep = np.abs(np.diff(ends, axis=0)).max(axis=1)
    margin.note(f"creep of the loops: {' '.join(f'{value:.1e}' for value in creep)} rad")
    assert creep[0] > 1e-5
    assert creep[-1] < 0.2 * creep[0]


@pytest.mark.parametrize("what", ["tension", "force"])
def test_periodic_loops_take_work(robot, margin, what) -> None:
    steps = 30
    if what == "tension":
        tension, force = ramp(0.4, 1.2, 0.5, 1.2, 0.5, steps=steps), np.zeros(4 * steps + 1)
    else:
        force = ramp(0.0, 0.06, -0.04, 0.06, -0.04, steps=steps)
        tension = np.full_like(force, 0.8)
    path = run(robot, tension, force)
    lost = work(path, force, 2 * steps, 4 * steps)
    margin.note(f"work of a periodic loop of {what}: {lost:.3e} N mm")
    assert lost > 1e-6
    # Small loops, which still creep: what they take is more than what they store, or as much.
    small = ramp(0.0, *(1e-4, 0.0) * 10, steps=6) * (1.0 if what == "tension" else 0.1)
    turn = nf.simulate(
        robot,
        [
            nf.Load(
                tension=(tension[-1] + (by if what == "tension" else 0.0), 0.4),
                tip_force=(force[-1] + (by if what == "force" else 0.0), 0.0, 0.0),
            )
            for by in small
        ],
        from_state=path.state,
    ).raise_if_failed()
    pushes = force[-1] + (small if what == "force" else 0.0 * small)
    for start in range(0, 120, 12):
        stored = turn.stored_energy[start + 12] - turn.stored_energy[start]
        assert work(turn, pushes, start, start + 12) - stored >= -1e-9


TENSION = st.floats(0.0, 1.5)
FORCE = st.floats(-0.05, 0.05)


@settings(max_examples=60)
@given(st.lists(st.tuples(TENSION, TENSION, FORCE), min_size=1, max_size=8))
def test_random_histories_converge(robot, history) -> None:
    loads = [
        nf.Load(tension=(one, other), tip_force=(force, 0.0, 0.0)) for one, other, force in history
    ]
    path = nf.simulate(robot, loads)
    assert path.converged.all(), [reason for reason in path.reason if reason]
    span = path.span_tension
    assert (span[~np.isnan(span)] >= 0.0).all()
