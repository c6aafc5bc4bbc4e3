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

from notchflex.export.simulators.joint_model import HingeSpring, JointModel
from notchflex.export.simulators.text import (
    METRE,
    add,
    comment,
    finished,
    inertia,
    printable,
    quaternion,
)

TIME_STEP = 5e-4  # s
# Turn of a drum before it yields, of about 1 rad over the whole range: smaller is closer to dry
# friction and needs more inertia for the same time step.
_YIELD = 3e-3
# Largest natural frequency times the time step.
_RESOLVED = 0.5


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
    if not (steepest := spring.largest_friction):
        return None
    moment = spring.potential_range
    return _Drum(moment * METRE, [0.0, 0.0, *(spring.friction / moment)], steepest / moment)


def mjcf(model: JointModel, head: str = "", numbers: Mapping[str, float] | None = None) -> str:
    """Return the text of an MJCF file.

    Args:
        model: The robot as bodies, hinges and tendons.
        head: What stands at the head of the file.
        numbers: Named numbers that the file carries as `<custom><numeric>`.
    """
    root = ElementTree.Element("mujoco", model=printable(model.robot.name))
    root.append(comment(head))
    add(root, "compiler", angle="radian", autolimits="true")
    add(
        root,
        "option",
        timestep=TIME_STEP,
        integrator="implicitfast",
        gravity=[0, 0, 0],
        iterations=50,
    )
    custom = add(root, "custom")
    for name, value in (numbers or {}).items():
        add(custom, "numeric", name=name, data=value)
    drums = [_drum(spring) for spring in model.springs]
    _bodies(root, model, drums)
    _tendons(root, model)
    equality = add(root, "equality")
    for j, drum in enumerate(drums):
        if drum:
            add(
                equality,
                "joint",
                joint1=f"drum_{j + 1}",
                joint2=f"notch_{j + 1}",
                polycoef=drum.powers,
                solref=[4 * TIME_STEP, 1],
                solimp=[0.999, 0.9999, 1e-3],
            )
    _keyframes(root, model, drums)
    actuators = add(root, "actuator")
    sensors = add(root, "sensor")
    for k in range(len(model.holes)):
        # A motor pushes along a tendon; a tendon pulls.
        add(
            actuators,
            "motor",
            name=f"tension_{k + 1}",
            tendon=f"tendon_{k + 1}",
            gear=-1,
            ctrlrange=[0, model.top],
        )
        add(sensors, "tendonpos", name=f"tendon_length_{k + 1}", tendon=f"tendon_{k + 1}")
        add(sensors, "actuatorfrc", name=f"tendon_force_{k + 1}", actuator=f"tension_{k + 1}")
    for j in range(len(model.springs)):
        add(sensors, "jointpos", name=f"angle_{j + 1}", joint=f"notch_{j + 1}")
    add(sensors, "framepos", name="tip_position", objtype="site", objname="tip")
    add(sensors, "framequat", name="tip_rotation", objtype="site", objname="tip")
    return finished(root)


