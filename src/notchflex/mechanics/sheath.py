"""Sheaths that lead the tendons from their drives to the base: friction, stretch and backlash.

The wire of a sheath of length L and total bend angle Theta loses tension by |d ln T / dx| =
mu Theta / L wherever it slides (Euler's law of the rope). The tension along it is its memory: a
change at one end moves a front into the sheath, behind which the wire slides, and beyond which
nothing has changed. So ln T is a line of straight pieces, kept by its corners.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import Pytree, constant, jax, jnp
from notchflex.mechanics.tendon import OfTendons
from notchflex.robot import Tendon

# Corners kept of a profile: 10 reversals within each other. One more drops the corner that changes
# the profile least.
_CORNERS = 12
# Tension that counts as none, N, so that logarithms stay finite.
_MIN_TENSION = 1e-100
# Differences of ln T that may be rounding.
_ROUNDING = 1e-12
# Half differences of ln T below which the mean of T is computed by a series.
_SMALL = 0.05

Corners = tuple[Float[Array, "t corners"], Float[Array, "t corners"]]
"""Places of corners, 0 at the drive and 1 at the base, and ln T there."""


class Sheath(Pytree):
    """Sheaths of t tendons; a tendon without one has 0 everywhere."""

    friction: OfTendons  # Coefficient of friction
    bend: OfTendons  # Total bend angle, rad
    compliance: OfTendons  # Stretch of wire and sheath under one tension all along, mm/N
    backlash: OfTendons  # Way of the drive on a reversal before the wire follows, mm

    def log_ratio(self, bend: Float[Array, ""]) -> OfTendons:
        """Return ln of the largest tension ratio over the sheaths; bent by a load from 0 rad on."""
        return self.friction * jnp.where(bend < 0.0, self.bend, bend)

    def rest(self) -> SheathMemory:
        """Return the memory of slack wires."""
        none = constant(np.zeros(self.friction.shape))
        place = constant(np.tile(np.linspace(0.0, 1.0, _CORNERS), (len(none), 1)))
        return SheathMemory(none, place, 0.0 * place + np.log(_MIN_TENSION), none, none, none)

    def wire_end(self, memory: SheathMemory) -> OfTendons:
        """Return the ways of the wires' ends at the drives, mm."""
        return memory.stroke + self.compliance * mean_tension((memory.place, memory.level))

    def end_stretch(self, side: float, log_ratio: Array, tension: Array) -> OfTendons:
        """Return the stretch, mm, of a wire that slides all along toward drive (1) or base (-1)."""
        # The mean of exp over the profile: T (exp(c) - 1) / c while it is pulled.
        mean = jnp.exp(0.5 * side * log_ratio) * _relative_mean(0.5 * log_ratio)
        return self.compliance * tension * mean


class SheathMemory(NamedTuple):
    """What sheaths remember of the last solved state.

    Attributes:
        tension: Tension of the drives, N.
        place: Corners of the profiles of ln T, from 0 at the drive to 1 at the base.
        level: ln T there, T in N.
        limit: ln of the largest tension ratio over the sheath.
        stroke: Tendon drawn out at the base, mm.
        play: Position of the drive within its backlash, 0 where it pulls, mm.
    """

    tension: Float[Array, "*s t"]
    place: Float[Array, "*s t corners"]
    level: Float[Array, "*s t corners"]
    limit: Float[Array, "*s t"]
    stroke: Float[Array, "*s t"]
    play: Float[Array, "*s t"]


def build_sheath(tendons: Sequence[Tendon]) -> Sheath | None:
    """Build the sheaths of all tendons; None where there is none."""
    if all(tendon.sheath_length is None for tendon in tendons):
        return None

    def given(key: str, otherwise: float = 0.0) -> Array:
        values = (getattr(tendon, key) for tendon in tendons)
        return constant([otherwise if value is None else value for value in values])

    stretch = 1.0 / given("sheath_wire_stiffness", np.inf) + 1.0 / given("sheath_stiffness", np.inf)
    return Sheath(
        friction=given("sheath_friction"),
        bend=xp.radians(given("sheath_bend_deg")),
        compliance=given("sheath_length") * stretch,
        backlash=given("backlash"),
    )


def log_tension(tension: OfTendons) -> OfTendons:
    """Return ln T, finite for slack wires."""
    return jnp.log(jnp.maximum(tension, 0.0) + _MIN_TENSION)


