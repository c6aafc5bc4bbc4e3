"""Targets that forward paths with friction history have made are met from the same state."""

import numpy as np
import pytest

import notchflex as nf
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")
TWO_AXES = nf.load_robot("two-axis-wrist")


def test_a_loop_is_followed_forward_and_back():
    forward = nf.simulate(WRIST, nf.pull(0.2, 1.6, steps=15).release())
    found = nf.follow(WRIST, forward.tip_position)
    assert found.reached.all()
    assert found.code == [""] * 30
    np.testing.assert_allclose(found.tip_position, forward.tip_position, atol=1e-6)
    # Within the dead band of the peak the tip stays, so that the tension may too.
    moved = np.abs(np.diff(forward.tip_position, axis=0)).max(axis=1) > 1e-6
    same = np.abs(found.tension - forward.tension)[1:, 0] < 1e-6
    assert same[moved].all()


@pytest.mark.parametrize("seed", range(6))
def test_jumps_are_met_from_the_same_state(seed):
    random = np.random.default_rng(seed)
    forward = nf.simulate(WRIST, [nf.Load(tension=t) for t in random.uniform(0.0, 1.9, 8)])
    for step in range(1, 8):
        target, before = forward.tip_position[step], forward.state_at(step - 1)
        found = nf.reach(WRIST, target, state=before, approach="direct")
        assert found.reached
        np.testing.assert_allclose(found.tip_position, target, atol=1e-6)
        np.testing.assert_allclose(
            nf.simulate(WRIST, found.loads, from_state=before).tip_position[-1], target, atol=1e-6
        )


@pytest.mark.nightly
def test_the_tip_of_two_axes_is_met_with_drives_that_are_no_larger():
    forward = nf.solve(TWO_AXES, nf.Load(tension=[1.2, 0.8, 0.3, 0.3]))
    found = nf.reach(TWO_AXES, forward.tip_position, approach="direct")
    assert found.reached
    np.testing.assert_allclose(found.tip_position, forward.tip_position, atol=1e-6)
    assert np.linalg.norm(found.tension) <= np.linalg.norm(forward.tension)


@pytest.mark.nightly
def test_what_counts_as_met_is_met_by_a_simulation():
    """Other states are in balance under the same tensions; a pulled robot comes to one of them."""
    t = np.linspace(0.0, 2.0 * np.pi, 120)[50:90]
    goals = 2.0 * np.stack([np.cos(t), np.sin(t)], axis=1)
    robot = TWO_AXES.with_value("friction.coefficient", 0.2)
    found = nf.follow(robot, {"tip_position": [[x, y, None] for x, y in goals.tolist()]})
    assert found.reached.all()
    np.testing.assert_allclose(found.tip_position[:, :2], goals, atol=1e-6)


@pytest.mark.nightly
def test_strokes_meet_an_angle():
    found = nf.reach(WRIST, {"total_angle": 1.2}, drive="stroke", approach="direct")
    assert found.reached
    assert abs(found.equilibrium.total_angle - 1.2) < 1e-7
    assert found.load.stroke == pytest.approx(found.stroke[0])


def test_the_smaller_tension_is_after_an_overshoot():
    target = {"total_angle": 1.2}
    direct, least = (nf.reach(WRIST, target, approach=way) for way in ("direct", "least"))
    assert direct.reached
    assert least.reached
    assert len(direct.loads) == 1
    assert len(least.loads) == 2
    assert least.tension[0] < 0.9 * direct.tension[0] < least.loads[0].tension
    loading = nf.reach(WRIST, target, state=least.state, approach="loading")
    assert loading.reached
    assert loading.tension[0] == pytest.approx(direct.tension[0], rel=1e-6)


def test_a_reversal_is_compensated():
    """Without friction history in the inverse the tip stays behind after a reversal."""
    angle = np.concatenate([np.linspace(0.3, 1.2, 10), np.linspace(1.2, 0.3, 10)])
    slick = nf.follow(WRIST.with_value("friction.coefficient", 0.0), {"total_angle": angle})
    tensions = np.where(np.isnan(slick.tension), 0.0, slick.tension)
    behind = nf.simulate(WRIST, [nf.Load(tension=float(one[0])) for one in tensions])
    found = nf.follow(WRIST, {"total_angle": angle})
    assert np.abs(behind.total_angle - angle)[10:].max() > 0.02
    np.testing.assert_allclose(found.path.total_angle, angle, atol=1e-6)


def test_out_of_reach_gives_the_nearest():
    found = nf.reach(WRIST, (3.0, 2.0, 8.0), approach="direct")
    assert found.code == "TARGET_OUT_OF_REACH"
    assert "2" in found.reason
    around = nf.solve_each(WRIST, nf.pull(0.0, 2.0, steps=81)).tip_position
    nearest = np.linalg.norm(around - (3.0, 2.0, 8.0), axis=1).min()
    assert found.error <= nearest + 1e-9


