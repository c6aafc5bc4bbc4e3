"""Environments of gymnasium: its own checks, one robot against many, histories and failures."""

import subprocess
import sys
import time

import numpy as np
import pytest

import notchflex as nf

pytest.importorskip("gymnasium", reason="the extra `learn` is not installed")

import gymnasium
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv

from notchflex.learning import FollowEnv, FollowVectorEnv, ReachEnv, ReachVectorEnv, ScriptedPolicy

KINDS = {"Follow": (FollowEnv, FollowVectorEnv), "Reach": (ReachEnv, ReachVectorEnv)}
kinds = pytest.mark.parametrize("kind", KINDS)


def made(kind, **settings):
    return gymnasium.make(f"notchflex/{kind}-v0", **settings)


@pytest.mark.parametrize(("kind", "history"), [("Follow", 3), ("Reach", 0)])
def test_gymnasium_has_nothing_to_say(kind, history):
    """A warning is an error here."""
    env = made(kind, history=history, steps=20, render_mode="rgb_array")
    check_env(env.unwrapped)


@kinds
def test_a_seed_gives_the_same_episode_and_another_seed_another(kind):
    env = made(kind, steps=5)
    first, *_ = env.reset(seed=4)
    again, *_ = env.reset(seed=4)
    other, *_ = env.reset(seed=5)
    following, *_ = env.reset()
    assert first.tolist() == again.tolist() != other.tolist() != following.tolist()


def against_singles(kind, rows, number, **settings):
    """Largest difference of many robots in one call from as many environments."""
    env = gymnasium.make_vec(f"notchflex/{kind}-v0", num_envs=rows, **settings)
    assert isinstance(env.unwrapped, KINDS[kind][1])
    singles = SyncVectorEnv([lambda: made(kind, **settings)] * rows)
    random, worst, ended = np.random.default_rng(0), 0.0, 0
    many, one = env.reset(seed=7), singles.reset(seed=7)
    for _ in range(number):
        assert many[-1].keys() == one[-1].keys()
        for name, values in one[-1].items():
            if values.dtype == float:
                worst = max(worst, np.abs(many[-1][name] - values).max())
            else:
                assert many[-1][name].tolist() == values.tolist(), name
        for ours, theirs in zip(many[:-1], one[:-1], strict=True):
            assert ours.shape == theirs.shape
            worst = max(worst, np.abs(ours * 1.0 - theirs).max())
        # Not at random alone: pulled for a while, targets are reached and episodes end.
        actions = random.uniform(-0.3, 1.0, singles.action_space.shape)
        many, one = env.step(actions), singles.step(actions)
        ended += int((one[2] | one[3]).sum())
    return worst, ended


@kinds
def test_many_robots_in_one_call_are_as_many_environments(kind, margin):
    settings = {"steps": 7, "history": 2, "tolerance": 1.5}
    worst, ended = against_singles(kind, 11, 20, **settings)
    assert ended > 20
    margin.within(kind, worst, 1e-12)


@pytest.mark.nightly
@pytest.mark.parametrize(("robot", "tension"), [("two-axis-wrist", None), ("liu2022", 6.0)])
def test_many_robots_of_other_kinds(robot, tension, margin):
    worst, ended = against_singles("Follow", 9, 25, robot=robot, tension=tension, steps=12)
    assert ended == 2 * 9
    margin.within(robot, worst, 1e-12)


def test_states_of_rows_go_on_as_a_path_does(margin):
    """Rows at different places of a loop, each with its own history."""
    wrist = nf.load_robot("pacheco2021-a")
    tops = np.array([0.6, 1.1, 1.7, 2.4])
    way = np.concatenate([np.linspace(0.2, 1.0, 5), np.linspace(0.9, 0.1, 5)])
    stepper = nf.Stepper(wrist, ("tip_position", "total_angle"), cores=2)
    states, angles = stepper.rest(len(tops)), []
    for part in way:
        step = stepper.step(states, part * tops[:, None])
        assert step.converged.all()
        states = step.state
        angles.append(step.values["total_angle"])
    for row, top in enumerate(tops):
        path = nf.simulate(wrist, [nf.Load(tension=float(part * top)) for part in way])
        margin.within("angle", np.array(angles)[:, row] - path.total_angle, 1e-12, "rad")
    ahead = stepper.path(states[2], [0.4])
    expected = nf.simulate(wrist, nf.Load(tension=0.4), from_state=path_to(wrist, way * tops[2]))
    margin.within("next", ahead.total_angle - expected.total_angle, 1e-12, "rad")