def within(memory: SheathMemory, limit: OfTendons) -> Corners:
    """Return the profiles, with a corner in each piece, where less friction lets the wire slide."""
    # From the drive on the line is the old one, but nowhere steeper than the friction holds: behind
    # a piece that is too steep it goes on with the slope that holds until it meets the old one.
    # Nothing beyond moves, so a small change before stays small.
    first, *_ = before = [*zip(memory.place.T, memory.level.T, strict=True)]
    line, corners = first[1], [first]
    for (start, old), (end, new) in pairwise(before):
        width, step, gap = end - start, new - old, old - line
        apart, side, most = jnp.abs(gap) > _ROUNDING, jnp.sign(gap), limit * width
        nearer = most - side * step  # by so much the line comes nearer over the piece
        meets = apart & (nearer > jnp.abs(gap))
        part = jnp.where(meets, jnp.abs(gap) / jnp.where(meets, nearer, 1.0), 1.0 * apart)
        line = line + part * side * most
        corners.append((start + part * width, line))
        steep = jnp.abs(step) > most + _ROUNDING
        line = line + (1.0 - part) * jnp.where(steep, jnp.sign(step) * most, step)
        corners.append((end, line))
    place, level = (jnp.stack(values, axis=1) for values in zip(*corners, strict=True))
    return place, level


def from_drive(profile: Corners, end: OfTendons, limit: OfTendons) -> Corners:
    """Return the profiles, with a corner more, after drives have brought ln T there to `end`."""
    # The line ln T = end -+ limit * place covers the profile up to where it meets it.
    place, level = profile
    end, slope = end[:, None], limit[:, None]
    side = jnp.where(end >= level[:, :1], 1.0, -1.0)
    ahead = side * (level - end) + slope * place
    # It rises along the sheath, but for rounding where the profile is parallel to the line. There
    # rounding must not decide: derivatives belong to corners.
    covered = jax.lax.cummax(jax.lax.stop_gradient(ahead), axis=1) < -_ROUNDING
    crosses = covered[:, :-1] & ~covered[:, 1:]
    part = -ahead[:, :-1] / jnp.where(crosses, jnp.diff(ahead), 1.0)
    part = jnp.where(crosses, jnp.minimum(part, 1.0), 1.0 * covered[:, 1:])
    front = jnp.sum(part * jnp.diff(place), axis=1, keepdims=True)
    place = jnp.where(covered, front, place)
    level = jnp.where(covered, end - side * slope * front, level)
    return jnp.concatenate([0.0 * front, place], 1), jnp.concatenate([end, level], 1)


def from_base(profile: Corners, end: OfTendons, limit: OfTendons) -> Corners:
    """Return the profiles after the robot has brought ln T at the base to `end`."""
    place, level = from_drive(_reversed(profile), end, limit)
    return _reversed((place, level))


def _reversed(profile: Corners) -> Corners:
    place, level = profile
    return 1.0 - place[:, ::-1], level[:, ::-1]


def mean_tension(profile: Corners, power: int = 1) -> OfTendons:
    """Return the mean of a power of the tension along the sheaths."""
    place, level = profile[0], power * profile[1]
    middle, half = 0.5 * (level[:, 1:] + level[:, :-1]), 0.5 * jnp.diff(level)
    mean = jnp.sum(jnp.diff(place) * jnp.exp(middle) * _relative_mean(half), axis=1)
    return jnp.maximum(mean - 2.0 * _MIN_TENSION**power, 0.0)  # 0 for slack wires


def _relative_mean(half: Array) -> Array:
    """Return sinh(h) / h."""
    small = jnp.abs(half) < _SMALL
    squared = half * half
    series = 1.0 + squared / 6.0 * (1.0 + squared / 20.0 * (1.0 + squared / 42.0))
    safe = jnp.where(small, 1.0, half)
    return jnp.where(small, series, (jnp.exp(safe) - jnp.exp(-safe)) / (2.0 * safe))


def kept(profile: Corners) -> Corners:
    """Return the profiles by as many corners as a memory has, without those that change least."""
    count = profile[0].shape[1]

    def drop(dropped: Array, profile: Corners) -> Corners:
        before, after = (jnp.diff(line) for line in profile)
        area = jnp.abs(before[:, :-1] * after[:, 1:] - before[:, 1:] * after[:, :-1])
        # Behind the corners that are left stand copies of the last one.
        is_left = jnp.arange(count - 2) < count - 2 - dropped
        area = jnp.where(is_left[None], jnp.where(area < _ROUNDING, 0.0, area), jnp.inf)
        stays = jnp.arange(count)[None] <= jnp.argmin(area, axis=1, keepdims=True)
        place, level = (jnp.where(stays, x, jnp.append(x[:, 1:], x[:, -1:], 1)) for x in profile)
        return place, level

    place, level = jax.lax.fori_loop(0, count - _CORNERS, drop, profile)
    return place[:, :_CORNERS], level[:, :_CORNERS]
