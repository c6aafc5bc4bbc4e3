"""Whether sheaths lead their wires by Euler's law of the rope, and remember their tension.

Along a sheath ln T is a line of straight pieces between 0 (drive) and 1 (base). A wire that slides
loses c = mu Theta over its length, in the direction in which it slides; where it sticks, T stays.
So the tension of the drive holds the line between two others that fall and rise by c from it, and
that of the base does the same from the other end. What was remembered before is read and judged.
With less bend it slides where the line is steeper than c now holds, from the drive on: behind such
a piece the slope of c goes on until it meets the old line, beyond which nothing moves.

Base and drive are one contact: either the wire sticks somewhere, and what is drawn out at the base
is taken up by the stretch from there to the base; or it slides all along, and the tensions at its
ends differ by c.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import notchflex as nf

from .forces import State, height_of

_NONE = 1e-100  # a tension that counts as none, N
_EXACT = 1e-8  # relative, of tensions; of log ratios
# The solver keeps 12 corners, and drops the one that changes the line least.
_CORNERS, _DROPPED = 12, 1e-3
_LENGTH = 1e-9  # mm, below which a wire has not moved
_ROOT = 1e-6  # of the rounding of strokes
_STROKE = 1e-6  # of all strokes and stretches, and of the height of all notches


class Line(NamedTuple):
    """ln T along a sheath, straight between places that rise from 0 to 1."""

    place: np.ndarray
    level: np.ndarray

    def at(self, place: np.ndarray) -> np.ndarray:
        """Ln T at places."""
        return np.interp(place, self.place, self.level)

    def mean(self, power: float = 1.0) -> float:
        """Mean of a power of T."""
        width, rise = np.diff(self.place), power * np.diff(self.level)
        safe = np.where(np.abs(rise) < 1e-12, 1.0, rise)
        share = np.where(np.abs(rise) < 1e-12, 1.0 + 0.5 * rise, np.expm1(rise) / safe)
        return float(np.sum(width * np.exp(power * self.level[:-1]) * share))

    def between(self, low: tuple[float, float], high: tuple[float, float]) -> Line:
        """Hold it between two straight lines, given by their ends."""
        ends = np.array([0.0, 1.0])
        places = [self.place]
        for other in (low, high):
            over = self.level - np.interp(self.place, ends, other)
            crosses = np.flatnonzero(over[:-1] * over[1:] < 0.0)
            part = over[crosses] / (over[crosses] - over[crosses + 1])
            places.append(self.place[crosses] + part * np.diff(self.place)[crosses])
        place = np.unique(np.concatenate(places))
        level = np.clip(self.at(place), np.interp(place, ends, low), np.interp(place, ends, high))
        return Line(place, level)

    def no_steeper(self, limit: float) -> Line:
        """Follow it from the drive on by no steeper slope, which goes on until it is met again."""
        place, level = [self.place[0]], [self.level[0]]
        for end, old, new in zip(self.place[1:], self.level, self.level[1:], strict=False):
            width, gap = end - place[-1], old - level[-1]
            nearer = limit * width - np.copysign(new - old, (new - old) * gap)
            if 0.0 < abs(gap) < nearer:
                part = abs(gap) / nearer
                level.append(level[-1] + part * np.copysign(limit * width, gap))
                place.append(place[-1] + part * width)
            most = limit * (end - place[-1])
            level.append(level[-1] + np.clip(new - level[-1], -most, most))
            place.append(end)
        return Line(np.array(place), np.array(level))


def _memories(path: nf.EquilibriumPath) -> tuple[Any, Any] | None:
    """What sheaths remember: before the step, and after it; None without sheaths."""
    after = path.run.solved.memory.sheath
    if after is None:
        return None
    before = path.prepared.state.unpack(path.run.between).memory.sheath
    return tuple(type(after)(*(np.asarray(part)[0] for part in one)) for one in (before, after))


def _compliance(tendon: nf.Tendon) -> float:
    """Stretch of wire and sheath under a tension all along, mm/N."""
    if tendon.sheath_length is None:
        return 0.0
    soft = 1.0 / tendon.sheath_wire_stiffness + 1.0 / (tendon.sheath_stiffness or np.inf)
    return tendon.sheath_length * soft


def held_by_sheaths(path: nf.EquilibriumPath) -> float:
    """Energy of the stretched wires in their sheaths, N mm."""
    memories = _memories(path)
    if memories is None:
        return 0.0
    lines = map(Line, memories[1].place, memories[1].level)
    both = zip(path.robot.tendon, lines, strict=True)
    return sum(0.5 * _compliance(tendon) * line.mean(2.0) for tendon, line in both)


def judge_sheaths(state: State) -> list[str]:
    """Tell what does not hold between drives, sheaths and base."""
    memories = _memories(state.path)
    if memories is None:
        return []
    return [
        f"sheath {number + 1}: {what}"
        for number in range(state.robot.number_of_tendons)
        for what in _judged(state, *memories, number)
    ]


def _judged(state: State, before: Any, after: Any, number: int) -> Iterator[str]:
    """Tell what does not hold of one sheath."""
    tendon, now = state.robot.tendon[number], state.now
    soft, bend = _compliance(tendon), state.load.sheath_bend_deg
    bend = (tendon.sheath_bend_deg or 0.0) if bend is None else bend
    limit = (tendon.sheath_friction or 0.0) * np.radians(bend)
    remembered = Line(before.place[number], before.level[number])
    old = remembered.no_steeper(limit)
    drive, base = (max(float(each[number]), 0.0) for each in (now.tension, state.pull))
    ends = np.log(drive + _NONE), np.log(base + _NONE)
    from_base = (ends[1] - limit, ends[1]), (ends[1] + limit, ends[1])
    from_drive = (ends[0], ends[0] - limit), (ends[0], ends[0] + limit)
    line = old.between(*from_drive).between(*from_base)
    largest, falls = max(drive, base), ends[0] - ends[1]
    slack = min(drive, base) < 1e6 * state.rounding
    if abs(falls) > limit + _EXACT and not slack:
        yield f"friction beyond its bound by {abs(falls) - limit:.1e}"
    by_tension = state.load.per_tendon("stroke", state.robot.number_of_tendons)[number] is None
    told = Line(after.place[number], after.level[number])
    at = np.union1d(line.place, told.place)
    full = np.count_nonzero(np.diff(before.place[number]) > 0.0) >= _CORNERS - 2
    off = np.abs(np.exp(line.at(at)) - np.exp(told.at(at))).max()
    # A drive by stroke moves a front by the root of its rounding.
    exact = _EXACT if by_tension else _ROOT
    if off > exact * largest + state.rounding + full * _DROPPED * largest:
        yield f"its tension is off by {off:.1e} of {largest:.1e} N"
    ended = state.drawn[number] + soft * told.mean()
    moved = ended - float(before.stroke[number]) - soft * remembered.mean()
    near = abs(ended) + abs(state.drawn[number]) + soft * largest + state.height
    near *= _STROKE
    backlash, play = tendon.backlash or 0.0, float(now.stroke[number]) - ended
    if not -backlash - near < play < near:
        yield f"its drive is {play:.1e} mm off its wire's end"
    due = 0.0 if moved > 0.0 else -backlash
    if abs(moved) < 0.1 * _LENGTH and by_tension:
        due = float(before.play[number])
    elif abs(moved) < max(10.0 * _LENGTH, near):
        due = play
    if abs(play - due) > near and not slack:
        yield f"its drive stands at {play:.3e} mm in its backlash, not {due:.3e}"
    # Of the way of a stuck wire: what its end is drawn out, and what it stretches from there.
    stretch = soft * (old.between(*from_base).mean() - old.mean())
    slip = float(state.drawn[number] - before.stroke[number]) + stretch
    slides = abs(falls - np.copysign(limit, slip)) <= _EXACT
    if np.isinf(tendon.axial_stiffness):
        # The solver lets an inextensible tendon give way a little, so that its tension is known.
        change = base - np.exp(remembered.level[-1])
        stiffness = float(state.path.chain.memory_stiffness[number])
        near += abs(change) * max(map(height_of, state.robot.notches)) / stiffness
    if not (abs(slip) <= near or slides or slack):
        yield f"slides by {slip:.1e} mm though its ends differ by {falls:.3e}, not {limit:.3e}"
