"""Steps of a robot against paths, differences and bisection; rows against single robots."""

from __future__ import annotations

import gc
import tracemalloc

import numpy as np
import pytest

import notchflex as nf
from notchflex.errors import ErrorCode
from refusals import refused

OUTPUTS = ("tip_position", "tip_rotation", "total_angle", "span_tension", "contact_state", "stroke")
WRIST = nf.load_robot("pacheco2021-a")
TWO_AXES = nf.load_robot("two-axis-wrist")
LOSSY = WRIST.with_value("friction.constant_loss", 0.01)
PUSHED = nf.Load(tip_force=(0.02, 0.01, 0.0), base_rotation=(0.3, -0.5, 0.2), tip_mass=2.0)
WAY = np.array([[0.5], [1.1], [0.9], [0.3], [0.7], [0.0], [0.4]])
nightly = pytest.mark.nightly

CASES = {
    "by tension": (WRIST, "tension", nf.Load(), WAY),
    "pushed, turned": (WRIST, "tension", PUSHED, WAY),
    "by stroke": (WRIST, "stroke", nf.Load(), 0.6 * WAY),
    "constant loss": (LOSSY, "tension", nf.Load(), WAY),
    "mixed": (
        TWO_AXES,
        ("tension", "stroke", "tension", "tension"),
        nf.Load(),
        WAY * [1.0, 0.4, 0.0, 0.1],
    ),
}
cases = pytest.mark.parametrize(
    "case", ["by tension", *(pytest.param(one, marks=nightly) for one in [*CASES][1:])]
)


@pytest.fixture(scope="module")
def stepper() -> nf.Stepper:
    return nf.Stepper(WRIST, OUTPUTS, jacobian=True)


def made(case: str) -> tuple[nf.Stepper, np.ndarray]:
    robot, drives, loads, way = CASES[case]
    return nf.Stepper(robot, OUTPUTS, drives=drives, loads=loads, jacobian=True), way


def states_along(stepper: nf.Stepper, way: np.ndarray) -> list[nf.Step]:
    steps, state = [], stepper.rest()
    for drives in way:
        steps.append(stepper.step(state, drives))
        assert steps[-1].converged
        state = steps[-1].state
    return steps


@cases
def test_steps_are_those_of_simulate(case, margin):
    robot, drives, loads, _ = CASES[case]
    stepper, way = made(case)
    words = (drives,) * robot.number_of_tendons if isinstance(drives, str) else drives
    given = {one: np.where(np.array(words) == one, way, np.nan) for one in ("tension", "stroke")}
    path = nf.LoadPath(**given, base_rotation=np.array(loads.base_rotation))
    external = {"tip_force": loads.tip_force, "tip_mass": loads.tip_mass}
    path = nf.simulate(robot, path.loaded(**external)).raise_if_failed()
    for number, step in enumerate(states_along(stepper, way)):
        for name, values in step.values.items():
            expected = path.quantity(name)[number]
            assert values.dtype == expected.dtype
            assert (np.isnan(values) == np.isnan(expected)).all()
            size = max(1.0, float(np.nanmax(np.abs(expected))))
            margin.within(name, np.nan_to_num(values - expected) / size, 1e-12)


@cases
def test_jacobian_is_that_of_central_differences(case, margin):
    """At a slack tendon, and where a contact is about to slip, there are two: not looked at."""
    stepper, way = made(case)
    for before, step in zip(steps := states_along(stepper, way), steps[1:], strict=False):
        for tendon in np.flatnonzero(step.drives > 0.0):
            width = 1e-4 * np.eye(len(step.drives))[tendon]
            ends = [stepper.step(before.state, step.drives + side * width) for side in (1, -1)]
            for name, slopes in step.jacobian.items():
                up, down = (end.values[name] for end in ends)
                error = np.nan_to_num(slopes[..., tendon] - (up - down) / 2e-4)
                margin.within(name, error / max(1.0, np.nanmax(np.abs(slopes))), 1e-6)