def _bodies(root: ElementTree.Element, model: JointModel, drums: list[_Drum | None]) -> None:
    hinges = model.hinges
    world = add(root, "worldbody")
    parent = add(world, "body", name="body_0", pos=[0, 0, 0])
    _piece(parent, model, 0)
    for j, spring in enumerate(model.springs):
        parent = add(
            parent,
            "body",
            name=f"body_{j + 1}",
            pos=METRE * hinges.offset[j],
            quat=quaternion(hinges.free_rotation[j]),
        )
        drum = drums[j]
        steepest = drum.steepest if drum else 0.0
        yields = drum.moment / _YIELD if drum else 0.0
        stiffness = METRE * spring.largest_stiffness
        resolved = (TIME_STEP / _RESOLVED) ** 2
        armature = stiffness * resolved
        with_drum = armature + yields * resolved * steepest**2
        limit = {"range": [-np.pi, model.limit[j]]} if np.isfinite(model.limit[j]) else {}
        own = hinges.free_rotation[j].T
        add(
            parent,
            "joint",
            name=f"notch_{j + 1}",
            type="hinge",
            pos=-METRE * own @ hinges.lever[j],
            axis=own @ hinges.axis[j],
            stiffness=METRE * spring.stiffness,
            armature=armature,
            damping=2.0 * np.sqrt(stiffness * with_drum),
            **limit,
            **(
                {"solreflimit": [4 * TIME_STEP, 1], "solimplimit": [0.9995, 0.9995, 1e-4]}
                if limit
                else {}
            ),
        )
        _piece(parent, model, j + 1)
    add(parent, "site", name="tip", pos=[0, 0, METRE * model.body_length[-1]], size=1e-4)
    for j, drum in enumerate(drums):
        if drum:
            body = add(world, "body", name=f"friction_{j + 1}", pos=[0, 0, 0])
            add(body, "inertial", pos=[0, 0, 0], mass=1e-6, diaginertia=[1e-12] * 3)
            yields = drum.moment / _YIELD
            add(
                body,
                "joint",
                name=f"drum_{j + 1}",
                type="hinge",
                axis=[0, 0, 1],
                stiffness=yields,
                springyield=_YIELD,
                armature=yields * (TIME_STEP / _RESOLVED) ** 2,
            )


def _piece(parent: ElementTree.Element, model: JointModel, body: int) -> None:
    """Mass, shape and tendon holes of one body."""
    tube, length = model.robot.tube, float(model.body_length[body])
    own = inertia(model, body)
    moments = [own.across, own.across, own.along]
    add(parent, "inertial", pos=own.centre, mass=own.mass, diaginertia=moments)
    if length > 0.0:
        add(
            parent,
            "geom",
            type="cylinder",
            size=[METRE * tube.outer_radius, 0.5 * METRE * length],
            pos=[0, 0, 0.5 * METRE * length],
            contype="0",
            conaffinity="0",
            rgba=[0.7, 0.7, 0.75, 0.5],
        )
    for k, holes in enumerate(model.holes):
        for number, hole in enumerate(holes):
            if hole.body == body:
                name = f"tendon_{k + 1}_hole_{number + 1}"
                add(parent, "site", name=name, pos=METRE * hole.place, size=5e-5)


def _tendons(root: ElementTree.Element, model: JointModel) -> None:
    tendons = add(root, "tendon")
    for k, holes in enumerate(model.holes):
        spatial = add(tendons, "spatial", name=f"tendon_{k + 1}", width=5e-5)
        for number in range(len(holes)):
            add(spatial, "site", site=f"tendon_{k + 1}_hole_{number + 1}")
    far = 10.0  # rad; no hinge turns so far
    for j, spring in enumerate(model.springs):
        for number, (knot, own) in enumerate(zip(spring.knots, spring.further, strict=True)):
            fixed = add(
                tendons,
                "fixed",
                name=f"spring_{j + 1}_{number + 1}",
                stiffness=METRE * own,
                springlength=[-far, knot] if knot > 0.0 else [knot, far],
            )
            add(fixed, "joint", joint=f"notch_{j + 1}", coef=1)


def _keyframes(root: ElementTree.Element, model: JointModel, drums: list[_Drum | None]) -> None:
    """The free robot, and each tendon pulled from rest to thirds of its range.

    While a notch turns its drum yields, so that the spring of the drum lags by what it yields at.
    """
    frames = add(root, "keyframe")
    add(frames, "key", name="free")
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
            add(
                frames,
                "key",
                name=f"tendon_{one.tendon + 1}_at_{one.tension[at]:.4g}_N",
                qpos=[*angle, *turned],
                ctrl=control,
                **(
                    {"plastic": [a - np.sign(a) * min(_YIELD, abs(a)) for a in turned]}
                    if turned
                    else {}
                ),
            )
