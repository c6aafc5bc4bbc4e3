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
from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any
from xml.etree.ElementTree import TreeBuilder, XMLParser, fromstring, indent, tostring
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex import RodGap, __version__
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
_STOP = "0.002 1"  # four time steps, s, and the damping ratio of stops and drums
_FAR = 10.0  # rad; no hinge turns so far
_FASTEST = 100  # rad/s; URDF needs a limit, and quasi-static joints know none
_ANGLES = 11  # of a joint in the table
_FIRST_WITH_YIELD = 4
_LEVELS = 24  # up, and as many down
_RAMP = 200  # time steps from level to level: faster, and inertia carries hinges too far
_HOLD, _MAX_HOLDS = 100, 60  # time steps between looks whether all stands still, and how many
_STILL = 1e-4  # of the largest angle of a hinge so far, in 1 s
_NO_LOOP = 1e-9  # of tension times angle; a loop with less area is none
_MAX_ERROR = 0.02  # of the total angle, as a part of its range, beyond which the user is warned


def _digits(*values: object) -> str:
    """Return numbers and lists of numbers as an attribute has them, with nine digits."""
    numbers = (np.ravel(np.asarray(value, float)) for value in values)
    return " ".join(f"{number:.9g}" for number in np.concatenate([*numbers]))


def _xml(root: str) -> str:
    """Indent a document."""
    tree = fromstring(root, XMLParser(target=TreeBuilder(insert_comments=True)))
    indent(tree)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{tostring(tree, "unicode")}\n'


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in text)


def _comment(head: str) -> str:
    """Return a comment; XML allows no two hyphens in one, nor control characters."""
    return f"<!--\n{_printable(head).replace('--', '- -')}\n-->"


def _inertia(model: JointModel, body: int) -> tuple[float, Array, float, float]:
    """Return mass (kg) and centre (m) of a body, taken as a piece of tube, and its inertia.

    The moments of inertia are those across and along the tube, kg m².
    """
    tube, geometry = model.robot.tubes[body], model.robot.geometry
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
    drums = {j: drum for j, spring in enumerate(model.springs, start=1) if (drum := spring.drum())}
    custom = "".join(
        f'<numeric name="{name}" data="{_digits(value)}"/>'
        for name, value in (numbers or {}).items()
    )
    frictions = equalities = ""
    for j, (moment, _, powers) in drums.items():
        stiffness = _METRE * moment / _YIELD
        frictions += f"""<body name="friction_{j}" pos="0 0 0">
            <inertial pos="0 0 0" mass="1e-06" diaginertia="1e-12 1e-12 1e-12"/>
            <joint name="drum_{j}" type="hinge" axis="0 0 1" stiffness="{_digits(stiffness)}"
                springyield="{_YIELD}" armature="{_digits(stiffness * _RESOLVED)}"/>
        </body>"""
        equalities += f"""<joint joint1="drum_{j}" joint2="notch_{j}" polycoef="{_digits(powers)}"
            solref="{_STOP}" solimp="0.999 0.9999 0.001"/>"""
    return _xml(
        f"""<mujoco model={quoteattr(_printable(model.robot.name))}>{_comment(head)}
            <compiler angle="radian" autolimits="true"/>
            <option timestep="{_TIME_STEP}" integrator="implicitfast" gravity="0 0 0"
                iterations="50"/>
            <custom>{custom}</custom>
            <worldbody>{_bodies(model, drums)}{frictions}</worldbody>
            <tendon>{_tendons(model)}</tendon>
            <equality>{equalities}</equality>
            <keyframe>{_keyframes(model, drums)}</keyframe>
            {_drives(model)}
        </mujoco>"""
    )


def _bodies(model: JointModel, drums: Drums) -> str:
    """Return the bodies one inside the other, each with the hinge before it."""
    hinges, end = model.hinges, _METRE * model.robot.geometry.body_length[-1]
    inner = f'<site name="tip" pos="{_digits(0, 0, end)}" size="0.0001"/>'
    for j in range(len(model.springs), 0, -1):
        free, lever, spring = hinges.free_rotation[j - 1], hinges.lever[j - 1], model.springs[j - 1]
        quat = Rotation.from_matrix(free).as_quat(canonical=True, scalar_first=True)
        slopes = np.gradient(spring.moment(spring.range), spring.range)
        stiffness = _METRE * float(np.abs(slopes).max())
        armature = with_drum = stiffness * _RESOLVED
        if j in drums:
            moment, slope, _ = drums[j]
            with_drum += _METRE * moment / _YIELD * _RESOLVED * slope**2
        limit = model.limit[j - 1]
        stop = f'range="{_digits(-np.pi, limit)}" solreflimit="{_STOP}"'
        stop += ' solimplimit="0.9995 0.9995 0.0001"'
        inner = f"""<body name="body_{j}" pos="{_digits(_METRE * hinges.offset[j - 1])}"
                quat="{_digits(quat)}">
            <joint name="notch_{j}" type="hinge" pos="{_digits(-_METRE * free.T @ lever)}"
                axis="{_digits(free.T @ hinges.axis[j - 1])}"
                stiffness="{_digits(_METRE * spring.stiffness)}" armature="{_digits(armature)}"
                damping="{_digits(2.0 * np.sqrt(stiffness * with_drum))}"
                {stop if np.isfinite(limit) else ""}/>
            {_piece(model, j)}{inner}
        </body>"""
    return f'<body name="body_0" pos="0 0 0">{_piece(model, 0)}{inner}</body>'


