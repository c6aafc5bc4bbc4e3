"""A draw, states near its last one, and the same draw in other guises."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import notchflex as nf

LENGTHS = [
    "outer_diameter",
    "inner_diameter",
    "base_length",
    "height",
    "uncut_length",
    "depth",
    "strip_thickness",
    "strip_length",
    "wall_width",
    "slot_radius",
    "radius",
    "free_length",
    "length",
    "diameter",
    "axis_offset",
    "disk_radius",
    "sheath_length",
    "backlash",
    "corner_radius",
]
FORCES = ["axial_stiffness", "sheath_wire_stiffness", "sheath_stiffness", "pretension"]
POWERS = dict.fromkeys(LENGTHS, 1) | dict.fromkeys(FORCES, 2) | {"moment": 3, "disk_mass": 3}
"""By which power of its size the numbers of a robot grow while stresses stay."""
NEAR = 1e-4  # of the size of loads: how far a neighbouring state is
ROUNDING = 1e-13


class Draw(NamedTuple):
    """One robot and the loads that follow one another on it."""

    seed: int
    number: int
    form: str
    robot: nf.Robot
    loads: tuple[nf.Load, ...]


class Guise(NamedTuple):
    """The same draw seen otherwise: its places are `mapped` and then larger by a factor."""

    draw: Draw
    mapped: np.ndarray = np.eye(3)
    factor: float = 1.0


def with_neighbours(draw: Draw) -> list[nf.Load]:
    """Return the loads with the last one held, two near it, and the last one again."""
    random = np.random.default_rng([draw.seed, draw.number, 1])
    last = near = draw.loads[-1]
    loads = [*draw.loads, last]
    for _ in range(2):
        near = _shifted(near, draw, random)
        loads.append(near)
    return [*loads, last]


def _shifted(load: nf.Load, draw: Draw, random: np.random.Generator) -> nf.Load:
    changed: dict[str, Any] = {}
    tendons = draw.robot.number_of_tendons
    for name in ("tension", "stroke"):
        commands = [one.per_tendon(name, tendons) for one in draw.loads]
        size = max((abs(x) for row in commands for x in row if x is not None), default=0.0)
        changed[name] = [
            None if x is None else x + NEAR * size * random.uniform(0.3, 1.0)
            for x in load.per_tendon(name, tendons)
        ]
    for name in ("tip_force", "tip_moment"):
        vector = np.array(getattr(load, name))
        flat = vector != 0.0  # what is planar stays so
        changed[name] = vector + NEAR * np.abs(vector).max() * flat * random.normal(size=3)
    changed["body_forces"] = [
        replace(one, force=np.multiply(one.force, 1.0 + NEAR * random.normal()))
        for one in load.body_forces
    ]
    return replace(load, **changed)


def guise_of(name: str, draw: Draw, random: np.random.Generator) -> Guise:
    """Return a draw turned about the axis, mirrored, enlarged, or pulled by rounding more."""
    if name == "enlarged":
        factor = float(random.choice([0.1, 0.5, 3.0, 10.0]))
        return Guise(_enlarged(draw, factor), factor=factor)
    if name == "turned":
        angle = float(random.choice([90.0, 180.0, 37.0]))
        turn = Rotation.from_euler("z", angle, degrees=True).as_matrix()
        return Guise(_mapped(draw, turn, lambda side: side + angle), turn)
    if name == "mirrored":
        mirror = np.diag([-1.0, 1.0, 1.0])
        return Guise(_mapped(draw, mirror, lambda side: 180.0 - side), mirror)
    factor = 1.0 + float(random.choice([-1.0, 1.0])) * ROUNDING
    loads = [_commanded(load, draw, factor, factor) for load in draw.loads]
    return Guise(draw._replace(loads=tuple(loads)))


def enlarged(stiffness: Sequence[float], factor: float) -> np.ndarray:
    """Return the stiffness of a table, 6 numbers or 36, that is larger by a factor of lengths."""
    power = np.array([1.5, 1.5, 1.5, 0.5, 0.5, 0.5])
    if len(stiffness) == 36:
        return np.multiply(stiffness, factor ** np.add.outer(power, power).ravel())
    return np.multiply(stiffness, factor ** (2.0 * power))


def _mapped(draw: Draw, polar: np.ndarray, side: Callable[[float], float]) -> Draw:
    """Map all vectors: of forces as polar ones, of moments and turns as axial ones."""
    axial = np.linalg.det(polar) * polar
    kinds = {"force": polar, "point": polar, "moment": axial}
    kinds |= {"tip_force": polar, "tip_point": polar, "gravity": polar}
    kinds |= {"tip_moment": axial, "base_rotation": axial}

    def mapped(part: Any) -> Any:
        values = {name: getattr(part, name, None) for name in kinds}
        return replace(part, **{k: kinds[k] @ v for k, v in values.items() if v is not None})

    def turned(part: Any) -> Any:
        changed: dict[str, Any] = {"direction_deg": side(part.direction_deg)}
        if sides := getattr(part, "disk_direction_deg", None):
            changed["disk_direction_deg"] = tuple(map(side, sides))
        numbers = getattr(part, "stiffness", None)
        if numbers and len(numbers) == 36 and np.linalg.det(polar) < 0.0:
            # In the frame of the notch y is mirrored: turns about x and z, and moves along y.
            sign = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
            changed["stiffness"] = tuple(np.multiply(numbers, np.outer(sign, sign).ravel()))
        return replace(part, **changed)

    notches, tendons = (
        tuple(map(turned, parts)) for parts in (draw.robot.notch, draw.robot.tendon)
    )
    loads = tuple(
        replace(mapped(load), body_forces=[mapped(one) for one in load.body_forces])
        for load in draw.loads
    )
    return draw._replace(robot=replace(draw.robot, notch=notches, tendon=tendons), loads=loads)


def _enlarged(draw: Draw, factor: float) -> Draw:
    """Enlarge lengths by a factor and forces by its square: stresses stay."""
    powers = {"tip_force": 2, "tip_moment": 3, "tip_mass": 3, "tip_point": 1, "gravity": -1}
    powers |= {"force": 2, "point": 1, **POWERS}

    def larger(part: Any, **other: Any) -> Any:
        values = {one.name: getattr(part, one.name) for one in fields(part)} | other
        changed = {
            name: np.multiply(value, factor ** powers[name]).tolist()
            for name, value in values.items()
            if name in powers and value is not None
        }
        if values.get("stiffness"):
            changed["stiffness"] = enlarged(values["stiffness"], factor).tolist()
        if values.get("tube"):
            changed["tube"] = larger(values["tube"])
        return replace(part, **changed)

    def of_load(load: nf.Load) -> nf.Load:
        # The weight of a tip mass counts; where gravity is not told it stays.
        mass = load.tip_mass / factor if load.gravity is None else load.tip_mass
        forces = [larger(one) for one in load.body_forces]
        made = replace(larger(load, tip_mass=mass), body_forces=forces)
        return _commanded(made, draw, factor**2, factor)

    robot = draw.robot
    several = ("notch", "tendon", "drive")
    parts = {name: tuple(map(larger, getattr(robot, name))) for name in several}
    robot = replace(robot, tube=larger(robot.tube), fatigue=larger(robot.fatigue), **parts)
    return draw._replace(robot=robot, loads=tuple(map(of_load, draw.loads)))


def _commanded(load: nf.Load, draw: Draw, tension: float, stroke: float) -> nf.Load:
    """Return a load with tensions and strokes times factors."""
    changed = {
        name: [
            None if value is None else factor * value
            for value in load.per_tendon(name, draw.robot.number_of_tendons)
        ]
        for name, factor in (("tension", tension), ("stroke", stroke))
    }
    return replace(load, **changed)
