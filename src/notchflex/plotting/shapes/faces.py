"""Quadrilaterals of a bent robot in space: the walls of its bodies and its flexures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.robot_shape import FlexureShape, RobotShape
from notchflex.plotting.style import rgb

ROUND = 32  # flat pieces round the tube
LIGHT = np.array([0.35, -0.75, 0.55]) / np.linalg.norm([0.35, -0.75, 0.55])

Quads = NDArray[np.float64]


def body_faces(shape: RobotShape) -> Iterator[Quads]:
    """Yield the outer wall of every body, (pieces, 4, 3)."""
    outer = shape.robot.tube.outer_radius
    edges = 2.0 * np.pi * np.arange(ROUND + 1) / ROUND
    rim = outer * np.stack([np.cos(edges), np.sin(edges)], axis=1)
    sides = [shape.walls(float(np.degrees(angle))) for angle in edges[:-1] + np.pi / ROUND]
    for body in range(len(shape.position)):
        corners = [
            np.column_stack([rim[[i, i + 1, i + 1, i]], np.repeat(wall, 2)])
            for i in range(ROUND)
            if (wall := sides[i][body]) is not None and wall[1] > wall[0]
        ]
        if corners:
            yield shape.on_body(body, corners)


def flexure_faces(shape: RobotShape) -> Iterator[Quads]:
    """Yield every flexure: the wall at its spine, or a band with its thickness and area."""
    outer = shape.robot.tube.outer_radius
    closes = np.asarray(shape.chain.rods.has_closure) > 0.0
    for one, spine in zip(shape.flexures, closes, strict=True):
        lines = _spine(one, outer) if spine else _band(one)
        along = np.stack([one.fibre(across, out) for across, out in lines], axis=1)
        corners = [along[:-1, :-1], along[:-1, 1:], along[1:, 1:], along[1:, :-1]]
        yield np.stack(corners, axis=2).reshape(-1, 4, 3)


def shaded(faces: Quads, colour: Any) -> list[Any]:
    """Return the colours of the faces by their angle to the light."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    size = np.linalg.norm(normal, axis=1)
    facing = np.abs(normal @ LIGHT) / np.where(size > 0.0, size, 1.0)
    base = np.array(rgb(colour))
    base, pale = 0.8 * base, 1.0 - 0.45 * (1.0 - base)
    return [tuple(base + part * (pale - base)) for part in facing]


def _spine(one: FlexureShape, outer: float) -> list[tuple[Any, Any]]:
    axis = outer - one.spine  # from the neutral axis to the axis of the tube
    half = float(np.arccos(np.clip((axis[0] - one.near[0]) / outer, -1.0, 1.0)))
    angles = np.pi + np.linspace(-half, half, 9)
    return [(axis + outer * np.cos(angle), outer * np.sin(angle)) for angle in angles]


def _band(one: FlexureShape) -> list[tuple[Any, Any]]:
    half = 0.5 * one.area / (one.spine + one.near)
    corners = [(-one.spine, -half), (-one.spine, half), (one.near, half), (one.near, -half)]
    return [*corners, corners[0]]
