"""MJCF, the model files of MuJoCo (4.0 or newer), of a robot that bends like its chain. SI units.

Every flexure is a hinge: its spring a cubic, with further springs (fixed tendons with a dead band)
that begin at an angle. Its friction is a drum, a joint of its own beside the robot, whose angle is
a polynomial of the hinge's (a joint equality) and whose spring yields: the slope of the polynomial
times the yield moment is the friction moment of the hinge, which so depends on its angle.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from notchflex.export.simulators.joint_model import JointModel
from notchflex.export.simulators.springs import HingeSpring, potential_range

_M = 1e-3  # mm to m, N mm to N m
TIME_STEP = 5e-4  # s
# Turn of a drum before it yields, of about 1 rad over the whole range: smaller is closer to dry
# friction and needs more inertia for the same time step.
_YIELD = 3e-3
# Largest natural frequency times the time step.
_RESOLVED = 0.5
_LEAST_MASS = 1e-3  # g, where nothing is known of the density
_LEAST_FRICTION = 1e-9  # N mm


class _Drum(NamedTuple):
    """The friction of one hinge. SI units.

    Attributes:
        moment: Moment at which the spring of the drum yields, N m.
        powers: Coefficients of the drum's angle as a polynomial of the hinge's.
        steepest: Largest slope of the polynomial over the range.
    """

    moment: float
    powers: list[float]
    steepest: float


def _drum(spring: HingeSpring) -> _Drum | None:
    moment = potential_range(spring)
    if moment < _LEAST_FRICTION:
        return None
    at = np.linspace(spring.low, spring.high, 201)
    steepest = float(np.abs(spring.friction_moment(at)).max() / moment)
    return _Drum(moment * _M, [0.0, 0.0, *(spring.friction / moment)], steepest)


def mjcf(model: JointModel, comment: str = "", numbers: Mapping[str, float] | None = None) -> str:
    """Return the text of an MJCF file.

    Args:
        model: The robot as bodies, hinges and tendons.
        comment: What stands at the head of the file.
        numbers: Named numbers that the file carries as `<custom><numeric>`.
    """
    root = ElementTree.Element("mujoco", model=model.robot.name)
    root.append(ElementTree.Comment(f"\n{comment.replace('--', '- -')}\n"))
    _add(root, "compiler", angle="radian", autolimits="true")
    _add(
        root, "option", timestep=TIME_STEP, integrator="implicitfast", gravity=[0, 0, 0], iterations=50
    )
    custom = _add(root, "custom")
    for name, value in (numbers or {}).items():
        _add(custom, "numeric", name=name, data=value)
    drums = [_drum(spring) for spring in model.springs]
    _bodies(root, model, drums)
    _tendons(root, model)
    _equalities(root, drums)
    _keyframes(root, model, drums)
    actuators = _add(root, "actuator")
    sensors = _add(root, "sensor")
    for k in range(len(model.holes)):
        # A motor pushes along a tendon; a tendon pulls.
        _add(
            actuators, "motor", name=f"tension_{k + 1}", tendon=f"tendon_{k + 1}", gear=-1,
            ctrlrange=[0, model.top],
        )
        _add(sensors, "tendonpos", name=f"tendon_length_{k + 1}", tendon=f"tendon_{k + 1}")
        _add(sensors, "actuatorfrc", name=f"tendon_force_{k + 1}", actuator=f"tension_{k + 1}")
    for j in range(len(model.springs)):
        _add(sensors, "jointpos", name=f"angle_{j + 1}", joint=f"notch_{j + 1}")
    _add(sensors, "framepos", name="tip_position", objtype="site", objname="tip")
    _add(sensors, "framequat", name="tip_rotation", objtype="site", objname="tip")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add(parent: ElementTree.Element, tag: str, /, **keys: object) -> ElementTree.Element:
    """Add an element; numbers with as many digits as they have, `class_` without its underscore."""
    return ElementTree.SubElement(parent, tag, {name: _text(value) for name, value in keys.items()})


def _text(value: object) -> str:
    if isinstance(value, str):
        return value
    return " ".join(f"{number:.9g}" for number in np.atleast_1d(np.asarray(value, float)))


def _bodies(
    root: ElementTree.Element, model: JointModel, drums: list[_Drum | None]
) -> None:
    hinges = model.hinges
    world = _add(root, "worldbody")
    parent = _add(world, "body", name="body_0", pos=[0, 0, 0])
    _piece(parent, model, 0)
    for j, spring in enumerate(model.springs):
        parent = _add(
            parent, "body", name=f"body_{j + 1}", pos=_M * hinges.offset[j],
            quat=_quaternion(hinges.free_rotation[j]),
        )
        drum = drums[j]
        steepest = drum.steepest if drum else 0.0
        yields = drum.moment / _YIELD if drum else 0.0
        stiffness = _M * spring.largest_stiffness
        resolved = (TIME_STEP / _RESOLVED) ** 2
        armature = stiffness * resolved
        inertia = armature + yields * resolved * steepest**2
        limit = {"range": [-np.pi, model.limit[j]]} if np.isfinite(model.limit[j]) else {}
        own = hinges.free_rotation[j].T
        _add(
            parent, "joint", name=f"notch_{j + 1}", type="hinge", pos=-_M * own @ hinges.lever[j],
            axis=own @ hinges.axis[j], stiffness=_M * spring.stiffness, armature=armature,
            damping=2.0 * np.sqrt(stiffness * inertia), **limit,
            **({"solreflimit": [4 * TIME_STEP, 1], "solimplimit": [0.9995, 0.9995, 1e-4]} if limit else {}),
        )
        _piece(parent, model, j + 1)
    _add(parent, "site", name="tip", pos=[0, 0, _M * model.body_length[-1]], size=1e-4)
    for j, drum in enumerate(drums):
        if drum:
            body = _add(world, "body", name=f"friction_{j + 1}", pos=[0, 0, 0])
            _add(body, "inertial", pos=[0, 0, 0], mass=1e-6, diaginertia=[1e-12] * 3)
            yields = drum.moment / _YIELD
            _add(
                body, "joint", name=f"drum_{j + 1}", type="hinge", axis=[0, 0, 1],
                stiffness=yields, springyield=_YIELD,
                armature=yields * (TIME_STEP / _RESOLVED) ** 2,
            )


def _piece(parent: ElementTree.Element, model: JointModel, body: int) -> None:
    """Mass, shape and tendon holes of one body."""
    tube, length = model.robot.tube, float(model.body_length[body])
    mass = _M * max(float(model.body_mass[body]), _LEAST_MASS)
    radii = (_M * tube.outer_radius) ** 2 + (_M * tube.inner_radius) ** 2
    across = mass * (3.0 * radii + (_M * length) ** 2) / 12.0
    _add(
        parent, "inertial", pos=_M * model.body_centre[body], mass=mass,
        diaginertia=[across, across, mass * radii / 2.0],
    )
    if length > 0.0:
        _add(
            parent, "geom", type="cylinder", size=[_M * tube.outer_radius, 0.5 * _M * length],
            pos=[0, 0, 0.5 * _M * length], contype="0", conaffinity="0", rgba=[0.7, 0.7, 0.75, 0.5],
        )
    for k, holes in enumerate(model.holes):
        for number, hole in enumerate(holes):
            if hole.body == body:
                name = f"tendon_{k + 1}_hole_{number + 1}"
                _add(parent, "site", name=name, pos=_M * hole.place, size=5e-5)


def _tendons(root: ElementTree.Element, model: JointModel) -> None:
    tendons = _add(root, "tendon")
    for k, holes in enumerate(model.holes):
        spatial = _add(tendons, "spatial", name=f"tendon_{k + 1}", width=5e-5)
        for number in range(len(holes)):
            _add(spatial, "site", site=f"tendon_{k + 1}_hole_{number + 1}")
    far = 10.0  # rad; no hinge turns so far
    for j, spring in enumerate(model.springs):
        for number, (knot, own) in enumerate(zip(spring.knots, spring.further, strict=True)):
            fixed = _add(
                tendons, "fixed", name=f"spring_{j + 1}_{number + 1}", stiffness=_M * own,
                springlength=[-far, knot] if knot > 0.0 else [knot, far],
            )
            _add(fixed, "joint", joint=f"notch_{j + 1}", coef=1)


def _equalities(root: ElementTree.Element, drums: list[_Drum | None]) -> None:
    equality = _add(root, "equality")
    for j, drum in enumerate(drums):
        if drum:
            _add(
                equality, "joint", joint1=f"drum_{j + 1}", joint2=f"notch_{j + 1}",
                polycoef=drum.powers, solref=[4 * TIME_STEP, 1], solimp=[0.999, 0.9999, 1e-3],
            )


def _keyframes(root: ElementTree.Element, model: JointModel, drums: list[_Drum | None]) -> None:
    """The free robot, and each tendon pulled from rest to thirds of its range.

    While a notch turns its drum yields, so that the spring of the drum lags by what it yields at.
    """
    frames = _add(root, "keyframe")
    _add(frames, "key", name="free")
    for one in model.pulls:
        for third in (1, 2, 3):
            at = int(np.argmin(np.abs(one.tension - third / 3 * model.top)[one.loading]))
            angle = one.angle[at]
            turned = [
                (float(np.polynomial.polynomial.polyval(angle[j], drum.powers)))
                for j, drum in enumerate(drums)
                if drum
            ]
            control = np.zeros(len(model.holes))
            control[one.tendon] = one.tension[at]
            _add(
                frames, "key", name=f"tendon_{one.tendon + 1}_at_{one.tension[at]:.4g}_N",
                qpos=[*angle, *turned], ctrl=control,
                **({"plastic": [a - np.sign(a) * min(_YIELD, abs(a)) for a in turned]} if turned else {}),
            )


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return w, x, y, z of a rotation by less than half a turn."""
    w = 0.5 * np.sqrt(max(1.0 + np.trace(rotation), 0.0))
    skew = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return np.array([w, *(skew / (4.0 * w))])