def test_dead_band_is_that_of_bisection(stepper, margin):
    for step in states_along(stepper, WAY)[:5]:
        here, drive = step.values["total_angle"], step.drives[0]
        for edge, far in zip(step.dead_band[0], (0.5, 2.0), strict=True):
            still, moved = drive, far * drive
            while abs(moved - still) > 1e-9:
                middle = 0.5 * (still + moved)
                there = stepper.step(step.state, [middle]).values["total_angle"]
                still, moved = (middle, moved) if abs(there - here) < 1e-9 else (still, middle)
            margin.within("edge", edge - still, 1e-7, "N")
        assert np.ptp(step.dead_band) > 0.01 * drive
    by_stroke = nf.Stepper(WRIST, OUTPUTS, drives="stroke", jacobian=True)
    assert by_stroke.dead_band(step.state).tolist() == [[[step.values["stroke"][0]] * 2]][0]


def test_a_dead_band_is_there_whatever_rounding_does_to_the_sliding_contact(stepper):
    """The log ratio of a contact that slides misses its bound by rounding, to either side."""
    state = stepper.rest()
    for tension in np.linspace(0.3, 1.7, 57):
        state = stepper.step(state, [tension]).state
        low, high = stepper.dead_band(state)[0]
        assert low < 0.995 * tension
        assert high >= tension


def test_slack_and_rest_have_no_dead_band(stepper):
    assert stepper.dead_band(stepper.rest()).tolist() == [[0.0, 0.0]]
    assert stepper.dead_band(stepper.rest(3)).shape == (3, 1, 2)


def test_rows_are_single_robots(stepper, margin):
    tops = np.linspace(0.2, 1.8, 19)
    states, singles = stepper.rest(19), [stepper.rest()] * 19
    for part in (0.5, 1.0, 0.7):
        step = stepper.step(states, part * tops[:, None])
        rows = [stepper.step(one, [part * top]) for one, top in zip(singles, tops, strict=True)]
        for name, values in step.values.items():
            margin.within(name, values - np.stack([one.values[name] for one in rows]), 1e-12)
        for name, values in step.jacobian.items():
            margin.within(name, values - np.stack([one.jacobian[name] for one in rows]), 1e-12)
        bands = np.stack([one.dead_band for one in rows])
        margin.within("dead band", step.dead_band - bands, 1e-12, "N")
        states, singles = step.state, [one.state for one in rows]
    few = nf.Stepper(WRIST, OUTPUTS, jacobian=True, cores=1).step(states, tops[:, None])
    again = stepper.step(states, tops[:, None])
    assert np.array_equal(few.flat_values, again.flat_values)  # whatever the number of cores
    assert stepper.step(stepper.rest(0), np.zeros((0, 1))).values["tip_position"].shape == (0, 3)


def test_a_step_without_equilibrium_stays_and_says_why():
    stepper = nf.Stepper(WRIST, OUTPUTS, drives="stroke", jacobian=True)
    before = stepper.step(stepper.rest(), [1.0]).state
    failed = stepper.step(before, [5.0])
    told = nf.simulate(WRIST, nf.Load(stroke=5.0), from_state=stepper.unpacked(before))
    assert not failed.converged
    assert failed.code == told.reason_code[0] == "NOTCHES_CLOSED"
    assert np.array_equal(failed.state, before)
    assert np.isnan(failed.values["tip_position"]).all()
    assert np.isnan(failed.jacobian["tip_position"]).all()
    assert not failed.values["contact_state"].any()
    rows = stepper.step(np.stack([before] * 2), [[5.0], [0.8]])
    assert rows.converged.tolist() == [False, True]
    assert rows.code == ["NOTCHES_CLOSED", ""]
    assert np.array_equal(rows.state[0], before)
    assert np.isfinite(rows.values["tip_position"]).all(axis=1).tolist() == [False, True]


