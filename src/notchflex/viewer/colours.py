"""Colours of strains, contacts, tendons and loads, and what they mean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb
from numpy.typing import NDArray

from notchflex import Equilibrium, Robot
from notchflex.plotting import (
    BLACK,
    BLUE,
    COLOUR,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Curve,
    dots,
)
from notchflex.support import CONTACT_STATES

METAL, BEYOND = "#b0b6be", "#d60093"
"""Colours of a notch whose material has no allowed strain, and of a strain above it."""
TENDON, CLOSED, UNKNOWN = ORANGE, BLACK, GREY
LOAD = {"force": PURPLE, "moment": SKY}
CONTACT = {0: GREEN, 1: BLUE, -1: VERMILLION}
"""Colour of a friction contact by its state: sticking, slipping toward the base or the tip."""
SMALL = 1e-9
"""Tension of a slack tendon [N], and log tension ratio of a contact without friction, at most."""

_STEPS = 64  # a notch is updated only if its colour changes
# From zero strain to the allowed one, also for eyes that do not distinguish red and green.
STRAIN = LinearSegmentedColormap.from_list(
    "strain", ["#3c50a0", "#50a0be", "#f0d75a", "#e68228", "#be1414"], _STEPS + 1
)


def rgb(code: str) -> tuple[int, int, int]:
    """Return a colour code such as `#0072B2` as three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(code[1:])
    return red, green, blue


def linear(codes: Iterable[str]) -> NDArray[np.uint8]:
    """Return colour codes as linear light from 0 to 255, (count, 3).

    viser takes the colours of batched meshes and arrows as linear light, and all others as sRGB.

    Example:
        >>> linear(["#0072B2", "#FFFFFF"]).tolist()
        [[0, 43, 114], [255, 255, 255]]
    """
    part = np.array([to_rgb(code) for code in codes]).reshape(-1, 3)
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * light).astype(np.uint8)


def add_arrows(scene: Any, name: str, colour: str, radius: float) -> Any:
    """Add arrows to a scene of viser, as thick as suits a tube of an outer radius [mm]."""
    return scene.add_arrows(
        name, np.zeros((1, 2, 3)), linear([colour]), shaft_radius=0.13 * radius,
        head_radius=0.32 * radius, head_length=0.8 * radius,
    )  # fmt: skip


def strain_colour(strain: float, allowed: float | None) -> str:
    """Return the colour of a strain; `allowed` is the allowed one, if any is set."""
    if allowed is None or not np.isfinite(strain):
        return METAL
    part = abs(strain) / allowed
    return BEYOND if part > 1.0 else to_hex(STRAIN(round(part * _STEPS)))


def contact_colours(state: Equilibrium, tendon: int) -> list[str]:
    """Return the colours of the contacts of a tendon (from 0), base to tip.

    A contact without friction, or of a slack tendon, neither sticks nor slips.
    """
    slack = float(state.tension[tendon]) < SMALL
    pairs = np.stack([state.contact_state[tendon], state.contact_bound[tendon]], axis=1)
    return [
        CONTACT[int(code)] if bound > SMALL and not slack else UNKNOWN
        for code, bound in pairs[np.isfinite(pairs).all(axis=1)]
    ]


def legend(robot: Robot) -> list[Curve]:
    """Return the meaning of each colour, except the scale of the strain, as marks without points.

    What has a marker is a ball in the scene.
    """
    allowed = robot.material.allowed_strain
    if allowed is None:
        strain = METAL, "notch: the robot file sets no allowed strain"
    else:
        strain = BEYOND, f"notch strained beyond {100.0 * allowed:g} %"
    balls = [strain, (CLOSED, "closed notch")]
    balls += [(CONTACT[code], f"contact: {CONTACT_STATES[code]}") for code in CONTACT]
    balls.append((UNKNOWN, "contact without friction, or slack"))
    lines: list[tuple[Any, str]] = [(TENDON, "tendon")]
    lines += [(colour, f"loop: {way}") for way, colour in COLOUR.items()]
    lines += [(colour, f"{name} at the tip") for name, colour in LOAD.items()]
    return [
        *(dots([], colour, name=text) for colour, text in balls),
        *(Curve([], colour, name=text) for colour, text in lines),
    ]
