"""The controller for loops: it follows, takes up what is measured, and never raises."""

import numpy as np
import pytest

import notchflex as nf
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")
ROUGH = WRIST.with_value("friction.coefficient", 0.156)


def path(robot, tensions):
    return nf.simulate(robot, [nf.Load(tension=float(one)) for one in tensions])


SWEEP = 0.9 + 0.7 * np.sin(np.linspace(0.0, 9.0, 120))


def test_a_loop_is_followed_within_the_budget():
    forward = path(WRIST, SWEEP)
    controller = nf.Controller(WRIST)
    commands = []
    for tip in forward.tip_position:
        commands.append(float(controller.step(tip)[0]))
        assert controller.status.reached
        assert controller.status.solves <= 16 + 4
    np.testing.assert_allclose(path(WRIST, commands).tip_position, forward.tip_position, atol=1e-4)


def test_measured_angles_correct_another_robot():
    wanted = 0.8 + 0.5 * np.sin(np.linspace(0.0, 9.0, 120))
    errors = {}
    for feedback in (0.0, 0.5):
        controller = nf.Controller(WRIST, "total_angle", feedback=feedback)
        state, seen, error = None, None, []
        for angle in wanted:
            tension = controller.step(angle, measured=seen)
            real = nf.solve(ROUGH, nf.Load(tension=tension), from_state=state)
            state, seen = real.state, real.total_angle
            error.append(real.total_angle - angle)
        errors[feedback] = float(np.sqrt(np.mean(np.square(error))))
    assert errors[0.5] < 0.5 * errors[0.0]


def test_tension_and_stroke_tell_the_friction():
    real = path(ROUGH, SWEEP)
    observer = nf.Observer(WRIST, (0.8, 1.0, 1.2))
    random = np.random.default_rng(0)
    for tension, stroke in zip(real.tension, real.stroke, strict=True):
        observer.observe(tension, stroke + random.normal(0.0, 0.01, 1))
    assert observer.friction == pytest.approx(0.156, rel=0.02)


def test_the_observer_corrects_the_controller():
    wanted = 0.8 + 0.5 * np.sin(np.linspace(0.0, 9.0, 120))
    errors = []
    for observer in (None, nf.Observer(WRIST, (0.8, 1.0, 1.2))):
        controller = nf.Controller(WRIST, "total_angle", observer=observer)
        state, seen, error = None, {}, []
        for angle in wanted:
            tension = controller.step(angle, **seen)
            real = nf.solve(ROUGH, nf.Load(tension=tension), from_state=state)
            state, seen = real.state, {"tension": real.tension, "stroke": real.stroke}
            error.append(real.total_angle - angle)
        errors.append(float(np.sqrt(np.mean(np.square(error[30:])))))
    assert errors[1] < 0.05 * errors[0]


BAD = [
    np.nan * np.ones(3),
    (np.inf, 0.0, 1.0),
    (1.0, 2.0),
    "far",
    None,
    {"total_angle": 1.0},
    [[1.0, 2.0, 3.0]],
    object(),
]


@pytest.mark.parametrize("target", BAD, ids=range(len(BAD)))
def test_a_bad_target_holds_the_last_command(target):
    controller = nf.Controller(WRIST)
    good = controller.step((2.4, 0.0, 9.307))
    np.testing.assert_array_equal(controller.step(target), good)
    assert controller.status.held
    assert controller.status.code == "INVALID_INPUT"
    np.testing.assert_allclose(controller.step((2.4, 0.0, 9.307)), good)
    assert not controller.status.held


def test_bad_measurements_hold_the_last_command():
    controller = nf.Controller(WRIST, observer=nf.Observer(WRIST, (1.0,)))
    good = controller.step((2.4, 0.0, 9.307))
    for bad in ({"measured": "x"}, {"tension": [1.0, 2.0], "stroke": [1.0]}, {"measured": (1, 2)}):
        np.testing.assert_array_equal(controller.step((3.0, 0.0, 8.9), **bad), good)
        assert controller.status.code == "INVALID_INPUT"


def test_a_fault_of_the_program_is_no_invalid_input(monkeypatch):
    controller = nf.Controller(nf.load_robot("pacheco2021-a"), "total_angle")

    def fails(*_, **__):
        raise ValueError("a fault")

    monkeypatch.setattr("notchflex.control.controller.find", fails)
    with pytest.raises(ValueError, match="a fault"):
        controller.step(0.3)


def test_out_of_reach_is_flagged_and_the_nearest_commanded():
    controller = nf.Controller(WRIST)
    tension = controller.step((30.0, 0.0, 0.0))
    assert np.isfinite(tension).all()
    assert not controller.status.reached
    assert controller.status.code


