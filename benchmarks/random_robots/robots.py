"""Random robots: `draw(seed, number)`, with a random history of loads each.

Sixteen draws after one another share a form (notches, laws, tendons, number of steps, what acts
from outside), each with its own sizes and its own history. Half of the forms have the laws of the
papers; the others are what a drawing of the tube gives: elastic ends, elastic closing, nitinol
with and without hysteresis, a table of stress over strain. Into these other parts are mixed
(parts.py). Tables have the keys of robot files; lengths in mm, forces in N, angles of robots in
degrees. Some draws are no robots and are refused.

Loads go up to the range of the model. A notch that closes bears any tension in its plane: these go
up to three times what closes half of the notches, and now and then far beyond. Nothing stops gaps,
tables, an arc notch that a tendon opens, and out of the plane a notch that is bent to its side.
There tendons together pull no more than what bends the softest gap or table to its range, would
close the softest notch that is opened, or three times what closes the softest notch. Nowhere they
pull more than what lets the softest strip yield, or press on a gap so that it buckles, or on a
strip so that its notch half closes; and they draw no more than such tensions do. All loads from
outside together, weight among them, have at most the moment that closes the softest notch, bends
the softest gap or table to its range, or twists an arc notch by half a radian, and do not buckle
the robot.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import notchflex as nf
from notchflex.robot import Drive, Fatigue

from .draws import POWERS, Draw, enlarged
from .parts import COLDEST, mix_loads, mix_notches, mix_others
from .sections import section_of

Table = dict[str, Any]
VARIANTS = 16
NOTCHES = {
    "arc": nf.ArcNotch,
    "strip": nf.StripNotch,
    "u-link": nf.ULink,
    "rod": nf.RodGap,
    "table": nf.TableNotch,
}
ROUND = {"arc", "rod", "table"}  # kinds over which a tendon may lie on any side
# How many times what closes the softest notch may pull, where it may bend to its side; and what all
# tendons together may press on a gap, times its length over its stiffness: hinged at both ends it
# would buckle at pi**2, and bends to its side before.
_SIDEWAYS, _UPRIGHT = 3.0, 3.0
# What part of the width of a notch all tendons together may close by pressing alone.
_PRESSED = 0.5
# What loads from outside may press on a robot, times its length over its stiffness.
_COLUMN = 2.0
# How far loads from outside may twist an arc notch, rad.
_TWISTED = 0.5
STIFF = (
    "elastic_modulus",
    "superelastic_modulus",
    "plastic_modulus",
    "plateau_modulus",
    "plateau_stress",
    "unloading_stress",
    "plateau_slope",
    "stress",
    "compression_stress",
    "moment",
)
"""Keys of what is proportional to the stiffness of a robot."""
MATERIALS = {
    "linear": nf.Linear,
    "superelastic": nf.Superelastic,
    "nitinol": nf.Nitinol,
    "stress-strain": nf.StressStrain,
}
FRICTIONS = {"capstan": nf.Capstan, "corner": nf.Corner, "frictionless": nf.Frictionless}


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


def as_drawn(random: np.random.Generator, notches: list[Table], tube: Table) -> None:
    """Let the tube make the notches: elastic ends and lips; of half of the robots usual sizes."""
    usual, radius = random.random() < 0.5, tube["outer_diameter"] / 2
    closing = pick(random, elastic=1, rigid=1)
    depth_at = pick(random, outer=2, mid_wall=1, inner=1)
    for notch in notches:
        if notch["kind"] != "arc":
            notch["ends"] = "elastic"
            continue
        notch |= {"ends": "shell", "closing": closing}
        if usual:
            notch["depth"] = radius * random.uniform(1.5, 1.8)
            notch["uncut_length"] = radius * random.uniform(0.8, 3.0)
        # Read at another surface the edges of some cuts would not meet the tube.
        across = abs(notch["depth"] - radius) < 0.9 * tube["inner_diameter"] / 2
        if notch["cut"] == "on-axis" and across:
            notch["depth_at"] = depth_at


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
        left = count - sum(before.get("repeat", 1) for before in notches)
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
    ends, body = [], 0
    for notch in robot["notch"]:
        for place in range(notch["repeat"]):
            body += 1
            if notch["kind"] == "u-link":  # the slots before a row's links are on its sides in turn
                faces = np.cos(np.radians(direction - notch["direction_deg"])) > 0
                if (notch["proximal_slot"] == "toward") != (faces == (place % 2 == 0)):
                    continue
            ends.append(body)
    return ends or [body]


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
            direction = 360.0 / count * number if kinds <= ROUND else direction
            direction += float(random.uniform(-20, 20))
        tendon: Table = {"radius": radius * random.uniform(0.65, 0.94), "direction_deg": direction}
        straight = {"straight": 6.0, "straight_dead": 1.0, "straight_follower": 1.0}
        wall = {"wall_arc": 8.0} if kinds <= {"arc", "table"} else {"wall_arc": 0.08}
        if "rod" in kinds:
            wall, straight = {}, straight if random.random() < 0.5 else {"straight": 1.0}
        tendon["path"] = pick(random, **straight, **wall)
        if random.random() < 0.25 and bodies > 1:
            tendon["end_body"] = int(random.choice(ends_for(robot, direction)))
        elif bodies not in ends_for(robot, direction) and random.random() < 0.97:
            tendon["end_body"] = ends_for(robot, direction)[-1]
        if random.random() < 0.3:
            strong = tension_scale(robot | {"tendon": [*tendons, tendon]}, planar)
            tendon["axial_stiffness"] = strong * between_decades(random, 10, 1e5)
            tendon["free_length"] = radius * random.uniform(0, 20)
        tendons.append(tendon)
    return tendons


def draw_material(random: np.random.Generator, from_drawing: bool) -> Table:
    """Return a polymer, steel or nitinol."""
    weights = {"linear": 1.0, "superelastic": 1.0}
    if from_drawing:
        weights = {"linear": 1.0, "superelastic": 0.5, "nitinol": 2.0, "stress_strain": 0.5}
    kind = pick(random, **weights)
    modulus = between_decades(random, 100, 2e5)
    begin = between_decades(random, 0.002, 0.04)
    table: Table = {"kind": kind, "elastic_modulus": modulus}
    if kind == "superelastic":
        table |= {
            "superelastic_modulus": modulus * random.uniform(0.02, 0.6),
            "transition_strain": begin,
            "plastic_strain": begin * random.uniform(1.5, 10),
            "plastic_modulus": modulus * random.uniform(0.01, 0.3),
        }
    elif kind == "nitinol":
        stress = begin * modulus
        table |= {"plateau_stress": stress, "plateau_modulus": modulus * random.uniform(0.01, 0.5)}
        table["compression_ratio"] = float(random.choice([1.0, random.uniform(1.0, 1.6)]))
        if random.random() < 0.6:
            table["unloading_stress"] = stress * random.uniform(0.05, 0.95)
        if random.random() < 0.3:
            table["transformation_strain"] = begin + random.uniform(0.02, 0.06)
    elif kind == "stress-strain":
        del table["elastic_modulus"]
        table |= draw_curve(random, modulus, begin, "")
        if random.random() < 0.5:
            table |= draw_curve(random, modulus, begin * random.uniform(0.8, 1.6), "compression_")
    if random.random() < 0.5:
        table["poisson_ratio"] = random.uniform(0.0, 0.49)
    if random.random() < 0.4:
        table["density"] = between_decades(random, 500, 10000)
    return table


def draw_curve(random: np.random.Generator, modulus: float, begin: float, prefix: str) -> Table:
    """Return a curve of stress over strain of two to seven pieces, which may stiffen again."""
    count = int(random.integers(1, 7))
    strain = begin + np.append(0.0, np.cumsum(random.uniform(0.004, 0.02, count)))
    slope = modulus * np.exp(random.uniform(np.log(0.012), np.log(1.2), count))
    stress = modulus * begin + np.append(0.0, np.cumsum(np.diff(strain) * slope))
    return {f"{prefix}strain": strain.tolist(), f"{prefix}stress": stress.tolist()}


def elastic_modulus(material: Table) -> float:
    """Return Young's modulus, MPa: of a curve, that of its first piece."""
    if material["kind"] == "stress-strain":
        return material["stress"][0] / material["strain"][0]
    return material["elastic_modulus"]


