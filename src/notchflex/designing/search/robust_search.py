"""From a design to one whose limits hold for robots made within tolerances.

The search holds first-order quantiles. How many standard deviations they need is found by counting:
robots are drawn at each design, always at the same levels, until the part that meets the limits is
the one wanted, with the lower end of its 95 % interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool
from scipy.special import ndtri

from notchflex.designing.model.deviations import deviations_of
from notchflex.designing.search.drawn import levels_of, met_by
from notchflex.designing.search.local import LocalOptimum, search_from
from notchflex.designing.search.problem import DesignProblem, Progress
from notchflex.designing.search.robust_problem import Hold, RobustProblem, limited
from notchflex.designing.search.search import Searches, SearchResult
from notchflex.designing.specification.asked import DesignConstraint
from notchflex.designing.specification.spec import DesignSpec, RobustOptions
from notchflex.errors import InputError
from notchflex.robot.tolerance import Tolerance
from notchflex.tolerancing.yields import REPLICATES, yield_interval

# Searches from the best of the plain ones.
_STARTS = 2
_ROUNDS = 6
# The lower end of a yield may exceed its target by this part of the allowed failures.
_ABOVE = 0.1


@dataclass(frozen=True)
class YieldOf:
    """Which part of robots made within tolerances meets a limit, or all of them.

    Attributes:
        title: The constraint; "all limits" for all together.
        wanted: The part that is wanted; None where it is maximised or only reported.
        achieved: The part of the robots drawn of the design.
        interval: Its 95 % interval.
        plain: The same part of the design without regard to tolerances.
    """

    title: str
    wanted: float | None
    achieved: float
    interval: tuple[float, float]
    plain: float

    @property
    def met(self) -> bool:
        """Whether the part that is wanted is reached."""
        return self.wanted is None or self.achieved >= self.wanted


@dataclass(frozen=True)
class YieldEstimate:
    """Which drawn robots of a design meet which limits: an estimate of the yield.

    Attributes:
        met: By robot and constraint with limits.
    """

    met: Bool[np.ndarray, "draws k"]

    def part(self, columns: Sequence[int]) -> tuple[float, tuple[float, float]]:
        """Return which part meets all of some constraints, and its 95 % interval."""
        meets = np.asarray(self.met[:, list(columns)].all(axis=1))
        each = len(meets) // REPLICATES
        return float(meets.mean()), yield_interval(
            meets.reshape(REPLICATES, each).sum(axis=1), each
        )


@dataclass(frozen=True)
class YieldTarget:
    """The yield wanted of several constraints together, by their columns."""

    part: float
    columns: tuple[int, ...]


def robust_search(
    spec: DesignSpec,
    tolerances: Sequence[Tolerance],
    plain: Searches,
    progress: Progress | None,
) -> tuple[Searches, tuple[YieldOf, ...]]:
    """Search on from plain designs.

    Args:
        spec: The specification.
        tolerances: Within what robots are made.
        plain: The plain searches.
        progress: Called with what is done.

    Returns:
        The searches of the robust design, and the yields: of all limits together, and of every
        constraint with limits; no yields if Ctrl-C ended it before any was counted.

    Raises:
        InputError: No constraint has a limit, or nothing deviates.
    """
    options = spec.robust or RobustOptions()
    best = plain.best
    numbers = limited(best.problem)
    targets = _wanted(spec, options, best.problem, numbers)

    def counted(one: SearchResult) -> YieldEstimate:
        levels = levels_of(one.problem, tolerances, options.draws, options.seed)
        return YieldEstimate(met_by(one.problem, one.found.z, tolerances, levels, numbers))

    searches = Searches([best], plain.interrupted)
    try:
        before = count = counted(best)
    except KeyboardInterrupt:
        searches.interrupted = True
        return searches, ()
    starts = sorted(plain.outcomes, key=lambda one: one.merit)[:_STARTS]
    factors = [float(ndtri(one.part)) for one in targets]
    try:
        for done in range(0 if plain.interrupted else _ROUNDS):
            if progress is not None:
                progress("making it robust", done, _ROUNDS)
            holds = _holds(targets, factors, numbers)
            results = [_robust(one, tolerances, holds, spec.search.iterations) for one in starts]
            tried = Searches([one for one in results if one is not None])
            if not tried.outcomes:
                break
            count_now = counted(tried.best)
            if _is_better(targets, tried.best, count_now, searches.best, count):
                searches, count = tried, count_now
            starts = [tried.best]
            if not targets or not _recalibrate(targets, factors, count_now):
                break
    except KeyboardInterrupt:
        searches.interrupted = True
    return searches, _yields(best.problem, options, numbers, before, count)


def _wanted(
    spec: DesignSpec, options: RobustOptions, problem: DesignProblem, numbers: Sequence[int]
) -> list[YieldTarget]:
    """Return the yield targets: of single constraints, and of all together."""
    targets: list[YieldTarget] = []
    for column, number in enumerate(numbers):
        asked = problem.constraints[number].asked
        assert isinstance(asked, DesignConstraint)
        if asked.wanted_yield is not None:
            targets.append(YieldTarget(asked.wanted_yield, (column,)))
    if options.wanted_yield is not None:
        targets.append(YieldTarget(options.wanted_yield, tuple(range(len(numbers)))))
    return targets


def _holds(
    targets: Sequence[YieldTarget], factors: Sequence[float], numbers: Sequence[int]
) -> dict[int, Hold]:
    """Return how every constraint is to hold: by the largest factor of those that it needs."""
    holds: dict[int, Hold] = {}
    for one, factor in zip(targets, factors, strict=True):
        for column in one.columns:
            before = holds.get(numbers[column])
            if before is None or factor > before.factor:
                holds[numbers[column]] = Hold(one.part, factor)
    return holds


def _robust(
    start: SearchResult,
    tolerances: Sequence[Tolerance],
    holds: Mapping[int, Hold],
    iterations: int,
) -> SearchResult | None:
    """Search from the end of another search; None where that has no derivatives."""
    solver = start.problem.solver
    problem = RobustProblem(
        replace(solver, variables=replace(solver.variables, tolerances=tuple(tolerances))),
        start.problem.wishes,
        holds=holds,
    )
    first = problem.evaluate(start.found.z)
    if first is None:
        return None
    problem.set_sizes([first])
    if holds:  # the same sum, whose size several robots have shown
        vars(problem)["total_size"] = start.problem.total_size
    optimum: LocalOptimum = search_from(problem, start.found.z, iterations)
    return (
        None
        if optimum.evaluation is None
        else SearchResult(problem, start.number, optimum.z, optimum)
    )


def _recalibrate(
    targets: Sequence[YieldTarget], factors: list[float], count: YieldEstimate
) -> bool:
    """Move factors by what the counted yields lack; False where all are right."""
    right = True
    for number, one in enumerate(targets):
        low = count.part(one.columns)[1][0]
        if one.part <= low <= one.part + _ABOVE * (1.0 - one.part):
            continue
        aim = one.part + 0.5 * _ABOVE * (1.0 - one.part)
        edge = 0.5 / len(count.met)
        move = float(ndtri(aim) - ndtri(np.clip(low, edge, 1.0 - edge)))
        after = max(factors[number] + move, 0.0)
        right = right and after == factors[number]
        factors[number] = after
    return not right


def _is_better(
    targets: Sequence[YieldTarget],
    one: SearchResult,
    count: YieldEstimate,
    best: SearchResult,
    best_count: YieldEstimate,
) -> bool:
    """Whether a design lacks less yield than the best so far, or has a smaller sum."""
    if not targets:
        every = range(count.met.shape[1])
        return (one.merit[0] == 0.0) >= (best.merit[0] == 0.0) and (
            count.part(every)[0] >= best_count.part(every)[0]
        )
    lack, best_lack = (
        sum(max(one.part - counts.part(one.columns)[1][0], 0.0) for one in targets)
        for counts in (count, best_count)
    )
    if lack == best_lack == 0.0:
        return _total(one) < _total(best) or not isinstance(best.problem, RobustProblem)
    return lack < best_lack


def _total(one: SearchResult) -> float:
    assert one.found.evaluation is not None
    return one.found.evaluation.total


def _yields(
    problem: DesignProblem,
    options: RobustOptions,
    numbers: Sequence[int],
    before: YieldEstimate,
    after: YieldEstimate,
) -> tuple[YieldOf, ...]:
    every = tuple(range(len(numbers)))
    rows: list[tuple[str, float | None, tuple[int, ...]]] = [
        ("all limits", options.wanted_yield, every)
    ]
    for column, number in enumerate(numbers):
        wish = problem.constraints[number]
        asked = wish.asked
        assert isinstance(asked, DesignConstraint)
        rows.append((wish.title, asked.wanted_yield, (column,)))
    yields: list[YieldOf] = []
    for title, target, columns in rows:
        part, interval = after.part(columns)
        yields.append(YieldOf(title, target, part, interval, before.part(columns)[0]))
    return tuple(yields)


def check_limits(problems: Sequence[DesignProblem], tolerances: Sequence[Tolerance]) -> None:
    """Raise if there is nothing to make robust.

    Raises:
        InputError: No constraint has a limit, or nothing deviates.
    """
    if not any(map(limited, problems)):
        raise InputError.MISSING_VALUE(
            "a robust design needs a [[constraint]] with a limit: no robot made within tolerances "
            "has exactly one value; give `lower` or `upper`."
        )
    robot = problems[0].solver.variables.robot
    if not any(any(one.sd.values()) for one in deviations_of(robot, tolerances)):
        raise InputError.NO_DATA("nothing deviates: all tolerances are 0; give one that is not.")
