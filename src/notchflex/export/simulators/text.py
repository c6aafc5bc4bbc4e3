"""Pieces of XML: elements with numbers in SI units, rotations, masses."""

from __future__ import annotations

from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from notchflex.export.simulators.joint_model import JointModel

METRE = 1e-3
"""mm to m, N mm to N m, g to kg."""

_MIN_MASS = 1e-5  # g, where nothing is known of the density


class Inertia(NamedTuple):
    """Mass of a body, in SI units.

    Attributes:
        mass: Its mass, kg.
        centre: Its centre in the frame of the body, m.
        across: Moment of inertia about x and y through the centre, kg m².
        along: The same about z.
    """

    mass: float
    centre: Float[np.ndarray, " 3"]
    across: float
    along: float


def inertia(model: JointModel, body: int) -> Inertia:
    """Return mass and moments of inertia of a body, taken as a piece of tube."""
    tube, length = model.robot.tube, METRE * float(model.body_length[body])
    mass = METRE * max(float(model.body_mass[body]), _MIN_MASS)
    radii = (METRE * tube.outer_radius) ** 2 + (METRE * tube.inner_radius) ** 2
    along = 0.5 * mass * radii
    # A ring without length has half as much across as along, and simulators refuse less.
    across = max(mass * (3.0 * radii + length**2) / 12.0, 0.51 * along)
    return Inertia(mass, METRE * model.body_centre[body], across, along)


def add(parent: ElementTree.Element, tag: str, /, **keys: object) -> ElementTree.Element:
    """Add an element; numbers and lists of numbers are written with nine digits."""
    return ElementTree.SubElement(parent, tag, {name: _text(value) for name, value in keys.items()})


def _text(value: object) -> str:
    if isinstance(value, str):
        return value
    return " ".join(f"{number:.9g}" for number in np.atleast_1d(np.asarray(value, float)))


def comment(text: str) -> Any:
    """Return a comment; XML allows no two hyphens in one."""
    return ElementTree.Comment(f"\n{printable(text).replace('--', '- -')}\n")


def printable(text: str) -> str:
    """Return a text without the control characters that XML does not allow."""
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in text)


def finished(root: ElementTree.Element) -> str:
    """Return an indented document."""
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ElementTree.tostring(root, "unicode")}\n'


def quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 4"]:
    """Return w, x, y, z of a rotation."""
    return Rotation.from_matrix(rotation).as_quat(canonical=True, scalar_first=True)


def roll_pitch_yaw(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    """Return the angles about the fixed axes x, y and z of a rotation, rad."""
    return Rotation.from_matrix(rotation).as_euler("xyz")
