"""The documents of the formats for simulators of rigid bodies; URDF and the transmission table.

URDF has no tendons, no springs that a simulator must honour, and no friction that depends on the
load: what bends the joints is in the transmission table.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from notchflex import Robot, __version__
from notchflex.export.formats import Document, SimulatorOptions, Subject
from notchflex.export.simulators.joint_model import JointModel, joint_model, tendon_levers
from notchflex.export.simulators.mjcf import mjcf
from notchflex.export.simulators.mujoco_run import SimulatorError, has_mujoco, measure_errors
from notchflex.export.simulators.text import (
    METRE,
    add,
    comment,
    finished,
    inertia,
    printable,
    roll_pitch_yaw,
)
from notchflex.support import csv_text, install_command, robot_digest

_ANGLES = 11


def transmission_table(model: JointModel) -> str:
    """Return a CSV table with a row for every joint and some of its angles.

    Its columns are the angle from the free robot, the lever of every tendon (by how much it
    shortens per turn, the other joints as in the free robot), and the elastic and the friction
    moment of the joint. While the angle rises at tension T, T times the lever is the elastic
    plus the friction moment; while it falls, their difference.
    """
    tendons = range(len(model.holes))
    rows: list[list[str]] = []
    levers = [f"tendon_{k + 1}_lever_mm" for k in tendons]
    header = ["joint", "angle_rad", *levers, "elastic_moment_Nmm", "friction_moment_Nmm"]
    count = len(model.springs)
    for j, spring in enumerate(model.springs):
        at = np.linspace(spring.low, spring.high, _ANGLES)
        angle = np.zeros((_ANGLES, count))
        angle[:, j] = at
        columns = [
            at,
            *(tendon_levers(model.hinges, model.holes[k], angle)[:, j] for k in tendons),
            spring.moment(at),
            np.abs(spring.friction_moment(at)),
        ]
        for row in np.stack(columns, axis=1).tolist():
            rows.append([f"notch_{j + 1}", *(f"{value:.7g}" for value in row)])
    return csv_text(header, rows)


_FASTEST = 100.0  # rad/s; a limit is required, and quasi-static joints know none


def urdf(model: JointModel, head: str = "") -> str:
    """Return the text of a URDF file.

    Args:
        model: The robot as bodies and hinges.
        head: What stands at the head of the file.
    """
    root = ElementTree.Element("robot", name=printable(model.robot.name).replace(" ", "_"))
    root.append(comment(head))
    hinges = model.hinges
    # A link's frame is that of the joint before it: in the hinge, turned as the body.
    position = np.zeros(3)
    _link(root, model, 0, position)
    for j, spring in enumerate(model.springs):
        joint = add(root, "joint", name=f"notch_{j + 1}", type="revolute")
        add(joint, "parent", link=f"body_{j}")
        add(joint, "child", link=f"body_{j + 1}")
        origin = hinges.offset[j] - hinges.lever[j] - position
        turned = roll_pitch_yaw(hinges.free_rotation[j])
        add(joint, "origin", xyz=METRE * origin, rpy=turned)
        own = hinges.free_rotation[j].T
        add(joint, "axis", xyz=own @ hinges.axis[j])
        effort = np.abs(spring.moment(spring.range)) + np.abs(spring.friction_moment(spring.range))
        add(
            joint,
            "limit",
            lower=spring.low,
            upper=min(float(model.limit[j]), np.pi),
            effort=METRE * float(effort.max()),
            velocity=_FASTEST,
        )
        position = -own @ hinges.lever[j]
        _link(root, model, j + 1, position)
    add(root, "link", name="tip")
    joint = add(root, "joint", name="tip_fixed", type="fixed")
    add(joint, "parent", link=f"body_{len(model.springs)}")
    add(joint, "child", link="tip")
    end = np.array([0.0, 0.0, model.body_length[-1]]) - position
    add(joint, "origin", xyz=METRE * end, rpy=[0, 0, 0])
    return finished(root)


def _link(
    root: ElementTree.Element, model: JointModel, body: int, position: Float[np.ndarray, " 3"]
) -> None:
    """Add a link; its frame lies at a place of the body's frame, mm."""
    link = add(root, "link", name=f"body_{body}")
    own, length = inertia(model, body), float(model.body_length[body])
    inertial = add(link, "inertial")
    add(inertial, "origin", xyz=own.centre - METRE * position, rpy=[0, 0, 0])
    add(inertial, "mass", value=own.mass)
    add(inertial, "inertia", ixx=own.across, iyy=own.across, izz=own.along, ixy=0, ixz=0, iyz=0)
    if length > 0.0:
        visual = add(link, "visual")
        middle = np.array([0.0, 0.0, 0.5 * length]) - position
        add(visual, "origin", xyz=METRE * middle, rpy=[0, 0, 0])
        radius = METRE * model.robot.tube.outer_radius
        add(add(visual, "geometry"), "cylinder", radius=radius, length=METRE * length)


