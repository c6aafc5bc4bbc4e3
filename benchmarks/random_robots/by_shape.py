"""Random robots by shape: `draw(seed, number, shapes)`, with a random path of loads each.

A shape says how many notches of which kinds there are, which tendons run how, which laws, loads in
the plane or in space: it decides which program is compiled. `SHAPES` have the laws of the papers,
`DRAWN` what a drawing of the tube gives: elastic ends, elastic closing, fibres with and without
hysteresis. Robots are tubes of 0.5 to 10 mm, a tenth of the numbers from a wider range than is
usual. Loads are sized by the tension or the moment that would close the softest notch, were it
linear and alone.
"""

from __future__ import annotations

import dataclasses
from math import pi, radians
from typing import Any, NamedTuple

import numpy as np

import notchflex as nf

from .draws import Draw

UNUSUAL = 0.1  # part of the numbers that comes from the wider range
CUTS = {"o": "on-axis", "s": "off-axis"}
SECTIONS = {"on-axis": nf.annular_sector, "off-axis": nf.annular_segment}
DIRECTIONS = {"one": (0.0,), "both": (0.0, 180.0), "four": (0.0, 90.0, 180.0, 270.0)}


class Rope(NamedTuple):
    """How a tendon runs.

    Attributes:
        side: Direction, deg.
        path: "wall-arc", "straight" and so on.
        end: Body in which it ends; 0 is the last one, None any that has wall on its side.
    """

    side: float
    path: str = "wall-arc"
    end: int | None = None


class Shape(NamedTuple):
    """What robots that share a program have in common.

    Attributes:
        name: What it is called in tables.
        notches: Kinds, base to tip: o and s are arcs (on-axis cut by a laser, saw cut), p is a
            pair of triangular notches, u a U-link.
        directions: Sides to which the arcs bend: "one", "both" (0 and 180 deg), "four", "any".
        tendons: The tendons; the first ends in the last body that has wall on its side.
        friction: "frictionless", "geometric", "whole-before", "slope" or "chord".
        material: "linear", "superelastic", "nitinol", "hysteresis" (nitinol that unloads on a
            plateau of its own) or "table" (stress over strain).
        loads: "tendons" alone, other loads in the "plane", or in "space".
        ends: "rigid", or "elastic": the notches as the tube makes them.
        closing: Of arcs, "rigid" or "elastic".
    """

    name: str
    notches: str
    directions: str
    tendons: tuple[Rope, ...]
    friction: str
    material: str
    loads: str
    ends: str = "rigid"
    closing: str = "rigid"


def _straight(*sides: float, path: str = "straight") -> tuple[Rope, ...]:
    return tuple(Rope(side, path, None if i else 0) for i, side in enumerate(sides))


def _wall(*sides: float) -> tuple[Rope, ...]:
    return _straight(*sides, path="wall-arc")


SHAPES = (
    Shape("wrist", "ooooo", "one", _wall(0), "whole-before", "superelastic", "tendons"),
    Shape("saw-cut wrist", "ssss", "one", _wall(0), "geometric", "linear", "plane"),
    Shape("wrist in space", "ooo", "one", _wall(0, 180), "geometric", "superelastic", "space"),
    Shape("both sides", "oooooo", "both", _wall(0, 180), "frictionless", "linear", "plane"),
    Shape("two axes", "ooooo", "four", _wall(0, 90, 180, 270), "geometric", "linear", "space"),
    Shape("any side", "sososo", "any", _wall(0, 120, 240), "whole-before", "linear", "tendons"),
    Shape(
        "straight tendons",
        "ssssss",
        "four",
        _straight(0, 120, 240),
        "frictionless",
        "linear",
        "space",
    ),
    Shape("straight tendon", "oooo", "one", _straight(0), "slope", "superelastic", "plane"),
    Shape("strips", "pppp", "one", _straight(0), "slope", "linear", "tendons"),
    Shape("strips, two cables", "ppppp", "one", _straight(0, 180), "chord", "linear", "plane"),
    Shape(
        "strips in space",
        "ppp",
        "one",
        _straight(0, 180, path="straight-follower"),
        "geometric",
        "superelastic",
        "space",
    ),
    Shape("links", "uuuuuu", "one", _straight(0, 180), "slope", "linear", "tendons"),
    Shape("more links", "uuuuuuuu", "one", _straight(0, 180), "geometric", "linear", "plane"),
    Shape("links in space", "uuuuu", "one", _straight(0), "frictionless", "superelastic", "space"),
    Shape("all kinds", "oospuuu", "one", _straight(0, 180), "slope", "linear", "plane"),
    Shape(
        "links on a wrist",
        "ooouuu",
        "one",
        (Rope(0, "straight", 0), Rope(180, "straight"), Rope(0, "wall-arc", 3)),
        "geometric",
        "superelastic",
        "space",
    ),
)

