"""Read what CalculiX printed: the motion of the rings between the notches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.export.finite_elements.deck import ring_layers
from notchflex.export.finite_elements.half_tube import HalfTube


class RingMotion(NamedTuple):
    """Rigid motions of the middle of the uncut lengths, base first (n + 1 rings).

    Attributes:
        angle: Turn of each in the plane, toward the notches, rad.
        position: Where its centre has moved to, mm, (n + 1, 3).
    """

    angle: Float[np.ndarray, " rings"]
    position: Float[np.ndarray, "rings 3"]

    @property
    def notch_angle(self) -> Float[np.ndarray, " n"]:
        """Turn between neighbouring rings, rad."""
        return np.diff(self.angle)


def read_rings(mesh: HalfTube, text: str) -> RingMotion:
    """Return the motions of the rings from the last step of a .dat file of CalculiX.

    Args:
        mesh: The mesh of the deck.
        text: The .dat file.

    Raises:
        InputError: The file has no displacements of the rings.
    """
    moved = _displacements(text)
    angle, position = [], []
    for index in ring_layers(mesh):
        numbers = mesh.layer(index)
        missing = [number for number in numbers.tolist() if number not in moved]
        if missing:
            raise InputError.NO_DATA(
                f"the .dat file has no displacement of node {missing[0]}: the run did not finish, "
                "or belongs to another deck"
            )
        start = mesh.place[numbers - 1]
        end = start + np.array([moved[number] for number in numbers.tolist()])
        middle = np.array([0.0, 0.0, mesh.heights[index]])
        # The other half mirrors this one: a turn in the plane x-z, and no motion across.
        a, b = (start - middle)[:, [0, 2]], (end - end.mean(axis=0))[:, [0, 2]]
        a = a - a.mean(axis=0)
        sine = float(np.sum(a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]))
        turn = np.arctan2(sine, float(np.sum(a * b)))
        angle.append(turn)
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        centre = end.mean(axis=0)[[0, 2]] - rotation @ (start - middle).mean(axis=0)[[0, 2]]
        position.append([centre[0], 0.0, centre[1]])
    return RingMotion(np.array(angle), np.array(position))


def _displacements(text: str) -> dict[int, list[float]]:
    """Displacements of the last block of a .dat file, by the number of the node."""
    last = text.rfind("displacements")
    rows = (line.split() for line in text[max(last, 0) :].splitlines())
    return {
        int(row[0]): [float(value) for value in row[1:]]
        for row in rows
        if len(row) == 4 and row[0].isdigit()
    }
