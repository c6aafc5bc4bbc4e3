"""Forces from what the tendons read: tension and stroke, along a history."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Int
from numpy.typing import ArrayLike

from notchflex import InputError, Robot
from notchflex.search.least_squares import SearchPoint
from notchflex.sensing.bounds import Bounds, bounds
from notchflex.sensing.history import estimate, own_readings, state_after, with_noise
from notchflex.sensing.model import SensingModel, unknown_force
from notchflex.sensing.readings import SensorNoise, merged, readings_of
from notchflex.sensing.sensed import LeftOpen, SensedForce
from notchflex.support import ExternalLoad, check_is_robot, check_number

Stage = Callable[[str, int, int], None]

LEVEL = 0.95
"""Part of all cases that an interval shall contain."""

# The range of the search: this many times the force that balances the largest tension at the base.
_RANGE = 3.0


def sense(
    robot: Robot,
    tensions: ArrayLike | None,
    strokes: ArrayLike | None = None,
    *,
    tip: ArrayLike | None = None,
    angles: ArrayLike | None = None,
    noise: SensorNoise | None = None,
    components: str | None = None,
    place: int | str = "tip",
    known: ExternalLoad | None = None,
    largest: float | None = None,
    progress: Stage | None = None,
) -> SensedForce:
    """Find the force on a robot from the tensions and strokes of its tendons along a history.

    The history begins at rest, with slack tendons and without the force. From reading to reading
    tendons and force change in proportion. The force may come, change and go at any reading: that
    of every reading is estimated separately, from the state after the readings before. Consecutive
    readings that noise explains are averaged before the model follows them; the force of each stays
    its own, and so does its interval.

    Args:
        robot: The robot.
        tensions: Tensions at the base, N, (s, t), NaN where not measured. They drive the model.
        strokes: Strokes since the free robot, mm, (s, t), NaN where not measured. Where a tension
            was measured too they are compared with the model, else they drive it.
        tip: Positions of the tip in the world, mm, (s, 3), if measured.
        angles: Angles of the notches, rad, (s, n), if measured.
        noise: Noise of the sensors; `SensorNoise()` by default.
        components: Axes of the world along which the force may act, such as "x" or "xz"; by
            default those across the straight tube in which the robot bends.
        place: "tip", the number of a body at whose origin the force acts, or "search".
        known: Other loads: a `Load` with gravity, a tip mass, a turned base.
        largest: Largest component looked for, N; by default three times the force at the tip whose
            moment at the base is that of the largest tension.
        progress: Called with a stage, how much of it is done, and how much there is.

    Returns:
        Forces, intervals, contact, and what the readings leave open. Where a reading has no
        equilibrium the result ends there and says why.

    Raises:
        InputError: Readings that do not fit together or the robot, or nothing that depends on the
            force.

    Example:
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> touched = nf.simulate(wrist, nf.pull(0.1, 0.8, steps=4).loaded(tip_force=(0.02, 0, 0)))
        >>> sensed = nf.sense(wrist, touched.tension, touched.stroke)
        >>> f"{sensed.force[-1, 0]:.3f} N", bool(sensed.contact[-1])
        ('0.020 N', True)
    """
    check_is_robot(robot)
    sensors = SensorNoise() if noise is None else noise
    given = readings_of(robot, tensions, strokes, tip, angles, sensors)
    readings, group = merged(given)
    unknown = unknown_force(robot, components, place, known)
    if largest is None:
        lever = max(tendon.radius for tendon in robot.tendon)
        tension = float(np.nanmax(readings.tension, initial=0.0))
        far = _RANGE * max(tension, 1.0) * lever / robot.geometry.length
    elif not 0.0 < (far := check_number(largest, "largest", "a force in N")) < np.inf:
        raise InputError.OUT_OF_RANGE(
            f"largest is the largest force looked for, above 0 N; got {far:g}"
        )
    model = SensingModel(robot, readings, unknown, far)
    places: dict[int | None, float] = {}
    if place == "search":
        bodies = [*range(1, robot.number_of_notches + 1), None]
        report = _stage(progress, "trying places")
        for number, body in enumerate(bodies, 1):
            candidates = estimate(replace(model, unknown=replace(unknown, body=body))).best
            whole = len(candidates) == len(readings)
            places[body] = sum(point.merit for point in candidates) if whole else np.inf
            if report is not None:
                report(number, len(bodies))
        # Of places that fit as well the tip is taken: it is where robots touch.
        least = min(places.values())
        body = None if places[None] <= least + 1e-6 else min(places, key=lambda one: places[one])
        model = replace(model, unknown=replace(unknown, body=body))
    history = with_noise(estimate(model, _stage(progress, "finding the force")))
    own = own_readings(history, given, group)
    ends = bounds(history, own, LEVEL, _stage(progress, "finding the interval"))
    every = [reading for members in own for reading in members]
    left_open = [LeftOpen.of(model, reading, ends, LEVEL) for reading in every]
    return _result(model, history.best, ends, left_open, places, group)


def _stage(progress: Stage | None, name: str) -> Callable[[int, int], None] | None:
    return None if progress is None else lambda done, count: progress(name, done, count)


def _result(
    model: SensingModel,
    candidates: list[SearchPoint],
    ends: Bounds,
    left_open: list[LeftOpen],
    places: dict[int | None, float],
    group: Int[np.ndarray, " s"],
) -> SensedForce:
    means, count, size = len(model.readings), len(group), model.size
    hidden = [one.hidden for one in left_open]
    entries = np.array([len(model.step(number).entries) for number in range(means)])
    return SensedForce(
        robot=model.robot,
        components=model.unknown.names,
        directions=model.unknown.directions,
        force=_filled(ends.force, (count, size)),
        covariance=_filled([one.covariance for one in left_open], (count, size, size)),
        low=_filled(ends.low, (count, size)),
        high=_filled(ends.high, (count, size)),
        limited=_filled(ends.limited, (count, size), False),
        stuck=_filled([one.stuck for one in left_open], (count, size), False),
        misfit=_filled([point.merit for point in candidates], (means,))[group],
        read=entries[group],
        no_force=_filled(ends.no_force, (count,)),
        hidden=(*hidden, *[np.zeros((0, size))] * (count - len(hidden))),
        group=group,
        place=model.unknown.body,
        places=places,
        level=LEVEL,
        largest=model.largest,
        path=model.follow(np.array([point.variables for point in candidates]))
        if candidates
        else None,
        reason=_reason(model, candidates, group),
    )


def _filled(rows: object, shape: tuple[int, ...], missing: float = np.nan) -> np.ndarray:
    """Return rows as an array, and what is missing beyond their number."""
    values = np.full(shape, missing)
    given = np.asarray(rows, values.dtype)
    values[: len(given)] = given.reshape(len(given), *shape[1:])
    return values


def _reason(
    model: SensingModel, candidates: list[SearchPoint], group: Int[np.ndarray, " s"]
) -> str:
    """Return why the history ended before its last reading."""
    if len(candidates) == len(model.readings):
        return ""
    number = len(candidates)
    state, force = None, np.zeros(model.size)
    if candidates:
        state, force = state_after(candidates[-1]), candidates[-1].variables
    path = model.solve(state, number, force[None])
    reading = int(np.argmax(group == number)) + 1
    return f"reading {reading} of {len(group)}: {path.reason[0]}"
