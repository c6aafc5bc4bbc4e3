"""Random robots and random paths of loads: `draw(number, seed, shape)`.

Robots are drawn within what `nf.Robot` accepts, tubes of 0.5 to 10 mm, a tenth of the numbers from
a wider range than is usual. Loads are sized by the robot (drawn_loads.py).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from drawn_loads import Numbers, Size, drawn_loads
from drawn_materials import drawn_material, softened
from shapes import DRAWN, Rope, Shape

import notchflex as nf

CUTS = {"o": "on-axis", "s": "off-axis"}
SECTIONS = {"o": nf.annular_sector, "s": nf.annular_segment}
DIRECTIONS = {"one": (0.0,), "both": (0.0, 180.0), "four": (0.0, 90.0, 180.0, 270.0)}


class Draw(NamedTuple):
    """One robot and the loads that follow one another on it."""

    number: int
    shape: Shape
    robot: nf.Robot
    loads: tuple[nf.Load, ...]


def draw(number: int, seed: int, shape: Shape) -> Draw:
    """Draw one robot with loads.

    Raises:
        InputError: What was drawn is no robot: a fault of this file.
    """
    numbers = Numbers(np.random.default_rng([seed, number]))
    robot, sizes = _robot(numbers, shape, number)
    return Draw(number, shape, robot, drawn_loads(numbers, shape, robot, sizes))


def _robot(numbers: Numbers, shape: Shape, number: int) -> tuple[nf.Robot, list[Size]]:
    outer = numbers.log(0.5, 10.0)
    inner = outer * numbers.usual(0.5, 0.9, 0.2, 0.97)
    tube = nf.Tube(outer, inner, base_length=numbers.choice((0.0, numbers.uniform(0.0, 5.0))))
    material = _material(numbers, shape)
    modulus = material.elastic_modulus
    arcs = _arcs(numbers, shape, tube, modulus)
    strips = _strips(numbers, tube, modulus)
    links = _links(numbers, tube, modulus)
    finish = _as_drawn(numbers, shape, tube, material) if shape in DRAWN else None
    notches, sizes = [], []
    for i, kind in enumerate(shape.notches):
        made = {"p": strips, "u": links}.get(kind, arcs)
        notch, size = made(kind, shape.notches[:i].count("u"))
        if finish is not None:
            notch, size = finish(notch, size)
        notches.append(notch)
        sizes.append(size)
    least = 0.52 * max([one.strip_length for one in notches if isinstance(one, nf.ULink)] or [0.0])
    radius = max(numbers.usual(0.6, 1.0, 0.2, 1.0) * 0.5 * inner, min(least, 0.5 * outer))
    robot = nf.Robot(
        name=f"{shape.name} {number}",
        tube=tube,
        notch=tuple(notches),
        tendon=tuple(_tendon(numbers, rope, radius, notches, sizes) for rope in shape.tendons),
        material=material,
        friction=_friction(numbers, shape.friction),
    )
    return robot, [size._replace(lever=size.lever + radius) for size in sizes]


def _arcs(numbers: Numbers, shape: Shape, tube: nf.Tube, modulus: float):
    """Arc notches about alike, each with its own depth and side."""
    outer = tube.outer_diameter
    depth = numbers.usual(0.5, 0.9, 0.2, 0.96)
    closing, spread = numbers.usual(0.1, 0.6, 0.02, 1.2), numbers.uniform(0.0, 0.1)
    uncut = outer * numbers.usual(0.2, 1.5, 0.0, 3.0)
    precurved = numbers.uniform(-0.2, 0.5) if numbers.chance(0.15) else 0.0
    sides = DIRECTIONS.get(shape.directions)

    def make(kind: str, _: int) -> tuple[nf.ArcNotch, Size]:
        own = min(depth * (1.0 + spread * numbers.uniform(-1.0, 1.0)), 0.97)
        left = SECTIONS[kind](tube.outer_radius, tube.inner_radius, own * outer)
        lever = float(left.centroid)
        height = closing * (tube.outer_radius + lever)
        side = numbers.uniform(-180.0, 180.0) if sides is None else float(numbers.choice(sides))
        notch = nf.ArcNotch(
            CUTS[kind],
            depth=own * outer,
            height=height,
            uncut_length=uncut,
            direction_deg=side,
            precurvature_deg=precurved * np.degrees(closing),
        )
        # The softest way to turn the notch by that angle; loads in space twist an open section.
        torsion = 0.375 * float(left.torsion_constant) if shape.loads == "space" else np.inf
        softest = min(float(left.second_moment_weak), float(left.second_moment_strong), torsion)
        angle = closing * (1.0 - max(precurved, 0.0))
        return notch, Size(angle, modulus * softest * angle / height, lever)

    return make


def _strips(numbers: Numbers, tube: nf.Tube, modulus: float):
    """Pairs of triangular notches, all alike."""
    outer = tube.outer_diameter
    height = outer * numbers.usual(0.1, 0.4, 0.03, 0.6)
    strip = nf.StripNotch(
        height=height,
        strip_thickness=outer * numbers.usual(0.08, 0.2, 0.03, 0.35),
        depth=outer * numbers.uniform(0.55, 0.9),
        uncut_length=outer * float(numbers.choice((0.0, numbers.uniform(0.0, 1.0)))),
    )
    length = strip.strip_length_in(tube)
    second_moment = strip.wall_width_in(tube) * strip.strip_thickness**3 / 12.0
    angle = height / tube.outer_radius
    size = Size(angle, modulus * second_moment * angle / length, 0.0)
    return lambda _kind, _before: (strip, size)


def _links(numbers: Numbers, tube: nf.Tube, modulus: float):
    """U-links, all alike, the slots before them from the two sides in turn."""
    outer = tube.outer_diameter
    radius = outer * numbers.usual(0.03, 0.07, 0.015, 0.1)
    thickness = outer * numbers.usual(0.08, 0.2, 0.05, 0.25)
    # What is left for the straight part beside the round ends; tendons must pass beyond it.
    ends = nf.ULink(radius, thickness, outer, "away").span - outer
    length = min(outer * numbers.uniform(0.3, 0.55), 0.95 * (outer - ends))
    second_moment = (outer - tube.inner_diameter) * thickness**3 / 12.0
    angle = 2.0 * radius / tube.outer_radius
    moment = modulus * second_moment * angle / (length + 2.0 * radius)

    def make(_: str, before: int) -> tuple[nf.ULink, Size]:
        side = ("away", "toward")[before % 2]
        return nf.ULink(radius, thickness, length, side), Size(angle, moment, 0.0)

    return make


def _as_drawn(numbers: Numbers, shape: Shape, tube: nf.Tube, material: Any):
    """Notches as the tube makes them; arcs of half of the robots about as they were checked."""
    usual = numbers.chance(0.5)
    outer = tube.outer_diameter
    depth, uncut = outer * numbers.uniform(0.75, 0.9), outer * numbers.uniform(0.4, 1.5)
    precurved = numbers.uniform(0.0, 0.3) if numbers.chance(0.3) else 0.0
    read_at = str(numbers.choice(("outer", "outer", "mid-wall", "inner")))
    ends = {"elastic": "shell"}.get(shape.ends, shape.ends)

    def finish(notch: Any, size: Size) -> tuple[Any, Size]:
        if not isinstance(notch, nf.ArcNotch):
            length = getattr(notch, "strip_length", None) or 0.5 * outer
            strain = 0.5 * notch.strip_thickness * size.angle / length
            if isinstance(notch, nf.StripNotch):
                notch = dataclasses.replace(notch, uncut_length=notch.height if usual else 0.0)
            made = dataclasses.replace(notch, ends=shape.ends)
            return made, size._replace(moment=size.moment * softened(material, strain))
        given: dict[str, Any] = {"ends": ends, "closing": shape.closing}
        if usual:
            given |= {"depth": depth, "uncut_length": uncut}
            given["precurvature_deg"] = float(np.degrees(precurved * notch.height / outer))
        made = dataclasses.replace(notch, **given)
        # Read at another surface the edges of some cuts would not meet the tube.
        deep = abs(made.depth / outer - 0.5) < 0.45 * tube.inner_radius / tube.outer_radius
        if made.cut == "on-axis" and deep:
            made = dataclasses.replace(made, depth_at=read_at)
        shape_of = tube.outer_radius, tube.inner_radius, made.section_depth(tube)
        left = SECTIONS["o" if made.cut == "on-axis" else "s"](*shape_of)
        lever, height = float(left.centroid), made.height
        angle = height / (tube.outer_radius + lever) - np.radians(made.precurvature_deg)
        torsion = 0.375 * float(left.torsion_constant) if shape.loads == "space" else np.inf
        softest = min(float(left.second_moment_weak), float(left.second_moment_strong), torsion)
        moment = material.elastic_modulus * softest * angle / height
        strain = angle * float(left.edge_spine) / height
        return made, Size(angle, moment * softened(material, strain), lever)

    return finish


def _tendon(
    numbers: Numbers, rope: Rope, radius: float, notches: list, sizes: list[Size]
) -> nf.Tendon:
    """A tendon; half of those that may end anywhere end in the last body they can."""
    ends = [body for body, _, _ in _stops(notches, rope.side)]
    end = rope.end or ends[-1]
    if rope.end is None and numbers.chance(0.5):
        end = int(numbers.choice(tuple(ends)))
    stiffness = np.inf
    if numbers.chance(0.3):
        # Stretched by 0.1 to 2 % by the tension that closes the softest notch.
        closes = min(size.moment / (size.lever + radius) for size in sizes)
        stiffness = closes / numbers.log(1e-3, 2e-2)
    return nf.Tendon(
        radius, direction_deg=rope.side, end_body=end, axial_stiffness=stiffness, path=rope.path
    )


def _stops(notches: list, side: float) -> Iterator[tuple[int, float, float]]:
    around = [None, *notches, None]
    for body in range(1, len(notches) + 1):
        for opening in around[body].openings(around[body - 1], around[body + 1]):
            if opening.admits(side):
                yield body, opening.enters, opening.leaves


def _material(numbers: Numbers, shape: Shape) -> Any:
    density = float(numbers.choice((6450.0, 1200.0)))
    if shape.material in ("nitinol", "hysteresis", "table"):
        return drawn_material(numbers, shape.material, density)
    if shape.material == "linear":
        return nf.Linear(numbers.log(1e3, 2e5), density=density)
    modulus = numbers.log(5e3, 8e4)
    return nf.Superelastic(
        modulus,
        modulus * numbers.usual(0.1, 0.5, 0.02, 1.0),
        numbers.uniform(0.005, 0.03),
        density=density,
    )


def _friction(numbers: Numbers, kind: str) -> nf.Capstan | nf.Corner | nf.Frictionless:
    if kind == "frictionless":
        return nf.Frictionless()
    coefficient = numbers.usual(0.02, 0.3, 0.0, 0.8)
    if kind in ("slope", "chord"):
        return nf.Corner(coefficient, turning=kind)
    return nf.Capstan(coefficient, wrap=kind)
