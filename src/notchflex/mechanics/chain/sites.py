"""The rings beside every notch, as notches with elastic ends need them."""

from __future__ import annotations

from notchflex.mechanics.chain.mass import body_lengths
from notchflex.mechanics.ends import Side
from notchflex.mechanics.flexure import Site, validity_warnings
from notchflex.robot import Notch, Robot

_SAME_DIRECTION = 1e-6
"""Notches open to one side if their directions differ by less, deg: rounding of sums of angles."""


def sites_of(robot: Robot) -> tuple[Site | None, ...]:
    """Find what surrounds every notch; None for notches that do not depend on it.

    The base is held by a rigid plate at its length before the first notch. The ring behind the last
    notch is free. Where neighbours differ, each takes the ring between them as if both were its own
    kind and opened to its own side.

    Args:
        robot: The robot, n notches.

    Returns:
        n sites, base to tip.
    """
    notches = robot.notches
    if not any(notch.has_elastic_ends for notch in notches):
        return (None,) * len(notches)
    lengths = [float(length) for length in body_lengths(robot.tube, notches)]
    last = len(notches) - 1
    ratio = robot.material.poisson_ratio

    def site(index: int) -> Site:
        before, behind = lengths[index], lengths[index + 1]
        neighbours = notches[max(index - 1, 0)], notches[min(index + 1, last)]
        turned = [_is_turned(notches[index], one) for one in neighbours]
        proximal = Side("clamped" if index == 0 else "between", before, turned[0])
        distal = Side("free" if index == last else "between", behind, turned[1])
        return Site(proximal, distal, ratio)

    return tuple(
        site(index) if notch.has_elastic_ends else None for index, notch in enumerate(notches)
    )


def _is_turned(notch: Notch, other: Notch) -> bool:
    apart = (notch.direction_deg - other.direction_deg + 180.0) % 360.0 - 180.0
    return abs(apart) > _SAME_DIRECTION


def unchecked_dimensions(robot: Robot) -> list[str]:
    """List where dimensions of notches with elastic ends leave the range that was checked.

    Args:
        robot: The robot.

    Returns:
        One sentence for each dimension, with the notches that it belongs to; none where all lie
        inside, or the ends are rigid.
    """
    found: dict[str, list[str]] = {}
    for number, (notch, site) in enumerate(zip(robot.notches, sites_of(robot), strict=True), 1):
        if site is not None:
            for sentence in validity_warnings(notch, robot.tube, site):
                found.setdefault(sentence, []).append(str(number))
    return [
        f"notch{'es' if len(notches) > 1 else ''} {', '.join(notches)}: {sentence}."
        for sentence, notches in found.items()
    ]
