"""Parts that are mixed into random robots: disks, tables, own sections, sheaths, temperatures.

`mix_notches` changes the notches that were drawn, before tendons are; `mix_others` adds what the
robot has beside them; `mix_loads` adds what a load path may change of them. A part has the keys of
robot files. Each is there in some forms and not in others, so that any may meet any.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Table = dict[str, Any]
COLDEST, _WARMEST = -20.0, 60.0
"""Temperatures, °C."""
_MOST_GAPS = 12
# A table ends beyond the angle at which it closes, mostly: beyond its ends nothing is computed.
_CLOSES = 0.9
# Half a turn, deg: the free backbone of a row of gaps does not meet itself.
_FREE_BEND = 180.0


def mix_notches(
    random: np.random.Generator,
    robot: Table,
    planar: bool,
    stiffness: Callable[[Table, Table], float],
    material: Callable[[], Table],
) -> None:
    """Put disks and tables among the notches, or in their place, and give some own tubes.

    Args:
        random: Where numbers are from.
        robot: Tube, notches and material; changed.
        planar: Whether it stays in a plane.
        stiffness: Of a notch of the robot, N mm; parts have about that of the notches.
        material: Draws another material.
    """
    notches: list[Table] = robot["notch"]
    usual = float(np.median([stiffness(robot, notch) for notch in notches]))
    kind = str(
        random.choice(["disks", "shaft", "tables", "between", "none"], p=[0.3, 0.2, 0.2, 0.1, 0.2])
    )
    if kind == "disks":
        size = usual * _decades(random, 0.3, 30.0)
        notches[:] = [
            _gap(random, robot, planar, size * _decades(random, 0.5, 2.0), material)
            for _ in range(int(random.choice([1, 2, 3], p=[0.6, 0.25, 0.15])))
        ]
        rows = random.multinomial(
            int(random.integers(len(notches), 21)), [1 / len(notches)] * len(notches)
        )
        for notch, repeat in zip(notches, rows, strict=True):
            notch["repeat"] = max(1, int(repeat))
    elif kind == "shaft":
        size = usual * _decades(random, 0.5, 30.0)
        gap = _gap(random, robot, planar, size, material)
        notches.insert(0, gap | {"repeat": int(random.integers(1, _MOST_GAPS + 1))})
    elif kind == "tables":
        size = usual * _decades(random, 0.1, 10.0)
        notches[:] = [
            _joint(random, robot, planar, size) | {"repeat": int(random.integers(1, 5))}
            for _ in range(int(random.integers(1, 4)))
        ]
    elif kind == "between":
        notches.insert(0, _joint(random, robot, planar, usual * _decades(random, 0.3, 10.0)))
        if random.random() < 0.5:
            notches.append(_joint(random, robot, planar, usual * _decades(random, 0.3, 3.0)))
        if random.random() < 0.3:
            gap = _gap(random, robot, planar, usual * _decades(random, 0.5, 30.0), material)
            notches.append(gap)
    for notch in notches:
        if notch["kind"] == "rod" and "precurvature_deg" in notch:
            most = _FREE_BEND / notch["repeat"]
            notch["precurvature_deg"] = float(np.clip(notch["precurvature_deg"], -most, most))
    if random.random() < 0.35:
        _own_parts(random, robot, material)


def _decades(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _side(random: np.random.Generator, planar: bool) -> float:
    return float(random.choice([0.0, 180.0]) if planar else random.uniform(-180.0, 180.0))


def _gap(
    random: np.random.Generator,
    robot: Table,
    planar: bool,
    stiffness: float,
    material: Callable[[], Table],
) -> Table:
    """Return a gap of backbone between disks, of about a bending stiffness (N mm)."""
    tube = robot["tube"]
    outer = tube["outer_diameter"]
    diameter = tube["inner_diameter"] * random.uniform(0.05, 0.9)
    gap: Table = {
        "kind": "rod",
        "repeat": 1,
        "length": max(outer, 2.0 * diameter) * random.uniform(0.3, 3.0),
        "diameter": diameter,
        "uncut_length": 0.0 if random.random() < 0.2 else outer * random.uniform(0.01, 1.0),
        "direction_deg": _side(random, planar) if random.random() < 0.5 else 0.0,
    }
    if random.random() < 0.3:
        gap["inner_diameter"] = diameter * random.uniform(0.2, 0.95)
    second = math.pi / 64.0 * (diameter**4 - gap.get("inner_diameter", 0.0) ** 4)
    modulus = stiffness * gap["length"] / second
    if random.random() < 0.25:
        gap["precurvature_deg"] = float(random.uniform(-25.0, 25.0))
    # Out of the plane of a gap only linear ones are let.
    curved = planar and random.random() < 0.4
    own = material() if curved else {"kind": "linear", "elastic_modulus": modulus}
    factor = modulus / _modulus(own)
    for key, value in own.items():
        if key.endswith(("modulus", "stress")):
            own[key] = np.multiply(value, factor).tolist()
    gap["material"] = _as_dense(random, own, robot)
    return gap


def _modulus(material: Table) -> float:
    if material["kind"] == "stress-strain":
        return material["stress"][0] / material["strain"][0]
    return material["elastic_modulus"]


def _as_dense(random: np.random.Generator, own: Table, robot: Table) -> Table:
    """Give a density to an own material where the robot's has one, and none where it has none."""
    own.pop("density", None)
    if robot["material"].get("density") is not None:
        own["density"] = _decades(random, 500.0, 10_000.0)
    return own