@pytest.mark.parametrize(
    ("limits", "quantity", "value"),
    [
        (nf.Limits(tension=(0.0, 0.5)), "tension", 0.5),
        (nf.Limits(stroke=(None, 0.6)), "stroke", 0.6),
        (nf.Limits(strain=0.02), "peak_strain", 0.02),
        (nf.Limits(gap=0.6), "gap", 0.6),
    ],
)
def test_limits_are_kept_and_named(limits, quantity, value):
    found = nf.reach(WRIST, {"total_angle": 1.2}, limits=limits, approach="direct")
    assert found.code == "LIMITS_PREVENT"
    numbers = np.asarray(found.equilibrium.quantity(quantity))
    extreme = numbers.min() if quantity == "gap" else numbers.max()
    assert extreme == pytest.approx(value, rel=1e-5)


@pytest.mark.nightly
def test_pretension_is_kept_and_a_held_tendon_too():
    slack = nf.reach(TWO_AXES, {"total_angle": 0.4}, limits=nf.Limits(tension=(0.1, 3.0)))
    assert slack.reached
    assert (slack.tension >= 0.1 - 1e-12).all()
    load = nf.Load(tension=[None, None, 0.2, 0.2])
    held = nf.reach(TWO_AXES, {"total_angle": 0.4}, load=load, approach="direct")
    assert held.reached
    np.testing.assert_array_equal(held.tension[2:], 0.2)


def test_strains_that_are_not_known_have_no_limit_and_backbones_no_gap():
    joint = nf.TableNotch(2.0, angle_deg=(5.0, 20.0), moment=(1.0, 3.0), uncut_length=1.0)
    wrist = nf.load_robot("pacheco2021-a")
    robot = wrist.replace(notch=(joint, *wrist.notch), tendon=(nf.Tendon(0.7),))
    targets = {"total_angle": np.array([0.1])}
    with refused("UNSUPPORTED", "the strain of notch 1 is not known"):
        nf.follow(robot, targets, limits=nf.Limits(strain=0.05))
    found = nf.follow(robot, targets, limits=nf.Limits(gap=0.1))
    assert found.reached.all()
    assert np.isnan(found.path.gap[0]).tolist() == [True] + [False] * 5
    limit = nf.AcceptanceLimit("gap", lower=0.1)
    spec = nf.ToleranceSpec([limit], {"pulled": nf.Load(0.1)}, {"notch.depth": 0.001})
    analysis = nf.tolerance_analysis(robot, spec, draws=50)
    assert [one.name for one in analysis.criteria] == [f"gap[{n}]" for n in range(2, 7)]


def test_the_rate_limits_the_change_from_target_to_target():
    targets = {"total_angle": [0.2, 1.0, 1.0, 1.0]}
    found = nf.follow(WRIST, targets, limits=nf.Limits(rate=0.5))
    assert found.code == ["", "LIMITS_PREVENT", "", ""]
    assert np.abs(np.diff(found.tension[:, 0])).max() <= 0.5 + 1e-12


def test_direction_pose_and_free_entries():
    goal = nf.solve(WRIST, nf.Load(tension=1.0))
    for target in (
        {"tip_direction": goal.tip_rotation[:, 2]},
        {"tip_position": goal.tip_position, "tip_rotation": goal.tip_rotation},
        {"tip_position": [goal.tip_position[0], None, None]},
    ):
        found = nf.reach(WRIST, target, approach="direct")
        assert found.reached
        assert found.tension[0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.nightly
def test_known_loads_count():
    load = nf.Load(tip_force=(0.0, 0.0, -0.02), base_rotation=(0.0, 0.3, 0.0))
    goal = nf.solve(WRIST, nf.Load(1.0, tip_force=load.tip_force, base_rotation=(0.0, 0.3, 0.0)))
    found = nf.reach(WRIST, goal.tip_position, load=load, approach="direct")
    assert found.reached
    assert found.tension[0] == pytest.approx(1.0, abs=1e-6)


def test_a_target_out_of_reach_is_given_up_within_few_solves():
    found = nf.reach(nf.load_robot("pacheco2021-a"), (30.0, 0.0, 0.0), approach="direct")
    assert found.code == "TARGET_OUT_OF_REACH"
    assert found.error == pytest.approx(23.120518, abs=1e-6)
    assert found.following.solves[0] <= 400


@pytest.mark.parametrize("weight", [1e300, 1e-300, 1e10])
def test_a_weight_beside_which_nothing_counts_is_refused(weight):
    target = {"total_angle": 1.0, "tip_position": (None, None, 9.0)}
    with refused("OUT_OF_RANGE"):
        nf.reach(nf.load_robot("pacheco2021-a"), target, weights={"total_angle": weight})
