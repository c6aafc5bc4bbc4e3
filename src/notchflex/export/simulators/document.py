"""The documents of the formats for simulators of rigid bodies."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np

from notchflex import __version__
from notchflex._extras import install_command
from notchflex.export.document import FileDocument, Subject
from notchflex.export.simulators.joint_model import JointModel, joint_model
from notchflex.export.simulators.mjcf import mjcf
from notchflex.export.simulators.mujoco_run import SimulatorError, has_mujoco, measure_errors
from notchflex.export.simulators.options import SimulatorOptions
from notchflex.export.simulators.transmission import transmission_table
from notchflex.export.simulators.urdf import urdf
from notchflex.results.same_robot import robot_digest
from notchflex.robot import Robot


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


def mjcf_document(subject: Subject, options: SimulatorOptions) -> FileDocument:
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
        return FileDocument(mjcf(model, _head(model, *about, sentence)), (sentence,), facts)
    errors = measure_errors(model, text)
    numbers = {
        f"tendon_{error.tendon}_{name}_error": value
        for error in errors
        for name, value in asdict(error).items()
        if name not in ("tendon", "largest_tension") and value == value
    }
    head = _head(model, *about, *(_sentence(error) for error in errors))
    return FileDocument(
        mjcf(model, head, numbers),
        _large(errors),
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


def _large(errors: list[SimulatorError]) -> tuple[str, ...]:
    return tuple(
        f"The MJCF model misses the total angle under tendon {error.tendon} by "
        f"{error.total_angle:.1%} of its range; a smaller largest tension brings it closer."
        for error in errors
        if not error.total_angle <= _MAX_ERROR
    )


def urdf_document(subject: Subject, options: SimulatorOptions) -> FileDocument:
    """Make a URDF file."""
    model = _model_of(subject, options)
    missing = (
        "URDF carries no tendons, springs, hysteresis or contact of closing notches: its joints "
        "turn freely up to their limits. Levers and moments are in the table that --transmission "
        "writes."
    )
    text = urdf(model, _head(model, missing))
    return FileDocument(text, (missing,), {"largest_tension_N": model.top})


def transmission_document(subject: Subject, options: SimulatorOptions) -> FileDocument:
    """Make the table of levers and moments."""
    model = _model_of(subject, options)
    return FileDocument(transmission_table(model), (), {"largest_tension_N": model.top})