@pytest.mark.parametrize(
    ("tension", "stroke"),
    [
        ("x", [1.0]),
        (None, None),
        (object(), [1.0]),
        ([np.nan], [1.0]),
        ([np.inf], [1.0]),
        ([1.0], [np.inf]),
        ([1.0, 2.0], [1.0, 2.0]),
        ([1.0], [1.0, 2.0]),
        (1.0, 1.0),
        ([[1.0]], [[1.0]]),
        ([], []),
        (1 << 2000, [1.0]),
    ],
    ids=range(12),
)
def test_an_observer_ignores_what_it_cannot_use(tension, stroke):
    observer = nf.Observer(WRIST, (0.8, 1.0))
    kept, state = observer.observe([0.5], [0.62])
    friction = observer.friction
    again, same = observer.observe(tension, stroke)
    assert not observer.accepted
    assert (again, observer.friction) == (kept, friction)
    np.testing.assert_array_equal(same, state)
    observer.observe([0.6], [np.nan])  # a stroke that was not measured
    assert observer.accepted


@pytest.mark.parametrize("rate", [0.107, 0.04])
def test_a_rate_below_the_dead_band_still_turns_round(rate):
    # Let go from 1.359 N the tendon sticks for more than 0.107 N.
    pulled = nf.solve(WRIST, nf.Load(tension=1.359))
    limits = nf.Limits(rate=rate)
    controller = nf.Controller(WRIST, "total_angle", state=pulled.state, limits=limits)
    commands, steps = [1.359], []
    while not (steps and controller.status.reached) and len(steps) < 40:
        commands.append(float(controller.step(1.0)[0]))
        steps.append(controller.status)
    assert controller.status.reached
    assert -rate - 1e-12 <= np.diff(commands).min() <= np.diff(commands).max() < 0.0
    assert {one.code for one in steps[:-1]} == {"LIMITS_PREVENT"}
    assert max(one.solves for one in steps) <= 16
    assert path(WRIST, commands).total_angle[-1] == pytest.approx(1.0, abs=1e-4)
    wanted = {"total_angle": [1.0] * len(steps)}
    found = nf.follow(WRIST, wanted, state=pulled.state, limits=limits)
    assert found.reached[-1]
    assert not found.reached[:-1].any()


@pytest.mark.parametrize("target", [1e300, -1e300, 1e160])
def test_a_huge_target_is_refused_without_a_warning(target, recwarn):
    controller = nf.Controller(WRIST, "total_angle")
    good = controller.step(0.3)
    np.testing.assert_array_equal(controller.step(target), good)
    assert controller.status.code == "INVALID_INPUT"
    with refused("OUT_OF_RANGE"):
        nf.reach(WRIST, {"total_angle": target})
    assert not [one for one in recwarn if issubclass(one.category, RuntimeWarning)]


@pytest.mark.parametrize(
    ("top", "tension"),
    [
        (1.66183818, 1.4046),
        (1.71, 1.4046),
        # The notches hold on to just above this: half of the way so far leads far beyond.
        (1.66183818, 1.40547970),
        (1.66183818, 1.4051778),
    ],
)
def test_a_reversal_with_closed_notches_takes_few_solves(top, tension):
    # Let go, the first contact slips at 0.87 of the tension; closed notches hold on to 0.84 of it.
    pulled = path(WRIST, [0.5, 1.0, 1.4, top])
    goal = nf.solve(WRIST, nf.Load(tension=tension), from_state=pulled.state).tip_position
    controller = nf.Controller(WRIST, state=pulled.state)
    command = controller.step(goal)
    assert controller.status.reached
    assert controller.status.solves <= 8
    assert command[0] == pytest.approx(tension, abs=1e-5)


def test_a_limited_rate_leads_back_from_closed_notches():
    """Notches that are pressed together hold the tip for longer than a step of the rate."""
    largest = 1.3 * float(nf.closing(WRIST).tension.max())
    change = 0.05 * largest
    controller = nf.Controller(WRIST, limits=nf.Limits(tension=(0.0, largest), rate=change))
    pulled = path(
        WRIST, np.concatenate([np.linspace(0.0, largest, 27), np.linspace(largest, 0, 9)])
    )
    for tip in pulled.tip_position[:27]:
        controller.step(tip)
    assert controller.command[0] > 0.7 * largest
    for tip in [*pulled.tip_position[27:], *20 * [pulled.tip_position[-1]]]:
        controller.step(tip)
    assert controller.status.reached
    assert controller.command[0] < change
