"""The rings beside every notch, as notches with elastic ends need them."""

from __future__ import annotations

from notchflex._arrays import plain_number
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.mechanics.ends import Side
from notchflex.mechanics.flexure import Site, validity_warnings
from notchflex.robot import Notch, Robot

_SAME_DIRECTION = 1e-6
"""Notches open to one side if their directions differ by less, deg: rounding of sums of angles."""


def sites_of(robot: Robot) -> tuple[Site | None, ...]:
    """Return the rings beside every notch; None for notches that do not depend on them.

    A rigid plate holds the base at its length before the first notch. The ring after the last notch
    is free. Where neighbours differ, each models the ring between them as if both were of its own
    kind and opened to its own side.

    Args:
        robot: The robot, n notches.

    Returns:
        n sites, base to tip.
    """
    notches = robot.notches
    if not any(notch.has_elastic_ends for notch in notches):
        return (None,) * len(notches)
    lengths = [plain_number(length) for length in body_lengths(robot.tube, notches)]
    last = len(notches) - 1
    ratio = robot.material.poisson_ratio

    sites: dict[tuple[int | None, ...], Site] = {}  # shared where all around is of the same parts

    def site(index: int) -> Site:
        before, after = lengths[index], lengths[index + 1]
        neighbours = notches[max(index - 1, 0)], notches[min(index + 1, last)]
        turned = [_is_turned(notches[index], one) for one in neighbours]
        proximal = Side("clamped" if index == 0 else "between", before, turned[0])
        distal = Side("free" if index == last else "between", after, turned[1])
        parts = (neighbours[0], notches[index], neighbours[1])
        key = (*map(id, parts), index == 0, index == last)
        return sites.setdefault(key, Site(proximal, distal, ratio))

    return tuple(
        site(index) if notch.has_elastic_ends else None for index, notch in enumerate(notches)
    )


def _is_turned(notch: Notch, other: Notch) -> bool:
    apart = (notch.direction_deg - other.direction_deg + 180.0) % 360.0 - 180.0
    return abs(apart) > _SAME_DIRECTION


def unchecked_dimensions(robot: Robot) -> list[str]:
    """Say where dimensions of notches with elastic ends leave the range that was checked.

    Args:
        robot: The robot.

    Returns:
        One sentence with each dimension, the notches that it belongs to, and what to do; none where
        all lie inside, or the ends are rigid.
    """
    notches_of: dict[str, list[str]] = {}
    sites = sites_of(robot)
    for number, (notch, site) in enumerate(zip(robot.notches, sites, strict=True), 1):
        if site is not None:
            for found in validity_warnings(notch, robot.tube, site):
                notches_of.setdefault(found, []).append(str(number))
    if not notches_of:
        return []
    every = [f"{found} ({_numbered(numbers, len(sites))})" for found, numbers in notches_of.items()]
    return [
        f"finite elements did not check all dimensions of this robot: {'; '.join(every)}. Widen "
        "the band by a tolerance of `notch.stiffness_factor`, or check a notch by `export`."
    ]


def _numbered(numbers: list[str], count: int) -> str:
    if len(numbers) == count > 1:
        return "all notches"
    return f"notch{'es' if len(numbers) > 1 else ''} {', '.join(numbers)}"