def kink(material: Table) -> tuple[float, float]:
    """Return the strain where a law leaves Young's modulus, and the modulus beyond it, about.

    A law that depends on the temperature does so first in the greatest cold of parts.py.
    """
    modulus, cold = elastic_modulus(material), 0.0
    if "reference_temperature" in material:
        cold = material["plateau_slope"] * (material["reference_temperature"] - COLDEST) / modulus
    if material["kind"] == "nitinol":
        return material["plateau_stress"] / modulus - cold, material["plateau_modulus"]
    if material["kind"] == "superelastic":
        return material["transition_strain"] - cold, material["superelastic_modulus"]
    if material["kind"] == "stress-strain":
        begin, last = material["strain"][0], material["strain"][-1]
        return begin, (material["stress"][-1] - material["stress"][0]) / (last - begin)
    return math.inf, modulus


def softened(material: Table, strain: float) -> float:
    """Return stress at a strain over what Young's modulus alone would give, about."""
    begin, beyond = kink(material)
    if strain <= begin:
        return 1.0
    return min(1.0, (begin + beyond / elastic_modulus(material) * (strain - begin)) / strain)


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


def tension_scale(robot: Table, planar: bool) -> float:
    """Return a tension that bends the robot far [N]."""
    sizes = [reference(robot, notch) for notch in robot["notch"]]
    median = float(np.median([stiff * angle / lever for stiff, angle, lever in sizes]))
    return min(median, most_tension(robot, planar))


