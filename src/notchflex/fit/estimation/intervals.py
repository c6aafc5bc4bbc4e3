"""95 % intervals: how far a constant may go while all others make the best of it.

Profile likelihood (Venzon and Moolgavkar 1988): the ends are where the least misfit with that
constant held has risen by what chance would let it. No straight-line guess is told as an interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, f

from notchflex.fit.estimation.curvature import unit_free
from notchflex.fit.estimation.minimise import Cost, Objective, minimise

LEVEL = 0.95
# How near the root of the rise must be to its target (of about 2), and how many tries to get there.
_CLOSE, _TRIES = 0.005, 12
# So many times the guessed half-width is far enough to say that the data set no end.
_FAR = 50.0
NO_SOLUTION = "the model has no solution that far"
"""Why an end is open that the data may well set."""


@dataclass(frozen=True)
class Interval:
    """Where a constant lies.

    Attributes:
        lower: Lower end; None where the data set none.
        upper: Upper end; None where the data set none.
        profile: Values of the constant and by how much twice the misfit rises there, as tried, in
            the order of the values; the estimate among them.
        reason: Why an end is open, "" where none is.
    """

    lower: float | None
    upper: float | None
    profile: Float[np.ndarray, "m 2"]
    reason: str = ""

    @property
    def is_closed(self) -> bool:
        """Whether the data set both ends."""
        return self.lower is not None and self.upper is not None


def allowed_rise(freedom: int | None, level: float = LEVEL) -> float:
    """By how much twice the misfit may rise: of chi squared, or of F where the fit told the noise.

    Args:
        freedom: Degrees of freedom that the noise was told with; None where it is known.
        level: Confidence.
    """
    return float(chi2.ppf(level, 1) if freedom is None else f.ppf(level, 1, max(freedom, 1)))


def profile_interval(
    objective: Objective,
    best: Float[np.ndarray, " k"],
    cost: Cost,
    number: int,
    lower: Float[np.ndarray, " k"],
    upper: Float[np.ndarray, " k"],
    *,
    rise: float,
    scale: float,
) -> Interval:
    """The interval of one constant.

    Args:
        objective: The misfit.
        best: Where it is least.
        cost: The misfit there, with slopes.
        number: Which constant.
        lower: Least values allowed.
        upper: Greatest values allowed.
        rise: By how much twice the misfit may rise.
        scale: A size of the constant's changes, to begin with where its curvature tells none.
    """
    points: dict[float, float] = {float(best[number]): 0.0}
    ends: list[float | None] = []
    why: list[str] = []
    for side in (-1.0, 1.0):
        limit = lower[number] if side < 0.0 else upper[number]
        end, reason = _end(objective, best, cost, number, lower, upper, rise, scale, side, points)
        ends.append(end)
        if end is None:
            word = "below" if side < 0.0 else "above"
            at = f" (limit {limit:.6g})" if np.isfinite(limit) else ""
            why.append(reason or f"nothing in the data holds it from {word}{at}")
    profile = np.array(sorted(points.items()))
    return Interval(ends[0], ends[1], profile, "; ".join(dict.fromkeys(why)))


def _end(
    objective: Objective,
    best: np.ndarray,
    cost: Cost,
    number: int,
    lower: np.ndarray,
    upper: np.ndarray,
    rise: float,
    scale: float,
    side: float,
    points: dict[float, float],
) -> tuple[float | None, str]:
    """One end of an interval: where the root of the rise, nearly straight, meets its target."""
    guess = min(_half_width(cost.curvature, number, rise), _FAR * scale)
    limit = lower[number] if side < 0.0 else upper[number]
    target = np.sqrt(rise)
    inner, outer = (0.0, 0.0), None
    reach = guess
    warm = best.copy()
    for _ in range(_TRIES):
        value = float(best[number] + side * reach)
        at_limit = (value - limit) * side >= 0.0
        if at_limit:
            value = float(limit)
            reach = abs(value - best[number])
            if reach == 0.0:
                return None, ""
        found = held(objective, warm, number, value, lower, upper)
        if found is None:
            # No robot, or no solution, that far: the end must be nearer.
            outer = (reach, np.inf)
            root = np.inf
        else:
            warm, least = found
            rose = max(2.0 * (least - cost.value), 0.0)
            points[value] = rose
            root = np.sqrt(rose)
            if abs(root - target) < _CLOSE * target:
                return value, ""
            if root < target:
                if at_limit:
                    return None, ""
                inner = (reach, root)
            else:
                outer = (reach, root)
        if outer is None:
            if reach >= _FAR * max(scale, guess):
                return None, ""
            reach *= min(max(1.1 * target / max(root, 1e-300), 1.2), 4.0)
        elif np.isinf(outer[1]):
            reach = 0.5 * (inner[0] + outer[0])
        else:
            share = (target - inner[1]) / (outer[1] - inner[1])
            reach = inner[0] + min(max(share, 0.05), 0.95) * (outer[0] - inner[0])
    if outer is None or np.isinf(outer[1]):
        return None, NO_SOLUTION
    return float(best[number] + side * reach), ""


def _half_width(curvature: np.ndarray, number: int, rise: float) -> float:
    """Half an interval if the misfit were a parabola."""
    plain = unit_free(curvature)
    inverse = np.linalg.pinv(plain.curvature, rcond=1e-10, hermitian=True)
    return float(np.sqrt(rise * max(inverse[number, number], 1e-12)) / plain.size[number])


def held(
    objective: Objective,
    start: Float[np.ndarray, " k"],
    number: int,
    value: float,
    lower: Float[np.ndarray, " k"],
    upper: Float[np.ndarray, " k"],
) -> tuple[Float[np.ndarray, " k"], float] | None:
    """The least misfit with one constant held, and where; None where there is no solution.

    Args:
        objective: The misfit.
        start: Values of all constants to begin with.
        number: Which constant.
        value: Where it is held.
        lower: Least values allowed.
        upper: Greatest values allowed.
    """
    others = np.delete(np.arange(len(start)), number)

    def whole(part: np.ndarray) -> np.ndarray:
        at = start.copy()
        at[number] = value
        at[others] = part
        return at

    def reduced(part: np.ndarray) -> Cost | None:
        came = objective(whole(part))
        if came is None:
            return None
        own = came.curvature[np.ix_(others, others)]
        return came._replace(gradient=came.gradient[others], curvature=own)

    if not len(others):
        came = objective(whole(np.zeros(0)))
        return None if came is None else (whole(np.zeros(0)), came.value)
    found = minimise(reduced, start[others], lower[others], upper[others], tolerance=1e-7)
    return None if found.cost is None else (whole(found.values), found.cost.value)


__all__ = ["LEVEL", "NO_SOLUTION", "Interval", "allowed_rise", "held", "profile_interval"]
