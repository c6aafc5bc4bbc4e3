"""Models for simulators of rigid bodies: MJCF, URDF, and a table of levers and moments. SI units.

MJCF are the model files of MuJoCo (4.0 or newer), which runs them, to compare them with the chain.
Every flexure is a hinge: its spring a cubic, with further springs (fixed tendons with a dead band)
that begin at an angle. Its friction is a drum, a joint of its own beside the robot, whose angle is
a polynomial of the hinge's (a joint equality) and whose spring yields: the slope of the polynomial
times the yield moment is the friction moment of the hinge, which so depends on its angle.

URDF has no tendons, no springs that a simulator must honour, and no friction that depends on the
load: what bends the joints is in the transmission table.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from importlib import import_module
from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex import __version__
from notchflex.export.formats import Document, SimulatorOptions, Subject
from notchflex.export.joints import (
    STEPS,
    JointModel,
    joint_model,
    tendon_levers,
    turned,
)
from notchflex.support import csv_text, install_command, robot_digest

Array = NDArray[np.float64]
Drums = Mapping[int, tuple[float, float, Array]]

_METRE = 1e-3  # mm to m, N mm to N m, g to kg
_MIN_MASS = 1e-5  # g, where nothing is known of the density
_TIME_STEP = 5e-4  # s
# Turn of a drum before it yields, of about 1 rad over the whole range: smaller is closer to dry
# friction and needs more inertia for the same time step.
_YIELD = 3e-3
_RESOLVED = (_TIME_STEP / 0.5) ** 2  # s²; the largest natural frequency times the step is 0.5
_FAR = 10.0  # rad; no hinge turns so far
_FASTEST = 100.0  # rad/s; URDF needs a limit, and quasi-static joints know none
_ANGLES = 11  # of a joint in the table
_FIRST_WITH_YIELD = 4
_LEVELS = 24  # up, and as many down
_RAMP = 200  # time steps from level to level: faster, and inertia carries hinges too far
_HOLD, _MAX_HOLDS = 100, 60  # time steps between looks whether all stands still, and how many
_STILL = 1e-4  # of the largest angle of a hinge so far, in 1 s
_NO_LOOP = 1e-9  # of tension times angle; a loop with less area is none
_MAX_ERROR = 0.02  # of the total angle, as a part of its range, beyond which the user is warned


def _add(parent: Element, tag: str, /, **keys: object) -> Element:
    """Add an element; numbers and lists of numbers are written with nine digits."""
    return SubElement(parent, tag, {name: _text(value) for name, value in keys.items()})


def _text(value: object) -> str:
    if isinstance(value, str):
        return value
    return " ".join(f"{number:.9g}" for number in np.atleast_1d(np.asarray(value, float)))


def _root(tag: str, head: str, **keys: str) -> Element:
    """Return a root with a comment; XML allows no two hyphens in one, nor control characters."""

    def printable(text: str) -> str:
        return "".join(c if c.isprintable() or c == "\n" else "?" for c in text)

    root: Any = Element(tag, {name: printable(value) for name, value in keys.items()})
    root.append(Comment(f"\n{printable(head).replace('--', '- -')}\n"))
    return root


def _xml(root: Element) -> str:
    indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{tostring(root, "unicode")}\n'


def _inertia(model: JointModel, body: int) -> tuple[float, Array, float, float]:
    """Return mass (kg) and centre (m) of a body, taken as a piece of tube, and its inertia.

    The moments of inertia are those across and along the tube, kg m².
    """
    tube, geometry = model.robot.tube, model.robot.geometry
    mass = _METRE * max(float(geometry.body_mass[body]), _MIN_MASS)
    radii = (_METRE * tube.outer_radius) ** 2 + (_METRE * tube.inner_radius) ** 2
    along, length = 0.5 * mass * radii, _METRE * float(geometry.body_length[body])
    # A ring without length has half as much across as along, and simulators refuse less.
    across = max(mass * (3.0 * radii + length**2) / 12.0, 0.51 * along)
    return mass, _METRE * geometry.body_centre[body], across, along


def mjcf(model: JointModel, head: str = "", numbers: Mapping[str, float] | None = None) -> str:
    """Return the text of an MJCF file.

    Args:
        model: The robot as bodies, hinges and tendons.
        head: What stands at the head of the file.
        numbers: Named numbers that the file carries as `<custom><numeric>`.
    """
    root = _root("mujoco", head, model=model.robot.name)
    _add(root, "compiler", angle="radian", autolimits="true")
    _add(
        root,
        "option",
        timestep=_TIME_STEP,
        integrator="implicitfast",
        gravity=[0, 0, 0],
        iterations=50,
    )
    custom = _add(root, "custom")
    for name, value in (numbers or {}).items():
        _add(custom, "numeric", name=name, data=value)
    drums = {j: drum for j, spring in enumerate(model.springs, start=1) if (drum := spring.drum())}
    world = _add(root, "worldbody")
    _bodies(world, model, drums)
    _tendons(root, model)
    equality = _add(root, "equality")
    for j, (moment, _, powers) in drums.items():
        body = _add(world, "body", name=f"friction_{j}", pos=[0, 0, 0])
        _add(body, "inertial", pos=[0, 0, 0], mass=1e-6, diaginertia=[1e-12] * 3)
        stiffness = _METRE * moment / _YIELD
        _add(
            body,
            "joint",
            name=f"drum_{j}",
            type="hinge",
            axis=[0, 0, 1],
            stiffness=stiffness,
            springyield=_YIELD,
            armature=stiffness * _RESOLVED,
        )
        _add(
            equality,
            "joint",
            joint1=f"drum_{j}",
            joint2=f"notch_{j}",
            polycoef=powers,
            solref=[4 * _TIME_STEP, 1],
            solimp=[0.999, 0.9999, 1e-3],
        )
    _keyframes(root, model, drums)
    _drives(root, model)
    return _xml(root)


def _bodies(world: Element, model: JointModel, drums: Drums) -> None:
    """Write the bodies one inside the other, each with the hinge before it."""
    hinges = model.hinges
    parent = _add(world, "body", name="body_0", pos=[0, 0, 0])
    _piece(parent, model, 0)
    for j, spring in enumerate(model.springs, start=1):
        free, lever, limit = hinges.free_rotation[j - 1], hinges.lever[j - 1], model.limit[j - 1]
        quat = Rotation.from_matrix(free).as_quat(canonical=True, scalar_first=True)
        pos = _METRE * hinges.offset[j - 1]
        parent = _add(parent, "body", name=f"body_{j}", pos=pos, quat=quat)
        stiffness = _METRE * spring.largest_stiffness
        armature = with_drum = stiffness * _RESOLVED
        if j in drums:
            moment, slope, _ = drums[j]
            with_drum += _METRE * moment / _YIELD * _RESOLVED * slope**2
        joint = _add(
            parent,
            "joint",
            name=f"notch_{j}",
            type="hinge",
            pos=-_METRE * free.T @ lever,
            axis=free.T @ hinges.axis[j - 1],
            stiffness=_METRE * spring.stiffness,
            armature=armature,
            damping=2.0 * np.sqrt(stiffness * with_drum),
        )
        if np.isfinite(limit):
            joint.set("range", _text([-np.pi, limit]))
            joint.set("solreflimit", _text([4 * _TIME_STEP, 1]))
            joint.set("solimplimit", _text([0.9995, 0.9995, 1e-4]))
        _piece(parent, model, j)
    end = [0, 0, _METRE * model.robot.geometry.body_length[-1]]
    _add(parent, "site", name="tip", pos=end, size=1e-4)


def _piece(parent: Element, model: JointModel, body: int) -> None:
    """Write mass, shape and tendon holes of one body."""
    mass, centre, across, along = _inertia(model, body)
    _add(parent, "inertial", pos=centre, mass=mass, diaginertia=[across, across, along])
    half = 0.5 * _METRE * float(model.robot.geometry.body_length[body])
    if half > 0.0:
        _add(
            parent,
            "geom",
            type="cylinder",
            size=[_METRE * model.robot.tube.outer_radius, half],
            pos=[0, 0, half],
            contype=0,
            conaffinity=0,
            rgba=[0.7, 0.7, 0.75, 0.5],
        )
    for k, holes in enumerate(model.holes, start=1):
        for number, hole in enumerate(holes, start=1):
            if hole.body == body:
                name = f"tendon_{k}_hole_{number}"
                _add(parent, "site", name=name, pos=_METRE * hole.place, size=5e-5)


def _tendons(root: Element, model: JointModel) -> None:
    """Write the tendons, and the springs that begin at an angle."""
    tendons = _add(root, "tendon")
    for k, holes in enumerate(model.holes, start=1):
        spatial = _add(tendons, "spatial", name=f"tendon_{k}", width=5e-5)
        for number in range(1, len(holes) + 1):
            _add(spatial, "site", site=f"tendon_{k}_hole_{number}")
    for j, spring in enumerate(model.springs, start=1):
        springs = zip(spring.knots, spring.further, strict=True)
        for number, (knot, stiffness) in enumerate(springs, start=1):
            dead = [-_FAR, knot] if knot > 0.0 else [knot, _FAR]
            fixed = _add(
                tendons,
                "fixed",
                name=f"spring_{j}_{number}",
                stiffness=_METRE * stiffness,
                springlength=dead,
            )
            _add(fixed, "joint", joint=f"notch_{j}", coef=1)


def _keyframes(root: Element, model: JointModel, drums: Drums) -> None:
    """Write the free robot, and each tendon pulled from rest to thirds of its range.

    While a notch turns its drum yields, so that the spring of the drum lags by what it yields at.
    """
    frames = _add(root, "keyframe")
    _add(frames, "key", name="free")
    for k, path in enumerate(model.pulls):
        tension, angles = path.commanded_tension, turned(path)
        for third in (1, 2, 3):
            step = int(np.argmin(np.abs(tension[:STEPS, k] - third / 3 * model.top)))
            drum_angle = np.array(
                [polyval(angles[step, j - 1], powers) for j, (_, _, powers) in drums.items()]
            )
            key = _add(
                frames,
                "key",
                name=f"tendon_{k + 1}_at_{tension[step, k]:.4g}_N",
                qpos=[*angles[step], *drum_angle],
                ctrl=np.nan_to_num(tension[step]),
            )
            if drums:
                yields = np.clip(drum_angle, -_YIELD, _YIELD)
                key.set("plastic", _text(drum_angle - yields))


def _drives(root: Element, model: JointModel) -> None:
    """Write the motors that pull the tendons, and the sensors."""
    actuators, sensors = _add(root, "actuator"), _add(root, "sensor")
    for k in range(1, len(model.holes) + 1):
        # A motor pushes along a tendon; a tendon pulls.
        _add(
            actuators,
            "motor",
            name=f"tension_{k}",
            tendon=f"tendon_{k}",
            gear=-1,
            ctrlrange=[0, model.top],
        )
        _add(sensors, "tendonpos", name=f"tendon_length_{k}", tendon=f"tendon_{k}")
        _add(sensors, "actuatorfrc", name=f"tendon_force_{k}", actuator=f"tension_{k}")
    for j in range(1, len(model.springs) + 1):
        _add(sensors, "jointpos", name=f"angle_{j}", joint=f"notch_{j}")
    _add(sensors, "framepos", name="tip_position", objtype="site", objname="tip")
    _add(sensors, "framequat", name="tip_rotation", objtype="site", objname="tip")


def urdf(model: JointModel, head: str = "") -> str:
    """Return the text of a URDF file.

    Args:
        model: The robot as bodies and hinges.
        head: What stands at the head of the file.
    """
    root, hinges = _root("robot", head, name=model.robot.name.replace(" ", "_")), model.hinges
    # A link's frame is that of the joint before it: in the hinge, turned as the body.
    position = np.zeros(3)
    _link(root, model, 0, position)
    for j, spring in enumerate(model.springs):
        free, lever = hinges.free_rotation[j], hinges.lever[j]
        joint = _joint(root, f"notch_{j + 1}", "revolute", f"body_{j}", f"body_{j + 1}")
        origin = _METRE * (hinges.offset[j] - lever - position)
        _add(joint, "origin", xyz=origin, rpy=Rotation.from_matrix(free).as_euler("xyz"))
        _add(joint, "axis", xyz=free.T @ hinges.axis[j])
        effort = np.abs(spring.moment(spring.range)) + np.abs(spring.friction_moment(spring.range))
        _add(
            joint,
            "limit",
            lower=spring.low,
            upper=min(float(model.limit[j]), np.pi),
            effort=_METRE * float(effort.max()),
            velocity=_FASTEST,
        )
        position = -free.T @ lever
        _link(root, model, j + 1, position)
    _add(root, "link", name="tip")
    joint = _joint(root, "tip_fixed", "fixed", f"body_{len(model.springs)}", "tip")
    end = np.array([0.0, 0.0, model.robot.geometry.body_length[-1]]) - position
    _add(joint, "origin", xyz=_METRE * end, rpy=[0, 0, 0])
    return _xml(root)


def _joint(root: Element, name: str, kind: str, parent: str, child: str) -> Element:
    joint = _add(root, "joint", name=name, type=kind)
    _add(joint, "parent", link=parent)
    _add(joint, "child", link=child)
    return joint


def _link(root: Element, model: JointModel, body: int, position: Array) -> None:
    """Add a link; its frame lies at a place of the body's frame, mm."""
    link, length = _add(root, "link", name=f"body_{body}"), model.robot.geometry.body_length[body]
    mass, centre, across, along = _inertia(model, body)
    inertial = _add(link, "inertial")
    _add(inertial, "origin", xyz=centre - _METRE * position, rpy=[0, 0, 0])
    _add(inertial, "mass", value=mass)
    _add(inertial, "inertia", ixx=across, iyy=across, izz=along, ixy=0, ixz=0, iyz=0)
    if length > 0.0:
        visual = _add(link, "visual")
        middle = np.array([0.0, 0.0, 0.5 * length]) - position
        _add(visual, "origin", xyz=_METRE * middle, rpy=[0, 0, 0])
        radius = _METRE * model.robot.tube.outer_radius
        _add(_add(visual, "geometry"), "cylinder", radius=radius, length=_METRE * length)


