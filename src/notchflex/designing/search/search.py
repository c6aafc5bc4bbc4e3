"""The whole search: every size and number of notches, several starts each, the best of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from notchflex.designing.search.local import LocalOptimum, search_from, search_on
from notchflex.designing.search.nearest import nearest
from notchflex.designing.search.problem import DesignProblem, Progress, Vector
from notchflex.designing.search.rows import TOLERANCE
from notchflex.designing.search.squares import is_followed
from notchflex.designing.search.starts import starts
from notchflex.designing.specification.spec import SearchOptions
from notchflex.errors import InputError

# Largest violation of a robot from which another search starts.
_MAX_VIOLATION = 1e-3
# Largest difference of scaled variables of equal robots.
_MAX_DIFFERENCE = 1e-3


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Result of one search.

    Attributes:
        problem: Robots of which form.
        number: Number of that form.
        start: Where it began, scaled.
        found: Where it ended.
    """

    problem: DesignProblem
    number: int
    start: Vector
    found: LocalOptimum

    @property
    def merit(self) -> tuple[float, float]:
        """Largest violation, and the sum; less is better."""
        one = self.found.evaluation
        assert one is not None
        worst = self.problem.worst(one)
        return (worst if worst > TOLERANCE else 0.0), one.total


@dataclass(eq=False)
class Searches:
    """All searches of a design.

    Attributes:
        outcomes: Where they ended.
        interrupted: Whether they were stopped by Ctrl-C.
    """

    outcomes: list[SearchResult] = field(default_factory=list[SearchResult])
    interrupted: bool = False

    @property
    def best(self) -> SearchResult:
        """The best of all."""
        return min(self.outcomes, key=lambda one: one.merit)

    def of(self, number: int) -> list[SearchResult]:
        """Return where the searches of a form ended."""
        return [one for one in self.outcomes if one.number == number]

    def settled(self, number: int) -> list[LocalOptimum]:
        """Return the searches of a form that settled at different robots."""
        optima: list[LocalOptimum] = []
        for one in self.of(number):
            same = any(_same(one.found, other) for other in optima)
            if one.found.stationary and one.found.trajectory and not same:
                optima.append(one.found)
        return optima

    def has_agreed(self, number: int, count: int) -> bool:
        """Return whether nothing is to be gained from further searches of a form.

        So many have settled at the best robot that it has, or a curve is followed.
        """
        best = min(self.of(number), key=lambda one: one.merit, default=None)
        if best is None or best.merit[0] > 0.0:
            return False
        near = [one for one in self.of(number) if _same(one.found, best.found)]
        return sum(one.found.stationary for one in near) >= count or self.has_followed(number)

    def has_followed(self, number: int) -> bool:
        """Whether nothing but curves is asked, and a robot of a form follows all well enough."""
        return any(is_followed(one.problem, one.merit[1]) for one in self.of(number))


def _same(one: LocalOptimum, other: LocalOptimum) -> bool:
    return bool(np.abs(one.z - other.z).max(initial=0.0) < _MAX_DIFFERENCE)


def search(
    problems: Sequence[DesignProblem], options: SearchOptions, progress: Progress | None
) -> Searches:
    """Search robots of several forms.

    Args:
        problems: A problem for every form.
        options: How hard to try.
        progress: Called with what is done.

    Raises:
        InputError: No robot between the limits can be solved; the message says why.
    """
    searches = Searches()
    report: Progress = progress or (lambda stage, done, total: None)
    several = max(1, round(options.starts / len(problems)))
    each = max(4, options.candidates // len(problems))
    try:
        for number, problem in enumerate(problems):
            report("ranking robots", number, len(problems))
            for done, z in enumerate(starts(problem, several, each, options.seed)):
                report("searching", number * several + done, several * len(problems))
                settled = searches.settled(number)
                optimum = search_from(problem, z, options.iterations, settled)
                if optimum.evaluation is not None:
                    searches.outcomes.append(SearchResult(problem, number, z, optimum))
                if searches.has_agreed(number, max(2, (several + 1) // 2)):
                    break
            if searches.has_followed(number):
                break
        if searches.outcomes and searches.best.merit[0] > 0.0:
            report("searching what comes nearest", 0, 1)
            _approach(searches, options)
        if searches.outcomes and not searches.best.found.stationary:
            report("searching on", 0, 1)
            best = searches.best
            if best.merit[0] == 0.0:
                optimum = search_on(best.problem, best.found, options.iterations)
                searches.outcomes.append(replace(best, found=optimum))
    except KeyboardInterrupt:
        searches.interrupted = True
        if not searches.outcomes:
            raise
    if not searches.outcomes:
        raise _nothing(problems)
    return searches


def _approach(searches: Searches, options: SearchOptions) -> None:
    """Search what misses least, and from there once more if nothing is missed."""
    ordered = sorted(searches.outcomes, key=lambda one: one.merit)[: max(2, options.starts // 2)]
    for one in ordered:
        evaluation = one.found.evaluation
        assert evaluation is not None
        z, near = nearest(one.problem, one.found.z, evaluation)
        if one.problem.worst(near) <= _MAX_VIOLATION:
            optimum = search_from(one.problem, z, options.iterations)
        else:
            optimum = LocalOptimum(z, near, False, 0)
        if optimum.evaluation is not None:
            searches.outcomes.append(SearchResult(one.problem, one.number, one.start, optimum))
        if searches.best.merit[0] == 0.0:
            return


def _nothing(problems: Sequence[DesignProblem]) -> InputError:
    """Make the error that says why no robot could be solved."""
    reasons: dict[str, int] = {}
    for problem in problems:
        for reason, count in problem.failures.items():
            reasons[reason] = reasons.get(reason, 0) + count
    most = max(reasons, key=lambda one: reasons[one], default="no robot was tried")
    first = most.splitlines()[0]
    return InputError.UNSUPPORTED(
        "no robot between the limits of the variables can be made and solved; most often: "
        f"{first} Change the limits or the loads."
    )
