"""Random robots and random histories of loads, as plain tables that can be printed.

One draw is a function of (seed, number) alone.  Tables have the keys of robot files, so that a
finding can be repeated by hand; lengths in mm, forces in N, angles of robots in degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from histories import draw_frame, draw_history
from sections import reference
from shape import notches_of

Table = dict[str, Any]
VARIANTS = 16
LENGTHS = """
    outer_diameter inner_diameter base_length height uncut_length depth strip_thickness
    strip_length wall_width slot_radius radius free_length
"""
LENGTHS_OF = LENGTHS.split()


@dataclass
class Case:
    """A robot, its loads in order, and what was meant by them."""

    robot: Table
    loads: list[Table]
    planar: bool
    marks: list[str] = field(default_factory=list)
    first: bool = True  # of its form


def pick(random: np.random.Generator, **weights: float) -> str:
    """Return one of the names, by weight."""
    names = list(weights)
    share = np.array([weights[name] for name in names])
    return names[random.choice(len(names), p=share / share.sum())].replace("_", "-")


def between_decades(random: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def draw_tube(random: np.random.Generator) -> Table:
    """Return a tube between hair and hose."""
    outer = between_decades(random, 0.2, 40.0)
    base = 0.0 if random.random() < 0.5 else outer * random.uniform(0, 3)
    inner = outer * random.uniform(0.4, 0.95)
    return {"outer_diameter": outer, "inner_diameter": inner, "base_length": base}


def draw_notch(random: np.random.Generator, kind: str, tube: Table) -> Table:
    """Return one notch of a kind, its sizes relative to the tube."""
    radius = tube["outer_diameter"] / 2
    uncut = 0.0 if random.random() < 0.2 else radius * random.uniform(0.05, 3)
    notch: Table = {"kind": kind, "uncut_length": uncut}
    if kind == "arc":
        cut = "on-axis" if random.random() < 0.5 else "off-axis"
        depth, height = radius * random.uniform(1.0, 1.9), radius * random.uniform(0.2, 2)
        notch |= {"cut": cut, "depth": depth, "height": height}
        if random.random() < 0.25:
            most = math.degrees(height / (2 * radius))
            notch["precurvature_deg"] = most * random.uniform(-0.5, 0.9)
    elif kind == "strip":
        notch |= {
            "height": radius * random.uniform(0.15, 0.9),
            "strip_thickness": radius * random.uniform(0.05, 0.35),
            "depth": radius * random.uniform(1.05, 1.7),
            "deflection": pick(random, large=3, small=1),
        }
        if random.random() < 0.4:
            notch["strip_length"] = radius * random.uniform(0.8, 1.9)
        if random.random() < 0.4:
            notch["wall_width"] = radius * random.uniform(0.1, 1.2)
    else:
        notch |= {
            "slot_radius": radius * random.uniform(0.04, 0.14),
            "strip_thickness": radius * random.uniform(0.08, 0.35),
            "strip_length": radius * random.uniform(0.3, 0.9),
            "proximal_slot": pick(random, away=1, toward=1),
        }
    return notch


def draw_notches(random: np.random.Generator, tube: Table, planar: bool) -> list[Table]:
    """Return the notches: of one kind or mixed, equal or each its own."""
    family = pick(random, arc=5, strip=2, u_link=2, mixed=3)
    count = int(random.choice([1, 2, 3, 4, 5, 6, 8, 12, 20, 40], p=[0.1] * 7 + [0.15, 0.1, 0.05]))
    notches: list[Table] = []
    while sum(notch.get("repeat", 1) for notch in notches) < count:
        kind = pick(random, arc=2, strip=1, u_link=1) if family == "mixed" else family
        if kind == "u-link" and notches and notches[-1]["kind"] == "u-link":
            kind = "arc"  # rows side by side would have to share a slot
        notch = draw_notch(random, kind, tube)
        left = count - sum(other.get("repeat", 1) for other in notches)
        equal = left if random.random() < 0.4 or count > 12 else 1
        if family == "mixed":
            equal = int(random.integers(1, min(4, left) + 1))
        if kind == "u-link":  # neighbours of a row share their slots: one row, mostly
            equal = left if family == "u-link" else equal
        notch["repeat"] = equal
        side = random.choice([0.0, 180.0], p=[0.8, 0.2])
        if not planar and kind == "arc":
            side = random.choice([0.0, 90.0, 180.0, 270.0, random.uniform(-180, 180)])
        elif not planar:
            side = random.uniform(-20, 20)
        notch["direction_deg"] = float(side)
        notches.append(notch)
    return notches


def ends_for(robot: Table, direction: float) -> list[int]:
    """Return the bodies in which a tendon may end: those with a wall on its side."""
    rows = notches_of(robot)
    ends = []
    for body, notch in enumerate(rows, start=1):
        faces = np.cos(np.radians(direction - notch["direction_deg"])) > 0
        if notch["kind"] != "u-link" or faces == (notch["proximal_slot"] == "toward"):
            ends.append(body)
    return ends or [len(rows)]


def draw_tendons(random: np.random.Generator, robot: Table, planar: bool) -> list[Table]:
    """Return one to four tendons that suit the notches, mostly."""
    tube, kinds = robot["tube"], {notch["kind"] for notch in robot["notch"]}
    radius, count = (
        tube["outer_diameter"] / 2,
        int(random.choice([1, 2, 3, 4], p=[0.5, 0.3, 0.1, 0.1])),
    )
    bodies = sum(notch["repeat"] for notch in robot["notch"])
    tendons: list[Table] = []
    for number in range(count):
        direction = (
            0.0 if number == 0 else 180.0 if number == 1 else float(random.choice([0.0, 180.0]))
        )
        if not planar:
            direction = 360.0 / count * number if kinds == {"arc"} else direction
            direction += float(random.uniform(-20, 20))
        tendon: Table = {"radius": radius * random.uniform(0.65, 0.94), "direction_deg": direction}
        straight = {"straight": 6.0, "straight_dead": 1.0, "straight_follower": 1.0}
        wall = {"wall_arc": 8.0} if kinds == {"arc"} else {"wall_arc": 0.08}
        tendon["path"] = pick(random, **straight, **wall)
        if random.random() < 0.25 and bodies > 1:
            tendon["end_body"] = int(random.choice(ends_for(robot, direction)))
        elif bodies not in ends_for(robot, direction) and random.random() < 0.97:
            tendon["end_body"] = ends_for(robot, direction)[-1]
        if random.random() < 0.3:
            tendon["axial_stiffness"] = tension_scale(robot) * between_decades(random, 10, 1e5)
            tendon["free_length"] = radius * random.uniform(0, 20)
        tendons.append(tendon)
    return tendons


def draw_material(random: np.random.Generator) -> Table:
    """Return a polymer, steel or nitinol."""
    table: Table = {"kind": "linear", "elastic_modulus": between_decades(random, 100, 2e5)}
    if random.random() < 0.5:
        first = between_decades(random, 0.002, 0.04)
        table |= {
            "kind": "superelastic",
            "superelastic_modulus": table["elastic_modulus"] * random.uniform(0.02, 0.6),
            "transition_strain": first,
            "plastic_strain": first * random.uniform(1.5, 10),
            "plastic_modulus": table["elastic_modulus"] * random.uniform(0.01, 0.3),
        }
    if random.random() < 0.5:
        table["poisson_ratio"] = random.uniform(0.0, 0.49)
    if random.random() < 0.4:
        table["density"] = between_decades(random, 500, 10000)
    return table


def draw_friction(random: np.random.Generator) -> Table:
    """Return one of the laws, sometimes with a coefficient of 0."""
    kind = pick(random, capstan=4, corner=3, frictionless=2)
    if kind == "frictionless":
        return {"kind": kind}
    coefficient = float(random.choice([0.0, random.uniform(0, 0.2), random.uniform(0, 0.6)]))
    if kind == "capstan":
        wrap = pick(random, geometric=2, whole_before=1)
        return {"kind": kind, "coefficient": coefficient, "wrap": wrap}
    return {"kind": kind, "coefficient": coefficient, "turning": pick(random, slope=3, chord=1)}


def tension_scale(robot: Table) -> float:
    """Return a tension that bends the robot far [N]."""
    sizes = [reference(robot, notch) for notch in robot["notch"]]
    return float(np.median([stiff * angle / lever for stiff, angle, lever in sizes]))


def spoil(random: np.random.Generator, robot: Table) -> str:
    """Make a robot unusable in one place; return where."""
    what = pick(random, depth=1, wall=1, tendon=1, end=1, nan=1, modulus=1, precurved=1)
    notch, tendon = robot["notch"][0], robot["tendon"][0]
    if what == "depth":
        notch["depth"] = robot["tube"]["outer_diameter"] * random.uniform(1, 2)
    elif what == "wall":
        robot["tube"]["inner_diameter"] = robot["tube"]["outer_diameter"] * random.uniform(1, 2)
    elif what == "tendon":
        tendon["radius"] = robot["tube"]["outer_diameter"] * random.uniform(0.51, 2)
    elif what == "end":
        tendon["end_body"] = 1 + sum(other["repeat"] for other in robot["notch"])
    elif what == "nan":
        notch["uncut_length"] = math.nan
    elif what == "modulus":
        robot["material"]["elastic_modulus"] *= -1
    else:
        notch["precurvature_deg"] = 400.0
    return what


def varied(random: np.random.Generator, robot: Table) -> None:
    """Give all sizes of a robot other values; its form, and so its program, stays."""
    size = between_decades(random, 0.2, 5.0)
    for part in [robot["tube"], *robot["notch"], *robot["tendon"]]:
        for key in LENGTHS_OF:
            if part.get(key):
                part[key] *= size * random.uniform(0.97, 1.03)
        if "axial_stiffness" in part:
            part["axial_stiffness"] *= size**2
    for part, keys in (("material", ("elastic_modulus",)), ("friction", ("coefficient",))):
        for key in keys:
            if key in robot[part]:
                robot[part][key] *= random.uniform(0.3, 1.5)


def draw_case(seed: int, number: int) -> Case:
    """Return draw `number` of a seed.

    Draws follow one another in sixteens of one form, each with its own sizes and its own history:
    a program is compiled once for them.
    """
    of_form = np.random.default_rng([seed, number // VARIANTS, 0])
    random = np.random.default_rng([seed, number, 2])
    planar = bool(of_form.random() < 0.55)
    tube = draw_tube(of_form)
    robot: Table = {"name": f"draw {seed}-{number}", "tube": tube}
    robot["notch"] = draw_notches(of_form, tube, planar)
    robot["material"] = draw_material(of_form)
    robot["friction"] = draw_friction(of_form)
    robot["tendon"] = draw_tendons(of_form, robot, planar)
    frame = draw_frame(of_form, len(robot["tendon"]))
    if number % VARIANTS:
        varied(random, robot)
    marks = ["+".join(sorted({notch["kind"] for notch in robot["notch"]}))]
    marks += ["planar" if planar else "spatial", robot["friction"]["kind"]]
    loads = draw_history(random, robot, planar, tension_scale(robot), frame, marks)
    if random.random() < 0.03:
        marks.append("spoiled: " + spoil(random, robot))
    return Case(robot, loads, planar, marks, first=number % VARIANTS == 0)