def test_steps_start_from_saved_states(tmp_path, stepper, margin):
    path = nf.simulate(WRIST, nf.pull(0.0, 1.2, steps=3))
    path.state.save(tmp_path / "state.json")
    expected = nf.simulate(WRIST, nf.Load(tension=0.8), from_state=path.state)
    for state in (path.state, nf.State.load(tmp_path / "state.json")):
        later = nf.Stepper(WRIST, OUTPUTS, jacobian=True, from_state=state)
        assert later.start(2).shape[0] == 2
        step = later.step(later.start(), [0.8])
        margin.within("angle", step.values["total_angle"] - expected.total_angle, 1e-12, "rad")
        margin.within("path", later.path(step.before, [0.8]).stroke - expected.stroke, 1e-12, "mm")


def test_thousands_of_steps_take_no_more_memory(stepper):
    state, drives = stepper.rest(), np.abs(np.sin(np.arange(3_000.0)))[:, None]
    tracemalloc.start()
    try:
        for number, drive in enumerate(drives):
            step = stepper.step(state, drive)
            state = step.state
            if number == 100:
                gc.collect()
                early = tracemalloc.get_traced_memory()[0]
        gc.collect()
        assert tracemalloc.get_traced_memory()[0] < early + 20_000
    finally:
        tracemalloc.stop()


def test_what_is_not_a_step_is_refused(stepper):
    state = stepper.rest()
    for given in ("1.0", [None], [True], [[1.0], [1.0, 2.0]], [1j], [1.0, 1.0], 1.0, [[1.0]]):
        with refused(ErrorCode.WRONG_SHAPE, "(1,)"):
            stepper.step(state, given)
    with refused(ErrorCode.WRONG_SHAPE, "(2, 1)"):
        stepper.step(stepper.rest(2), [1.0])
    for given in ([np.nan], [np.inf], [-0.1]):
        with refused(ErrorCode.OUT_OF_RANGE, "0 N or more"):
            stepper.step(state, given)
    for given in (None, state[:-1], state.tolist(), nf.simulate(WRIST, nf.Load(tension=1)).state):
        with refused(ErrorCode.WRONG_TYPE, "a state is"):
            stepper.step(given, [1.0])
    for rows, code in ((-1, ErrorCode.OUT_OF_RANGE), (1.5, ErrorCode.WRONG_TYPE)):
        with refused(code, "rows"):
            stepper.rest(rows)


@pytest.mark.parametrize(
    ("options", "code", "word"),
    [
        ({"outputs": "reason"}, ErrorCode.UNKNOWN_NAME, "reason"),
        ({"outputs": ()}, ErrorCode.UNKNOWN_NAME, "no output"),
        ({"drives": "force"}, ErrorCode.UNKNOWN_NAME, "force"),
        ({"drives": ("tension", "stroke")}, ErrorCode.UNKNOWN_NAME, "tendons"),
        ({"drives": None}, ErrorCode.WRONG_TYPE, "None"),
        ({"jacobian": 1}, ErrorCode.WRONG_TYPE, "jacobian"),
        ({"loads": nf.pull(0.0, 1.0, steps=2)}, ErrorCode.CONFLICT, "Load"),
        ({"loads": nf.Load(tension=1.0)}, ErrorCode.CONFLICT, "drives"),
        ({"cores": 0}, ErrorCode.OUT_OF_RANGE, "cores"),
        ({"refinement": 9}, ErrorCode.OUT_OF_RANGE, "refinement"),
        ({"from_state": "file.json"}, ErrorCode.WRONG_TYPE, "State"),
    ],
)
def test_what_makes_no_stepper_is_refused(options, code, word):
    with refused(code, word):
        nf.Stepper(WRIST, **options)
    with refused(ErrorCode.WRONG_TYPE, "Robot"):
        nf.Stepper("pacheco2021-a")


def test_both_are_shown_in_a_few_lines(stepper):
    assert "tip_position" in repr(stepper)
    step = stepper.step(stepper.rest(), [1.0])
    assert f"total_angle    {float(step.values['total_angle']):.4g} rad" in repr(step)
    assert len(repr(step).splitlines()) == 9
