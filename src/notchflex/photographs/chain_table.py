"""Poses of the bodies of a planar robot as smooth functions of its notch angles.

The poses are those of the library (`bodies_from_angles`). Each notch moves the body behind it by an
amount that depends on its own angle alone, so that one table per notch serves every fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from notchflex import ArcNotch, InputError, Robot, bodies_from_angles

Numbers = NDArray[np.float64]

_GRID = np.radians(np.arange(-60.0, 121.0, 2.0))
_IN_PLANE = 1e-6


@dataclass(frozen=True)
class ChainTable:
    """A planar robot of n arc notches, in the plane in which it bends. Lengths mm, angles rad.

    The plane has the axis x on the side of the first notch and z along the straight tube.

    Attributes:
        robot: The robot.
        outer: Outer radius.
        inner: Inner radius.
        side: Side of every notch, 1 or -1 along x, (n,).
        depth: Depth of every notch at the outer surface, (n,).
        radial: Whether the edges of a notch point to the tube axis, (n,).
        height: Height of every notch, (n,).
        uncut: Uncut length behind every notch, (n,).
        steps: Splines of the translation (x, z) from body to body over the notch angle.
    """

    robot: Robot
    outer: float
    inner: float
    side: Numbers
    depth: Numbers
    radial: NDArray[np.bool_]
    height: Numbers
    uncut: Numbers
    steps: tuple[CubicSpline, ...]

    @property
    def notches(self) -> int:
        """Number of notches."""
        return len(self.side)

    @property
    def length(self) -> float:
        """Length from the start of the first notch to the tip."""
        return float(self.height.sum() + self.uncut.sum())

    def poses(self, angles: Numbers) -> tuple[Numbers, Numbers]:
        """Return where the bodies start and how far they are turned.

        Args:
            angles: Notch angles, positive toward the side of the notch, (b, n).

        Returns:
            Starts of the bodies (x, z), the base first, whose start is that of the first notch,
            (b, n + 1, 2); and their angles in the plane, (b, n + 1).
        """
        turned = np.concatenate(
            [np.zeros((len(angles), 1)), np.cumsum(angles * self.side, axis=1)], axis=1
        )
        start = np.zeros((len(angles), self.notches + 1, 2))
        for notch, step in enumerate(self.steps):
            x, z = step(angles[:, notch]).T
            cos, sin = np.cos(turned[:, notch]), np.sin(turned[:, notch])
            before = start[:, notch]
            start[:, notch + 1] = before + np.stack([cos * x + sin * z, cos * z - sin * x], axis=1)
        return start, turned


def chain_table(robot: Robot) -> ChainTable:
    """Return the table of a robot that photographs can be measured for.

    Raises:
        InputError: Notches of another kind than "arc", or not all cut in one plane.
    """
    arcs = [notch for notch in robot.notches if isinstance(notch, ArcNotch)]
    if len(arcs) < len(robot.notches):
        kind = next(notch.kind for notch in robot.notches if not isinstance(notch, ArcNotch))
        raise InputError.UNSUPPORTED(
            f"{robot.name} has notches of kind {kind!r}; photographs are measured for robots "
            'whose notches are all of kind "arc"'
        )
    turns = np.radians([arc.direction_deg - arcs[0].direction_deg for arc in arcs])
    if np.abs(np.sin(turns)).max() > _IN_PLANE:
        raise InputError.UNSUPPORTED(
            f"the notches of {robot.name} do not all bend in one plane; one photograph from the "
            "side shows robots that bend in one plane only"
        )
    tube = robot.tube
    return ChainTable(
        robot,
        tube.outer_radius,
        tube.inner_radius,
        np.sign(np.cos(turns)),
        np.array([arc.section_depth(tube) for arc in arcs]),
        np.array([arc.cut == "on-axis" for arc in arcs]),
        np.array([arc.height for arc in arcs]),
        np.array([arc.uncut_length for arc in arcs]),
        _steps(robot, math.radians(arcs[0].direction_deg)),
    )


def _steps(robot: Robot, direction: float) -> tuple[CubicSpline, ...]:
    angles = np.repeat(_GRID[:, None], robot.number_of_notches, axis=1)
    position, rotation = bodies_from_angles(robot, angles)
    step = np.einsum("sbji,sbj->sbi", rotation[:, :-1], np.diff(position, axis=1))
    step[:, 0, 2] -= robot.tube.base_length  # lengths count from the start of the first notch
    along = step[..., 0] * math.cos(direction) + step[..., 1] * math.sin(direction)
    plane = np.stack([along, step[..., 2]], axis=-1)
    return tuple(CubicSpline(_GRID, plane[:, notch]) for notch in range(plane.shape[1]))
