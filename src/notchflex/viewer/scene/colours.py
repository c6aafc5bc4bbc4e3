"""Colours of the viewer: strain of a notch, state of a contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION
from notchflex.results import Equilibrium

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
    place = round(min(abs(part), 1.0) * STEPS) / STEPS * (len(_SCALE) - 1)
    red, green, blue = (np.interp(place, np.arange(len(_SCALE)), part) for part in _SCALE.T)
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
