"""Sentences about a design: which limits hold it, what each costs, and what cannot be met."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from notchflex import Robot
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.optimality import ActiveLimit, multipliers
from notchflex.designing.search.problem import TOLERANCE, DesignProblem, Row
from notchflex.designing.search.robust import YieldOf
from notchflex.designing.search.search import SearchResult
from notchflex.designing.specification import DesignObjective, DesignSpec
from notchflex.support import numbers_at, round_number, short

# The most sentences about limits, the dearest first.
_MAX_SENTENCES = 12
# Change of a limit, relative to its size, for which its cost is stated.
_PART = 0.05
_NOTHING = 1e-9


def curves_missed(outcome: SearchResult) -> tuple[str, ...]:
    """Return a sentence for every curve with points that the axis does not reach."""
    one = outcome.found.evaluation
    assert one is not None
    sentences: list[str] = []
    for curve in {id(w.curve): w.curve for w in outcome.problem.wishes if w.curve}.values():
        far = one.point.plain.curve(curve).values
        numbers = np.flatnonzero(far > curve.within) + 1
        if len(numbers):
            shown = ", ".join(map(str, numbers[:10].tolist())) + (
                " ..." if len(numbers) > 10 else ""
            )
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
    low, high = (_percent(end) for end in one.interval)
    target = "" if one.wanted is None else f", wanted {_percent(one.wanted)} %"
    meets = "meet" if one.title == "all limits" else "meet the limit of"
    return (
        f"{_percent(one.achieved)} % of the robots made within the tolerances {meets} {one.title} "
        f"({low} to {high} %{target}); without regard to tolerances {_percent(one.plain)} %."
    )


def _percent(part: float) -> str:
    return f"{100.0 * part:.4g}"


def explain(outcome: SearchResult) -> tuple[str, ...]:
    """Return sentences about the best robot of a design."""
    return (*curves_missed(outcome), *_about_limits(outcome))


def _about_limits(outcome: SearchResult) -> tuple[str, ...]:
    one = outcome.found.evaluation
    assert one is not None
    problem = outcome.problem
    if problem.worst(one) > TOLERANCE:
        return (*_missed(outcome), *_at_limits(outcome))
    active = multipliers(problem, outcome.found.z, one)
    costs = sorted(active.held, key=lambda held: -abs(_effect(problem, held)[1]))
    sentences = [_sentence(problem, held) for held in costs]
    kept = [one for one in sentences if one]
    left = len(kept) - _MAX_SENTENCES
    if not kept:
        kept = ["No limit is active: the design meets the specification inside all limits."]
    more = [f"{left} more limits are reached."] if left > 0 else []
    return (*kept[:_MAX_SENTENCES], *more)


def _effect(problem: DesignProblem, held: ActiveLimit) -> tuple[float, float]:
    """A round change of a limit, and what it changes of the sum."""
    if held.is_variable:
        size = problem.solver.variables.span[held.row]
    else:
        row = problem.rows[held.row]
        limits = [abs(one) for one in (row.lower, row.upper) if np.isfinite(one)]
        size = max(limits, default=0.0) or float(problem.sizes[held.row])
    step = round_number(_PART * size)
    return step, held.cost * step


def _sentence(problem: DesignProblem, held: ActiveLimit) -> str:
    step, effect = _effect(problem, held)
    what = _objective_name(problem)
    limit, unit, change = _place(problem, held, step)
    if what is None or abs(effect) <= _NOTHING * problem.total_size:
        return f"{limit}." if held.side else ""
    name, of_unit, sign = what
    gain = effect if held.side else -abs(effect)
    if held.side == 0:
        way = "more" if effect < 0.0 else "less"
        change = f"{short(step)} {unit}".strip() + f" {way}"
    elif held.side < 0:
        gain = -effect
    amount = f"{short(abs(gain))} {of_unit}".strip()
    return f"{limit}; {change} would {'save' if sign > 0 else 'gain'} {amount} of {name}."


def _place(problem: DesignProblem, held: ActiveLimit, step: float) -> tuple[str, str, str]:
    if held.is_variable:
        column = problem.solver.variables.columns[held.row]
        limit = column.upper if held.side > 0 else column.lower
        title, unit = column.name, column.unit
    else:
        row = problem.rows[held.row]
        limit = row.upper if held.side >= 0 else row.lower
        title, unit = row.title, row.wish.unit
    at = {1: "greatest", -1: "least", 0: "wanted"}[held.side]
    shown = f"{short(limit)} {unit}".strip()
    change = f"{short(step)} {unit}".strip() + (" more" if held.side > 0 else " less")
    return f"{title} stands at its {at} value, {shown}", unit, change


def _objective_name(problem: DesignProblem) -> tuple[str, str, float] | None:
    """Name, unit and direction of the only objective; None without one."""
    objectives = problem.objectives
    if len(objectives) == 0:
        return None
    if len(objectives) > 1:
        return "the weighted sum of the objectives", "", 1.0
    wish = objectives[0]
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is not None:
        return f"the squared distance of {wish.title} from {asked.target:g}", "", 1.0
    if wish.take == "rms":
        return f"the square of {wish.title}", f"{wish.unit}²" if wish.unit else "", 1.0
    return wish.title, wish.unit, 1.0 if asked.goal == "minimise" else -1.0


def _missed(outcome: SearchResult) -> tuple[str, ...]:
    """Conflicting constraints, and the violation of each at the nearest robot."""
    one, problem = outcome.found.evaluation, outcome.problem
    assert one is not None
    violation = np.abs(problem.violation(one))
    worst: dict[int, tuple[float, int]] = {}
    wishes: dict[int, Wish] = {}
    for number, row in enumerate(problem.rows):
        if violation[number] > TOLERANCE:
            before = worst.get(id(row.wish), (0.0, number))
            worst[id(row.wish)] = max(before, (float(violation[number]), number))
            wishes[id(row.wish)] = row.wish
    sentences: list[str] = []
    for _, number in sorted(worst.values(), reverse=True):
        row = problem.rows[number]
        sentences.append(_miss(row, float(one.rows.values[number])))
    start = (
        "One constraint cannot be met"
        if len(sentences) == 1
        else "These constraints contradict each other"
    )
    return (
        f"{start} within the limits of the variables; the robot that comes nearest:",
        *sentences,
    )


def _miss(row: Row, value: float) -> str:
    unit = f" {row.wish.unit}" if row.wish.unit else ""
    limit = row.upper if value > row.upper else row.lower
    way = "above" if value > limit else "below"
    word = "the value" if row.is_equality else "its limit"
    off = f"{short(abs(value - limit))}{unit} {way} {word} {short(limit)}{unit}"
    return f"{row.title} is {short(value)}{unit}, {off}."


def _at_limits(outcome: SearchResult) -> tuple[str, ...]:
    """Which variables stand at their limits, where wider ones could help."""
    names: list[str] = []
    for z, column in zip(
        outcome.found.z.tolist(), outcome.problem.solver.variables.columns, strict=False
    ):
        if z < 1e-6 or z > 1.0 - 1e-6:
            limit = column.upper if z > 0.5 else column.lower
            which = "greatest" if z > 0.5 else "least"
            names.append(f"{column.name} ({which}, {limit:g} {column.unit})".replace(" )", ")"))
    if not names:
        return ("No variable stands at its limit: other variables are needed, or weaker wishes.",)
    shown = ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
    return (f"Wider limits could help where a variable stands at its own: {shown}.",)