def _has_mujoco() -> bool:
    """Tell whether MuJoCo is installed, in a version whose springs yield."""
    if importlib.util.find_spec("mujoco") is None:
        return False
    return int(import_module("mujoco").__version__.split(".")[0]) >= _FIRST_WITH_YIELD


def run_mujoco(text: str, tendon: int, tension: Array, notches: int) -> tuple[Array, Array]:
    """Pull one tendon of an MJCF model through levels of tension, each until it stands still.

    Args:
        text: The MJCF file.
        tendon: Which tendon, from 0.
        tension: The levels, N, (s,).
        notches: Number of notches, n.

    Returns:
        Angles of the hinges, rad, (s, n), and positions of the tip, mm, (s, 3).
    """
    mujoco: Any = import_module("mujoco")  # it has no types
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    # One joint coordinate and one velocity a hinge.
    joints = [int(model.joint(f"notch_{j + 1}").qposadr[0]) for j in range(notches)]
    angle, tip, before, largest = [], [], 0.0, 0.0
    for level in tension:
        for control in np.linspace(before, level, _RAMP):
            data.ctrl[tendon] = control
            mujoco.mj_step(model, data)
        for _ in range(_MAX_HOLDS):
            mujoco.mj_step(model, data, _HOLD)
            largest = max(largest, float(np.abs(data.qpos[joints]).max()))
            if np.abs(data.qvel[joints]).max() <= _STILL * largest:
                break
        before = level
        angle.append(data.qpos[joints].copy())
        tip.append(1e3 * data.site("tip").xpos)
    return np.array(angle), np.array(tip)


