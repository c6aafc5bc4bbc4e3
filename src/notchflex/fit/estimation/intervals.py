"""95 % intervals by profile likelihood (Venzon and Moolgavkar 1988).

The ends are where the least misfit with one constant held has risen by as much as chance allows.
No linear estimate is shown as an interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2, f

from notchflex.fit.estimation.minimise import Cost, Minimum, Objective, Vector, minimise

LEVEL = 0.95
# How near the root of the rise must be to its target (of about 2), and how many tries to get there.
_CLOSE, _TRIES = 0.005, 12
# So many estimated half-widths away the data still set no end.
_MAX_HALF_WIDTHS = 50.0
NO_SOLUTION = "the model has no solution that far"
"""Why an end is open that the data may well set."""


@dataclass(frozen=True)
class Interval:
    """Interval of a constant.

    Attributes:
        lower: Lower end; None if the data set none.
        upper: Upper end; None if the data set none.
        profile: Values of the constant and the rise of twice the misfit there, as tried, in
            the order of the values, with the estimate, (m, 2).
        reason: Why an end is open, "" if none is.
    """

    lower: float | None
    upper: float | None
    profile: Float[np.ndarray, "m 2"]
    reason: str = ""


def allowed_rise(freedom: int | None, level: float = LEVEL) -> float:
    """Return the rise of twice the misfit that chance allows.

    By chi squared if the noise is known, else by F with the degrees of freedom of its estimate.
    """
    return float(chi2.ppf(level, 1) if freedom is None else f.ppf(level, 1, max(freedom, 1)))


@dataclass(frozen=True, eq=False)
class Profile:
    """The misfit about its minimum, as a function of one constant.

    Attributes:
        objective: The misfit.
        best: Values at the minimum.
        cost: The misfit there, with derivatives.
        number: Number of the constant.
        lower: Least values allowed.
        upper: Greatest values allowed.
    """

    objective: Objective
    best: Vector
    cost: Cost
    number: int
    lower: Vector
    upper: Vector

    def interval(self, *, rise: float, scale: float) -> Interval:
        """Return the interval for an allowed rise of twice the misfit.

        `scale` is a typical size of the constant's changes, if its curvature gives none.
        """
        points: dict[float, float] = {float(self.best[self.number]): 0.0}
        ends: list[float | None] = []
        reasons: list[str] = []
        for side, word, limits in ((-1.0, "below", self.lower), (1.0, "above", self.upper)):
            limit = float(limits[self.number])
            end, reason = self._end(side, limit, rise, scale, points)
            ends.append(None if end is None else float(end))
            if end is None:
                at = f" (limit {limit:.6g})" if np.isfinite(limit) else ""
                reasons.append(reason or f"nothing in the data holds it from {word}{at}")
        profile = np.array(sorted(points.items()))
        return Interval(ends[0], ends[1], profile, "; ".join(dict.fromkeys(reasons)))

    def held(self, value: float, start: Vector) -> Minimum:
        """Return the minimum with the constant held at a value, searched from a start."""
        start, lower, upper = (one.copy() for one in (start, self.lower, self.upper))
        for values in (start, lower, upper):
            values[self.number] = value
        return minimise(self.objective, start, lower, upper, tolerance=1e-7)

    def _end(
        self, side: float, limit: float, rise: float, scale: float, points: dict[float, float]
    ) -> tuple[float | None, str]:
        """One end of the interval: where the root of the rise, nearly linear, meets its target."""
        estimate = float(self.best[self.number])
        guess = min(self._half_width(rise), _MAX_HALF_WIDTHS * scale)
        target = np.sqrt(rise)
        inner, outer = (0.0, 0.0), None
        reach, start = guess, self.best
        for _ in range(_TRIES):
            value = estimate + side * reach
            at_limit = (value - limit) * side >= 0.0
            if at_limit:
                value, reach = limit, abs(limit - estimate)
                if reach == 0.0:
                    return None, ""
            minimum = self.held(value, start)
            root = np.inf  # without a robot, or a solution, that far the end must be nearer
            if minimum.cost is not None:
                start = minimum.values
                points[value] = max(2.0 * (minimum.cost.value - self.cost.value), 0.0)
                root = np.sqrt(points[value])
            if abs(root - target) < _CLOSE * target:
                return value, ""
            if root > target:
                outer = (reach, root)
            elif at_limit:
                return None, ""
            else:
                inner = (reach, root)
            if outer is None:
                if reach >= _MAX_HALF_WIDTHS * max(scale, guess):
                    return None, ""
                reach *= min(max(1.1 * target / max(root, 1e-300), 1.2), 4.0)
            elif np.isinf(outer[1]):
                reach = 0.5 * (inner[0] + outer[0])
            else:
                share = (target - inner[1]) / (outer[1] - inner[1])
                reach = inner[0] + min(max(share, 0.05), 0.95) * (outer[0] - inner[0])
        if outer is None or np.isinf(outer[1]):
            return None, NO_SOLUTION
        return estimate + side * reach, ""

    def _half_width(self, rise: float) -> float:
        """Half an interval if the misfit were a parabola."""
        sizes, plain = unit_free(self.cost.curvature)
        inverse = np.linalg.pinv(plain, rcond=1e-10, hermitian=True)
        variance = max(inverse[self.number, self.number], 1e-12)
        return float(np.sqrt(rise * variance) / sizes[self.number])


def unit_free(curvature: Float[np.ndarray, "k k"]) -> tuple[Vector, Float[np.ndarray, "k k"]]:
    """Return the units that give a curvature ones on its diagonal, and the curvature in these.

    Example:
        >>> unit_free(np.array([[4.0, 1.0], [1.0, 1.0]]))[1].tolist()
        [[1.0, 0.5], [0.5, 1.0]]
    """
    sizes = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
    return sizes, curvature / np.outer(sizes, sizes)