def _piece(model: JointModel, body: int) -> str:
    """Return mass, shape and tendon holes of one body."""
    mass, centre, across, along = _inertia(model, body)
    half = 0.5 * _METRE * float(model.robot.geometry.body_length[body])
    parts = [
        f"""<inertial pos="{_digits(centre)}" mass="{_digits(mass)}"
            diaginertia="{_digits(across, across, along)}"/>"""
    ]
    if half > 0.0:
        radius = _METRE * model.robot.tubes[body].outer_radius
        parts.append(
            f"""<geom type="cylinder" size="{_digits(radius, half)}" pos="{_digits(0, 0, half)}"
                contype="0" conaffinity="0" rgba="0.7 0.7 0.75 0.5"/>"""
        )
    parts += [
        f"""<geom type="cylinder" size="{_digits(_METRE * 0.5 * notch.diameter)}"
            fromto="{_digits(0, 0, _METRE * start, 0, 0, _METRE * end)}"
            contype="0" conaffinity="0" rgba="0.5 0.5 0.55 1"/>"""
        for number, start, end in _halves(model, body)
        if isinstance(notch := model.robot.notches[number], RodGap)
    ]
    parts += [
        f'<site name="tendon_{k}_hole_{number}" pos="{_digits(_METRE * hole.place)}" size="5e-05"/>'
        for k, holes in enumerate(model.holes, start=1)
        for number, hole in enumerate(holes, start=1)
        if hole.body == body
    ]
    return "".join(parts)


def _halves(model: JointModel, body: int) -> Iterator[tuple[int, float, float]]:
    """Yield the flexures that adjoin a body, and the ends of their halves on its axis, mm."""
    length, hinges = float(model.robot.geometry.body_length[body]), model.hinges
    if body > 0:
        yield body - 1, -(hinges.free_rotation[body - 1].T @ hinges.lever[body - 1])[2], 0.0
    if body < len(hinges.lever):
        yield body, length, (hinges.offset - hinges.lever)[body, 2]


def _tendons(model: JointModel) -> str:
    """Return the tendons, and the springs that begin at an angle."""
    text = ""
    for k, holes in enumerate(model.holes, start=1):
        sites = (f'<site site="tendon_{k}_hole_{hole + 1}"/>' for hole in range(len(holes)))
        text += f'<spatial name="tendon_{k}" width="5e-05">{"".join(sites)}</spatial>'
    for j, spring in enumerate(model.springs, start=1):
        springs = zip(spring.knots, spring.further, strict=True)
        for number, (knot, stiffness) in enumerate(springs, start=1):
            dead = [-_FAR, knot] if knot > 0.0 else [knot, _FAR]
            text += f"""<fixed name="spring_{j}_{number}"
                    stiffness="{_digits(_METRE * stiffness)}" springlength="{_digits(dead)}">
                <joint joint="notch_{j}" coef="1"/>
            </fixed>"""
    return text


def _keyframes(model: JointModel, drums: Drums) -> str:
    """Return the free robot, and each tendon pulled from rest to thirds of its range.

    While a notch turns its drum yields, so that the spring of the drum lags by what it yields at.
    """
    text = '<key name="free"/>'
    for k, path in enumerate(model.pulls):
        tension, angles = path.commanded_tension, turned(path)
        for third in (1, 2, 3):
            step = int(np.argmin(np.abs(tension[:STEPS, k] - third / 3 * model.top)))
            angle = np.array([polyval(angles[step, j - 1], drums[j][2]) for j in drums])
            plastic = _digits(angle - np.clip(angle, -_YIELD, _YIELD))
            text += f"""<key name="tendon_{k + 1}_at_{tension[step, k]:.4g}_N"
                qpos="{_digits(angles[step], angle)}" ctrl="{_digits(np.nan_to_num(tension[step]))}"
                {f'plastic="{plastic}"' if drums else ""}/>"""
    return text


