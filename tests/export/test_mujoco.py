"""MJCF files, run by MuJoCo and compared with the chain."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest

import notchflex as nf
from notchflex.export import joints as samples
from notchflex.export.formats import SimulatorOptions
from notchflex.export.joints import fit_spring, joint_model
from notchflex.export.simulators import measure_errors, mjcf
from refusals import refused

mujoco: Any = pytest.importorskip("mujoco", reason="needs the extra robotics")

TOP = 2.35  # N; all notches of wrists A and B have closed


class Loop(NamedTuple):
    """A pull and its release in MuJoCo, and in the chain: total and notch angles, deg."""

    tension: np.ndarray
    angle: np.ndarray
    chain: np.ndarray

    def errors(self) -> tuple[float, float, float]:
        """Return the largest error of total and notch angle over the range, and of the area."""
        total, known = self.angle.sum(axis=1), self.chain.sum(axis=1)
        area = np.trapezoid(total, self.tension) / np.trapezoid(known, self.tension)
        notch = np.abs(self.angle - self.chain).max() / np.ptp(self.chain, axis=0).max()
        return float(np.abs(total - known).max() / np.ptp(known)), float(notch), float(area - 1.0)


def pulled(file: Any, robot: nf.Robot, levels: np.ndarray) -> Loop:
    """Pull the first tendon of a file slowly, read every joint where it stands still."""
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    count = robot.number_of_notches
    sensors = [model.sensor(f"angle_{j + 1}").adr[0] for j in range(count)]
    angle, before = [], 0.0
    for level in levels:
        for control in np.linspace(before, level, 300):
            data.ctrl[0] = control
            mujoco.mj_step(model, data)
        mujoco.mj_step(model, data, 2000)
        before = level
        angle.append(np.degrees(data.sensordata[sensors]))
    path = nf.simulate(robot, [nf.Load(tension=float(level)) for level in levels])
    return Loop(levels, np.array(angle), np.degrees(path.notch_angle - path.notch_angle[0]))


def up_and_down(top: float, count: int) -> np.ndarray:
    """Levels from 0 to the top and back."""
    up = np.linspace(0.0, top, count)
    return np.concatenate([up, up[::-1]])


@pytest.fixture(scope="module")
def written(wrist, tmp_path_factory):
    """Wrist A as a file, and what `export_robot` says of it."""
    file = tmp_path_factory.mktemp("mjcf") / "a.xml"
    return file, nf.export_robot(wrist, file, SimulatorOptions(TOP))


def check_targets(loop: Loop, margin: Any) -> None:
    total, notch, area = loop.errors()
    margin.within("total angle, part of its range", total, 0.02)
    margin.within("any notch, part of the range", notch, 0.02)
    margin.within("hysteresis area", area, 0.10)


@pytest.fixture(scope="module")
def loop(written, wrist) -> Loop:
    """Wrist A up and down."""
    return pulled(written[0], wrist, up_and_down(TOP, 16))


def test_wrist_a_up_and_down(loop, margin):
    check_targets(loop, margin)


def test_the_file_states_the_error_that_is_measured(written, wrist, loop):
    file, exported = written
    model = joint_model(wrist, TOP)
    measured = measure_errors(model, file.read_text())[0]
    assert exported.facts["errors"] == [measured]
    stated = {
        one.get("name"): float(one.get("data", "nan"))
        for one in ElementTree.parse(file).iter("numeric")
    }
    for name in ("total_angle", "notch_angle", "tip_position", "loop_area"):
        assert stated[f"tendon_1_{name}_error"] == pytest.approx(measured[name], rel=1e-6)
    # That it states the truth needs a run of another kind: other levels, other pauses.
    total, notch, area = loop.errors()
    assert total < 2.0 * measured["total_angle"] + 0.002
    assert notch < 2.0 * measured["notch_angle"] + 0.004
    assert abs(area) < measured["loop_area"] + 0.01


def test_equal_samples_of_two_pulls_do_not_spoil_a_spring():
    """The export of the two-axis wrist ended with "SVD did not converge"."""
    angle = np.repeat(np.linspace(0.0, 0.4, 20), 3)
    rising = np.repeat([1.0, -1.0], 60)
    angle = np.concatenate([angle, angle])
    with np.errstate(all="raise", under="ignore"):
        spring = fit_spring(angle, 2.0 * angle, rising, 2.0)
    assert spring.moment(angle) == pytest.approx(2.0 * angle, abs=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "top"),
    [("pacheco2021-b", 2.06), ("pacheco2021-c", 2.54), ("gao2017", 13.0)],
)
def test_other_robots_up_and_down(name, top, tmp_path, margin):
    robot = nf.load_robot(name)
    nf.export_robot(robot, tmp_path / "a.xml", SimulatorOptions(top))
    check_targets(pulled(tmp_path / "a.xml", robot, up_and_down(top, 10)), margin)


def test_inner_loops_follow_the_chain(written, wrist):
    """Reversals within the range were not fitted."""
    levels = np.concatenate(
        [np.linspace(*ends, 6) for ends in ((0, 1.5), (1.5, 0.7), (0.7, 1.9), (1.9, 0.3))]
    )
    total, _, _ = pulled(written[0], wrist, levels).errors()
    assert total < 0.04


def test_keyframes_are_states_at_rest(written, wrist):
    model = mujoco.MjModel.from_xml_path(str(written[0]))
    data = mujoco.MjData(model)
    names = [model.key(i).name for i in range(model.nkey)]
    assert names[0] == "free"
    assert len(names) == 4
    for key in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, key)
        start = data.qpos[:5].copy()
        path = nf.simulate(wrist, nf.pull(0.0, float(data.ctrl[0]), 31))
        assert start == pytest.approx(path.notch_angle[-1], abs=1e-6)
        mujoco.mj_step(model, data, 4000)
        assert np.abs(data.qpos[:5] - start).max() < np.radians(0.4)


def test_bodies_holes_and_tip_stand_where_the_chain_has_them(written, wrist):
    model = mujoco.MjModel.from_xml_path(str(written[0]))
    data = mujoco.MjData(model)
    path = nf.simulate(wrist, nf.pull(0.0, 1.2, 7))
    data.qpos[:5] = path.notch_angle[-1]
    mujoco.mj_forward(model, data)
    assert 1e3 * data.site("tip").xpos == pytest.approx(path.tip_position[-1], abs=0.03)
    body = path.body_position[-1][3] + path.body_rotation[-1][3] @ [0.7, 0.0, 1.2]
    assert 1e3 * data.site("tendon_1_hole_7").xpos == pytest.approx(body, abs=0.03)
    # Straight in the notches, where the tendon of the chain follows the arc of the wall.
    stroke = 1e3 * (model.tendon_length0[0] - data.ten_length[0])
    assert stroke == pytest.approx(path.stroke[-1][0], rel=0.01)
    moved = data.sensor("tip_position").data
    assert moved == pytest.approx(data.site("tip").xpos)


def test_a_wrist_bent_when_free_stands_where_the_chain_has_it(wrist, tmp_path):
    bent = {"notch.precurvature_deg": 4.0, "notch.direction_deg": 30.0}
    robot = wrist.with_values({**bent, "tendon[1].direction_deg": 30.0})
    nf.export_robot(robot, tmp_path / "a.xml", SimulatorOptions(1.2))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "a.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    state = nf.solve(robot, nf.Load(tension=0.0))
    tip = data.site("tip")
    assert 1e3 * tip.xpos == pytest.approx(state.tip_position, abs=1e-5)
    assert tip.xmat.reshape(3, 3) == pytest.approx(state.tip_rotation, abs=1e-8)


def test_a_notch_closes_at_its_stop(written):
    model = mujoco.MjModel.from_xml_path(str(written[0]))
    data = mujoco.MjData(model)
    for control in np.linspace(0.0, TOP, 4000):
        data.ctrl[0] = control
        mujoco.mj_step(model, data)
    assert np.degrees(data.qpos[:5]) == pytest.approx(np.full(5, 30.63), abs=0.15)


def test_without_friction_there_are_no_drums(wrist):
    model = joint_model(wrist.with_value("friction.coefficient", 1e-6), 1.0)
    text = mjcf(model)
    assert "springyield" not in text
    assert measure_errors(model, text)[0]["total_angle"] < 0.01


def test_without_mujoco_a_sentence_says_that_nothing_was_measured(wrist, tmp_path, monkeypatch):
    import importlib.util

    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "mujoco" else find(name)
    )
    file = tmp_path / "a.xml"
    exported = nf.export_robot(wrist, file, SimulatorOptions(TOP))
    assert "notchflex[robotics]" in exported.warnings[0]
    assert "not measured" in file.read_text()
    mujoco.MjModel.from_xml_path(str(file))


@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # 1e6 N is meant
@pytest.mark.parametrize(
    ("top", "code"),
    [
        (0.0, "OUT_OF_RANGE"),
        (-1.0, "OUT_OF_RANGE"),
        (float("nan"), "OUT_OF_RANGE"),
        ("much", "WRONG_TYPE"),
        (1e6, "OUT_OF_RANGE"),
    ],
)
def test_ranges_that_cannot_be_fitted_are_refused(wrist, tmp_path, top, code):
    with refused(code, "tension"):
        nf.export_robot(wrist, tmp_path / "a.xml", SimulatorOptions(top))
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_a_robot_that_never_closes_needs_a_range(tmp_path):
    with refused("MISSING_VALUE", "largest tension"):
        nf.export_robot(nf.load_robot("liu2022"), tmp_path / "a.xml")


def test_a_spring_is_tried_on_a_triangle_not_on_all_samples(monkeypatch):
    """Up to 300 trials had each solved all samples of all tendons."""
    angle = np.concatenate([np.linspace(0.0, 0.5, 2000), np.linspace(0.5, 0.0, 2000)])
    moment = np.where(angle < 0.2, angle, 0.2 + 0.3 * (angle - 0.2))
    solved, lstsq = [], np.linalg.lstsq
    monkeypatch.setattr(
        np.linalg, "lstsq", lambda *args, **keys: solved.append(args[0]) or lstsq(*args, **keys)
    )
    spring = fit_spring(angle, moment, np.repeat([1.0, -1.0], 2000), 1.0)
    assert len(solved) > 20
    assert max(len(one) for one in solved) < 70
    # The corner at 0.2 lies between two places where a spring may begin.
    assert spring.moment(angle) == pytest.approx(moment, abs=3e-3)


def test_what_closes_at_no_tension_is_no_range(wrist, monkeypatch):
    """A search that finds -0.03 N had ended in "a tendon can only pull: got -0.03 N"."""
    found = nf.closing(wrist)
    tension = np.array([-0.03, np.nan, 1.6, 1.8, np.inf])
    monkeypatch.setattr(samples, "closing", lambda _: dataclasses.replace(found, tension=tension))
    assert samples.load_range(wrist) == pytest.approx(1.6)
    tension[2:] = np.nan
    with refused("MISSING_VALUE", "closes"):
        samples.load_range(wrist)


def test_a_base_of_100_m_changes_no_joint():
    """Its file ended in an error of linear algebra, or in a tension that nobody had given."""
    short = nf.load_robot("pacheco2021-b-true")
    models = [joint_model(short.with_value("tube.base_length", base)) for base in (10.0, 1e5)]
    assert models[1].top == pytest.approx(models[0].top, rel=1e-6)
    for first, second in zip(models[0].springs, models[1].springs, strict=True):
        at = first.range
        assert second.moment(at) == pytest.approx(first.moment(at), rel=1e-3, abs=1e-4)
