"""Random histories of loads: what tendons are told, and what acts from outside meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from sections import reference

Table = dict[str, Any]


def draw_course(
    random: np.random.Generator, steps: int, both_signs: bool
) -> tuple[str, np.ndarray]:
    """Return the course of one command over the steps, of the size of 1, and its name."""
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
    return name, course


def sizes_of(robot: Table) -> tuple[float, float, float, float]:
    """Return stroke (mm), moment (N mm), force (N) and length (mm) that are large for a robot."""
    rows = [(*reference(robot, notch), notch["repeat"]) for notch in robot["notch"]]
    stroke = sum(angle * lever * count for _, angle, lever, count in rows)
    moment = min(stiff * angle for stiff, angle, _, _ in rows)
    length = robot["tube"]["base_length"] + robot["tube"]["outer_diameter"] * 0.5
    for notch in robot["notch"]:
        piece = notch.get("height", 2 * notch.get("slot_radius", 0.0)) + notch["uncut_length"]
        length += notch["repeat"] * (piece + notch.get("strip_thickness", 0.0))
    return stroke, moment, moment / length, length


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


def draw_outside(
    random: np.random.Generator, robot: Table, planar: bool, frame: Frame, marks: list[str]
) -> Table:
    """Return external loads at their full size."""
    _, moment, force, _ = sizes_of(robot)
    size = float(np.exp(random.uniform(np.log(0.01), np.log(1.0))))
    flat = np.array([1.0, 0.0, 1.0]) if planar else np.ones(3)
    turn = np.array([0.0, 1.0, 0.0]) if planar else np.ones(3)
    radius = robot["tube"]["outer_diameter"] / 2
    bodies = sum(notch["repeat"] for notch in robot["notch"])
    load: Table = {}
    for what in frame.outside:
        marks.append(what)
        if what == "tip_force":
            load["tip_force"] = size * force * flat * random.normal(size=3)
            if random.random() < 0.3:
                load["tip_point"] = flat * random.uniform(-1, 1, 3) * radius
        elif what == "tip_moment":
            load["tip_moment"] = size * moment * turn * random.normal(size=3)
        elif what == "tip_mass":
            load["tip_mass"] = size * force * 100
        elif what == "gravity":
            load["gravity"] = 9.81 * flat * random.normal(size=3)
        elif what == "base_rotation":
            load["base_rotation"] = turn * random.uniform(-1, 1, 3) * 3.0
        else:
            load["body_forces"] = [
                {
                    "body": int(random.integers(0, bodies + 1)),
                    "force": size * force * flat * random.normal(size=3),
                    "moment": size * moment * 0.5 * turn * random.normal(size=3),
                    "point": flat * random.uniform(-1, 1, 3) * radius,
                    "following": frame.following,
                }
                for _ in range(1 + frame.steps % 2)
            ]
    heavy = robot["material"].get("density") is not None or "tip_mass" in load
    if "gravity" in load and not heavy and random.random() < 0.9:
        del load["gravity"]  # nothing to act on, which is refused
    load["following"] = frame.following
    return load


def scaled(load: Table, factor: float) -> Table:
    """Return external loads with forces, moments and masses times a factor."""
    load = dict(load)
    for key in ("tip_force", "tip_moment"):
        if key in load:
            load[key] = load[key] * factor
    if "tip_mass" in load:
        load["tip_mass"] = load["tip_mass"] * abs(factor)
    if "body_forces" in load:
        load["body_forces"] = [
            one | {"force": one["force"] * factor, "moment": one["moment"] * factor}
            for one in load["body_forces"]
        ]
    return load


def draw_history(
    random: np.random.Generator,
    robot: Table,
    planar: bool,
    tension: float,
    frame: Frame,
    marks: list[str],
) -> list[Table]:
    """Return the loads, step by step."""
    steps = frame.steps
    size = float(np.exp(random.uniform(np.log(1e-3), np.log(3.0))))
    if random.random() < 0.04:
        size *= float(10 ** random.uniform(2, 6))
        marks.append("absurd")
    stroke = sizes_of(robot)[0]
    tendons = len(robot["tendon"])
    told: Table = {
        "tension": np.full((steps, tendons), np.nan),
        "stroke": np.full((steps, tendons), np.nan),
    }
    for tendon, kind in enumerate(frame.commands):
        if kind == "slack":
            continue
        name, course = draw_course(random, steps, both_signs=kind == "stroke" and tendon > 0)
        marks.append(f"{kind} {name}")
        unit = {"tension": tension, "stroke": min(size, 0.9) * stroke / size}
        if kind == "both":
            change = int(random.integers(1, steps))
            told["tension"][:change, tendon] = size * tension * course[:change]
            told["stroke"][change:, tendon] = size * unit["stroke"] * course[change:]
        else:
            told[kind][:, tendon] = size * unit[kind] * course
    # two strokes that work against each other agree, mostly: nothing stretches where they do not
    both = tendons > 1 and not np.isnan(told["stroke"][:, :2]).any()
    if both and random.random() < 0.85:
        told["stroke"][:, 1] = -random.choice([1.0, 1.1, 0.7]) * told["stroke"][:, 0]
    outside: Table = {}
    if frame.outside:
        outside = draw_outside(random, robot, planar, frame, marks)
    changes = random.random() < 0.5
    _, course = draw_course(random, steps, both_signs=True) if changes else ("", np.ones(steps))
    return [
        {key: [None if np.isnan(x) else float(x) for x in told[key][step]] for key in told}
        | scaled(outside, float(course[step]))
        for step in range(steps)
    ]