def measure_errors(model: JointModel, text: str) -> list[dict[str, Any]]:
    """Run an exported file over loading and unloading of each tendon, against the chain.

    Returns:
        Of each tendon its number, from 1, and the end of its range; the largest error of the total
        angle (a notch that turns to the other side adds to it too) as a part of its range, of any
        notch as a part of the largest range of a notch, and of the tip as a part of its way; and
        that of the area between loading and unloading, total angle over tension, as a part of the
        area, None where there is none.
    """
    errors: list[dict[str, Any]] = []
    levels = np.unique(np.linspace(0, STEPS - 1, _LEVELS).round().astype(int))
    rows = np.concatenate([levels, 2 * STEPS - 1 - levels[::-1]])
    for tendon, path in enumerate(model.pulls):
        chain, tips, tension = turned(path), path.tip_position, path.commanded_tension[rows, tendon]
        angle, tip = run_mujoco(text, tendon, tension, len(model.springs))
        # Notches that open to opposite sides turn to both: each counts the way that it turns.
        way = np.sign(chain[STEPS])
        total, known = angle @ way, chain[rows] @ way
        area, known_area = np.abs(np.trapezoid([total, known], tension)).tolist()  # N rad
        has_loop = known_area > _NO_LOOP * model.top * np.ptp(known)
        away, ways = (np.linalg.norm(x, axis=1).max() for x in (tip - tips[rows], tips - tips[0]))
        off = np.abs(angle - chain[rows]).max() / np.ptp(chain, axis=0).max()
        errors.append(
            {
                "tendon": tendon + 1,
                "largest_tension_N": model.top,
                "total_angle": float(np.abs(total - known).max() / np.ptp(known)),
                "notch_angle": float(off),
                "tip_position": float(away / ways),
                "loop_area": abs(area / known_area - 1.0) if has_loop else None,
            }
        )
    return errors


