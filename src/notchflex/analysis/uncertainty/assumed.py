"""Tolerances that are assumed where the robot file gives none."""

from __future__ import annotations

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
_NITINOL = {
    "elastic_modulus": (30e3, 42e3, 57e3),
    "plateau_stress": (260.0, 350.0, 460.0),
    "plateau_modulus": (3e3, 6e3, 9e3),
}
_NITINOL_FRICTION = (0.13, 0.18, 0.19)
_MODULUS, _FRICTION = (0.9, 1.0, 1.1), (0.8, 1.0, 1.2)

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
        limits = _NITINOL_FRICTION if nitinol else _FRICTION
        yield _between("friction.coefficient", *limits)


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
