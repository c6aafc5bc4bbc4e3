r"""The strip between two slots with the walls that it turns into, from the drawing.

A strip does not end at the tips of its slots: there it passes into the wall of a rigid piece, which
deforms. Its rod continues slightly beyond the tip, turns at a right angle and runs along the wall.
This models the root rotation of a strip on an elastic body, proportional to $M / (E b t^2)$, at the
position found by finite elements. The two walls of the strip are curved bars:

* at the angle φ from its middle a wall is twisted by $M\sin\varphi$ where it is bent by
  $M\cos\varphi$, which makes the strip more flexible by $\tan^2\varphi\,E I/(G J)$ of the wall, and
  the root by $c\tan^2\varphi\,t/t_w$;
* pulled across the tube, a wall straightens like an arch, clamped $\kappa\sqrt{t t_w}$
  beyond the tips;
* pushed sideways, both walls bend like the posts of a frame, clamped likewise; moments out of the
  plane move the walls against each other (`sideways.py`).

The shear areas of strip and root are 5/6 of the whole. The constants were fitted, all at once, to
the cells of finite elements in `tests/reference/fem_strip_cells.csv` and `fem_u_link_cells.csv`
(`benchmarks/fe`); `validity_warnings` of a notch lists dimensions outside their range.
"""

from __future__ import annotations

from typing import NamedTuple

from notchflex.mechanics.flexure.roots.sideways import (
    ROUND,
    SHARP,
    Sideways,
)
from notchflex.robot import StripNotch, Tube, ULink

# Length of a strip beyond the tip of the slot, over its size (`_size`).
_BEYOND = 0.267
# The same for the run along the wall, at sharp and at round tips; and over the slot's radius.
_ALONG_SHARP, _ALONG_ROUND, _ALONG_RADIUS = 1.208, 1.016, 0.544
# Length of a strip round the end of a slot on each side, over the radius of the slot.
_ROUND_END = 0.662
# Second moment of a root over that of the strip at the tip, sharp or round.
_BENDING_SHARP, _BENDING_ROUND = 2.098, 2.695
# Power of the strip's over the wall's thickness by which the lengths of the root grow.
_POWER = 0.152
# Shear of a body below a triangular notch: length over the notch's height, of the whole tube.
_WEDGE = 4.893


class RootedStrip(NamedTuple):
    """A strip between two slots of a tube.

    Attributes:
        thickness: Thickness t along the tube, mm.
        free_length: Length between the tips of the slots, mm.
        beyond: Length beyond the tips, mm.
        along: Length along the wall, mm.
        bending: Second moment of the root over that of the strip at the tip.
        sheared: Length of a tube that shears like the wall there, mm.
        middle: Height of its middle above the proximal face, mm.
        hand: 1 where the proximal wall is on the bend's side, -1 on the opposite one.
        sideways: Constants of the answer to loads out of the plane.
        width_factor: Width of the walls over that of the tube's walls there.
    """

    thickness: float
    free_length: float
    beyond: float
    along: float
    bending: float
    sheared: float
    middle: float
    hand: float
    sideways: Sideways
    width_factor: float = 1.0


def sharp_strip(notch: StripNotch, tube: Tube) -> RootedStrip:
    """Describe the strip between triangular notches."""
    factor = notch.wall_width_in(tube) / (tube.outer_diameter - tube.inner_diameter)
    size = _size(notch.strip_thickness, tube, factor)
    return RootedStrip(
        thickness=notch.strip_thickness,
        free_length=2.0 * notch.depth - tube.outer_diameter,
        beyond=_BEYOND * size,
        along=_ALONG_SHARP * size,
        bending=_BENDING_SHARP,
        sheared=_WEDGE * notch.height,
        middle=notch.height + notch.rise,
        hand=-1.0,
        sideways=SHARP,
        width_factor=factor,
    )


def round_strip(notch: ULink, tube: Tube) -> RootedStrip:
    """Describe the strip between slots with round ends."""
    size = _size(notch.strip_thickness, tube)
    return RootedStrip(
        thickness=notch.strip_thickness,
        free_length=notch.strip_length + 2.0 * _ROUND_END * notch.slot_radius,
        beyond=_BEYOND * size,
        along=_ALONG_ROUND * size + _ALONG_RADIUS * notch.slot_radius,
        bending=_BENDING_ROUND,
        sheared=0.0,
        middle=notch.height + 0.5 * notch.strip_thickness,
        hand=1.0 if notch.proximal_slot == "away" else -1.0,
        sideways=ROUND,
    )


def _size(thickness: float, tube: Tube, width_factor: float = 1.0) -> float:
    """Compute the thickness to which the lengths of a root are proportional, mm."""
    wall = width_factor * (tube.outer_radius - tube.inner_radius)
    return thickness * (thickness / wall) ** _POWER