def path_to(robot, tensions):
    return nf.simulate(robot, [nf.Load(tension=float(one)) for one in tensions]).state


@pytest.mark.nightly
def test_targets_are_states_of_the_robot_with_its_history():
    """A second robot pulled as the first was has met all targets at the end."""
    env = made("Follow", steps=30)
    rows = env.unwrapped._rows
    env.reset(seed=3)
    targets = rows._targets[0]
    assert np.ptp(targets, axis=0)[0] > 1.0
    state = None
    for target in targets:
        found = nf.reach(rows.settings.model, target, state=state, approach="direct")
        assert found.reached
        state = found.state


def test_what_was_observed_before_is_observed_again():
    env = made("Reach", history=2, steps=10)
    now, *_ = env.reset(seed=0)
    assert now.shape == (4 + 8 + 3,)
    assert now[4:8].tolist() == now[8:12].tolist() == now[:4].tolist()  # at rest
    for action in (1.0, -0.5, 1.0):
        before, (now, *_) = now, env.step(np.array([action]))
        assert now[4:12].tolist() == before[:8].tolist()
        assert now[-3:].tolist() == before[-3:].tolist()
    assert now[0] == pytest.approx(1.5 / 20)  # in parts of the largest tension


def test_an_episode_ends_when_it_is_told_to():
    env = made("Follow", steps=4)
    env.reset(seed=0)
    ends = [env.step(np.array([0.1]))[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(False, True)]
    env = made("Reach", tolerance=0.2, steps=100)
    policy = ScriptedPolicy(env)
    observation, info = env.reset(seed=1)
    assert not info["is_success"]
    for _ in range(99):
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        assert terminated == info["is_success"] == (info["distance"] <= 0.2)
        assert not truncated
        if terminated:
            break
    assert terminated
    assert reward > 0.9


def test_tensions_without_equilibrium_are_refused_and_told():
    """The robot stays where it is, and the episode goes on."""
    settings = {"robot": "two-axis-wrist", "tension": 1000.0, "rate": 500.0, "steps": 5}
    rows = 3
    env = FollowVectorEnv(rows, **settings)
    env.reset(seed=0)
    pull = np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1))
    before, _, _, _, info = env.step(0.001 * pull)
    assert info["code"].tolist() == [""] * rows
    for _ in range(2):
        now, reward, terminated, truncated, info = env.step(pull)
        if info["code"][0]:
            break
        before = now
    assert info["code"].tolist() == ["BENT_TOO_FAR"] * rows
    assert now[:, :7].tolist() == before[:, :7].tolist()
    assert (reward < -1.0).all()
    assert not (terminated | truncated).any()
    env.step(-0.5 * pull)  # it goes on


@pytest.mark.nightly
def test_the_scripted_policy_knows_the_history():
    errors = {}
    for friction in (True, False):
        env = made("Follow", steps=40)
        policy = ScriptedPolicy(env, friction=friction)
        observation, _ = env.reset(seed=2)
        missed = []
        for _ in range(40):
            observation, _, _, _, info = env.step(policy(observation))
            missed.append(info["distance"])
        errors[friction] = np.median(missed)
    assert errors[True] < 1e-4
    assert errors[False] > 0.2
    with pytest.raises(nf.InputError):
        ScriptedPolicy(gymnasium.make("CartPole-v1"))


def test_a_mask_begins_some_episodes_anew():
    env = FollowVectorEnv(3, steps=9)
    first, _ = env.reset(seed=0)
    now, *_ = env.step(np.ones((3, 1)))
    mask = np.array([False, True, False])
    again, info = env.reset(seed=[None, 1, None], options={"reset_mask": mask})
    assert again[[0, 2]].tolist() == now[[0, 2]].tolist()
    assert again[1].tolist() == first[1].tolist()
    assert info["_code"].tolist() == mask.tolist()


