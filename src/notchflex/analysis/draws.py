"""Robots drawn within tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.analysis.varied import VariedRobots
from notchflex.errors import InputError
from notchflex.mechanics.chain import law_errors
from notchflex.robot import Material, Nitinol, Robot
from notchflex.robot.part import fields_of, unit_of
from notchflex.robot.problems import Tolerance, amount
from notchflex.robot.value_names import number_at, numbers_at

_TRIES = 100
"""How often a draw that makes no valid robot is drawn again."""


class Draws(NamedTuple):
    """Robots within tolerances."""

    robot: Robot  # of the drawing, without tolerances
    values: Mapping[str, Float[np.ndarray, " draws"]]
    redrawn: int  # draws that made no valid robot at first


class ToleranceSource(NamedTuple):
    """One number drawn, and the values that follow it."""

    tolerance: Tolerance
    nominal: dict[str, float]  # values of the drawing by name

    @property
    def name(self) -> str:
        """Name of what deviates: that of the tolerance, or of a single notch."""
        return next(iter(self.nominal)) if self.tolerance.per_notch else self.tolerance.value

    def values(self, level: Any) -> dict[str, Any]:
        """Return the values at levels of the distribution, each between 0 and 1."""
        return {
            name: value + deviation(self.tolerance, value, level)
            for name, value in self.nominal.items()
        }


def deviation(tolerance: Tolerance, value: float, level: Any) -> Any:
    """Return the deviation from a value that a part `level` (0 to 1) of all stays below."""
    sd = amount(tolerance.sd, value)
    plus, minus = amount(tolerance.plus, value), amount(tolerance.minus, value)
    if tolerance.sd is None:
        return level * (plus + minus) - minus
    if sd == 0.0:
        return 0.0 * level
    from scipy.special import ndtr, ndtri  # takes a fifth of a second, and most commands do without

    lower, upper = ndtr(-minus / sd), ndtr(plus / sd)
    return sd * ndtri(lower + level * (upper - lower))


def moments(tolerance: Tolerance, value: float) -> tuple[float, float]:
    """Return mean and standard deviation of the deviation from a value."""
    sd = amount(tolerance.sd, value)
    plus, minus = amount(tolerance.plus, value), amount(tolerance.minus, value)
    if tolerance.sd is None:
        return 0.5 * (plus - minus), (plus + minus) / math.sqrt(12.0)
    if sd == 0.0 or (math.isinf(plus) and math.isinf(minus)):
        return 0.0, sd
    from scipy.special import ndtr

    # A normal distribution that is cut off at a and b, in standard deviations.
    a, b = -minus / sd, plus / sd
    part = ndtr(b) - ndtr(a)
    low, high = (math.exp(-0.5 * end**2) / math.sqrt(2.0 * math.pi) for end in (a, b))
    mean = (low - high) / part
    ends = sum(end * density for end, density in ((a, low), (-b, high)) if density)
    return float(sd * mean), float(sd * math.sqrt(1.0 + ends / part - mean**2))


def draw_robots(robot: Robot, tolerances: Sequence[Tolerance], draws: int, seed: int) -> Draws:
    """Draw robots within tolerances, as a Latin hypercube."""
    exact = robot.replace(tolerance=None)
    sources = sources_of(exact, tolerances)
    random = np.random.default_rng(seed)
    # Its columns do not correlate (Iman and Conover 1982): in every column one draw lies in each of
    # as many equal parts. Their random pairing alone would make spreads wrong by 4 % at 256 draws;
    # without its correlations it is 0.5 %.
    count = len(sources)
    part = random.permuted(np.tile(np.arange(draws), (count, 1)), axis=1).T
    if draws > count + 1 > 2:
        from scipy.special import ndtri

        normal = ndtri((part + 0.5) / draws)
        root = np.linalg.cholesky(np.corrcoef(normal, rowvar=False))
        part = np.linalg.solve(root, normal.T).T.argsort(axis=0).argsort(axis=0)
    levels = (part + random.random(part.shape)) / draws
    errors = VariedRobots.of(exact, values_at(sources, levels)).errors if sources else {}
    for row in sorted(errors):
        for tried in range(2, _TRIES + 1):
            levels[row] = random.random(count)
            try:
                exact.with_values(values_at(sources, levels[row]))
                break
            except InputError as error:
                if tried == _TRIES:
                    raise InputError.OUT_OF_RANGE(
                        f"{_TRIES} draws within the tolerances made no valid robot; make the "
                        f"tolerances smaller. The last one: {error}"
                    ) from None
    return Draws(exact, values_at(sources, levels), len(errors))


def values_at(
    sources: Sequence[ToleranceSource], levels: Float[np.ndarray, "... d"]
) -> dict[str, Any]:
    """Return the values of robots by name, at levels of the sources between 0 and 1."""
    values: dict[str, Any] = {}
    for source, level in zip(sources, np.moveaxis(levels, -1, 0), strict=True):
        values |= source.values(level)
    return values


def sources_of(robot: Robot, tolerances: Sequence[Tolerance]) -> list[ToleranceSource]:
    """Return what is drawn; the tolerance of a single notch replaces that of all notches there."""
    sources: list[ToleranceSource] = []
    alone = {tolerance.value for tolerance in tolerances if "[" in tolerance.value}
    for tolerance in tolerances:
        numbers = numbers_at(robot, tolerance.value)
        others = {name: value for name, value in numbers.items() if name not in alone}
        nominal = numbers if tolerance.value in alone else others
        if tolerance.per_notch:
            sources += [
                ToleranceSource(tolerance, {name: value}) for name, value in nominal.items()
            ]
        elif nominal == numbers and len(set(numbers.values())) == 1:  # equal notches stay a group
            value = number_at(robot, tolerance.value)
            sources.append(ToleranceSource(tolerance, {tolerance.value: value}))
        elif nominal:
            sources.append(ToleranceSource(tolerance, nominal))
    return sources


# Tolerances that are assumed where the robot file gives none.

CUT, CUT_OF_DIAMETER = 0.010, 0.005
"""Standard deviation of what is cut [mm], and at least this part of the outer diameter."""
WALL, WALL_OF_DIAMETER = 0.006, 0.003
"""The same for the wall of the tube, and for the wire of a backbone [mm]."""

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

# Of no effect before a notch is destroyed.
_LEFT_OUT = ("plastic_modulus",)


def tolerances_of(robot: Robot) -> tuple[tuple[Tolerance, ...], tuple[str, ...]]:
    """Return the tolerances of a robot, and the names of those that its file lacks: assumed."""
    specified = {tolerance.value for tolerance in robot.tolerance}
    # What the file says of all notches holds for the last one too.
    assumed = {
        tolerance.value: tolerance
        for tolerance in _assumed(robot)
        if not specified & {tolerance.value, f"notch.{tolerance.value.rpartition('.')[2]}"}
    }
    return (*robot.tolerance, *assumed.values()), tuple(assumed)


def _assumed(robot: Robot) -> Iterator[Tolerance]:
    cut = _rounded(max(CUT, CUT_OF_DIAMETER * robot.tube.outer_diameter))
    lengths = {
        name: getattr(notch, name)
        for notch in robot.notch
        for name, field in fields_of(type(notch)).items()
        if unit_of(field) == "mm" and name != "uncut_length"
    }
    for name, value in lengths.items():
        if _is_number(robot, f"notch.{name}"):
            # The wire or tube of a backbone is drawn and not cut.
            sd = _rounded(_wall(value)) if name.endswith("diameter") else cut
            yield Tolerance(f"notch.{name}", sd=sd)
    # Disks carry a backbone through their hole: their wall bends nowhere.
    cut_tubes = [notch.tube for notch in robot.notch if not notch.is_round]
    if None in cut_tubes:
        yield Tolerance("tube.inner_diameter", sd=_rounded(2.0 * _wall(robot.tube.outer_diameter)))
    if own := [tube.outer_diameter for tube in cut_tubes if tube]:
        yield Tolerance("notch.tube.inner_diameter", sd=_rounded(2.0 * _wall(max(own))))
    own_materials = [notch.material for notch in robot.notch if notch.material]
    if len(own_materials) < len(robot.notch):
        yield from _material("material", robot.material, robot)
    # Sections of unlike kinds share the wider tolerance, that of nitinol.
    for material in sorted(own_materials, key=lambda each: isinstance(each, Nitinol)):
        yield from _material("notch.material", material, robot)
    for name in ("friction.coefficient", "tendon.sheath_friction"):
        if _is_number(robot, name):
            yield replace(_FRICTION, value=name)
    yield from _tendon_radius(robot)
    # The errors of the law of notches with elastic ends, the last one's if it differs.
    sizes = {name: f"{100.0 * error:.2g} %" for name, error in law_errors(robot).items()}
    for name, size in sizes.items():
        if name == "notch" or size != sizes.get("notch"):
            yield Tolerance(f"{name}.stiffness_factor", sd=size)


def _material(path: str, material: Material, robot: Robot) -> Iterator[Tolerance]:
    limits = _NITINOL if isinstance(material, Nitinol) else {}
    for name, field in fields_of(type(material)).items():
        value = f"{path}.{name}"
        if unit_of(field) == "MPa" and name not in _LEFT_OUT and _is_number(robot, value):
            lower, mean, upper = limits.get(name, _MODULUS)
            plus, minus = upper / mean - 1.0, 1.0 - lower / mean
            yield Tolerance(value, plus=f"{100 * plus:.3g} %", minus=f"{100 * minus:.3g} %")


def _tendon_radius(robot: Robot) -> Iterator[Tolerance]:
    inner, tendons = 0.5 * robot.tube.inner_diameter, robot.tendon
    play = inner - max(tendon.radius + 0.5 * (tendon.diameter or 0.0) for tendon in tendons)
    if play >= 0.0 and all(tendon.diameter for tendon in tendons):
        play = _rounded(min(play, 0.5 * min(tendon.radius for tendon in tendons)))
        yield Tolerance("tendon.radius", plus=play, minus=play)
    elif play >= 0.0:
        yield _RADIUS


def _wall(diameter: float) -> float:
    """Return the standard deviation of a wall, or of a wire, drawn to a diameter [mm]."""
    return max(WALL, WALL_OF_DIAMETER * diameter)


def _rounded(size: float) -> float:
    return float(f"{size:.2g}")


def _is_number(robot: Robot, path: str) -> bool:
    try:
        return any(numbers_at(robot, path).values())
    except InputError:
        return False
