"""A flexure as one hinge: where it stands, and the kinematics of a chain of hinges.

Beyond the hinge the distal body turns on a circle. A flexure moves it on another curve; the hinge
lies where the circle comes closest to it, and the free robot keeps its shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex.export.simulators.samples import PullSamples
from notchflex.robot import Robot

# Without any turn the place of a hinge is not determined: half way along the flexure.
_MIN_TURN = 1e-6


@dataclass(frozen=True)
class HingeChain:
    """Bodies 0 (the base) to n joined by n hinges. Units mm, rad.

    Attributes:
        axis: Axis of every hinge, in the frames of both bodies, (n, 3).
        offset: Origin of the distal body in the frame of the proximal one, free robot, (n, 3).
        free_rotation: Rotation of the distal body in the proximal one, free robot, (n, 3, 3).
        lever: From the hinge to the origin of the distal body, frame of the proximal one, (n, 3).
    """

    axis: Float[np.ndarray, "n 3"]
    offset: Float[np.ndarray, "n 3"]
    free_rotation: Float[np.ndarray, "n 3 3"]
    lever: Float[np.ndarray, "n 3"]

    def bodies(
        self, angle: Float[np.ndarray, "s n"]
    ) -> tuple[Float[np.ndarray, "s bodies 3"], Float[np.ndarray, "s bodies 3 3"]]:
        """Return origins (mm) and rotations of the bodies for angles from the free robot, rad."""
        steps, count = angle.shape
        position = np.zeros((steps, count + 1, 3))
        rotation = np.broadcast_to(np.eye(3), (steps, count + 1, 3, 3)).copy()
        for j in range(count):
            turn = rotations(self.axis[j], angle[:, j])
            step = self.offset[j] - self.lever[j] + turn @ self.lever[j]
            position[:, j + 1] = position[:, j] + np.einsum("sab,sb->sa", rotation[:, j], step)
            rotation[:, j + 1] = rotation[:, j] @ turn @ self.free_rotation[j]
        return position, rotation


def rotations(
    axis: Float[np.ndarray, " 3"], angle: Float[np.ndarray, " s"]
) -> Float[np.ndarray, "s 3 3"]:
    """Return rotations about one axis by several angles (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, rest = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    return np.eye(3) + sine * cross + rest * (cross @ cross)


def fit_hinges(robot: Robot, pulls: Sequence[PullSamples]) -> HingeChain:
    """Place one hinge per flexure.

    Args:
        robot: The robot, n notches.
        pulls: Its states while tendons are pulled; the first state of each is the free robot.

    Returns:
        The hinges: a least-squares fit to the relative motions of neighbouring bodies.
    """
    direction = np.radians([notch.direction_deg for notch in robot.notches])
    axis = np.stack([-np.sin(direction), np.cos(direction), 0.0 * direction], axis=1)
    offset, free, lever = [], [], []
    for j in range(len(axis)):
        moved = np.concatenate([_relative(one, j) for one in pulls])
        angle = np.concatenate([one.angle[:, j] for one in pulls])
        start = pulls[0].rotation[0]
        offset.append(moved[0])
        free.append(start[j].T @ start[j + 1])
        lever.append(0.5 * moved[0])
        if np.ptp(angle) > _MIN_TURN:
            matrix = (rotations(axis[j], angle) - np.eye(3)).reshape(-1, 3)
            right = (moved - moved[0]).reshape(-1)
            lever[-1] = np.linalg.lstsq(matrix, right, rcond=1e-9)[0]
    return HingeChain(axis, np.array(offset), np.array(free), np.array(lever))


def _relative(one: PullSamples, j: int) -> Float[np.ndarray, "s 3"]:
    """Origin of body j + 1 in the frame of body j."""
    way = one.position[:, j + 1] - one.position[:, j]
    return np.einsum("sba,sb->sa", one.rotation[:, j], way)