def test_pictures_follow_the_robot():
    pytest.importorskip("matplotlib", reason="the extra `plot` is not installed")
    env = made("Reach", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before.shape == (480, 480, 3)
    assert before.dtype == np.uint8
    for _ in range(8):
        env.step(np.array([1.0]))
    assert (np.abs(env.render().astype(int) - before).max(axis=2) > 60).mean() > 0.01
    assert ReachEnv().render() is None


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ({"robot": "no such robot"}, "UNKNOWN_NAME"),
        ({"robot": 3}, "WRONG_TYPE"),
        ({"tension": -1.0}, "OUT_OF_RANGE"),
        ({"tension": float("nan")}, "NOT_FINITE"),
        ({"tension": (1.0, 2.0)}, "WRONG_SHAPE"),
        ({"rate": 0.0}, "OUT_OF_RANGE"),
        ({"rate": "fast"}, "WRONG_TYPE"),
        ({"steps": 0}, "OUT_OF_RANGE"),
        ({"steps": 1.5}, "WRONG_TYPE"),
        ({"history": -1}, "OUT_OF_RANGE"),
        ({"history": 10**9}, "OUT_OF_RANGE"),
        ({"tolerance": float("inf")}, "OUT_OF_RANGE"),
        ({"render_mode": "human"}, "UNKNOWN_NAME"),
        ({"num_envs": 0}, "OUT_OF_RANGE"),
        ({"cores": 0}, "OUT_OF_RANGE"),
    ],
)
def test_settings_that_cannot_be_used(settings, code):
    with pytest.raises(nf.InputError) as raised:
        ReachVectorEnv(**settings)
    assert raised.value.code.name == code


@pytest.mark.parametrize(
    ("action", "code"),
    [
        ([float("nan")], "NOT_FINITE"),
        ([0.0, 0.0], "WRONG_SHAPE"),
        (0.0, "WRONG_SHAPE"),
        (["much"], "WRONG_TYPE"),
    ],
)
def test_actions_that_cannot_be_used(action, code):
    env = FollowEnv(steps=5)
    before, _ = env.reset(seed=0)
    with pytest.raises(nf.InputError) as raised:
        env.step(action)
    assert raised.value.code.name == code
    assert env._rows.observation[0].tolist() == before.tolist()
    many = FollowVectorEnv(2, steps=5)
    many.reset(seed=0)
    with pytest.raises(nf.InputError) as raised:
        many.step([action, action])
    assert raised.value.code.name == code
    with pytest.raises(nf.InputError):
        many.step(np.zeros((5, 1)))
    with pytest.raises(nf.InputError):
        many.reset(seed=[1, 2, 3])
    with pytest.raises(nf.InputError):
        many.reset(options={"reset_mask": [1, 0]})


def test_a_large_action_counts_as_the_largest():
    env = FollowEnv(steps=5)
    env.reset(seed=0)
    far, *_ = env.step(np.array([7.0]))
    env.reset(seed=0)
    assert far.tolist() == env.step(np.array([1.0]))[0].tolist()


@pytest.mark.nightly
@kinds
def test_twenty_thousand_steps_a_second_of_256_wrists(kind):
    """By time of the processor, all threads together; episodes begin anew within."""
    env = gymnasium.make_vec(f"notchflex/{kind}-v0", num_envs=256, steps=50)
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (120, 256, 1))
    env.step(actions[0])
    before = time.process_time()
    for one in actions:
        env.step(one)
    assert 256 * len(actions) / (time.process_time() - before) > 20_000


@pytest.mark.nightly
def test_gymnasium_is_imported_for_learning_alone():
    code = "import sys, notchflex as nf; nf.solve; assert 'gymnasium' not in sys.modules; "
    code += "import gymnasium; gymnasium.make('notchflex.learning:notchflex/Reach-v0')"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
