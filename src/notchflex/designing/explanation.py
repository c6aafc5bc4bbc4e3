"""Sentences about a design: which limits hold it, what each costs, and what cannot be met."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from notchflex import Robot
from notchflex.designing.problem import DesignProblem, Row
from notchflex.designing.robust import YieldOf
from notchflex.designing.search import SearchResult
from notchflex.designing.specification import DesignObjective, DesignSpec
from notchflex.search.slsqp import TOLERANCE
from notchflex.support import numbers_at, round_number, short

# The most sentences about limits, the dearest first.
_MAX_SENTENCES = 12
# Change of a limit, relative to its size, for which its cost is stated.
_PART = 0.05
# No effect is below this part of the sum; a limit of a variable is reached within this part.
_NO_EFFECT, _AT_LIMIT = 1e-9, 1e-6


def curves_missed(outcome: SearchResult) -> tuple[str, ...]:
    """Return a sentence for every curve with points that the axis does not reach."""
    sentences: list[str] = []
    for curve in {id(w.curve): w.curve for w in outcome.problem.wishes if w.curve}.values():
        far = outcome.evaluation.point.curve(curve).values
        numbers = (np.flatnonzero(far > curve.within) + 1).tolist()
        if numbers:
            shown = ", ".join(map(str, numbers[:10])) + (" ..." if len(numbers) > 10 else "")
            sentences.append(
                f"curve.{curve.name} is not reached at {len(numbers)} of {len(far)} points "
                f"({shown}), up to {short(float(far.max()))} mm away; asked {curve.within:g} mm."
            )
    return tuple(sentences)


def chosen_form(spec: DesignSpec, robot: Robot, forms: int) -> tuple[str, ...]:
    """Return a sentence about the number of notches and the sizes that were chosen of several."""
    if forms < 2:
        return ()
    chosen = [f"{robot.number_of_notches} notches"] if spec.number_of_notches else []
    for path in (path for stock in spec.stock for path in stock.values):
        value = next(iter(numbers_at(robot, path).values()))
        chosen.append(f"{path} {short(value)}")
    return (f"Chosen of {forms} combinations: {', '.join(chosen)}.",)


def yield_sentences(yields: Sequence[YieldOf]) -> tuple[str, ...]:
    """Return a sentence for the yield of all limits, and for every one that is wanted."""
    return tuple(_yield_sentence(one) for one in yields if one is yields[0] or one.wanted)


def _yield_sentence(one: YieldOf) -> str:
    achieved, low, high, plain = (
        f"{100.0 * part:.4g}" for part in (one.achieved, *one.interval, one.plain)
    )
    target = "" if one.wanted is None else f", wanted {100.0 * one.wanted:.4g} %"
    meets = "meet" if one.title == "all limits" else "meet the limit of"
    return (
        f"{achieved} % of the robots made within the tolerances {meets} {one.title} "
        f"({low} to {high} %{target}); without regard to tolerances {plain} %."
    )


def explain(outcome: SearchResult) -> tuple[str, ...]:
    """Return sentences about the best robot of a design."""
    missed = missed_rows(outcome)
    limits = (*_missed(outcome, missed), _at_limits(outcome)) if missed else _held(outcome)
    return (*curves_missed(outcome), *limits)


class _ActiveLimit(NamedTuple):
    """A limit that the design is at."""

    title: str
    unit: str
    limit: float
    side: str  # "least", "greatest" or "wanted"
    step: float  # a round change of the limit
    effect: float  # change of the sum by that step more


def _active_limits(outcome: SearchResult) -> list[_ActiveLimit]:
    """Return the limits that are reached, that with the greatest effect first."""
    problem, minimum = outcome.problem, outcome.minimum
    assert minimum is not None
    rows = [
        (row.title, row.wish.unit, row, row.size or size, 1.0)
        for row, size in zip(problem.rows, problem.sizes.tolist(), strict=True)
    ]
    columns = [(c.name, c.unit, c, c.span, c.span) for c in problem.solver.variables.columns]
    numbers = np.append(outcome.evaluation.rows.values, outcome.evaluation.point.x)
    first = len(minimum.multipliers) - len(minimum.variables)  # of the variables
    places = [*range(len(rows)), *range(first, first + len(columns))]
    limits: list[_ActiveLimit] = []
    for place, number, described in zip(places, numbers, [*rows, *columns], strict=True):
        if minimum.active[place]:
            title, unit, between, size, scale = described
            is_low = between.upper - number > number - between.lower
            limit = between.lower if is_low else between.upper
            is_equal = between.lower == between.upper
            side = "wanted" if is_equal else "least" if is_low else "greatest"
            step = round_number(_PART * size)
            effect = -minimum.multipliers[place] / scale * step
            limits.append(_ActiveLimit(title, unit, limit, side, step, effect))
    return sorted(limits, key=lambda limit: -abs(limit.effect))


def _held(outcome: SearchResult) -> tuple[str, ...]:
    """Which limits hold the design, and what each costs."""
    sentences = [_sentence(outcome, limit) for limit in _active_limits(outcome)]
    kept = [one for one in sentences if one]
    if not kept:
        return ("No limit is active: the design meets the specification inside all limits.",)
    left = len(kept) - _MAX_SENTENCES
    more = [f"{left} more limits are reached."] if left > 0 else []
    return (*kept[:_MAX_SENTENCES], *more)


def _sentence(outcome: SearchResult, active: _ActiveLimit) -> str:
    what = _objective_name(outcome.problem)
    limit = f"{active.title} stands at its {active.side} value, "
    limit += f"{short(active.limit)} {active.unit}".strip()
    if what is None or abs(active.effect) <= _NO_EFFECT * abs(outcome.evaluation.total):
        return "" if active.side == "wanted" else f"{limit}."
    name, unit, verb = what
    # A wanted value is moved to where the sum falls, a limit to where it leaves more room.
    is_more = active.effect < 0.0 if active.side == "wanted" else active.side == "greatest"
    step = f"{short(active.step)} {active.unit}".strip() + (" more" if is_more else " less")
    amount = f"{short(abs(active.effect))} {unit}".strip()
    return f"{limit}; {step} would {verb} {amount} of {name}."


def _objective_name(problem: DesignProblem) -> tuple[str, str, str] | None:
    """Name and unit of the objective, and what less of a limit does to it; None without one."""
    if not problem.objectives:
        return None
    if len(problem.objectives) > 1:
        return "the weighted sum of the objectives", "", "save"
    wish = next(iter(problem.objectives))
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is not None:
        return f"the squared distance of {wish.title} from {asked.target:g}", "", "save"
    if wish.take == "rms":
        return f"the square of {wish.title}", f"{wish.unit}²" if wish.unit else "", "save"
    return wish.title, wish.unit, "save" if asked.goal == "minimise" else "gain"


def missed_rows(outcome: SearchResult) -> list[int]:
    """Return the number of the row by which each missed constraint is missed most, worst first."""
    rows, worst = outcome.problem.rows, dict[int, int]()
    violation = np.abs(outcome.problem.violation(outcome.evaluation))
    for number in np.argsort(-violation).tolist():
        if violation[number] > TOLERANCE:
            worst.setdefault(id(rows[number].wish), number)
    return list(worst.values())


def _missed(outcome: SearchResult, missed: Sequence[int]) -> tuple[str, ...]:
    """Conflicting constraints, and the violation of each at the nearest robot."""
    several = "These constraints contradict each other"
    start = several if len(missed) > 1 else "One constraint cannot be met"
    numbers = outcome.evaluation.rows.values.tolist()
    return (
        f"{start} within the limits of the variables; the robot that comes nearest:",
        *(_miss(outcome.problem.rows[number], numbers[number]) for number in missed),
    )


def _miss(row: Row, value: float) -> str:
    unit = f" {row.wish.unit}" if row.wish.unit else ""
    limit = row.upper if value > row.upper else row.lower
    way = "above" if value > limit else "below"
    word = "the value" if row.lower == row.upper else "its limit"
    off = f"{short(abs(value - limit))}{unit} {way} {word} {short(limit)}{unit}"
    return f"{row.title} is {short(value)}{unit}, {off}."


def _at_limits(outcome: SearchResult) -> str:
    """Which variables stand at their limits, where wider ones could help."""
    columns = outcome.problem.solver.variables.columns
    names: list[str] = []
    for z, column in zip(outcome.evaluation.z.tolist(), columns, strict=True):
        if abs(z - 0.5) > 0.5 - _AT_LIMIT:
            which, limit = ("greatest", column.upper) if z > 0.5 else ("least", column.lower)
            names.append(f"{column.name} ({which}, {limit:g} {column.unit})".replace(" )", ")"))
    if not names:
        return "No variable stands at its limit: other variables are needed, or weaker wishes."
    shown = ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
    return f"Wider limits could help where a variable stands at its own: {shown}."
