"""Robots drawn within tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri

from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.tolerance import Tolerance, amount
from notchflex.robot.value_names import number_at, numbers_at

_TRIES = 100
"""How often a draw that makes no valid robot is drawn again."""


class Draws(NamedTuple):
    """Robots within tolerances.

    Attributes:
        robots: The robots, without tolerances of their own.
        values: The numbers that were drawn, by name, one per robot.
        redrawn: How many draws made no valid robot and were drawn again.
    """

    robots: list[Robot]
    values: Mapping[str, Float[np.ndarray, " draws"]]
    redrawn: int


class _Source(NamedTuple):
    """One number drawn, and the values that follow it."""

    tolerance: Tolerance
    nominal: dict[str, float]

    def values(self, level: float) -> dict[str, float]:
        """The values at a level of the distribution, between 0 and 1."""
        return {
            name: one + deviation(self.tolerance, one, level) for name, one in self.nominal.items()
        }


def deviation(tolerance: Tolerance, value: float, level: float) -> float:
    """Return the deviation from a value that a part `level` of all deviations stays below.

    Example:
        >>> deviation(Tolerance("material.elastic_modulus", plus="20 %", minus="10 %"), 4e4, 0.5)
        2000.0
    """
    sd = amount(tolerance.sd, value)
    plus, minus = amount(tolerance.plus, value), amount(tolerance.minus, value)
    if tolerance.sd is None:
        return level * (plus + minus) - minus
    if sd == 0.0:
        return 0.0
    lower, upper = ndtr(-minus / sd), ndtr(plus / sd)
    return sd * float(ndtri(lower + level * (upper - lower)))


def draw_robots(robot: Robot, tolerances: Sequence[Tolerance], draws: int, seed: int) -> Draws:
    """Draw robots within tolerances, as a Latin hypercube.

    Args:
        robot: The robot with the values of the drawing.
        tolerances: What deviates; one of a single notch replaces that of all notches there.
        draws: How many robots.
        seed: The same seed makes the same robots.

    Raises:
        InputError: Hardly any draw makes a valid robot.
    """
    exact = robot.replace(tolerance=None)
    sources = _sources(exact, tolerances)
    random = np.random.default_rng(seed)
    robots: list[Robot] = []
    values: list[dict[str, float]] = []
    redrawn = 0
    for level in _levels(draws, len(sources), random):
        for tried in range(_TRIES):
            drawn = _values(sources, level)
            try:
                robots.append(exact.with_values(drawn))
            except InputError as error:
                if tried + 1 == _TRIES:
                    raise InputError.OUT_OF_RANGE(
                        f"{_TRIES} draws within the tolerances made no valid robot; make the "
                        f"tolerances smaller. The last one: {error}"
                    ) from None
                level = random.random(len(sources))
                continue
            values.append(drawn)
            redrawn += tried > 0
            break
    names = values[0] if values else {}
    return Draws(robots, {name: np.array([one[name] for one in values]) for name in names}, redrawn)


def _levels(
    draws: int, count: int, random: np.random.Generator
) -> Float[np.ndarray, "draws count"]:
    """Draw a Latin hypercube whose columns do not correlate (Iman and Conover 1982).

    In every column one draw lies in each of as many equal parts. Their random pairing alone would
    make spreads wrong by 4 % at 256 draws; without its correlations it is 0.5 %.
    """
    part = random.permuted(np.tile(np.arange(draws), (count, 1)), axis=1).T
    if draws > count + 1 > 2:
        normal = ndtri((part + 0.5) / draws)
        root = np.linalg.cholesky(np.corrcoef(normal, rowvar=False))
        part = np.linalg.solve(root, normal.T).T.argsort(axis=0).argsort(axis=0)
    return (part + random.random(part.shape)) / draws


def _values(sources: Sequence[_Source], levels: Float[np.ndarray, " d"]) -> dict[str, float]:
    drawn: dict[str, float] = {}
    for source, level in zip(sources, levels, strict=True):
        drawn |= source.values(float(level))
    return drawn


def _sources(robot: Robot, tolerances: Sequence[Tolerance]) -> list[_Source]:
    """What is drawn: those of all notches first, so that those of a single one replace them."""
    found: list[_Source] = []
    for one in sorted(tolerances, key=lambda one: "[" in one.value):
        numbers = numbers_at(robot, one.value)
        if one.per_notch:
            found += [_Source(one, {name: value}) for name, value in numbers.items()]
        elif len(set(numbers.values())) == 1:  # by one name: equal notches stay a group
            found.append(_Source(one, {one.value: number_at(robot, one.value)}))
        else:
            found.append(_Source(one, numbers))
    return found
