"""The result of a design."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from notchflex._summary import Displayed, Summary, short
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.problem import DesignProblem
from notchflex.designing.search.robust_search import YieldOf
from notchflex.designing.search.search import Searches, SearchResult
from notchflex.designing.specification.asked import DesignConstraint, DesignObjective
from notchflex.designing.specification.spec import DesignSpec
from notchflex.errors import ConvergenceError
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot

MINIMISE, MAXIMISE = "as small as possible", "as great as possible"


@dataclass(frozen=True)
class WishResult:
    """One objective or constraint, with the achieved value.

    Attributes:
        title: The quantity, with its state.
        unit: Its unit.
        asked: What was asked of it, in words.
        achieved: Its numbers, made one or few as asked.
        before: The same of the robot that the design began with; empty where it has none.
        met: Whether it is met; None for an objective that is only to be small or great.
        parts: What the numbers are called.
    """

    title: str
    unit: str
    asked: str
    achieved: tuple[float, ...]
    before: tuple[float, ...]
    met: bool | None
    parts: tuple[str, ...]


@dataclass(frozen=True)
class VariableResult:
    """One number that the search chose.

    Attributes:
        name: What it is called.
        unit: Its unit.
        value: The value chosen.
        before: The value of the robot that the design began with, within the limits.
        lower: Least value allowed.
        upper: Greatest value allowed.
    """

    name: str
    unit: str
    value: float
    before: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False, repr=False)
class Design(Displayed):
    """A designed robot, and how well it does what was asked.

    Attributes:
        spec: What was asked.
        before: The robot that the design began with.
        robot: The designed robot.
        converged: Whether all constraints hold and no small change improves the design.
        reason: Why not, "" if it has converged.
        wishes: What was asked and what is achieved.
        variables: The numbers chosen.
        explanation: Sentences: which limits hold the design, what each costs, and what cannot be
            met.
        solves: Number of robots solved.
        gradients: Number of robots differentiated.
        starts: Number of searches.
        yields: Of a robust design, which part of robots made within the tolerances meets all
            limits, and each of them.
    """

    spec: DesignSpec
    before: Robot
    robot: Robot
    converged: bool
    reason: str
    wishes: tuple[WishResult, ...]
    variables: tuple[VariableResult, ...]
    explanation: tuple[str, ...]
    solves: int
    gradients: int
    starts: int
    outcome: SearchResult
    yields: tuple[YieldOf, ...] = ()

    @property
    def met(self) -> bool:
        """Whether all constraints hold."""
        return all(one.met is not False for one in self.wishes)

    @cached_property
    def path(self) -> EquilibriumPath | None:
        """The states of the designed robot, one after the other; None if nothing asks for one."""
        problem = self.outcome.problem
        return problem.solver.path(problem.x(self.outcome.found.z))

    @cached_property
    def path_before(self) -> EquilibriumPath | None:
        """The same of the robot that the design began with, at its loads."""
        problem = self.outcome.problem
        return problem.solver.path(problem.x(problem.start))

    @property
    def state_steps(self) -> dict[str, int]:
        """The step of every state in `path`."""
        steps = self.outcome.problem.solver.paths.step
        return {name: step for name, step in steps.items() if isinstance(name, str)}

    def save(self, folder: str | os.PathLike[str]) -> tuple[Any, ...]:
        """Write robot file, table, picture and JSON document into a folder.

        Args:
            folder: The folder; it is made if it is missing.

        Returns:
            The files.

        Raises:
            InputError: A file cannot be written.
        """
        from notchflex.designing.files import write_design

        return write_design(self, folder)

    def raise_if_failed(self) -> Design:
        """Return itself, if it converged.

        Raises:
            ConvergenceError: It did not; the message says why.
        """
        if not self.converged:
            raise ConvergenceError(self.reason)
        return self

    def _summary(self) -> Summary:
        rows = [
            (one.title, f"{numbers(one.achieved)} {one.unit}".rstrip() + f", asked {one.asked}")
            for one in self.wishes
        ]
        state = "converged" if self.converged else self.reason
        return Summary(f"Design {self.spec.name!r}: {state}", rows, " ".join(self.explanation[:2]))


def numbers(values: Sequence[float]) -> str:
    """Return a number, or the range of several."""
    if not values:
        return "-"
    low, high = min(values), max(values)
    if high - low <= 1e-6 * max(abs(low), abs(high)):
        return short(low)
    return f"{short(low)} to {short(high)}"


def asked_in_words(wish: Wish) -> str:
    """Return what was asked, such as "at most 0.06"."""
    asked = wish.asked
    if isinstance(asked, DesignObjective):
        if asked.target is not None:
            return f"near {asked.target:g} {wish.unit}".rstrip()
        return MINIMISE if asked.goal == "minimise" else MAXIMISE
    assert isinstance(asked, DesignConstraint)
    unit = f" {wish.unit}" if wish.unit else ""
    if asked.order is not None:
        by = f" by {asked.margin:g}{unit} or more" if asked.margin else ""
        way = "falling" if asked.order == "tip-first" else "rising"
        return f"{asked.order}: {way} toward the tip{by}"
    if asked.equal is not None:
        return f"{asked.equal:g}{unit}"
    of = "" if asked.wanted_yield is None else f" for {100.0 * asked.wanted_yield:g} % of robots"
    if asked.lower is not None and asked.upper is not None:
        return f"{asked.lower:g} to {asked.upper:g}{unit}{of}"
    if asked.lower is not None:
        return f"at least {asked.lower:g}{unit}{of}"
    return f"at most {asked.upper:g}{unit}{of}"


def total_counts(problems: Sequence[DesignProblem]) -> tuple[int, int]:
    """Return how many robots were solved and differentiated."""
    counts = {id(one.solver.counts): one.solver.counts for one in problems}.values()
    return sum(one["solves"] for one in counts), sum(one["gradients"] for one in counts)


__all__ = ["Design", "Searches", "VariableResult", "WishResult"]