DRAWN = (
    Shape(
        "drawn wrist", "ooooo", "one", _straight(0), "geometric", "nitinol", "tendons", "elastic"
    ),
    Shape(
        "with hysteresis",
        "ooooo",
        "one",
        _straight(0),
        "geometric",
        "hysteresis",
        "tendons",
        "elastic",
        "elastic",
    ),
    Shape("drawn saw cuts", "ssss", "one", _wall(0), "geometric", "linear", "plane", "elastic"),
    Shape(
        "drawn in space", "ooo", "one", _straight(0, 180), "slope", "nitinol", "space", "elastic"
    ),
    Shape(
        "both sides, loops",
        "oooo",
        "both",
        _wall(0, 180),
        "frictionless",
        "hysteresis",
        "plane",
        "elastic",
    ),
    Shape(
        "drawn, of a table",
        "soos",
        "one",
        _straight(0),
        "whole-before",
        "table",
        "tendons",
        "elastic",
        "elastic",
    ),
    Shape(
        "rigid, loops",
        "osos",
        "any",
        _wall(0, 120, 240),
        "geometric",
        "hysteresis",
        "tendons",
        "rigid",
        "elastic",
    ),
    Shape(
        "loops in space",
        "oooo",
        "four",
        _straight(0, 90, 180, 270),
        "geometric",
        "hysteresis",
        "space",
        "elastic",
        "elastic",
    ),
    Shape(
        "drawn, superelastic",
        "oooo",
        "one",
        _straight(0),
        "chord",
        "superelastic",
        "plane",
        "elastic",
        "elastic",
    ),
    Shape("drawn strips", "pppp", "one", _straight(0, 180), "slope", "linear", "plane", "elastic"),
    Shape(
        "drawn strips in space",
        "ppp",
        "one",
        _straight(0, 180),
        "geometric",
        "nitinol",
        "space",
        "elastic",
    ),
    Shape("drawn links", "uuuuuu", "one", _straight(0, 180), "slope", "linear", "plane", "elastic"),
    Shape(
        "drawn links in space", "uuuuu", "one", _straight(0), "chord", "table", "space", "elastic"
    ),
    Shape(
        "all kinds, drawn",
        "oospuu",
        "one",
        _straight(0, 180),
        "slope",
        "hysteresis",
        "plane",
        "elastic",
        "elastic",
    ),
)


def draw(seed: int, number: int, shapes: tuple[Shape, ...] = SHAPES) -> Draw:
    """Draw one robot, of the shape at place `number` modulo the number of shapes, with loads.

    Raises:
        InputError: What was drawn is no robot: a fault of this file.
    """
    shape = shapes[number % len(shapes)]
    numbers = Numbers(np.random.default_rng([seed, number]))
    robot, sizes = _robot(numbers, shape, number)
    return Draw(seed, number, shape.name, robot, drawn_loads(numbers, shape, robot, sizes))


class Size(NamedTuple):
    """How a notch alone answers: angle of closing (rad), moment for it (N mm), lever (mm)."""

    angle: float
    moment: float
    lever: float


