"""The moment of a hinge: an elastic part, and friction of a size that depends on the angle.

While a notch turns at tension T, the tendon pulls at its hinge with T times the lever. Friction
before the notch leaves more of it on unloading than on loading, so that the hinge must answer with
S(q) + F(q) while the angle q rises and with S(q) - F(q) while it falls. Both parts follow from one
linear least-squares fit over both branches. A notch that stands is held between the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

_POWERS = np.array([1, 2, 3])
_KNOT_POWERS = np.array([1, 2])
# Where further springs may begin between the free robot and the largest angle, how many at
# most, how far apart, and the error of the angle that is good enough, all as parts of the
# range.
_PLACES = np.linspace(0.05, 0.95, 28)
_MAX_KNOTS = 6
_APART = 0.06
_WORTH = 0.95  # of the error before; a knot that leaves more is not worth its spring
_MAX_MISFIT = 5e-4
# No sample weighs more than that of a flexure softer than the free one by this factor.
_SOFTEST = 50.0
# Friction below this part of the elastic moment is none.
_ROUNDING = 1e-3
_FRICTION_POWERS = np.array([2, 3, 4])  # a joint equality has powers up to 4
_MIN_TURN = 1e-4  # rad; a flexure that turns less is given its stiffness in the free robot


@dataclass(frozen=True)
class HingeSpring:
    """The moment of one hinge. Units N mm, rad.

    Attributes:
        low: Smallest angle of the samples, from the free robot.
        high: Largest angle.
        knots: Angles from which further springs act outwards; (k,).
        stiffness: Coefficients of x, x², x³ of the joint; (3,).
        further: Coefficients of x, x² of each further spring, x from its knot; (k, 2).
        friction: Coefficients of q², q³, q⁴ in the potential whose slope is the friction moment.
    """

    low: float
    high: float
    knots: Float[np.ndarray, " k"]
    stiffness: Float[np.ndarray, " 3"]
    further: Float[np.ndarray, "k 2"]
    friction: Float[np.ndarray, " 3"]

    def moment(self, angle: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
        """Return the elastic moment at hinge angles, N·mm."""
        return _elastic(angle, self.knots) @ np.append(self.stiffness, self.further)

    def friction_moment(self, angle: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
        """Return the friction moment during loading at hinge angles, N·mm, with their sign."""
        return np.sign(angle) * (_friction(angle) @ self.friction)

    @property
    def largest_stiffness(self) -> float:
        """Largest slope of the elastic moment over the range."""
        at = np.linspace(self.low, self.high, 201)
        return float(np.abs(np.gradient(self.moment(at), at)).max())


def linear_spring(stiffness: float) -> HingeSpring:
    """Return a hinge without friction (N mm/rad), for a flexure that no tendon bends."""
    first = np.array([stiffness, 0.0, 0.0])
    return HingeSpring(-0.1, 0.1, np.zeros(0), first, np.zeros((0, 2)), np.zeros(3))


def fit_spring(
    angle: Float[np.ndarray, " s"],
    moment: Float[np.ndarray, " s"],
    rising: Float[np.ndarray, " s"],
    stiffness: float,
) -> HingeSpring:
    """Fit both parts to samples of a slipping hinge.

    Args:
        angle: Angles from the free robot, rad.
        moment: Moments that the hinge answers with, N mm.
        rising: 1 where the angle moves away from that of the free robot, -1 where it comes back.
        stiffness: Stiffness of the free flexure, N mm/rad, where the samples say nothing.
    """
    low, high = float(angle.min(initial=0.0)), float(angle.max(initial=0.0))
    # Rounding is not a motion to a side.
    low, high = (0.0 if abs(end) < _MIN_TURN else end for end in (low, high))
    if high - low < _MIN_TURN:
        return linear_spring(stiffness)
    slope = (rising * np.sign(angle))[:, None] * _friction(angle)
    weight = _weights(angle, moment, rising, stiffness)
    goal = _MAX_MISFIT * (high - low)
    candidates = np.concatenate([end * _PLACES for end in (low, high) if abs(end) > _MIN_TURN])
    best = _least_squares(angle, moment, slope, weight, np.zeros(0))
    for _ in range(_MAX_KNOTS):
        # A superelastic notch yields somewhere: the knot that helps most is found by trying.
        apart = _APART * (high - low)
        free = [at for at in candidates if np.abs(at - best.knots).min(initial=np.inf) > apart]
        if best.error < goal or not free:
            break
        trials = [
            _least_squares(angle, moment, slope, weight, np.sort(np.append(best.knots, at)))
            for at in free
        ]
        better = min(trials, key=lambda trial: trial.error)
        if better.error > _WORTH * best.error:
            break
        best = better
    own, further, friction = np.split(best.found, [3, 3 + 2 * len(best.knots)])
    return HingeSpring(low, high, best.knots, own, further.reshape(-1, 2), friction)


class _Trial(NamedTuple):
    """A fit with given knots, and its root mean square error as an angle, rad."""

    knots: Float[np.ndarray, " k"]
    found: Float[np.ndarray, " m"]
    error: float


def _least_squares(
    angle: Float[np.ndarray, " s"],
    moment: Float[np.ndarray, " s"],
    slope: Float[np.ndarray, "s 3"],
    weight: Float[np.ndarray, " s"],
    knots: Float[np.ndarray, " k"],
) -> _Trial:
    matrix = np.concatenate([_elastic(angle, knots), slope], axis=1) * weight[:, None]
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    coefficients = np.linalg.lstsq(matrix / scale, moment * weight, rcond=1e-10)[0] / scale
    error = matrix @ coefficients - moment * weight
    return _Trial(knots, coefficients, float(np.sqrt(np.mean(error**2))))


def _weights(
    angle: Float[np.ndarray, " s"],
    moment: Float[np.ndarray, " s"],
    rising: Float[np.ndarray, " s"],
    stiffness: float,
) -> Float[np.ndarray, " s"]:
    """Angle per moment along the branches: what is to be small is the error of the angle."""
    weight = np.full(len(angle), 1.0 / stiffness)
    for branch in np.unique(np.stack([rising, np.sign(angle)]), axis=1).T:
        rows = np.flatnonzero((rising == branch[0]) & (np.sign(angle) == branch[1]))
        if len(rows) > 2:
            rows = rows[np.argsort(moment[rows], kind="stable")]
            change = np.abs(np.gradient(moment[rows]))
            step = np.abs(np.gradient(angle[rows]))
            moves = change > 0.0  # two pulls may turn a hinge by the same to the last digit
            ratio = np.divide(step, change, out=weight[rows], where=moves)
            weight[rows] = np.minimum(ratio, _SOFTEST / stiffness)
    return weight


def _elastic(
    angle: Float[np.ndarray, " s"], knots: Float[np.ndarray, " k"]
) -> Float[np.ndarray, "s m"]:
    """Powers of the angle, and of its way beyond every knot."""
    own = angle[:, None] ** _POWERS
    beyond = np.array(np.where(np.sign(knots) * (angle[:, None] - knots) > 0.0, 1.0, 0.0))
    further = (angle[:, None] - knots)[..., None] ** _KNOT_POWERS * beyond[..., None]
    return np.concatenate([own, further.reshape(len(angle), -1)], axis=1)


def _friction(angle: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s 3"]:
    """Slopes of the powers of the friction potential."""
    return _FRICTION_POWERS * angle[:, None] ** (_FRICTION_POWERS - 1)


def potential_range(spring: HingeSpring) -> float:
    """Return the range of the friction potential over that of a hinge, N mm; 0 for rounding."""
    at = np.linspace(spring.low, spring.high, 201)
    rounding = _ROUNDING * np.abs(spring.moment(at)).max()
    if np.abs(spring.friction_moment(at)).max() <= rounding:
        return 0.0
    return float(np.abs(at[:, None] ** _FRICTION_POWERS @ spring.friction).max())