def most_tension(robot: Table, planar: bool) -> float:
    """Return what every tendon may pull [N] where nothing stops what they bend."""
    sides = np.radians([tendon["direction_deg"] for tendon in robot["tendon"]])
    # How many pull toward one side, at most; by the cosine beside it.
    together = np.maximum(np.cos(np.subtract.outer(sides, sides)), 0.0).sum(0).max()
    most = []
    for notch in robot["notch"]:
        stiff, angle, lever = reference(robot, notch)
        opened = min(toward(notch, tendon) for tendon in robot["tendon"]) < -1e-9
        freely = notch["kind"] in ("rod", "table") or (notch["kind"] == "arc" and opened)
        # Where only a part of a strip yields, its few modes miss the moment.
        crosses = notch["kind"] in ("strip", "u-link")
        freely = freely or (crosses and yields(robot, notch))
        times = 1.0 if freely else math.inf if planar else _SIDEWAYS
        most.append(times * stiff * angle / lever / together)
        if crosses:  # its ends move past each other, by 12 EI / L**3, until the tendon's edges meet
            length = strip_length(notch, notch.get("tube", robot["tube"]))
            width = notch.get("height") or 2 * notch["slot_radius"]
            most.append(_PRESSED * 12.0 * stiff * width / length**2 / len(sides))
        if notch["kind"] in ("rod", "table"):
            most.append(_UPRIGHT * stiff / notch["length"] / len(sides))
    return float(min(most))


def strip_length(notch: Table, tube: Table) -> float:
    """Return the length of what bends in a notch of kind strip or u-link, mm."""
    if notch["kind"] == "strip":
        across = (tube["outer_diameter"] + tube["inner_diameter"]) / 2
        return notch.get("strip_length") or across
    return notch["strip_length"] + 2 * notch["slot_radius"]


def yields(robot: Table, notch: Table) -> bool:
    """Return whether the law of a notch leaves Young's modulus."""
    return kink(notch.get("material", robot["material"]))[0] < math.inf


def toward(notch: Table, tendon: Table) -> float:
    """Return the cosine between the direction of a notch and the side of a tendon."""
    return math.cos(math.radians(tendon["direction_deg"] - notch["direction_deg"]))


def most_stroke(robot: Table, tension: float, tendon: Table) -> float:
    """Return what a tendon is drawn [mm] where all that it passes closes or bears a tension.

    Friction takes of the tension on the way.
    """
    passed = [notch for notch in robot["notch"] for _ in range(notch["repeat"])]
    stroke, coefficient = 0.0, robot["friction"].get("coefficient", 0.0)
    for notch in passed[: tendon.get("end_body")]:
        stiff, angle, lever = reference(robot, notch)
        if notch["kind"] == "arc":  # at its spine a tendon has hardly a lever
            lever *= max(toward(notch, tendon), 0.0)
        bend = min(angle, tension * lever / stiff)
        stroke += lever * bend
        tension *= math.exp(-coefficient * bend)
    return stroke


