"""Liu's robot where the tables end: both cables, closed lips, and where friction has no law.

The numbers beside are from tests/oracles/strip.py, which shoots every strip by itself.
"""

from __future__ import annotations

import numpy as np
import pytest

from liu2022 import STEPS, liu, pulled
from oracles.strip import Strip, march, solve_notch

ANGLE, FORCE, GAP = 1e-10, 1e-9, 2e-6  # rad; tension relative to the pull; mm
FAR_ANGLE, LIP_FORCE = 3e-7, 1e-5  # rad, N; up to 40 N
FAR = np.linspace(0.0, 40.0, STEPS + 1)[1:]  # N


@pytest.mark.parametrize(("mu", "part"), [(0.2, 1 / 8), (0.0, 1 / 2)])
def test_both_cables(mu, part, margin):
    # While the first cable bends the robot more than the second one pulls it back, the second is
    # drawn in at the base, and its tension rises toward the tip.
    first = np.linspace(0.0, 12.0, STEPS + 1)[1:]
    path = pulled(liu(0, mu, "slope"), np.stack([first, part * first], axis=1))
    assert path.converged.all(), path.reason
    # Farther on the last notch has next to no tension left to bend it, and the second cable sticks.
    for step in (5, 11):
        if mu > 0.0:
            np.testing.assert_array_equal(path.contact_state[step], [[1] * 13, [-1] * 13])
        wanted = march(Strip(mu=mu), path.tension[step], np.array([1.0, -1.0]))
        angles = [notch.angle for notch in wanted]
        margin.within("angles", path.notch_angle[step] - angles, ANGLE, "rad")
        gaps = np.transpose([notch.gap_tension for notch in wanted])
        error = (path.span_tension[step, :, 1::2] - gaps) / first[step]
        margin.within("tension in the gaps, of the pull", error, FORCE)


def test_equal_cables_keep_it_straight_and_shorten_it(margin):
    force = np.linspace(0.0, 12.0, STEPS + 1)[1:]
    path = pulled(liu(0, 0.0, "slope"), np.stack([force, force], axis=1))
    assert path.converged.all(), path.reason
    margin.within("angles", path.notch_angle, 1e-12, "rad")
    strip = Strip()
    end = strip.length**3 * 2.0 * force[0] / (12.0 * strip.stiffness)  # both ends held upright
    sinks = path.tip_position[0, 2] - 35.0
    margin.within("sinks at 0.5 N as by linear theory, relative", sinks / (-7.0 * end) - 1.0, 2e-3)


def test_pulled_along_the_gap_it_stays_open_to_40_newton(margin):
    path = pulled(liu(0, 0.2, "slope"), FAR)
    assert path.converged.all(), path.reason
    assert path.stable.all()
    assert not path.closed.any()
    assert (np.diff(path.total_angle) > 0.0).all()
    for step in (5, 11, STEPS - 1):
        wanted = march(Strip(mu=0.2), [path.tension[step, 0], 0.0], np.array([1.0, 1.0]))
        angles = [notch.angle for notch in wanted]
        margin.within(
            f"angles at {FAR[step]:.0f} N", path.notch_angle[step] - angles, FAR_ANGLE, "rad"
        )
        lips = [notch.lip_gap for notch in wanted]
        margin.within(f"lips at {FAR[step]:.0f} N", path.gap[step] - lips, GAP, "mm")


@pytest.mark.parametrize("mu", [0.0, 0.2])
@pytest.mark.parametrize(
    "model", [*(pytest.param(one, marks=pytest.mark.nightly) for one in (1, 3)), 2]
)
def test_a_strip_that_would_fold_through_ends_on_its_lips(model, mu):
    path = pulled(liu(model, mu), FAR)
    assert path.converged.all(), path.reason
    assert path.closed[-1, 0]
    assert path.gap.min() > -1e-9
    assert path.contact_force.min() > -1e-9
    # Either open or pressed, and closed once and for good.
    assert np.all(np.minimum(path.gap, path.contact_force) < 1e-9)
    closed = path.contact_force > 1e-9
    assert np.all(closed[1:] >= closed[:-1])
    if mu > 0.0:  # friction leaves less for the notches farther on
        assert np.all(closed[:, :-1] >= closed[:, 1:])


@pytest.mark.parametrize("step", [8, 12, 13, STEPS - 1])
def test_closed_lips_carry_what_the_strip_does_not(step, margin):
    path = pulled(liu(2, 0.0), FAR)
    closed = bool(path.closed[step, 0])
    assert closed == (step >= 13)
    wanted = solve_notch(Strip(dead=True), np.array([FAR[step], 0.0]), np.array([1.0, 1.0]), closed)
    assert closed or wanted.lip_gap > 0.0
    margin.within("angles", path.notch_angle[step] - wanted.angle, FAR_ANGLE, "rad")
    margin.within("lips", path.gap[step] - wanted.lip_gap, GAP, "mm")
    margin.within("force of the lips", path.contact_force[step] - wanted.lip_force, LIP_FORCE, "N")


def test_friction_beyond_its_law_is_told(margin):
    # mu tan(turning / 2) reaches 1 at 14.25 deg.
    path = pulled(liu(0, 8.0, "slope"), np.linspace(0.5, 12.0, STEPS))
    sharpest = np.max(path.contact_turning[:, 0], axis=1)
    limit = 2.0 * np.arctan(1.0 / 8.0)
    np.testing.assert_array_equal(path.converged, sharpest < limit)
    assert path.converged[0]
    assert not path.converged[-1]
    for step in range(STEPS):
        assert ("turns so sharply" in path.reason[step]) == (not path.converged[step])
    margin.note(
        f"limit {np.degrees(limit):.2f} deg, passed at {path.tension[~path.converged][0]} N"
    )
