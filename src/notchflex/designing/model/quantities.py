"""Quantities of a design beside the values of its robot file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.analysis.kinematics import bodies_from_angles
from notchflex.mechanics.chain import assemble
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.mechanics.contact import closing_angles, free_angle
from notchflex.results.quantities.registry import DEGREES, QUANTITIES
from notchflex.robot import Robot

OF_STATES = {
    name: one
    for name, one in QUANTITIES.items()
    if one.kind is float
    and one.title
    and one.source in ("solve", "state")
    and one.per in ((), ("notch",), ("tendon",), ("axis",))
}
"""Quantities of solved states that can be differentiated."""

CLOSING, COMPLIANCE, CURVE = "closing_tension", "tip_compliance", "curve."


@dataclass(frozen=True)
class OfRobot:
    """A quantity of the robot alone.

    Attributes:
        unit: Its unit.
        title: What it is.
        formula: From a robot to its numbers, in that unit.
        by_notch: Whether there is one for every notch.
    """

    unit: str
    title: str
    formula: Callable[[Robot], Float[np.ndarray, " k"]]
    by_notch: bool = False


def _length(robot: Robot) -> np.ndarray:
    straight, _ = bodies_from_angles(robot, np.zeros((1, robot.number_of_notches)))
    return np.array([straight[0, -1, 2] + body_lengths(robot.tube, robot.notches)[-1]])


def _closing_angle(robot: Robot) -> np.ndarray:
    rods = assemble(robot, flat=False).rods
    return DEGREES * np.asarray(closing_angles(rods) + free_angle(rods))


def _closed_length(robot: Robot) -> np.ndarray:
    # A closed notch bends about its lips on the outer surface, at the outer radius from the axis.
    travel = np.asarray(closing_angles(assemble(robot, flat=False).rods))
    bodies = body_lengths(robot.tube, robot.notches)
    return np.array([bodies.sum() + robot.tube.outer_radius * travel.sum()])


def _spine(robot: Robot) -> np.ndarray:
    cuts = [notch.spine_cut for notch in robot.notches]
    return np.array([np.nan if cut is None else robot.tube.outer_diameter - cut[0] for cut in cuts])


def _web(robot: Robot) -> np.ndarray:
    return body_lengths(robot.tube, robot.notches)[1:]


def _free_bore(robot: Robot) -> np.ndarray:
    return 2.0 * np.array([min(robot.tube.inner_radius, *(one.radius for one in robot.tendon))])


OF_ROBOTS: dict[str, OfRobot] = {
    "length": OfRobot("mm", "length of the straight robot", _length),
    "closing_angle": OfRobot("deg", "angle at which a notch closes", _closing_angle, True),
    "closed_length": OfRobot(
        "mm", "length of the tube axis with all notches closed", _closed_length
    ),
    "spine": OfRobot("mm", "width of the spine, outer diameter less depth", _spine, True),
    "web": OfRobot("mm", "length of the rigid piece behind a notch", _web, True),
    "free_bore": OfRobot(
        "mm", "diameter of the bore on the axis that is free of tendons", _free_bore
    ),
}
"""Quantities of the robot alone, by name."""


def quantity_names() -> list[str]:
    """Return every name that a design file may give as `quantity`, beside paths of robot files."""
    return [*OF_STATES, CLOSING, COMPLIANCE, *OF_ROBOTS]


def edge_unit(name: str) -> tuple[str, float]:
    """Return the unit of a quantity of states at the edges, and the factor to it."""
    one: Any = OF_STATES[name]
    return one.unit, one.scale