def varied(random: np.random.Generator, robot: Table) -> None:
    """Give all sizes of a robot other values; its form, and so its program, stays."""
    size = between_decades(random, 0.2, 5.0)
    parts = list(parts_of(robot))
    for part in parts:
        for key, power in POWERS.items():
            if part.get(key):
                more = random.uniform(0.97, 1.03) if power == 1 else 1.0
                part[key] = np.multiply(part[key], size**power * more).tolist()
    stiffer, rougher = random.uniform(0.3, 1.5, 2)
    for part in parts:
        for key in STIFF:
            if part.get(key):
                part[key] = np.multiply(part[key], stiffer).tolist()
        if part.get("stiffness"):  # of tables: about axes and along them
            part["stiffness"] = (enlarged(part["stiffness"], size) * stiffer).tolist()
    if "coefficient" in robot["friction"]:
        robot["friction"]["coefficient"] *= rougher


def parts_of(robot: Table) -> Iterator[Table]:
    """Yield all tables of a robot."""
    for part in robot.values():
        for table in part if isinstance(part, list) else [part]:
            if isinstance(table, dict):
                yield table
                yield from parts_of(table)


def reference(robot: Table, notch: Table) -> tuple[float, float, float]:
    """Return stiffness (N mm), a large angle and the lever (mm) of a notch, roughly."""
    tube, material = (notch.get(key, robot[key]) for key in ("tube", "material"))
    outer, inner = tube["outer_diameter"] / 2, tube["inner_diameter"] / 2
    if notch["kind"] == "table":
        if "moment" in notch:
            angles, moments = np.radians(notch["angle_deg"]), notch["moment"]
            angle = float(angles[-1])
            stiffness = min(moments[end] / angles[end] for end in (0, -1) if moments[end])
        else:
            angle, known = 0.4, notch["stiffness"]
            stiffness = known[7 if len(known) == 36 else 1]
        angle = min(angle, math.radians(notch.get("closing_angle_deg", 60.0)))
        lever = outer * 0.8 + abs(notch.get("axis_offset", 0.0))
        # A tendon has no length left where the edges of its channel meet.
        return stiffness, 0.7 * min(angle, notch["length"] / lever), lever
    if notch["kind"] == "rod":
        fibre, length = notch["diameter"] / 2, notch["length"]
        second = math.pi / 4 * (fibre**4 - (notch.get("inner_diameter", 0.0) / 2) ** 4)
        angle, lever = min(0.4 * length / outer, 0.5, 0.1 * length / fibre), 0.7 * outer
    elif notch["kind"] == "arc":
        left = section_of(notch["cut"], outer, inner, notch["depth"])
        length, second, fibre = notch["height"], left.weak, left.spine
        angle = min(length / (outer + left.centroid), 0.8)
        lever = outer * 0.9 + left.centroid
    else:
        fibre = notch["strip_thickness"] / 2
        second = (notch.get("wall_width") or 2 * (outer - inner)) * 2 * fibre**3 / 3
        length = strip_length(notch, tube)
        if notch["kind"] == "strip":
            angle, lever = min(notch["height"] / (2 * outer), 0.5), 0.5 * length
        else:
            angle, lever = min(notch["slot_radius"] / outer, 0.3), 0.8 * outer
        angle = min(angle, 0.9 * kink(material)[0] * length / fibre)
    modulus = elastic_modulus(material) * softened(material, angle * fibre / length)
    return modulus * second / length, angle, lever


def draw_course(random: np.random.Generator, steps: int, both_signs: bool) -> np.ndarray:
    """Return the course of one command over the steps, of the size of 1."""
    names = ["ramp", "loop", "partial", "walk", "jump", "hold"]
    name = str(random.choice(names, p=[0.2, 0.25, 0.2, 0.2, 0.1, 0.05]))
    part = np.linspace(0, 1, steps)
    if name == "ramp":
        course = part
    elif name == "loop":
        course = 1 - np.abs(2 * part - 1)
    elif name == "partial":
        turns = np.concatenate([[0.0, 1.0], random.uniform(0, 1, 3)])
        course = np.interp(part * 4, np.arange(5), turns)
    elif name == "walk":
        course = np.cumsum(random.normal(0, 0.3, steps))
        course = course if both_signs else np.abs(course)
    elif name == "jump":
        course = np.where(random.random(steps) < 0.5, random.uniform(0, 1, steps), 0.0)
    else:
        course = np.ones(steps)
    if both_signs and random.random() < 0.3:
        course = -course
    return course