def _joint(random: np.random.Generator, robot: Table, planar: bool, stiffness: float) -> Table:
    """Return a flexure given by numbers, of about a bending stiffness (N mm)."""
    outer = robot["tube"]["outer_diameter"]
    length = outer * random.uniform(0.1, 2.0)
    joint: Table = {
        "kind": "table",
        "repeat": 1,
        "length": length,
        "uncut_length": 0.0 if random.random() < 0.2 else outer * random.uniform(0.05, 2.0),
        "direction_deg": _side(random, planar) if random.random() < 0.5 else 0.0,
    }
    if random.random() < 0.4:
        joint["axis_offset"] = 0.5 * outer * random.uniform(-0.9, 0.9)
    if random.random() < 0.3:
        joint["precurvature_deg"] = float(random.uniform(-10.0, 10.0))
    along = stiffness / length**2 * _decades(random, 1.0, 1e3)
    six = stiffness * np.array([_decades(random, 0.5, 50.0), 1.0, _decades(random, 0.3, 30.0)])
    six = np.append(
        six, along * np.array([1.0, _decades(random, 0.3, 3.0), _decades(random, 1.0, 30.0)])
    )
    most = 170.0
    if random.random() < 0.65:
        most = float(random.uniform(12.0, 60.0))
        joint |= _curve(random, stiffness, most)
        if random.random() < 0.5:
            six[random.random(6) < 0.35] = np.inf
            joint["stiffness"] = six.tolist()
    elif random.random() < 0.5:
        six[np.array([True, False, True, True, True, True]) & (random.random(6) < 0.35)] = np.inf
        joint["stiffness"] = six.tolist()
    else:
        coupled = random.uniform(-0.15, 0.15, (6, 6))
        coupled = coupled + coupled.T + np.eye(6)
        if planar:
            coupled *= (np.arange(6)[:, None] + np.arange(6)) % 2 == 0
        size = np.sqrt(six)
        joint["stiffness"] = (size[:, None] * coupled * size).ravel().tolist()
    if most < 100.0 or random.random() < 0.7:
        joint["closing_angle_deg"] = min(most, 60.0) * random.uniform(0.5, _CLOSES)
    return joint


def _curve(random: np.random.Generator, stiffness: float, most: float) -> Table:
    """Return a curve of moment over angle up to an angle, deg, on one side or on both."""

    def side() -> tuple[np.ndarray, np.ndarray]:
        steps = random.uniform(0.3, 1.0, int(random.integers(1, 6)))
        slopes = stiffness * np.exp(random.uniform(np.log(0.2), np.log(3.0), len(steps)))
        slopes[1:][random.random(len(steps) - 1) < 0.1] = 0.0  # a plateau
        steps *= most / steps.sum()
        return np.cumsum(steps), np.cumsum(np.radians(steps) * slopes)

    angles, moments = side()
    if random.random() < 0.4:
        others, backs = side()
        angles = np.concatenate([-others[::-1], [0.0], angles])
        moments = np.concatenate([-backs[::-1], [0.0], moments])
    return {"angle_deg": angles.tolist(), "moment": moments.tolist()}


