"""Tolerances that are assumed where the robot file gives none."""

from __future__ import annotations

import math
from collections.abc import Iterator

from notchflex.errors import InputError
from notchflex.robot import Nitinol, Robot
from notchflex.robot.fields import fields_of
from notchflex.robot.tolerance import Tolerance
from notchflex.robot.value_names import numbers_at

CUT, CUT_OF_DIAMETER = 0.010, 0.005
"""Standard deviation of what is cut [mm], and at least this part of the outer diameter."""
WALL, WALL_OF_DIAMETER = 0.006, 0.003
"""The same for the wall of the tube [mm]."""

# Nitinol of an unknown tube: lower, usual and upper value, in proportion to the value of the file.
# Data sheets of tubing: austenite of 40 to 65 GPa and, partly R-phase, from 30; upper plateau 250
# to 520 MPa at room temperature; the slope of the plateau as tubes of publications have it.
_NITINOL = {
    "elastic_modulus": (30e3, 42e3, 65e3),
    "plateau_stress": (250.0, 350.0, 520.0),
    "plateau_modulus": (2e3, 6e3, 9e3),
}
_MODULUS = (0.9, 1.0, 1.1)
# Friction belongs to the set-up: pulls of one wrist on different days differed three- to fourfold.
# Normal about the file's value, so that the prediction keeps its middle, and cut off at a quarter
# of it and at four times.
_FRICTION = Tolerance("friction.coefficient", sd="60 %", plus="300 %", minus="75 %")
# Where in the lumen a tendon runs is seldom known: York's is read as 0.43 or 0.38 mm.
_RADIUS = Tolerance("tendon.radius", sd="6 %", plus="12 %", minus="12 %")

# Error of the law of fibres: moments of yielding notches with hardening by finite elements.
_LAW_OF_FIBRES = 0.034

# Of no effect before a notch is destroyed.
_LEFT_OUT = ("plastic_modulus",)


def tolerances_of(robot: Robot) -> tuple[tuple[Tolerance, ...], tuple[str, ...]]:
    """Return the tolerances of a robot, those that its file lacks assumed.

    Returns:
        The tolerances, and the names of the values whose tolerance is assumed.

    Example:
        >>> from notchflex import load_robot
        >>> wrist = load_robot("pacheco2021-a").replace(tolerance={"notch.depth": 0.005})
        >>> tolerances_of(wrist)[1][0]
        'notch.height'
    """
    given = {one.value: one for one in robot.tolerance}
    assumed = {one.value: one for one in _assumed(robot) if one.value not in given}
    return (*given.values(), *assumed.values()), tuple(assumed)


def _assumed(robot: Robot) -> Iterator[Tolerance]:
    diameter = robot.tube.outer_diameter
    cut = _rounded(max(CUT, CUT_OF_DIAMETER * diameter))
    cuts = [
        name
        for notch in robot.notch
        for name, field in fields_of(type(notch)).items()
        if (field.json_schema_extra or {}).get("unit") == "mm" and name != "uncut_length"
    ]
    for name in dict.fromkeys(cuts):
        if _is_number(robot, f"notch.{name}"):
            yield Tolerance(f"notch.{name}", sd=cut)
    wall = max(WALL, WALL_OF_DIAMETER * diameter)
    yield Tolerance("tube.inner_diameter", sd=_rounded(2.0 * wall))
    material = robot.material
    nitinol = isinstance(material, Nitinol)
    for name, field in fields_of(type(material)).items():
        is_modulus = (field.json_schema_extra or {}).get("unit") == "MPa"
        if is_modulus and name not in _LEFT_OUT and _is_number(robot, f"material.{name}"):
            limits = _NITINOL.get(name, _MODULUS) if nitinol else _MODULUS
            yield _between(f"material.{name}", *limits)
    if _is_number(robot, "friction.coefficient"):
        yield _FRICTION
    yield from _tendon_radius(robot)
    yield from _law(robot)


def _tendon_radius(robot: Robot) -> Iterator[Tolerance]:
    inner, tendons = 0.5 * robot.tube.inner_diameter, robot.tendon
    play = inner - max(tendon.radius + 0.5 * (tendon.diameter or 0.0) for tendon in tendons)
    if play >= 0.0 and all(tendon.diameter for tendon in tendons):
        play = _rounded(min(play, 0.5 * min(tendon.radius for tendon in tendons)))
        yield Tolerance("tendon.radius", plus=play, minus=play)
    elif play >= 0.0:
        yield _RADIUS


def _law(robot: Robot) -> Iterator[Tolerance]:
    """Yield the error of the law of notches with elastic ends, larger for the last notch.

    Papers' laws of rigid ends come with constants that were fitted by them, error included.
    """
    notches = robot.notches
    all_of_them = max(notch.law_errors[0] for notch in notches)
    last = notches[-1].law_errors[1]
    names = ("notch", all_of_them), (f"notch[{len(notches)}]", last)
    for name, error in names if all_of_them != last else names[:1]:
        if error:
            both = math.hypot(error, _LAW_OF_FIBRES * robot.material.by_fibres)
            yield Tolerance(f"{name}.stiffness_factor", sd=f"{100 * both:.2g} %")


def _rounded(size: float) -> float:
    return float(f"{size:.2g}")


def _between(name: str, lower: float, usual: float, upper: float) -> Tolerance:
    plus, minus = upper / usual - 1.0, 1.0 - lower / usual
    return Tolerance(name, plus=f"{100 * plus:.3g} %", minus=f"{100 * minus:.3g} %")


def _is_number(robot: Robot, path: str) -> bool:
    try:
        return any(numbers_at(robot, path).values())
    except InputError:
        return False
