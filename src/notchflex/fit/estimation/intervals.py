"""Minimising within limits, and 95 % intervals by profile likelihood (Venzon and Moolgavkar 1988).

`scipy.optimize.least_squares` searches, with its trust region and its steps along limits. It takes
residuals: a function that is not a sum of squares is passed as residuals that have its value,
gradient and curvature. A trial value at which the model has no solution counts as infinite.

The ends are where the least misfit with one constant held has risen by as much as chance allows.
No linear estimate is shown as an interval.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.stats import chi2, f

from notchflex.support import Displayed, Summary, short

_EVALUATIONS = 200
# Part of the objective that a full step may still promise to gain at the end: at a kink, such as
# where a notch closes, no step gains what the curvature promises.
_KINK = 1e-3

Vector = Float[np.ndarray, " k"]


class Cost(NamedTuple):
    """An objective at some values.

    Attributes:
        value: Its value, 0 or more.
        gradient: Its derivatives.
        curvature: Approximate second derivatives, positive semidefinite.
        residuals: The residuals it is made of, less what deviations from the drawing explain.
        contributions: What each residual adds to the gradient; the deviations from the drawing
            make the best of it.
        deviations: The deviations, in standard deviations, less their means, (m,).
        scatter: Covariance of the gradient that priors stand for.
        hessian: Second derivatives, if they are known better than `curvature`.
    """

    value: float
    gradient: Vector
    curvature: Float[np.ndarray, "k k"]
    residuals: Any = None
    contributions: Float[np.ndarray, "r k"] = np.zeros((0, 0))
    deviations: Float[np.ndarray, " m"] = np.zeros(0)
    scatter: Any = 0.0
    hessian: Any = None


class Minimum(NamedTuple):
    """Result of one search.

    Attributes:
        values: The values.
        cost: The objective there, with derivatives; None if the search could not start.
        converged: Whether it is a minimum.
        reason: Why not, "" if it is.
        iterations: Number of steps.
        calls: Number of evaluations of the objective.
    """

    values: Vector
    cost: Cost | None
    converged: bool
    reason: str
    iterations: int
    calls: int


Objective = Callable[[Vector], Cost | None]
"""Values -> cost with its derivatives, or None if the model has no solution."""


def minimise(
    objective: Objective, start: Vector, lower: Vector, upper: Vector, *, tolerance: float = 1e-10
) -> Minimum:
    """Search for a minimum from a start, within limits; equal limits hold a value.

    The search stops if a step lowers the objective by less than `tolerance` of it.

    Example:
        >>> def bowl(at):
        ...     return Cost(float((at - 2.0) @ (at - 2.0)), 2.0 * (at - 2.0), 2.0 * np.eye(1))
        >>> minimise(bowl, np.zeros(1), np.zeros(1), np.ones(1)).values
        array([1.])
    """
    values = np.clip(np.asarray(start, float), lower, upper)
    first = objective(values)
    if first is None:
        return Minimum(values, None, False, "the model has no solution at the start", 0, 1)
    if (lower == upper).all():
        return Minimum(values, first, True, "", 0, 1)
    scaled = _Scaled(objective, values, first, lower, upper)
    result = least_squares(
        scaled.residuals,
        np.zeros(len(scaled.scale)),
        cast("Any", scaled.jacobian),  # SciPy's annotations omit functions here, and None below
        (scaled.least, scaled.most),
        method="dogbox",
        ftol=tolerance,
        xtol=1e-10,
        gtol=cast("Any", None),
        max_nfev=_EVALUATIONS,
    )
    cost = scaled.cost(result.x)
    assert cost is not None
    # How much lower a full step of the values that are not at a limit should be.
    residual, slopes = scaled.squares(cost)
    free = slopes[:, result.active_mask == 0]
    promised = 0.5 * np.sum((free @ np.linalg.lstsq(free, residual)[0]) ** 2)
    settled = promised <= _KINK * (1.0 + cost.value)
    reason = "" if settled else "no step lowers the objective (a kink, or rounding)"
    if result.status == 0:
        reason = f"not settled after {_EVALUATIONS} evaluations"
    values, calls = scaled.values(result.x), len(scaled.tried)
    return Minimum(values, cost, not reason, reason, int(result.njev) - 1, calls)


class _Scaled:
    """The objective of scaled steps of the values that are not held, as a sum of squares."""

    def __init__(
        self, objective: Objective, start: Vector, first: Cost, lower: Vector, upper: Vector
    ) -> None:
        self.objective, self.start, self.lower, self.upper = objective, start, lower, upper
        self.free = np.flatnonzero(lower < upper)
        size = np.where(start == 0.0, 1.0, np.abs(start))
        curvature = np.diag(first.curvature)
        is_known = curvature > 0.0
        scale = np.where(is_known, 1.0 / np.sqrt(np.where(is_known, curvature, 1.0)), size)
        self.scale = scale[self.free]
        self.least, self.most = (
            (limit - start)[self.free] / self.scale for limit in (lower, upper)
        )
        self.tried: dict[bytes, Cost | None] = {np.zeros(len(self.free)).tobytes(): first}

    def values(self, step: Vector) -> Vector:
        """Return the values after a step, exactly at a limit where the step is."""
        values, lower, upper = (one.copy() for one in (self.start, self.lower, self.upper))
        moved = values[self.free] + self.scale * step
        moved = np.where(step >= self.most, upper[self.free], moved)
        values[self.free] = np.where(step <= self.least, lower[self.free], moved)
        return np.clip(values, lower, upper)

    def cost(self, step: Vector) -> Cost | None:
        key = step.tobytes()
        if key not in self.tried:
            self.tried[key] = self.objective(self.values(step))
        return self.tried[key]

    def residuals(self, step: Vector) -> Float[np.ndarray, " k+1"]:
        cost = self.cost(step)
        return np.full(len(step) + 1, np.inf) if cost is None else self.squares(cost)[0]

    def jacobian(self, step: Vector) -> Float[np.ndarray, "k+1 k"]:
        cost = self.cost(step)
        assert cost is not None  # asked only where the residuals are finite
        return self.squares(cost)[1]

    def squares(self, cost: Cost) -> tuple[Float[np.ndarray, " k+1"], Float[np.ndarray, "k+1 k"]]:
        """Return residuals f with derivatives J: |f|^2 / 2 is the objective, J^T f its gradient.

        J^T J is its curvature, or more: the objective is never below 0, so no step may promise to
        lower it by more than its value.
        """
        gradient = self.scale * cost.gradient[self.free]
        curvature = cost.curvature[np.ix_(self.free, self.free)]
        sizes, axes = np.linalg.eigh(curvature * np.outer(self.scale, self.scale))
        is_known = sizes > 1e-12 * sizes[-1]
        root = np.sqrt(np.where(is_known, sizes, 1.0))
        along = np.where(is_known, axes.T @ gradient / root, 0.0)
        slopes = np.where(is_known, root, 0.0)[:, None] * axes.T
        stiffer = max(np.sqrt(along @ along / max(2.0 * cost.value, 1e-300)), 1.0)
        along, slopes = along / stiffer, slopes * stiffer
        rest = np.sqrt(max(2.0 * cost.value - along @ along, 0.0))
        return np.append(along, rest), np.vstack([slopes, np.zeros(len(self.scale))])


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


@dataclass(frozen=True, eq=False, repr=False)
class Profile(Displayed):
    """The misfit about its minimum, as a function of one constant.

    Attributes:
        search: Finds the least misfit from a start, between least and greatest values.
        best: Values at the minimum.
        cost: The misfit there, with derivatives.
        number: Number of the constant.
        lower: Least values allowed.
        upper: Greatest values allowed.
    """

    search: Callable[[Vector, Vector, Vector], Minimum]
    best: Vector
    cost: Cost
    number: int
    lower: Vector
    upper: Vector

    def _summary(self) -> Summary:
        limits = (self.lower[self.number], self.upper[self.number])
        rows = [
            ("at the minimum", short(self.best[self.number])),
            ("limits", " to ".join(map(short, limits))),
            ("misfit there", short(self.cost.value)),
        ]
        title = f"Misfit as a function of constant {self.number + 1} of {len(self.best)}"
        return Summary(title, rows, ".interval(rise=..., scale=...) finds where it has risen")

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
        return self.search(start, lower, upper)

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