# MJCF, URDF and transmission table of one robot are often written together.
@lru_cache(maxsize=4)
def _model(robot: Robot, largest_tension: float | None) -> JointModel:
    return joint_model(robot, largest_tension)


def _model_of(subject: Subject, options: SimulatorOptions) -> JointModel:
    top = options.largest_tension
    if top is None and subject.path is not None:
        top = float(np.max(subject.path.tension))
    return _model(subject.robot, top)


def _head(model: JointModel, *sentences: str) -> str:
    """Head of a file: robot, units, range, and further sentences."""
    robot = model.robot
    return "\n".join(
        [
            f"{robot.name}, by notchflex {__version__} from the robot {robot_digest(robot)}.",
            "SI units: m, kg, s, N, rad. The base is body 0; z is its tube axis.",
            f"Fitted to a pull of each tendon from rest to {model.top:.6g} N and its release.",
            *sentences,
        ]
    )


def mjcf_document(subject: Subject, options: SimulatorOptions) -> Document:
    """Make an MJCF file and measure its error by running it, where MuJoCo is installed."""
    model = _model_of(subject, options)
    about = (
        "ctrl of the motors is the tension of the tendons at the base, in N.",
        "Hinges bend as the flexures do; each has springs (joint and tendons spring_*), friction "
        "(joint drum_*) and a stop where the notch closes.",
        "Friction depends on the angle of the hinge, not on the tension: under other loads than a "
        "pull of one tendon the loops differ.",
        "Bending across the planes of the notches, torsion and stretch are left out. Armature and "
        "damping are numerical: the file is for quasi-static motion.",
    )
    text = mjcf(model, _head(model, *about))
    facts: dict[str, Any] = {"largest_tension_N": model.top}
    if not has_mujoco():
        sentence = (
            "The error of the MJCF file against the chain was not measured, because MuJoCo 4.0 or "
            f"newer is not installed: {install_command('robotics')}."
        )
        return Document(mjcf(model, _head(model, *about, sentence)), (sentence,), facts)
    errors = measure_errors(model, text)
    numbers = {
        f"tendon_{error.tendon}_{name}_error": value
        for error in errors
        for name, value in asdict(error).items()
        if name not in ("tendon", "largest_tension") and value == value
    }
    head = _head(model, *about, *(_sentence(error) for error in errors))
    return Document(
        mjcf(model, head, numbers),
        tuple(
            f"The MJCF model misses the total angle under tendon {error.tendon} by "
            f"{error.total_angle:.1%} of its range; a smaller largest tension brings it closer."
            for error in errors
            if not error.total_angle <= _MAX_ERROR
        ),
        {**facts, "errors": [error.as_dict() for error in errors]},
    )


def _sentence(error: SimulatorError) -> str:
    area = "" if error.loop_area != error.loop_area else f", loop area {error.loop_area:.2%}"
    return (
        f"Measured error, tendon {error.tendon}: total angle {error.total_angle:.2%} of its range, "
        f"any notch {error.notch_angle:.2%} of the largest range, tip {error.tip_position:.2%} of "
        f"its way{area}."
    )


_MAX_ERROR = 0.02
"""Error of the total angle, as a part of its range, beyond which the user is warned."""


def urdf_document(subject: Subject, options: SimulatorOptions) -> Document:
    """Make a URDF file."""
    model = _model_of(subject, options)
    missing = (
        "URDF carries no tendons, springs, hysteresis or contact of closing notches: its joints "
        "turn freely up to their limits. Levers and moments are in the table that --transmission "
        "writes."
    )
    text = urdf(model, _head(model, missing))
    return Document(text, (missing,), {"largest_tension_N": model.top})


def transmission_document(subject: Subject, options: SimulatorOptions) -> Document:
    """Make the table of levers and moments."""
    model = _model_of(subject, options)
    return Document(transmission_table(model), facts={"largest_tension_N": model.top})