class Numbers:
    """Random numbers, most of them usual, a few not."""

    def __init__(self, generator: np.random.Generator) -> None:
        self.generator = generator

    def usual(self, low: float, high: float, least: float, most: float) -> float:
        """Uniform between low and high, at times between least and most."""
        if self.chance(UNUSUAL):
            return float(self.generator.uniform(least, most))
        return float(self.generator.uniform(low, high))

    def uniform(self, low: float, high: float) -> float:
        """Uniform between low and high."""
        return float(self.generator.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        """Uniform in the logarithm."""
        return float(np.exp(self.generator.uniform(np.log(low), np.log(high))))

    def chance(self, part: float) -> bool:
        """True so often."""
        return bool(self.generator.uniform() < part)

    def choice(self, values: tuple) -> object:
        """One of some values, each as often as the others."""
        return values[self.generator.integers(len(values))]

    def direction(self, in_space: bool) -> np.ndarray:
        """Unit vector, in the x-z plane or anywhere."""
        vector = self.generator.normal(size=3)
        vector[1] *= in_space
        return vector / np.linalg.norm(vector)


def drawn_loads(
    numbers: Numbers, shape: Shape, robot: nf.Robot, sizes: list[Size]
) -> tuple[nf.Load, ...]:
    """One to four loads; each later one pulls on, lets go, or holds, and so do other loads."""
    steps = int(numbers.generator.integers(1, 5))
    pulled = _tendon_values(numbers, robot, sizes)
    others = _external(numbers, shape, robot, sizes)
    pull, push = 1.0, 1.0
    every = []
    for _ in range(steps):
        tension = [None if value is None else pull * value for value in pulled[0]]
        stroke = [None if value is None else pull * value for value in pulled[1]]
        every.append(nf.Load(tension=tension, stroke=stroke, **others(push)))
        pull = numbers.choice((pull, numbers.uniform(0.0, 1.3), 0.0))
        push = numbers.choice((push, push, numbers.uniform(0.1, 1.2)))
    return tuple(every)


def _tendon_values(
    numbers: Numbers, robot: nf.Robot, sizes: list[Size]
) -> tuple[list[float | None], list[float | None]]:
    """Tensions up to 1.3 times the one that closes the softest notch; at times one stroke.

    The stroke is up to 85 % of what the tendon would be drawn by that tension over notches that
    are linear up to their closing. Of opposite tendons only one is drawn: two could not both be.
    """
    count = robot.number_of_tendons
    closes = min(size.moment / size.lever for size in sizes)
    most = numbers.log(0.02, 1.3) * closes
    tension: list[float | None] = [most]
    stroke: list[float | None] = [None] * count
    for _ in range(1, count):
        tension.append(numbers.choice((None, most * numbers.uniform(0.0, 1.0))))
    if numbers.chance(0.3):
        first = robot.tendon[0]
        reach = 0.0
        for notch, size in zip(robot.notches, sizes, strict=True):
            toward = np.cos(radians(first.direction_deg - notch.direction_deg))
            lever = max(size.lever - first.radius * (1.0 - toward), 0.0)
            reach += lever * size.angle * min(closes * lever / size.moment, 1.0)
        tension[0], stroke[0] = None, numbers.uniform(0.02, 0.85) * float(reach)
    return tension, stroke


def _external(numbers: Numbers, shape: Shape, robot: nf.Robot, sizes: list[Size]):
    """Loads beside the tendons as a function of their part; nothing where tendons act alone."""
    if shape.loads == "tendons":
        return lambda _: {}
    space = shape.loads == "space"
    lengths = [notch.height + notch.spacing(None) for notch in robot.notches]
    whole = robot.tube.base_length + sum(lengths)
    moment = numbers.log(0.01, 1.0) * min(size.moment for size in sizes)
    force = moment / whole
    tip_force = force * numbers.direction(space)
    # In the plane a moment turns about its normal, y; in space about anything.
    about = numbers.direction(True) if space else np.array([0.0, numbers.choice((-1.0, 1.0)), 0.0])
    tip_moment = (0.5 * moment * about) if numbers.chance(0.3) else np.zeros(3)
    following = numbers.chance(0.2)
    mass = 1e3 * force / 9.81 if numbers.chance(0.3) else 0.0
    gravity = tuple(9.81 * numbers.direction(space)) if numbers.chance(0.3) else None
    turned = (0.0, pi * numbers.uniform(-0.5, 0.5), 0.0) if numbers.chance(0.2) else (0.0,) * 3
    body = int(numbers.generator.integers(1, robot.number_of_notches + 1))
    on_body = 0.5 * force * numbers.direction(space) if numbers.chance(0.2) else None

    def at(part: float) -> dict[str, object]:
        forces = [] if on_body is None else [nf.BodyForce(body, tuple(part * on_body))]
        return {
            "tip_force": tuple(part * tip_force),
            "tip_moment": tuple(part * tip_moment),
            "following": following,
            "tip_mass": part * mass,
            "gravity": gravity,
            "base_rotation": turned,
            "body_forces": forces,
        }

    return at


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
        left = SECTIONS[CUTS[kind]](tube.outer_radius, tube.inner_radius, own * outer)
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
        angle = closing * (1.0 - max(precurved, 0.0))
        return notch, Size(angle, modulus * _softest(left, shape) * angle / height, lever)

    return make


def _softest(left: nf.Section, shape: Shape) -> float:
    """The softest way to turn a notch, mm^4; loads in space twist an open section."""
    torsion = 0.375 * float(left.torsion_constant) if shape.loads == "space" else np.inf
    return min(float(left.second_moment_weak), float(left.second_moment_strong), torsion)


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
        left = SECTIONS[made.cut](*shape_of)
        lever, height = float(left.centroid), made.height
        angle = height / (tube.outer_radius + lever) - np.radians(made.precurvature_deg)
        moment = material.elastic_modulus * _softest(left, shape) * angle / height
        strain = angle * float(left.edge_spine) / height
        return made, Size(angle, moment * softened(material, strain), lever)

    return finish


def _tendon(
    numbers: Numbers, rope: Rope, radius: float, notches: list, sizes: list[Size]
) -> nf.Tendon:
    """A tendon; half of those that may end anywhere end in the last body they can."""
    around = [None, *notches, None]
    ends = [
        body
        for body, notch in enumerate(notches, start=1)
        for opening in notch.openings(around[body - 1], around[body + 1])
        if opening.admits(rope.side)
    ]
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


def drawn_material(numbers: Numbers, kind: str, density: float) -> nf.Nitinol | nf.StressStrain:
    """Draw nitinol with or without hysteresis, or a table of stress over strain."""
    modulus = numbers.log(2e4, 8e4)
    begin = numbers.usual(0.006, 0.012, 0.002, 0.03)
    if kind == "table":
        return _table(numbers, modulus, begin, density)
    stress = begin * modulus
    unloading = stress * numbers.usual(0.2, 0.6, 0.01, 0.98) if kind == "hysteresis" else None
    return nf.Nitinol(
        modulus,
        stress,
        modulus * numbers.usual(0.05, 0.25, 0.01, 0.9),
        float(numbers.choice((1.0, numbers.uniform(1.0, 1.6)))),
        unloading,
        float(begin + numbers.uniform(0.02, 0.06)) if numbers.chance(0.3) else None,
        density=density,
    )


def _table(numbers: Numbers, modulus: float, begin: float, density: float) -> nf.StressStrain:
    """Draw a curve of two to seven pieces that may stiffen again, at times one for each sign."""

    def curve(first: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        count = int(numbers.generator.integers(1, 7))
        strain = first + np.append(0.0, np.cumsum(numbers.generator.uniform(0.004, 0.02, count)))
        slope = modulus * np.array([numbers.log(0.012, 1.2) for _ in range(count)])
        stress = modulus * first + np.append(0.0, np.cumsum(np.diff(strain) * slope))
        return tuple(strain.tolist()), tuple(stress.tolist())

    strain, stress = curve(begin)
    other: dict[str, Any] = {}
    if numbers.chance(0.5):
        both = curve(begin * numbers.uniform(0.8, 1.6))
        other = {"compression_strain": both[0], "compression_stress": both[1]}
    return nf.StressStrain(strain=strain, stress=stress, density=density, **other)


def softened(material: Any, strain: float) -> float:
    """Stress in tension at a strain over that of Young's modulus there, about."""
    modulus = material.elastic_modulus
    if isinstance(material, nf.Nitinol):
        begin = material.plateau_stress / modulus
        beyond = material.plateau_modulus
    elif isinstance(material, nf.StressStrain):
        begin = material.strain[0]
        beyond = (material.stress[-1] - material.stress[0]) / (material.strain[-1] - begin)
    else:
        return 1.0
    if strain <= begin:
        return 1.0
    return (begin + beyond / modulus * (strain - begin)) / strain
