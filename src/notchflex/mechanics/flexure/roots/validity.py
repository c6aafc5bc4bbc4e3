"""Where the law of a strip with its roots was checked, and how far a notch lies outside."""

from __future__ import annotations

from notchflex.robot import StripNotch, Tube, ULink

_UNCHECKED = ": the stiffness of the strip was not checked"
_THIN = ": bending was found up to 5 % off, shear across the strip up to 18 %"


def strip_validity(notch: StripNotch | ULink, tube: Tube) -> list[str]:
    """List how a strip with elastic ends leaves the ranges checked against finite elements.

    Args:
        notch: The notch; one with rigid ends is a model of a paper, of which nothing is said.
        tube: The tube that it is cut into.

    Returns:
        A sentence for each range that is left, with the number, the range and the error found
        beyond it; empty inside.

    Example:
        >>> tube = Tube(10.0, 6.0)
        >>> strip = StripNotch(3.5, 1.5, 6.9, ends="elastic", uncut_length=5.0)
        >>> strip_validity(strip, tube)
        []
        >>> for sentence in strip_validity(strip, Tube(10.0, 7.8)):
        ...     print(sentence.split(":")[0])
        inner / outer diameter is 0.78, above 0.77
        strip thickness / wall is 1.36, above 1
    """
    found: list[str] = []
    if not notch.has_elastic_ends:
        return found

    def check(what: str, value: float, low: float, high: float, why: str = _UNCHECKED) -> None:
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            side, bound = ("below", low) if value < low else ("above", high)
            found.append(f"{what} is {value:.3g}, {side} {bound:g}{why}")

    thickness, wall = notch.strip_thickness, tube.outer_radius - tube.inner_radius
    check("inner / outer diameter", tube.inner_radius / tube.outer_radius, 0.4, 0.77, _THIN)
    check("strip thickness / wall", thickness / wall, 0.35, 1.0)
    if isinstance(notch, StripNotch):
        overlap = 2.0 * notch.depth - tube.outer_diameter
        check("overlap of the cuts / strip thickness", overlap / thickness, 1.6, 5.4)
        check("overlap of the cuts / outer diameter", overlap / tube.outer_diameter, 0.24, 0.54)
        check("height / outer diameter", notch.height / tube.outer_diameter, 0.2, 0.5)
        check(
            "uncut length / height",
            notch.uncut_length / notch.height,
            0.7,
            float("inf"),
            ": the body between two pairs is a slanting bar, which bends too; pairs that adjoin "
            "were found 2.1 times as flexible",
        )
    else:
        check("strip length / strip thickness", notch.strip_length / thickness, 1.7, 5.8)
        check("strip length / outer diameter", notch.strip_length / tube.outer_diameter, 0.2, 0.5)
        check("slot radius / strip thickness", notch.slot_radius / thickness, 0.2, 0.8)
    return found