def sizes_of(robot: Table, planar: bool) -> tuple[float, float]:
    """Return moment (N mm) and force (N) that are large for a robot."""
    rows = [reference(robot, notch) for notch in robot["notch"]]
    moments = [stiff * angle for stiff, angle, _ in rows]
    for notch in robot["notch"]:
        if notch["kind"] == "arc" and not planar:  # open sections twist before they bend
            tube, material = (notch.get(key, robot[key]) for key in ("tube", "material"))
            radii = tube["outer_diameter"] / 2, tube["inner_diameter"] / 2
            left = section_of(notch["cut"], *radii, notch["depth"])
            shear = elastic_modulus(material) / (2.0 + 2.0 * material.get("poisson_ratio", 0.3))
            moments.append(_TWISTED * shear * left.torsion / notch["height"])
    moment = min(moments)
    length = robot["tube"]["base_length"] + robot["tube"]["outer_diameter"] * 0.5
    for notch in robot["notch"]:
        piece = notch.get("length", notch.get("height", 2 * notch.get("slot_radius", 0.0)))
        piece += notch["uncut_length"]
        length += notch["repeat"] * (piece + notch.get("strip_thickness", 0.0))
    # A column held at its base buckles under pi**2 / 4 of the stiffness of all notches together.
    soft = sum(notch["repeat"] / row[0] for notch, row in zip(robot["notch"], rows, strict=True))
    return moment, min(moment, _COLUMN / soft) / length


def heaviest(robot: Table, length: float) -> float:
    """Return the mass of a robot (g) with its disks, as if it were full and of its densest part."""
    parts = (robot["material"], *(notch.get("material", {}) for notch in robot["notch"]))
    density = max(part.get("density") or 0.0 for part in parts)
    radius = robot["tube"]["outer_diameter"] / 2.0
    disks = sum(notch["repeat"] * notch.get("disk_mass", 0.0) for notch in robot["notch"])
    return 1e-6 * density * math.pi * radius**2 * length + disks


@dataclass(frozen=True)
class Frame:
    """What histories of one form share: another one would ask for another program."""

    steps: int
    commands: tuple[str, ...]
    outside: tuple[str, ...]
    following: bool


def draw_frame(random: np.random.Generator, tendons: int) -> Frame:
    """Return how many steps, what tendons are told, and which loads act from outside."""
    steps = int(random.choice([2, 5, 9, 15, 25], p=[0.1, 0.2, 0.3, 0.3, 0.1]))
    commands = ["tension", "stroke", "both", "slack"]
    first = str(random.choice(commands[:3], p=[0.55, 0.35, 0.1]))
    others = random.choice(commands, size=tendons - 1, p=[0.4, 0.23, 0.07, 0.3])
    kinds = ["tip_force", "tip_moment", "tip_mass", "gravity", "body_forces", "base_rotation"]
    count = int(random.integers(1, 4)) if random.random() < 0.55 else 0
    outside = random.choice(kinds, size=count, replace=False)
    following = bool(random.random() < 0.3)
    return Frame(steps, (first, *map(str, others)), tuple(map(str, outside)), following)


def within_ball(random: np.random.Generator, axes: np.ndarray) -> np.ndarray:
    """Return a random vector, along some of the axes, that is not longer than 1."""
    vector = axes * random.normal(size=3)
    return vector / max(1.0, float(np.linalg.norm(vector)))


