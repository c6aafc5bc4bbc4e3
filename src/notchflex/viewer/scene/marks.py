"""Colours of strains and contacts; tendons, and marks outside the tube that hides them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import Equilibrium, EquilibriumPath, RobotShape
from notchflex.plotting import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    lips,
    tendon_line,
)

Colour = tuple[int, int, int]


def rgb(code: str) -> Colour:
    """Return a colour code such as `#0072B2` as three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(code[1:])
    return red, green, blue


METAL: Colour = (176, 182, 190)
TENDON = rgb(ORANGE)
CLOSED = rgb(BLACK)
BEYOND: Colour = (214, 0, 147)
"""Colour of a strain above the allowed one, outside the scale."""
LOAD = {"force": PURPLE, "moment": SKY}
CONTACT = {0: GREEN, 1: BLUE, -1: VERMILLION}
"""Colour of a friction contact by its state: sticking, slipping toward the base or the tip."""
UNKNOWN = GREY
SLACK = 1e-9
"""A tendon with less tension [N] at the base is slack."""
SMOOTH = 1e-9
"""A contact with a smaller bound of its log tension ratio has no friction."""

# From zero strain to the allowed one, also for eyes that do not distinguish red and green.
_SCALE = np.array([(60, 80, 160), (80, 160, 190), (240, 215, 90), (230, 130, 40), (190, 20, 20)])
STEPS = 64
"""Number of colours of strain; a notch is updated only if its colour changes."""


def is_beyond(part: float) -> bool:
    """Return whether a strain, as a fraction of the allowed one, exceeds it."""
    return abs(part) > 1.0


def strain_colour(part: float | None) -> Colour:
    """Return the colour of a strain by its fraction of the allowed one; None if none is set."""
    if part is None or not np.isfinite(part):
        return METAL
    if is_beyond(part):
        return BEYOND
    position = round(min(abs(part), 1.0) * STEPS) / STEPS * (len(_SCALE) - 1)
    red, green, blue = (np.interp(position, np.arange(len(_SCALE)), part) for part in _SCALE.T)
    return round(float(red)), round(float(green)), round(float(blue))


def contact_colours(state: Equilibrium, tendon: int) -> list[str]:
    """Return the colours of the contacts of a tendon (from 0), base to tip.

    A contact without friction, or of a slack tendon, neither sticks nor slips.
    """
    codes = np.asarray(state.contact_state, float)[tendon]
    bound = np.asarray(state.contact_bound, float)[tendon]
    slack = float(state.tension[tendon]) < SLACK
    return [
        UNKNOWN if slack or not holds > SMOOTH else CONTACT[int(one)]
        for one, holds in zip(codes, bound, strict=True)
        if np.isfinite(one) and np.isfinite(holds)
    ]


def linear(codes: Sequence[str]) -> NDArray[np.uint8]:
    """Return colour codes as linear light from 0 to 255, (count, 3).

    viser takes the colours of batched meshes and arrows as linear light, and all others as sRGB.

    Example:
        >>> linear(["#0072B2", "#FFFFFF"]).tolist()
        [[0, 43, 114], [255, 255, 255]]
    """
    part = np.array([rgb(code) for code in codes], float).reshape(-1, 3) / 255.0
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * light).astype(np.uint8)


def css(colour: Colour) -> str:
    """Return a colour in CSS."""
    return "#" + "".join(f"{part:02x}" for part in colour)


# In outer radii of the tube: thickness of tendons, radius of marks, distance of their centres from
# the tube axis.
_TENDON, _CONTACT, _LIPS = 0.09, 0.13, 0.2
_CONTACT_AT, _LIPS_AT = 1.2, 1.55


@dataclass
class Shown:
    """What is visible in the scene."""

    tendons: bool = True
    contacts: bool = True
    frames: bool = True
    loads: bool = True
    see_through: bool = False
    handle: bool = False
    cloud: bool = False
    sensed: bool = False


class Marks:
    """Tendons and marks of a robot at rest as children of a node of a viser scene."""

    def __init__(self, scene: Any, root: str, rest: RobotShape) -> None:
        import trimesh

        self._outer = outer = rest.robot.tube.outer_radius
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_CONTACT * outer)
        self._tendons: list[Any] = []
        self._contacts: list[Any] = []
        for tendon in range(rest.robot.number_of_tendons):
            name, line = f"{root}/tendon_{tendon + 1}", _segments(rest, tendon)
            thick = _TENDON * outer
            self._tendons.append(scene.add_line_segments(name, line, TENDON, thickness=thick))
            points = self._ball_positions(rest, tendon)
            self._contacts.append(
                scene.add_batched_meshes_simple(
                    f"{root}/contacts_{tendon + 1}",
                    ball.vertices,
                    ball.faces,
                    batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1)),
                    batched_positions=points,
                    batched_colors=linear([UNKNOWN] * len(points)),
                    lod="off",
                )
            )
        self._closed = [
            scene.add_icosphere(f"{root}/closed_{number + 1}", _LIPS * outer, color=CLOSED)
            for number in range(len(rest.flexures))
        ]

    def _ball_positions(self, shape: RobotShape, tendon: int) -> NDArray[np.float32]:
        return shape.contacts(tendon, _CONTACT_AT * self._outer).astype(np.float32)

    def move(self, path: EquilibriumPath, shape: RobotShape, shown: Shown) -> None:
        """Move them to the state of a path of one step, with its shape."""
        for tendon, (line, balls) in enumerate(zip(self._tendons, self._contacts, strict=True)):
            line.visible, balls.visible = shown.tendons, shown.contacts
            if shown.tendons:
                line.points = _segments(shape, tendon)
            if shown.contacts:
                balls.batched_positions = self._ball_positions(shape, tendon)
                balls.batched_colors = linear(contact_colours(path[0], tendon))
        for notch, (ball, closed) in enumerate(zip(self._closed, path.closed[0], strict=True)):
            ball.visible = bool(closed)
            if closed:
                ball.position = lips(shape, notch, _LIPS_AT * self._outer)


def _segments(shape: RobotShape, tendon: int) -> NDArray[np.float32]:
    """Return the straight pieces of a tendon (from 0), (pieces, 2, 3)."""
    points = tendon_line(shape, tendon).astype(np.float32)
    return np.stack([points[:-1], points[1:]], axis=1)
