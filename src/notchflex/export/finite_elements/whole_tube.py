"""A mesh of a whole notched tube, whose notches may open to any side.

Its lines run along the tube, evenly round it but for what the notches ask for: a line runs along
both edges of the spine of a notch, and one at every tendon. Between two notches the lines go over
from their places at one to those at the next.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.export.finite_elements.layers import check_shape, edge_angle, layers_of
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.finite_elements.tube_mesh import GridOpening, TubeMesh, numbered
from notchflex.robot import ArcNotch, Robot

# Elements round the tube for those that half a tube has in its plane.
_ROUND = 1.4
# The narrowest and widest element round the tube, in parts of an even one.
_NARROW, _WIDE = 0.25, 3.0


def whole_tube(robot: Robot, options: DeckOptions, tendons: Sequence[int]) -> TubeMesh:
    """Mesh the whole of a robot; x points to direction 0.

    Args:
        robot: The robot.
        options: The mesh.
        tendons: The tendons that are pulled, from 0.

    Raises:
        InputError: The robot has another shape than the mesh can have.
    """
    notches = check_shape(robot)
    for number, notch in enumerate(notches[:-1], start=1):
        if notch.uncut_length <= 0.0:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} has no uncut_length behind it, in which the lines "
                "of the mesh could go over to the next notch: give it one above 0 mm"
            )
    height, edges_at, faces = layers_of(robot, notches, options)
    radius = np.linspace(robot.tube.inner_radius, robot.tube.outer_radius, 2 * options.wall + 1)
    around = 4 * int(np.ceil(_ROUND * (options.spine + options.opening) / 2.0))
    sides = [np.radians(robot.tendon[number].direction_deg) for number in tendons]
    openings: list[GridOpening] = []
    shifts: list[np.ndarray] = []
    for number, (notch, (low, high)) in enumerate(zip(notches, faces, strict=True), start=1):
        edge = np.asarray(edge_angle(notch, robot, radius))
        first, last = _edges(notch, float(edge[-1]), around, options)
        knots = _knots(notch, edge, (first, last), sides, around)
        shifts.append(_lines(knots, around, f"notch {number} of {robot.name}"))
        openings.append(GridOpening(2 * last, around - (last - first), low, high))
    every = np.repeat(np.stack(shifts), 2, axis=0)  # (2 n, radii, half elements)
    flat = every.reshape(len(every), -1)
    shift = np.stack([np.interp(height, edges_at, one) for one in flat.T])
    angle = shift.reshape(*every.shape[1:], len(height))
    angle = angle + (np.arange(2 * around) * np.pi / around)[:, None]
    position = np.stack(
        [
            radius[:, None, None] * np.cos(angle),
            radius[:, None, None] * np.sin(angle),
            np.broadcast_to(height, angle.shape),
        ],
        axis=-1,
    )
    return numbered(position, height, openings, is_half=False, x_deg=0.0)


def _edges(notch: ArcNotch, edge: float, around: int, options: DeckOptions) -> tuple[int, int]:
    """Return the lines at the edges of the spine of a notch, by their number."""
    middle = round(around * (notch.direction_deg + 180.0) / 360.0)
    even = around * edge / (2.0 * np.pi)
    # Somewhat finer than even where the spine is narrow.
    half = round(0.5 * (even + max(even, options.spine)))
    half = min(max(half, 2), around // 2 - 2)
    return middle - half, middle + half


def _knots(
    notch: ArcNotch,
    edge: Float[np.ndarray, " radii"],
    lines: tuple[int, int],
    sides: Sequence[float],
    around: int,
) -> dict[int, Float[np.ndarray, " radii"]]:
    """Return by how much lines lie beside their even places at a notch, rad."""
    spine = np.radians(notch.direction_deg) + np.pi
    per = 2.0 * np.pi / around
    first, last = lines
    knots = {first % around: spine - edge - first * per, last % around: spine + edge - last * per}
    for side in sides:
        away = (side - spine + np.pi) % (2.0 * np.pi) - np.pi  # from the middle of the spine
        inside = abs(away) < edge[0]
        number = round((spine + away) / per)
        if inside:
            number = min(max(number, first + 1), last - 1)
        else:
            number = last + 1 + (number - last - 1) % around
            number = min(number, first + around - 1)
            away %= 2.0 * np.pi
        knots[number % around] = np.full(len(edge), spine + away - number * per)
    return {one: (by + np.pi) % (2.0 * np.pi) - np.pi for one, by in knots.items()}


def _lines(
    knots: dict[int, Float[np.ndarray, " radii"]], around: int, name: str
) -> Float[np.ndarray, "radii half"]:
    """Return by how much all lines lie beside their even places, between those that must.

    Raises:
        InputError: Two lines come too near to each other.
    """
    at = sorted(knots)
    half = np.arange(2 * around) / 2.0
    by = np.stack([knots[one] for one in at], axis=1)
    shift = np.stack([np.interp(half, at, one, period=around) for one in by])
    width = 1.0 + np.diff(shift, axis=1, append=shift[:, :1]) * around / np.pi
    if width.min() < _NARROW or width.max() > _WIDE:
        raise InputError.UNSUPPORTED(
            f"{name}: a tendon lies so near to an edge of the notch that the mesh has no line for "
            "each of them; take a finer mesh, or place the tendon elsewhere"
        )
    return shift