def draw_outside(random: np.random.Generator, robot: Table, planar: bool, frame: Frame) -> Table:
    """Return external loads at their full size."""
    moment, force = sizes_of(robot, planar)
    size = between_decades(random, 0.05, 1.0) / len(frame.outside)
    flat = np.array([1.0, 0.0, 1.0]) if planar else np.ones(3)
    turn = np.array([0.0, 1.0, 0.0]) if planar else np.ones(3)
    radius = robot["tube"]["outer_diameter"] / 2
    bodies = sum(notch["repeat"] for notch in robot["notch"])
    load: Table = {}
    for what in frame.outside:
        if what == "tip_force":
            load["tip_force"] = size * force * within_ball(random, flat)
            if random.random() < 0.3:
                load["tip_point"] = flat * random.uniform(-1, 1, 3) * radius
        elif what == "tip_moment":
            load["tip_moment"] = size * moment * within_ball(random, turn)
        elif what == "tip_mass":
            load["tip_mass"] = size * force * 100
        elif what == "gravity":
            weight = 1e-3 * 9.81 * heaviest(robot, moment / force)
            light = min(1.0, size * force / max(weight, 1e-300))
            load["gravity"] = light * 9.81 * within_ball(random, flat)
        elif what == "base_rotation":
            load["base_rotation"] = turn * random.uniform(-1, 1, 3) * 3.0
        else:
            count = 1 + frame.steps % 2
            load["body_forces"] = [
                {
                    "body": int(random.integers(0, bodies + 1)),
                    "force": size * force * 0.5 / count * within_ball(random, flat),
                    "moment": size * moment * 0.5 / count * within_ball(random, turn),
                    "point": flat * random.uniform(-1, 1, 3) * radius,
                    "following": frame.following,
                }
                for _ in range(count)
            ]
    heavy = robot["material"].get("density") is not None or "tip_mass" in load
    if "gravity" in load and not heavy:
        del load["gravity"]  # nothing to act on, which is refused
    load["following"] = frame.following
    return load


def scaled(load: Table, factor: float) -> Table:
    """Return external loads with forces and moments times a factor; a mass stays."""
    load = dict(load)
    for key in ("tip_force", "tip_moment"):
        if key in load:
            load[key] = load[key] * factor
    if "body_forces" in load:
        load["body_forces"] = [
            part | {"force": part["force"] * factor, "moment": part["moment"] * factor}
            for part in load["body_forces"]
        ]
    return load


def draw_history(
    random: np.random.Generator,
    robot: Table,
    planar: bool,
    frame: Frame,
) -> list[Table]:
    """Return the loads, step by step."""
    steps, tendons = frame.steps, len(robot["tendon"])
    size = between_decades(random, 0.02, 3.0)
    if random.random() < 0.04:
        size *= float(10 ** random.uniform(2, 6))
    most = most_tension(robot, planar)
    told: Table = {
        "tension": np.full((steps, tendons), np.nan),
        "stroke": np.full((steps, tendons), np.nan),
    }
    for tendon, kind in enumerate(frame.commands):
        if kind == "slack":
            continue
        course = draw_course(random, steps, both_signs=kind == "stroke" and tendon > 0)
        pulled = np.minimum(size * tension_scale(robot, planar) * course, most)
        longest = 0.9 * most_stroke(robot, most, robot["tendon"][tendon])
        drawn = min(size, 1.0) * longest * np.clip(course, -1.0, 1.0)
        change = int(random.integers(1, steps)) if kind == "both" else steps * (kind == "tension")
        told["tension"][:change, tendon] = pulled[:change]
        told["stroke"][change:, tendon] = drawn[change:]
    # two strokes that work against each other agree, mostly: nothing stretches where they do not
    both = tendons > 1 and not np.isnan(told["stroke"][:, :2]).any()
    if both and random.random() < 0.85:
        told["stroke"][:, 1] = -random.choice([1.0, 1.1, 0.7]) * told["stroke"][:, 0]
    outside: Table = {}
    if frame.outside:
        outside = draw_outside(random, robot, planar, frame)
    changes = random.random() < 0.5
    course = draw_course(random, steps, both_signs=True) if changes else np.ones(steps)
    course = np.clip(course, -1.0, 1.0)
    return [
        {key: [None if np.isnan(x) else float(x) for x in told[key][step]] for key in told}
        | scaled(outside, float(course[step]))
        for step in range(steps)
    ]


