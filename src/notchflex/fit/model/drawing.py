"""Tolerances of drawings as priors: numbers of the robots that are not fitted, but may deviate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from notchflex import Robot
from notchflex.analysis.draws import moments, sources_of, tolerances_of
from notchflex.fit.model.constants import RobotNumber, Unknown
from notchflex.fit.model.residuals import SENSOR
from notchflex.support import numbers_at

# Robots of one fit are of one tube and tendon: these deviate in all of them alike.
_SHARED = ("material.", "friction.")
# A factor on all notches is no other number than the moduli: fitted constants hold the error of
# the law by which they are found. That of the last notch shows in its angle.
_IN_THE_MODULI = "notch.stiffness_factor"


def deviations_of(robots: Mapping[str, Robot], constants: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """Return what may deviate from the drawings and is not fitted, in standard deviations.

    The tolerances are those of the robot files, or those that `uncertain` assumes. Dimensions
    belong to each robot, constants of material and friction to all.
    """
    fitted = numbers_set(robots, constants)
    deviations: dict[str, Unknown] = {}
    for label, robot in robots.items():
        exact = robot.replace(tolerance=None)
        tolerances = [one for one in tolerances_of(robot)[0] if one.value != _IN_THE_MODULI]
        for source in sources_of(exact, tolerances):
            sets: list[RobotNumber] = []
            means: list[float] = []
            for name, nominal in source.nominal.items():
                mean, deviation = moments(source.tolerance, nominal)
                numbers = {(label, one): value for one, value in numbers_at(exact, name).items()}
                free = numbers.keys() - fitted
                whole = len(free) == len(numbers)
                paths = (
                    {name: nominal} if whole else {p: numbers[label, p] for _, p in sorted(free)}
                )
                if deviation > 0.0:
                    sets += [RobotNumber(label, *one, deviation) for one in paths.items()]
                    means.append(mean / deviation)
            if not sets:
                continue
            shared = source.name.startswith(_SHARED) or len(robots) == 1
            key = source.name if shared else f"{label}:{source.name}"
            before = deviations[key].sets if key in deviations else ()
            prior = (math.fsum(means) / len(means), 1.0)
            deviations[key] = Unknown(
                key, "", (*before, *sets), -math.inf, math.inf, 0.0, -1.0, 1.0, prior, source.name
            )
    return tuple(deviations.values())


def deviated(robot: Robot, label: str, deviations: Sequence[Unknown]) -> Robot:
    """Return the robot of a label with deviations at their `start`.

    Raises:
        InputError: The robot cannot deviate so.
    """
    numbers = {
        one.path: one.base + one.slope * deviation.start
        for deviation in deviations
        for one in deviation.sets
        if one.label == label
    }
    return robot.with_values(numbers) if numbers else robot


def numbers_set(robots: Mapping[str, Robot], constants: Sequence[Unknown]) -> set[tuple[str, str]]:
    """Return label and name of every single number that constants set."""
    return {
        (number.label, name)
        for constant in constants
        for number in constant.sets
        for name in (
            [number.path]
            if number.path in SENSOR
            else numbers_at(robots[number.label], number.path)
        )
    }