def _own_parts(random: np.random.Generator, robot: Table, material: Callable[[], Table]) -> None:
    """Give the last arc notches a tube and a material of their own."""
    outer = robot["tube"]["outer_diameter"]
    first = int(random.integers(0, len(robot["notch"])))
    wider = random.uniform(0.97, 1.4) if random.random() < 0.6 else None
    own = _as_dense(random, material(), robot) if random.random() < 0.7 else None
    for notch in robot["notch"][first:]:
        if wider is not None and notch["kind"] in ("arc", "table", "rod"):
            inner = outer * wider * random.uniform(0.6, 0.9)
            inner = max(inner, notch.get("diameter", 0.0) * 1.1)
            notch["tube"] = {"outer_diameter": outer * wider, "inner_diameter": inner}
        if wider is not None and notch["kind"] == "arc":
            notch["depth"] *= wider
        if own is not None and notch["kind"] == "arc":
            notch["material"] = dict(own)


def mix_others(
    random: np.random.Generator, robot: Table, planar: bool, tension: float, force: float
) -> None:
    """Give a robot with tendons holes in its disks, sheaths, a spool, a temperature and a line.

    Args:
        random: Where numbers are from.
        robot: The robot; changed.
        planar: Whether it stays in a plane.
        tension: A tension that bends it far, N.
        force: A force on its tip that does, N.
    """
    _holes(random, robot, planar)
    # Wires are stretched by a three-thousandth at least: of a stiffer one in a sheath, drawn by a
    # stroke, rounding decides the tension.
    outer, elastic = robot["tube"]["outer_diameter"], tension * _decades(random, 10.0, 3e3)
    if random.random() < 0.4:
        every = random.random() < 0.6
        for tendon in robot["tendon"]:
            if every or random.random() < 0.5:
                tendon |= _sheath(random, outer, elastic)
    # The pretension of a spool has a least value, 1e-6 N, of a robot made smaller too.
    if len(robot["tendon"]) > 1 and tension > 0.25 and random.random() < 0.4:
        for tendon in robot["tendon"][:2]:
            if "sheath_length" not in tendon:
                tendon.setdefault("axial_stiffness", elastic)
        robot["drive"] = [
            {"tendon": 1, "antagonist": 2, "pretension": tension * _decades(random, 0.01, 0.5)}
        ]
    for part in [robot, *robot["notch"]]:
        if (
            part.get("material", {}).get("kind") in ("nitinol", "superelastic")
            and random.random() < 0.6
        ):
            part["material"] |= _temperature(random, part["material"])
    for notch in robot["notch"]:
        if notch["kind"] == "rod" and random.random() < 0.4 and robot["material"].get("density"):
            weight = force / len(robot["notch"]) / notch["repeat"]
            notch["disk_mass"] = weight / 9.81e-3 * _decades(random, 0.01, 1.0)
    if random.random() < 0.5:
        robot["fatigue"] = _line(random, outer)


def _holes(random: np.random.Generator, robot: Table, planar: bool) -> None:
    """Lead tendons that end in disks through holes at other places of each."""
    kinds = [
        (notch["kind"], notch["tube"]) if "tube" in notch else (notch["kind"], robot["tube"])
        for notch in robot["notch"]
        for _ in range(notch["repeat"])
    ]
    disks = next((k for k, (kind, _) in enumerate(kinds) if kind != "rod"), len(kinds))
    for tendon in robot["tendon"] if disks else ():
        if disks < len(kinds) and random.random() < 0.5:
            tendon["end_body"] = int(random.integers(1, disks + 1))  # it ends in the shaft
        end = tendon.get("end_body", len(kinds))
        if end > disks:
            continue
        part = np.arange(1, end + 1) / end
        if random.random() < 0.5:
            widest = min(tube["outer_diameter"] for _, tube in kinds[:end]) / 2
            last = widest * random.uniform(0.3, 0.9)
            radii = tendon["radius"] + (last - tendon["radius"]) * part
            if random.random() < 0.3:
                radii = radii * random.uniform(0.8, 1.0, end)
            tendon["disk_radius"] = np.minimum(radii, 0.94 * widest).tolist()
        if not planar and random.random() < 0.5:
            turn = random.choice([1.0, -1.0]) * random.uniform(20.0, 360.0)
            sides = tendon["direction_deg"] + turn * part
            if random.random() < 0.3:
                sides = tendon["direction_deg"] + random.uniform(-40.0, 40.0, end)
            tendon["disk_direction_deg"] = sides.tolist()


