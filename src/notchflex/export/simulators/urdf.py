"""URDF of a robot: links and joints. SI units.

URDF has no tendons, no springs that a simulator must honour, and no friction that depends on the
load: what bends the joints is in the transmission table.
"""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from notchflex.export.simulators.joint_model import JointModel
from notchflex.export.simulators.text import (
    METRE,
    add,
    comment,
    finished,
    inertia,
    printable,
    roll_pitch_yaw,
)

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
        at = np.linspace(spring.low, spring.high, 51)
        effort = np.abs(spring.moment(at)) + np.abs(spring.friction_moment(at))
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
