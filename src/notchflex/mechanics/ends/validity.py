"""Checked ranges of the law of a notch with its ends, and where a notch lies outside."""

from __future__ import annotations

from typing import Any

import numpy as np

from notchflex.mechanics.ends.effective_notch import notch_stiffness
from notchflex.mechanics.ends.side import Side

_SHORT_RING = 0.37  # in outer diameters; shorter ones were not checked
_LEAST_EFFECT = 0.01  # of the stiffness; below, nothing is said
_LONG_RING = 1.5  # in outer diameters; with 1.9 the chain agrees with finite elements to 2 %


def validity(
    outer_radius: float,
    inner_radius: float,
    cut: str,
    depth: float,
    height: float,
    proximal: Side,
    distal: Side,
) -> list[str]:
    """List the checked ranges (against finite elements) that a notch leaves.

    Args:
        outer_radius: Outer radius of the tube, mm.
        inner_radius: Inner radius, mm.
        cut: "on-axis" or "off-axis".
        depth: Depth g of the cut, mm.
        height: Height h of the notch along the tube, mm.
        proximal: The ring toward the base.
        distal: The ring toward the tip.

    Returns:
        A sentence for each range that is left, with the number, the range and the error found
        beyond it; empty inside.

    Example:
        >>> ring = Side("between", 1.2)
        >>> validity(0.81, 0.70, "on-axis", 1.4, 0.8, ring, ring)
        []
        >>> for sentence in validity(0.81, 0.70, "on-axis", 1.2, 3.2, ring, Side("free", 3.0)):
        ...     print(sentence)
        depth / outer diameter is 0.741, below 0.75: moments near closing were found up to 3 % off
    """
    radius = 0.5 * (outer_radius + inner_radius)
    wall = (outer_radius - inner_radius) / radius
    diameter = 2.0 * outer_radius
    sentences: list[str] = []

    def check(what: str, value: float, low: float, high: float, why: str) -> bool:
        inside = low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9)
        if not inside:
            side, bound = ("below", low) if value < low else ("above", high)
            sentences.append(f"{what} is {value:.3g}, {side} {bound:g}: {why}")
        return inside

    untested = "the stiffness may be off by more than the 3 % found inside"
    if cut == "off-axis" and depth >= outer_radius + inner_radius:
        sentences.append(
            f"depth is {depth:.4g} mm, beyond the far side of the bore at "
            f"{outer_radius + inner_radius:.4g} mm, where a solid strip is left: the stiffness was "
            "found wrong by up to 23 %"
        )
    if check("wall / mean radius", wall, 0.0769, 0.47, untested):
        off = "moments near closing were found up to 13 % off"
        check("wall / mean radius", wall, 0.14, 0.47, off)
    # Of higher notches the rings are a small part.
    check("height / mean radius", height / radius, 0.39, np.inf, untested)
    what, ratio = "depth / outer diameter", depth / diameter
    between = proximal.boundary == distal.boundary == "between"
    if check(what, ratio, 0.60, 0.90, untested) and (
        not between or check(what, ratio, 0.68, 1.0, "between notches found up to 3 % off")
    ):
        check(what, ratio, 0.75, 1.0, "moments near closing were found up to 3 % off")
    shape = outer_radius, inner_radius, cut, depth, height, 0.33
    sentences += _short_rings(shape, (proximal, distal), diameter)
    turned = {side.length for side in (proximal, distal) if side.turned}
    return sentences + [
        f"a neighbour opens to another side of the tube, and the ring between them is {length:.3g} "
        f"mm long, below {_LONG_RING:g} outer diameters: both were found too stiff, 1.4 times with "
        "0.6 outer diameters and up to 2 times with 0.4"
        for length in sorted(turned)
        if length < _LONG_RING * 2.0 * outer_radius
    ]


def _short_rings(shape: tuple[Any, ...], sides: tuple[Side, Side], diameter: float) -> list[str]:
    """Tell of short rings by what they change against the shortest ones that were checked."""
    least = _SHORT_RING * diameter
    longer = [one._replace(length=max(one.length, least)) if one.length else one for one in sides]
    change = abs(notch_stiffness(*shape, *longer).weak / notch_stiffness(*shape, *sides).weak - 1.0)
    if change <= _LEAST_EFFECT:
        return []
    shortest = min(side.length for side in sides if side.length)
    return [
        f"ring / outer diameter is {shortest / diameter:.3g}, below {_SHORT_RING:g}: "
        f"{100.0 * change:.0f} % of the stiffness follow from longer rings"
    ]
