"""Of all tensions that hold one shape the smallest is found."""

import numpy as np
import pytest

import notchflex as nf

WRIST = nf.load_robot("pacheco2021-a")


def tip_after(top, tension):
    """Tip of the wrist after a pull and a change of the tension, by `simulate`."""
    path = nf.simulate(WRIST, [nf.Load(tension=top), nf.Load(tension=tension)])
    return path.tip_position[-1]


@pytest.mark.parametrize("top", [0.6, 1.0, 1.3])
def test_a_shape_that_friction_holds_is_kept_by_the_smallest_tension(top):
    state = nf.solve(WRIST, nf.Load(tension=top)).state
    held = tip_after(top, top)
    found = nf.reach(WRIST, held, state=state, approach="direct")
    assert found.reached
    # Bisection: the tip leaves its place by more than the tolerance of a search at its end.
    low, high = 0.5 * top, top
    while high - low > 1e-8 * top:
        middle = 0.5 * (low + high)
        moved = np.linalg.norm(tip_after(top, middle) - held) > 1e-7
        low, high = (middle, high) if moved else (low, middle)
    assert high < 0.995 * top
    assert found.tension[0] == pytest.approx(high, rel=1e-6)


def test_closed_notches_hold_beyond_the_first_contact():
    """Where the first notches are closed, what slides over them moves nothing."""
    top = 1.9
    loaded = nf.solve(WRIST, nf.Load(tension=top))
    assert loaded.closed[:3].all()
    released = nf.simulate(WRIST, nf.pull(top, 1.2, steps=141), from_state=loaded.state)
    still = np.linalg.norm(released.tip_position - loaded.tip_position, axis=1) < 1e-7
    found = nf.reach(WRIST, loaded.tip_position, state=loaded.state, approach="direct")
    assert found.reached
    last = released.tension[still, 0].min()
    assert last - 0.005 < found.tension[0] <= last * (1.0 + 1e-6)


def test_the_lower_limit_is_kept():
    state = nf.solve(WRIST, nf.Load(tension=1.0)).state
    held = tip_after(1.0, 1.0)
    limits = nf.Limits(tension=(0.995, None))
    found = nf.reach(WRIST, held, state=state, approach="direct", limits=limits)
    assert found.reached
    assert found.tension[0] == pytest.approx(0.995, rel=1e-12)


@pytest.mark.nightly
def test_drives_of_two_axes_are_no_larger_than_those_that_made_the_target():
    robot = nf.load_robot("two-axis-wrist")
    random = np.random.default_rng(5)
    state = None
    for drive in np.abs(np.cumsum(random.uniform(-0.4, 0.5, (12, 2)), axis=0)):
        tension = [drive[0], drive[1], 0.0, 0.0]
        forward = nf.simulate(robot, nf.Load(tension=tension), from_state=state)
        found = nf.reach(robot, forward.tip_position[-1], state=state, approach="direct")
        assert found.reached
        assert np.linalg.norm(found.tension) <= np.linalg.norm(tension) * (1.0 + 1e-6)
        state = forward.state
