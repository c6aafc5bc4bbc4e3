"""Checked ranges of the law of a notch with its ends, and where a notch lies outside."""

from __future__ import annotations

from notchflex.mechanics.ends.side import Side

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
        depth / outer diameter is 0.741, below 0.75: the softening with the angle was not checked
        distal ring length / mm is 3, above 2.4: the end compliance was not checked
    """
    radius = 0.5 * (outer_radius + inner_radius)
    wall = (outer_radius - inner_radius) / radius
    depth_ratio = depth / (2.0 * outer_radius)
    between = proximal.boundary == distal.boundary == "between"
    sentences: list[str] = []

    def check(what: str, value: float, low: float, high: float, why: str) -> None:
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            side, bound = ("below", low) if value < low else ("above", high)
            sentences.append(f"{what} is {value:.3g}, {side} {bound:g}{why}")

    untested = ": the end compliance was not checked"
    if cut == "off-axis" and depth >= outer_radius + inner_radius:
        sentences.append(
            f"depth is {depth:.4g} mm, beyond the far side of the bore at "
            f"{outer_radius + inner_radius:.4g} mm, where a solid strip is left: end compliance "
            "found wrong by up to 23 %"
        )
    check("wall / mean radius", wall, 0.0769, 0.47, untested)
    if 0.0769 <= wall < 0.14:
        check("wall / mean radius", wall, 0.14, 0.47, ": the moment was found up to 13 % off")
    check("height / mean radius", height / radius, 0.39, 5.3, untested)
    not_checked = ": the softening with the angle was not checked"
    check("depth / outer diameter", depth_ratio, 0.75, 1.0, not_checked)
    check("depth / outer diameter", depth_ratio, 0.60, 0.90, untested)
    if between:
        stiff = ", between notches: found up to 8 % too stiff"
        check("depth / outer diameter", depth_ratio, 0.68, 1.0, stiff)
    for name, side in (("proximal", proximal), ("distal", distal)):
        check(f"{name} ring length / mm", float(side.length), 0.6, 2.4, untested)
    turned = {side.length for side in (proximal, distal) if side.turned}
    return sentences + [
        f"a neighbour opens to another side of the tube, and the ring between them is {length:.3g} "
        f"mm long, below {_LONG_RING:g} outer diameters: both were found too stiff, 1.4 times with "
        "0.6 outer diameters and up to 2 times with 0.4"
        for length in sorted(turned)
        if length < _LONG_RING * 2.0 * outer_radius
    ]