def _drives(model: JointModel) -> str:
    """Return the motors that pull the tendons, and the sensors."""
    motors = sensors = ""
    for k in range(1, len(model.holes) + 1):
        # A motor pushes along a tendon; a tendon pulls.
        motors += f"""<motor name="tension_{k}" tendon="tendon_{k}" gear="-1"
            ctrlrange="{_digits(0, model.top)}"/>"""
        sensors += f"""<tendonpos name="tendon_length_{k}" tendon="tendon_{k}"/>
            <actuatorfrc name="tendon_force_{k}" actuator="tension_{k}"/>"""
    for j in range(1, len(model.springs) + 1):
        sensors += f'<jointpos name="angle_{j}" joint="notch_{j}"/>'
    return f"""<actuator>{motors}</actuator>
        <sensor>{sensors}
            <framepos name="tip_position" objtype="site" objname="tip"/>
            <framequat name="tip_rotation" objtype="site" objname="tip"/>
        </sensor>"""


def urdf(model: JointModel, head: str) -> str:
    """Return the text of a URDF file.

    Args:
        model: The robot as bodies and hinges.
        head: What stands at the head of the file.
    """
    hinges, last = model.hinges, len(model.springs)
    # A link's frame is that of the joint before it: in the hinge, turned as the body.
    position = np.zeros(3)
    text = _link(model, 0, position)
    for j, spring in enumerate(model.springs):
        free, lever = hinges.free_rotation[j], hinges.lever[j]
        effort = np.abs(spring.moment(spring.range)) + np.abs(spring.friction_moment(spring.range))
        text += f"""<joint name="notch_{j + 1}" type="revolute">
            <parent link="body_{j}"/><child link="body_{j + 1}"/>
            <origin xyz="{_digits(_METRE * (hinges.offset[j] - lever - position))}"
                rpy="{_digits(Rotation.from_matrix(free).as_euler("xyz"))}"/>
            <axis xyz="{_digits(free.T @ hinges.axis[j])}"/>
            <limit lower="{_digits(spring.low)}" upper="{_digits(min(model.limit[j], np.pi))}"
                effort="{_digits(_METRE * effort.max())}" velocity="{_FASTEST}"/>
        </joint>"""
        position = -free.T @ lever
        text += _link(model, j + 1, position)
    end = np.array([0.0, 0.0, model.robot.geometry.body_length[-1]]) - position
    name = quoteattr(_printable(model.robot.name.replace(" ", "_")))
    return _xml(
        f"""<robot name={name}>{_comment(head)}{text}
            <link name="tip"/>
            <joint name="tip_fixed" type="fixed">
                <parent link="body_{last}"/><child link="tip"/>
                <origin xyz="{_digits(_METRE * end)}" rpy="0 0 0"/>
            </joint>
        </robot>"""
    )


def _link(model: JointModel, body: int, position: Array) -> str:
    """Return a link; its frame lies at a place of the body's frame, mm."""
    length, radius = model.robot.geometry.body_length[body], model.robot.tubes[body].outer_radius
    mass, centre, across, along = _inertia(model, body)
    middle = np.array([0.0, 0.0, 0.5 * length]) - position
    visual = f"""<visual><origin xyz="{_digits(_METRE * middle)}" rpy="0 0 0"/><geometry>
        <cylinder radius="{_digits(_METRE * radius)}" length="{_digits(_METRE * length)}"/>
    </geometry></visual>"""
    return f"""<link name="body_{body}">
        <inertial>
            <origin xyz="{_digits(centre - _METRE * position)}" rpy="0 0 0"/>
            <mass value="{_digits(mass)}"/>
            <inertia ixx="{_digits(across)}" iyy="{_digits(across)}" izz="{_digits(along)}"
                ixy="0" ixz="0" iyz="0"/>
        </inertial>
        {visual if length > 0.0 else ""}
    </link>"""


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
        top = float(np.max(subject.path.span_tension[..., 0]))  # at the base
    return joint_model(subject.robot, top)


def _head(model: JointModel, *sentences: str) -> str:
    """Head of a file: robot, units, range, and further sentences."""
    robot = model.robot
    lines = [
        f"{robot.name}, by notchflex {__version__} from the robot {robot_digest(robot)}.",
        "SI units: m, kg, s, N, rad. The base is body 0; z is its tube axis.",
        f"Fitted to a pull of each tendon from rest to {model.top:.6g} N and its release.",
    ]
    if any(tendon.sheath_length for tendon in robot.tendon):
        lines.append("Tendons are pulled at the base: the sheaths before it are left out.")
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
    installed = importlib.util.find_spec("mujoco") is not None
    if installed and int(import_module("mujoco").__version__.split(".")[0]) >= _FIRST_WITH_YIELD:
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