def _sheath(random: np.random.Generator, outer: float, elastic: float) -> Table:
    """Return the sheath of a tendon."""
    table: Table = {
        "sheath_length": outer * _decades(random, 2.0, 500.0),
        "sheath_wire_stiffness": elastic * _decades(random, 0.3, 30.0),
    }
    if random.random() < 0.85:
        table["sheath_friction"] = float(
            random.choice([0.0, random.uniform(0.0, 0.4)], p=[0.1, 0.9])
        )
        table["sheath_bend_deg"] = float(random.uniform(0.0, 540.0))
    if random.random() < 0.4:
        table["sheath_stiffness"] = elastic * _decades(random, 1.0, 100.0)
    if random.random() < 0.4:
        table["backlash"] = outer * _decades(random, 1e-3, 0.1)
    return table


def _temperature(random: np.random.Generator, material: Table) -> Table:
    """Return temperatures of a material whose plateaus stay above 0 in the greatest cold."""
    lowest = material.get("unloading_stress") or material.get("plateau_stress")
    if lowest is None:
        lowest = material["elastic_modulus"] * material["transition_strain"]
    table: Table = {
        "reference_temperature": float(random.uniform(10.0, 40.0)),
        "plateau_slope": min(60.0, lowest / 60.0 * random.uniform(0.0, 0.95)),
    }
    if random.random() < 0.5:
        table["temperature"] = float(random.uniform(COLDEST, _WARMEST))
    return table


def _line(random: np.random.Generator, outer: float) -> Table:
    """Return a limit line of fatigue with or without what rises at corners."""
    line: Table = {"line": str(random.choice(["cao2020", "pelton2003"]))}
    if random.random() < 0.6:
        means = np.append(0.0, np.cumsum(random.uniform(0.005, 0.05, int(random.integers(1, 5)))))
        line = {"mean": means.tolist(), "amplitude": random.uniform(0.0, 0.02, len(means)).tolist()}
    corner = random.random()
    if corner < 0.3:
        line["corner_factor"] = float(random.uniform(1.0, 4.0))
    elif corner < 0.7:
        line["corner_radius"] = outer * _decades(random, 0.006, 0.1)
    return line


def mix_loads(
    form: np.random.Generator,
    random: np.random.Generator,
    robot: Table,
    loads: list[Table],
    stroke: float,
) -> None:
    """Let loads change temperature and bend of the sheaths, and spools turn.

    Args:
        form: Decides what changes; it belongs to the form.
        random: Decides how it does.
        robot: The robot.
        loads: Its loads, step by step; changed.
        stroke: A large stroke, mm.
    """
    steps = len(loads)
    warms, bends, turns = form.random(3)
    material = robot["material"]
    of_tube = [notch["kind"] != "table" and "material" not in notch for notch in robot["notch"]]
    own = any("material" in notch for notch in robot["notch"])
    if "reference_temperature" in material and any(of_tube) and not own and warms < 0.7:
        course = random.uniform(COLDEST, _WARMEST, steps)
        held = int(random.integers(0, steps))
        course[held:] = course[held]
        for load, value in zip(loads, course.tolist(), strict=True):
            load["temperature"] = value
    if any("sheath_length" in tendon for tendon in robot["tendon"]) and bends < 0.4:
        course = random.uniform(0.0, 540.0, steps)
        for load, value in zip(loads, course.tolist(), strict=True):
            load["sheath_bend_deg"] = value
    if "drive" in robot and turns < 0.7:
        size = stroke * _decades(random, 0.01, 0.9)
        course = np.clip(size * np.cumsum(random.normal(0.0, 0.4, steps)), -size, size)
        for load, way in zip(loads, course.tolist(), strict=True):
            load["spool"] = way