def tables_of(seed: int, number: int) -> tuple[Table, list[Table], str]:
    """Return robot and loads of draw `number` of a seed, and the name of their form."""
    of_form = np.random.default_rng([seed, number // VARIANTS, 0])
    random = np.random.default_rng([seed, number, 2])
    planar = bool(of_form.random() < 0.55)
    tube = draw_tube(of_form)
    robot: Table = {"name": f"draw {seed}-{number}", "tube": tube}
    robot["notch"] = draw_notches(of_form, tube, planar)
    from_drawing = bool(of_form.random() < 0.5)
    if from_drawing:
        as_drawn(of_form, robot["notch"], tube)
    robot["material"] = draw_material(of_form, from_drawing)
    mixed = np.random.default_rng([seed, number // VARIANTS, 6])
    mix_notches(
        mixed,
        robot,
        planar,
        lambda robot, notch: reference(robot, notch)[0],
        lambda: draw_material(mixed, from_drawing),
    )
    robot["friction"] = draw_friction(of_form)
    robot["tendon"] = draw_tendons(of_form, robot, planar)
    mix_others(mixed, robot, planar, tension_scale(robot, planar), sizes_of(robot, planar)[1])
    frame = draw_frame(of_form, len(robot["tendon"]))
    if number % VARIANTS:
        varied(random, robot)
    kinds = "+".join(sorted({notch["kind"] for notch in robot["notch"]}))
    form = f"{kinds} {'planar' if planar else 'spatial'} {robot['material']['kind']}"
    form += " elastic ends" if from_drawing else ""
    form += "".join(f" {word}" for word in mixed_words(robot))
    history = draw_history(random, robot, planar, frame)
    most = most_tension(robot, planar)
    stroke = min(most_stroke(robot, most, tendon) for tendon in robot["tendon"][:2])
    mix_loads(mixed, random, robot, history, stroke)
    return robot, history, form


def mixed_words(robot: Table) -> Iterator[str]:
    """Yield words for what is mixed into a robot."""
    notches, tendons = robot["notch"], robot["tendon"]
    if any({"tube", "material"} & notch.keys() for notch in notches):
        yield "sections"
    if any({"disk_radius", "disk_direction_deg"} & tendon.keys() for tendon in tendons):
        yield "holes"
    if any("sheath_length" in tendon for tendon in tendons):
        yield "sheaths"
    if "drive" in robot:
        yield "spool"
    if any("reference_temperature" in part for part in parts_of(robot)):
        yield "warm"
    if "fatigue" in robot:
        yield "fatigue"


def draw(seed: int, number: int) -> Draw:
    """Draw one robot with loads.

    Raises:
        InputError: The library does not take what was drawn.
    """
    table, loads, form = tables_of(seed, number)
    robot = make_robot(table)
    return Draw(seed, number, form, robot, make_loads(loads, robot))


def make_robot(table: Table) -> nf.Robot:
    """Return the robot of a table."""
    return nf.Robot(
        name=table["name"],
        tube=nf.Tube(**table["tube"]),
        notch=tuple(NOTCHES[notch["kind"]](**own_parts(notch)) for notch in table["notch"]),
        tendon=tuple(nf.Tendon(**tendon) for tendon in table["tendon"]),
        material=MATERIALS[table["material"]["kind"]](**table["material"]),
        friction=FRICTIONS[table["friction"]["kind"]](**table["friction"]),
        fatigue=Fatigue(**table.get("fatigue", {})),
        drive=tuple(Drive(**drive) for drive in table.get("drive", ())),
    )


def own_parts(notch: Table) -> Table:
    """Return a notch with the tube and the material of its tables."""
    made = dict(notch)
    if "tube" in notch:
        made["tube"] = nf.Tube(**notch["tube"])
    if "material" in notch:
        made["material"] = MATERIALS[notch["material"]["kind"]](**notch["material"])
    return made


def make_loads(rows: list[Table], robot: nf.Robot | None = None) -> tuple[nf.Load, ...]:
    """Return the loads of tables; spools turn those of a robot."""
    loads, turned = [], None
    if robot is not None and "spool" in rows[0]:
        # Its first step is the pretension.
        turned = nf.spool_path(robot, [row["spool"] for row in rows]).stroke[1:]
    for step, row in enumerate(rows):
        forces = [nf.BodyForce(**force) for force in row.get("body_forces", [])]
        keys = {key: value for key, value in row.items() if key != "spool"} | {
            "body_forces": forces
        }
        if turned is not None:
            for drive in robot.drive:
                for tendon in (drive.tendon - 1, drive.antagonist - 1):
                    keys["tension"][tendon] = None
                    keys["stroke"][tendon] = float(turned[step, tendon])
        loads.append(nf.Load(**keys))
    return tuple(loads)
