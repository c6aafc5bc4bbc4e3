"""Read what CalculiX printed: the motion of the rings between the notches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from notchflex.export.deck import ring_layers
from notchflex.export.mesh import TubeMesh


class RingMotion(NamedTuple):
    """Rigid motions of the middle of the uncut lengths, base first (n + 1 rings).

    Attributes:
        rotation: Turn of each, (n + 1, 3, 3).
        position: Where its centre has moved to, mm, (n + 1, 3).
    """

    rotation: Float[np.ndarray, "rings 3 3"]
    position: Float[np.ndarray, "rings 3"]

    @property
    def angle(self) -> Float[np.ndarray, " rings"]:
        """Turn in the plane x-z, toward x, rad."""
        return np.arctan2(self.rotation[:, 0, 2], self.rotation[:, 2, 2])

    @property
    def notch_angle(self) -> Float[np.ndarray, " n"]:
        """Turn between neighbouring rings of a robot that bends in the plane x-z, rad."""
        return np.diff(self.angle)

    @property
    def notch_turn(self) -> Float[np.ndarray, "n 3"]:
        """Turn of each ring against the one before, as a vector in the frame of that, rad."""
        relative = np.swapaxes(self.rotation[:-1], 1, 2) @ self.rotation[1:]
        return Rotation.from_matrix(relative).as_rotvec()


def read_rings(mesh: TubeMesh, text: str) -> RingMotion:
    """Return the motions of the rings from the last step of a .dat file of CalculiX.

    Args:
        mesh: The mesh of the deck.
        text: The .dat file.

    Raises:
        ValueError: The file has no displacements of the rings.
    """
    moved = _displacements(text)
    rotation, position = [], []
    for index in ring_layers(mesh):
        numbers = mesh.layer(index)
        missing = [number for number in numbers.tolist() if number not in moved]
        if missing:
            raise ValueError(
                f"the .dat file has no displacement of node {missing[0]}: the run did not finish, "
                "or belongs to another deck"
            )
        start = mesh.place[numbers - 1]
        end = start + np.array([moved[number] for number in numbers.tolist()])
        if mesh.is_half:  # the other half mirrors this one
            start, end = (np.concatenate([one, one * [1.0, -1.0, 1.0]]) for one in (start, end))
        middle = np.array([0.0, 0.0, mesh.heights[index]])
        turn = Rotation.align_vectors(end - end.mean(axis=0), start - start.mean(axis=0))[0]
        rotation.append(turn.as_matrix())
        position.append(end.mean(axis=0) - turn.apply(start.mean(axis=0) - middle))
    return RingMotion(np.array(rotation), np.array(position))


def _displacements(text: str) -> dict[int, list[float]]:
    """Displacements of the last block of a .dat file, by the number of the node."""
    last = text.rfind("displacements")
    rows = (line.split() for line in text[max(last, 0) :].splitlines())
    return {
        int(row[0]): [float(value) for value in row[1:]]
        for row in rows
        if len(row) == 4 and row[0].isdigit()
    }