def _model_of(subject: Subject, options: SimulatorOptions) -> JointModel:
    top = options.largest_tension
    if top is None and subject.path is not None:
        top = float(np.max(subject.path.tension))
    return joint_model(subject.robot, top)


def _head(model: JointModel, *sentences: str) -> str:
    """Head of a file: robot, units, range, and further sentences."""
    robot = model.robot
    lines = [
        f"{robot.name}, by notchflex {__version__} from the robot {robot_digest(robot)}.",
        "SI units: m, kg, s, N, rad. The base is body 0; z is its tube axis.",
        f"Fitted to a pull of each tendon from rest to {model.top:.6g} N and its release.",
    ]
    return "\n".join([*lines, *sentences])


def mjcf_document(subject: Subject, options: SimulatorOptions) -> Document:
    """Make an MJCF file and measure its error by running it, where MuJoCo is installed."""
    model = _model_of(subject, options)
    about = [
        "ctrl of the motors is the tension of the tendons at the base, in N.",
        "Hinges bend as the flexures do; each has springs (joint and tendons spring_*), friction "
        "(joint drum_*) and a stop where the notch closes.",
        "Friction depends on the angle of the hinge, not on the tension: under other loads than a "
        "pull of one tendon the loops differ.",
        "Bending across the planes of the notches, torsion and stretch are left out. Armature and "
        "damping are numerical: the file is for quasi-static motion.",
    ]
    facts: dict[str, Any] = {"largest_tension_N": model.top}
    numbers: dict[str, float] = {}
    warnings: list[str] = []
    if _has_mujoco():
        facts["errors"] = measure_errors(model, mjcf(model))
        for error in facts["errors"]:
            tendon, total, area = error["tendon"], error["total_angle"], error["loop_area"]
            loop = "" if area is None else f", loop area {area:.2%}"
            about.append(
                f"Measured error, tendon {tendon}: total angle {total:.2%} of its range, any notch "
                f"{error['notch_angle']:.2%} of the largest range, tip {error['tip_position']:.2%} "
                f"of its way{loop}."
            )
            numbers |= {
                f"tendon_{tendon}_{name}_error": value
                for name, value in error.items()
                if name not in ("tendon", "largest_tension_N") and value is not None
            }
            if not total <= _MAX_ERROR:
                warnings.append(
                    f"The MJCF model misses the total angle under tendon {tendon} by {total:.1%} "
                    "of its range; a smaller largest tension brings it closer."
                )
    else:
        warnings.append(
            "The error of the MJCF file against the chain was not measured, because MuJoCo 4.0 or "
            f"newer is not installed: {install_command('robotics')}."
        )
        about += warnings
    return Document(mjcf(model, _head(model, *about), numbers), tuple(warnings), facts)


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
    """Make the table of levers and moments, with a row for every joint and some of its angles.

    Its columns are the angle from the free robot, the lever of every tendon (by how much it
    shortens per turn, the other joints as in the free robot), and the elastic and the friction
    moment of the joint. While the angle rises at tension T, T times the lever is the elastic
    plus the friction moment; while it falls, their difference.
    """
    model = _model_of(subject, options)
    levers = [f"tendon_{k}_lever_mm" for k in range(1, len(model.holes) + 1)]
    header = ["joint", "angle_rad", *levers, "elastic_moment_Nmm", "friction_moment_Nmm"]
    rows: list[list[str]] = []
    for j, spring in enumerate(model.springs):
        angle = np.linspace(spring.low, spring.high, _ANGLES)
        angles = angle[:, None] * np.eye(len(model.springs))[j]
        levers = [tendon_levers(model.hinges, holes, angles)[:, j] for holes in model.holes]
        columns = angle, *levers, spring.moment(angle), np.abs(spring.friction_moment(angle))
        for row in zip(*columns, strict=True):
            rows.append([f"notch_{j + 1}", *(f"{value:.7g}" for value in row)])
    return Document(csv_text(header, rows), facts={"largest_tension_N": model.top})
