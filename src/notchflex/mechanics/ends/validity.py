"""Where the law of a notch with its ends was checked, and how far a notch lies outside."""

from __future__ import annotations

from notchflex.mechanics.ends.side import Side


def validity(
    outer_radius: float,
    inner_radius: float,
    cut: str,
    depth: float,
    height: float,
    proximal: Side,
    distal: Side,
) -> list[str]:
    """List how a notch leaves the ranges that were checked against finite elements.

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
        there; empty inside.
    """
    raise NotImplementedError
