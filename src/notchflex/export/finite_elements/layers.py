"""Which notches a structured mesh can have, and the layers of such a mesh along the tube."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.robot import ArcNotch, Robot

_REMEDY = "export the solid with --step and mesh it by gmsh, with second-order tetrahedra"


def check_shape(robot: Robot) -> list[ArcNotch]:
    """Return the notches of a robot that the mesh can be made of.

    Raises:
        InputError: A notch is not an arc, or has a precurvature, or its cut leaves a solid strip.
    """
    notches: list[ArcNotch] = []
    for number, notch in enumerate(robot.notches, start=1):
        if not isinstance(notch, ArcNotch):
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} is of kind {notch.kind!r}: a deck of finite "
                f'elements is made of notches of kind "arc" only; {_REMEDY}'
            )
        if abs(notch.precurvature_deg) > 0.0:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} has a precurvature, and the mesh is straight: "
                "set notch.precurvature_deg=0"
            )
        tube = robot.tube
        if notch.cut == "off-axis" and notch.depth - tube.outer_radius >= tube.inner_radius:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} leaves a solid strip, without bore: the mesh "
                f"needs a depth of less than {tube.outer_radius + tube.inner_radius:g} mm"
            )
        notches.append(notch)
    return notches


def edge_angle(notch: ArcNotch, robot: Robot, radius: Float[np.ndarray, " a"]) -> Any:
    """Return half the angle of the wall that a notch leaves, at some radii, rad."""
    tube = robot.tube
    if notch.cut == "off-axis":
        return np.arccos((notch.depth - tube.outer_radius) / radius)
    read_at = {
        "outer": tube.outer_radius,
        "mid-wall": 0.5 * (tube.outer_radius + tube.inner_radius),
        "inner": tube.inner_radius,
    }[notch.depth_at]
    return np.full(len(radius), np.arccos((notch.depth - tube.outer_radius) / read_at))


def layers_of(
    robot: Robot, notches: list[ArcNotch], options: DeckOptions
) -> tuple[Float[np.ndarray, " c"], list[float], list[tuple[int, int]]]:
    """Return heights of all layers and of the notch edges, with the indices of these layers."""
    height: list[np.ndarray] = [np.zeros(1)]
    edges: list[float] = []
    faces: list[tuple[int, int]] = []
    base, top = robot.tube.base_length, 0.0
    if base > 0.0:
        height.append(base * _both_ends(2 * options.uncut)[1:])
        top = base
    for notch in notches:
        start = sum(map(len, height)) - 1
        height.append(top + notch.height * np.linspace(0.0, 1.0, 2 * options.notch + 1)[1:])
        faces.append((start, start + 2 * options.notch))
        edges += [top, top + notch.height]
        top += notch.height
        if notch.uncut_length > 0.0:
            height.append(top + notch.uncut_length * _both_ends(2 * options.uncut)[1:])
            top += notch.uncut_length
    return np.concatenate(height), edges, faces


def _both_ends(count: int) -> Float[np.ndarray, " k"]:
    """Places from 0 to 1, closer at both ends; middle nodes half way between corners."""
    even = np.linspace(0.0, 1.0, count // 2 + 1)
    corner = even - 0.09 * np.sin(2.0 * np.pi * even)
    return np.interp(np.arange(count + 1), np.arange(0, count + 1, 2), corner)
