"""The ROS 2 example: units at the border, wrong messages, and the node with stand-ins for ROS."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "ros2"


def loaded(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def core_module():
    yield loaded("robot_core")
    del sys.modules["robot_core"]


@pytest.fixture
def core(core_module):
    return core_module.RobotCore(nf.load_robot("pacheco2021-a"))


def test_lengths_are_metres_at_the_border(core, core_module):
    state = nf.solve(core.robot, nf.Load(tension=1.2))
    assert core.command([1.2]) == ""
    joints, tip = core.joints(), core.tip()
    assert joints.name == ["tendon_1", *(f"notch_{number}" for number in range(1, 6))]
    assert joints.position[0] == pytest.approx(1e-3 * state.stroke[0], rel=1e-12)
    assert joints.position[1:] == pytest.approx(state.notch_angle.tolist(), rel=1e-12)
    assert joints.effort[0] == pytest.approx(1.2)
    assert joints.effort[1:] == pytest.approx((1e-3 * state.notch_moment).tolist(), rel=1e-12)
    assert tip.position == pytest.approx((1e-3 * state.tip_position).tolist(), rel=1e-12)
    turn = Rotation.from_quat(tip.orientation).as_matrix()
    assert turn == pytest.approx(state.tip_rotation, abs=1e-12)
    other = core_module.RobotCore(core.robot, "stroke")
    assert other.command([joints.position[0]]) == ""
    assert other.joints().effort[0] == pytest.approx(1.2, rel=1e-6)


def test_a_target_is_reached_with_the_friction_history(core):
    up = nf.simulate(core.robot, nf.pull(0.4, 1.2, steps=3).release())
    for step in (0, 1, 2, 4, 5):  # at 3 the tip stays, where a smaller tension holds it
        tip, tension = up.tip_position[step], up.tension[step, 0]
        assert core.steer((1e-3 * tip).tolist()) == ""
        assert core.joints().effort[0] == pytest.approx(tension, abs=2e-3)
    assert core.steer([0.05, 0.0, 0.0]) in ("TARGET_OUT_OF_REACH", "SEARCH_STOPPED")


@pytest.mark.parametrize(
    "values", [[float("nan")], [float("inf")], [1.0, 1.0], [], ["much"], [[1.0]], None]
)
def test_commands_that_cannot_be_used_change_nothing(core, values):
    core.command([0.5])
    before = core.joints()
    assert core.command(values) == "INVALID_INPUT"
    assert core.steer(values) == "INVALID_INPUT"
    assert core.joints() == before


def test_a_target_beyond_all_robots_changes_nothing(core):
    core.command([0.5])
    before = core.joints()
    assert core.steer([1e300, 0.0, 0.0]) == "OUT_OF_RANGE"
    assert core.joints() == before


def test_codes_of_failures_and_of_wrong_settings(core, core_module):
    assert core.command([-1.0]) == "OUT_OF_RANGE"
    by_stroke = core_module.RobotCore(core.robot, "stroke")
    assert by_stroke.command([0.02]) == "NOTCHES_CLOSED"
    assert by_stroke.joints().position[0] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(nf.InputError):
        core_module.RobotCore(core.robot, "current")


@pytest.mark.parametrize(
    ("name", "position", "effort"),
    [
        (["tendon_1"], [0.001], []),
        (["tendon_2"], [0.001], [1.0]),
        (["tendon_1"], [float("nan")], [1.0]),
        ([], [], []),
    ],
)
def test_readings_that_cannot_be_used(core, name, position, effort):
    assert core.read(name, position, effort) == "INVALID_INPUT"
    assert core.feel() is None


def test_readings_are_kept_where_the_tendon_turns_round(core):
    for tension, stroke in [(0.2, 0.2), (0.4, 0.4), (0.8, 0.9), (0.6, 0.8), (0.5, 0.7)]:
        names, strokes, tensions = ["tendon_1", "x"], [1e-3 * stroke, 9.0], [tension, 9.0]
        assert core.read(names, strokes, tensions) == ""
    assert np.allclose(core._readings, [[0.2, 0.2], [0.8, 0.9], [0.5, 0.7]])
    core.reset()
    assert core.feel() is None


@pytest.mark.nightly
def test_a_force_at_the_tip_is_felt(core):
    wrist = core.robot
    loads = [nf.Load(tension=0.4), nf.Load(tension=0.8)]
    loads += [nf.Load(tension=0.8, tip_force=(force, 0.0, 0.0)) for force in (0.03, 0.06)]
    path = nf.simulate(wrist, loads)
    for stroke, tension in zip(path.stroke[:, 0], path.tension[:, 0], strict=True):
        core.read(["tendon_1"], [1e-3 * stroke], [tension])
    felt = core.feel()
    assert felt.contact
    assert felt.axes == ("x",)
    assert felt.low[0] <= 0.06 <= felt.high[0]
    # In the frame of the tip; as long as in the base.
    assert np.linalg.norm(felt.force) == pytest.approx(0.06, abs=0.01)
    world = path[3].tip_rotation @ felt.force
    assert world[1:] == pytest.approx([0.0, 0.0], abs=1e-3)


class Message(SimpleNamespace):
    """Any message: its fields come into being when they are asked for."""

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        value = Message()
        setattr(self, name, value)
        return value


class Node:
    """What the example needs of `rclpy.node.Node`."""

    def __init__(self, name):
        self.name, self.topics, self.timers, self.said = name, {}, [], []

    def declare_parameter(self, name, value):
        return SimpleNamespace(value=value)

    def create_publisher(self, kind, topic, depth):
        sent = []
        self.topics[topic] = kind, sent
        return SimpleNamespace(publish=sent.append)

    def create_subscription(self, kind, topic, act, depth):
        self.topics[topic] = kind, act

    def create_timer(self, period, act, callback_group=None):
        self.timers.append((period, act))

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: "now"))

    def get_logger(self):
        return SimpleNamespace(warning=self.said.append)


@pytest.fixture
def node(core_module, monkeypatch):
    kinds = {}
    for module, names in {
        "rclpy": (),
        "rclpy.callback_groups": ("MutuallyExclusiveCallbackGroup",),
        "rclpy.executors": ("MultiThreadedExecutor",),
        "rclpy.node": ("Node",),
        "geometry_msgs.msg": ("PoseStamped", "WrenchStamped"),
        "sensor_msgs.msg": ("JointState",),
        "std_msgs.msg": ("Float64MultiArray",),
    }.items():
        made = ModuleType(module)
        for name in names:
            kinds[name] = Node if name == "Node" else type(name, (Message,), {})
            setattr(made, name, kinds[name])
        monkeypatch.setitem(sys.modules, module, made)
        if "." in module:
            monkeypatch.setitem(sys.modules, module.partition(".")[0], made)
    made = loaded("notchflex_node").NotchflexNode()
    yield made
    del sys.modules["notchflex_node"]


def test_the_node_hands_messages_on(node):
    kinds = {topic: kind.__name__ for topic, (kind, _) in node.topics.items()}
    assert kinds == {
        "~/joint_states": "JointState",
        "~/tip_pose": "PoseStamped",
        "~/tip_wrench": "WrenchStamped",
        "~/commands": "Float64MultiArray",
        "~/target": "PoseStamped",
        "~/measured": "JointState",
    }
    node.topics["~/commands"][1](Message(data=[1.0]))
    node.timers[0][1]()
    joints, pose = (node.topics[topic][1][0] for topic in ("~/joint_states", "~/tip_pose"))
    assert joints.effort[0] == pytest.approx(1.0)
    place = pose.pose.position
    assert [place.x, place.y, place.z] == node.core.tip().position
    assert pose.header.frame_id == "base_link"
    node.topics["~/target"][1](
        Message(header=Message(frame_id="base_link"), pose=Message(position=place))
    )
    assert node.said == []
    node.topics["~/target"][1](Message(header=Message(frame_id="map")))
    node.topics["~/commands"][1](Message(data=[float("nan")]))
    node.topics["~/measured"][1](Message(name=["tendon_1"], position=[], effort=[]))
    assert len(node.said) == 3
    node.timers[1][1]()  # nothing was read: nothing is published
    assert node.topics["~/tip_wrench"][1] == []
    read = node.core.joints()
    node.topics["~/measured"][1](
        Message(name=read.name, position=read.position, effort=read.effort)
    )
    node.timers[1][1]()
    assert node.topics["~/tip_wrench"][1][0].header.frame_id == "tip"
