"""`nf.design`: a robot from a specification, in every allowed form, on a grid of lengths."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from notchflex import InputError, Robot, load_robot
from notchflex.analysis.draws import tolerances_of
from notchflex.designing.model.point import BODIES, Solver
from notchflex.designing.model.quantities import COMPLIANCE, CURVE, OF_STATES
from notchflex.designing.model.variables import Direction, check_states, state_paths, variables_of
from notchflex.designing.model.wishes import wishes_of
from notchflex.designing.problem import DesignProblem, Progress
from notchflex.designing.result import (
    Design,
    VariableResult,
    WishResult,
    asked_in_words,
    chosen_form,
    curves_missed,
    explain,
    missed_rows,
    yield_sentences,
)
from notchflex.designing.robust import YieldOf, check_limits, robust_search
from notchflex.designing.search import Searches, on_grid, search
from notchflex.designing.specification import (
    DesignObjective,
    DesignSpec,
    RobustOptions,
    read_design,
    spec_from_table,
)
from notchflex.support import (
    check_number,
    from_table,
    numbers_at,
    remember_source,
    short_repr,
    source_of,
    to_table,
)

MAX_FORMS = 200


def problems_of(spec: DesignSpec, robot: Robot) -> list[DesignProblem]:
    """Make a problem for every size and every number of notches that a design may choose.

    Raises:
        InputError: What is asked does not fit the robot or itself.
    """
    _check_stock(spec, robot)
    return [_problem(spec, form) for form in _forms(spec, robot)]


def _problem(spec: DesignSpec, robot: Robot) -> DesignProblem:
    """Make the problem of one form: its wishes, and the states that they need."""
    check_states(spec.state, robot.number_of_tendons)
    wishes = wishes_of(spec, robot)
    curves = {f"{CURVE}{curve.name}": curve.state for curve in spec.curve}
    used: list[str] = []
    probes: list[tuple[str, Direction]] = []
    outputs: list[str] = []
    for wish in wishes:
        quantity = wish.asked.quantity
        states = [name for name in (wish.asked.state, wish.asked.minus) if name is not None]
        if quantity == COMPLIANCE:
            probes += [(name, wish.direction) for name in states]
            outputs.append("tip_position")
        elif quantity in curves:
            used.append(curves[quantity])
            outputs += BODIES
        else:
            used += states
            outputs += [quantity] if quantity in OF_STATES else []
    names = list(dict.fromkeys(used))
    paths = state_paths(spec.state, robot.number_of_tendons, names, probes)
    variables = variables_of(robot, spec.variable, paths.states)
    unique = tuple(dict.fromkeys(outputs or ["total_angle"]))
    return DesignProblem(Solver(variables, paths, unique), wishes)


def _check_stock(spec: DesignSpec, robot: Robot) -> None:
    """Raise if a number of the robot is chosen by a stock and by something else."""
    paths = [(f"stock[{k}]", path) for k, one in enumerate(spec.stock, 1) for path in one.values]
    variables = enumerate(spec.variable, 1)
    paths += [(f"variable[{k}]", v.value) for k, v in variables if not v.is_load]
    chosen: dict[str, str] = {}
    for place, path in paths:
        try:
            numbers = numbers_at(robot, path)
        except InputError as error:
            raise InputError(f"`{place}`: {error}", error.code) from None
        for number in numbers:
            before = chosen.get(number, "")
            if before.startswith("stock"):
                raise InputError.CONFLICT(
                    f"`{place}`: `{number}` is chosen by `{before}` too; leave one of them out."
                )
            chosen[number] = place


def _forms(spec: DesignSpec, robot: Robot) -> list[Robot]:
    numbers = spec.number_of_notches or (robot.number_of_notches,)
    sizes = [
        [tuple(zip(stock.values, size, strict=True)) for size in stock.sizes]
        for stock in spec.stock
    ]
    combinations = list(itertools.product(numbers, itertools.product(*sizes)))
    if len(combinations) > MAX_FORMS:
        raise InputError.OUT_OF_RANGE(
            f"there are {len(combinations)} combinations of sizes and numbers of notches; at most "
            f"{MAX_FORMS} can be searched."
        )
    robots: list[Robot] = []
    problem: InputError | None = None
    for number, chosen in combinations:
        try:
            one = robot
            if spec.number_of_notches:
                one = with_notches(robot, int(number))
            values = dict(pair for size in chosen for pair in size)
            robots.append(one.with_values(values) if values else one)
        except InputError as error:
            problem = error  # a size that does not suit the robot; others may
    if not robots:
        assert problem is not None
        raise InputError(
            f"no size and number of notches makes a robot: {problem}", problem.code
        ) from None
    return robots


def with_notches(robot: Robot, count: int) -> Robot:
    """Return a robot with another number of equal notches; tendons end behind the last as before.

    Raises:
        InputError: Its notches are not given by one table, or no robot has so many.
    """
    if len(robot.notch) != 1:
        raise InputError.UNSUPPORTED(
            "`number_of_notches` is for robots of equal notches, given by one [[notch]] table; "
            f"{robot.name} has {len(robot.notch)}."
        )
    table: dict[str, Any] = to_table(robot)
    table["notch"] = [table["notch"][0] | {"repeat": count}]
    for tendon in table["tendon"]:
        if tendon.get("end_body") == robot.number_of_notches:
            tendon["end_body"] = count
    return remember_source(from_table(table), source_of(robot))


def design(
    spec: DesignSpec | Mapping[str, Any] | str | os.PathLike[str],
    *,
    robot: Robot | None = None,
    robust: bool = False,
    grid: float = 0.0,
    progress: Progress | None = None,
) -> Design:
    """Choose numbers of a robot so that it meets a specification.

    Args:
        spec: A design file, its table, or a `DesignSpec`.
        robot: The robot to begin with, instead of the one that the specification names.
        robust: Make the yield of robots made within the tolerances as great as possible, or what
            `robust` and `wanted_yield` of the specification say.
        grid: Step of all lengths that the design chooses, mm, such as 0.005; the numbers of the
            result are those of the robot on this grid. 0 for any length.
        progress: Called with the stage, what is done of it and how much there is.

    Returns:
        The robot, what is achieved beside what was asked, and why not more. Where constraints
        contradict each other it is the robot that comes nearest. Ctrl-C ends the search with the
        best robot so far.

    Raises:
        InputError: The specification is not allowed, contradicts itself or does not fit the robot,
            or no robot between the limits, or on the grid, can be solved.

    Example:
        >>> wish = {"quantity": "closing_angle", "take": "sum", "equal": 120.0}
        >>> height = {"value": "notch.height", "lower": 0.3, "upper": 1.2}
        >>> made = design({"robot": "pacheco2021-a", "variable": [height], "constraint": [wish]})
        >>> f"{made.robot.notches[0].height:.3f} mm"
        '0.627 mm'
    """
    asked, first = specification_of(spec, robot)
    if not 0.0 <= check_number(grid, "grid") < np.inf:
        raise InputError.OUT_OF_RANGE(f"grid must be 0 mm or more and finite; got {grid:g} mm.")
    if robust and not asked.is_robust:
        asked = replace(asked, robust=RobustOptions())
    problems = problems_of(asked, first)
    place = partial(on_grid, grid=grid)
    if not asked.is_robust:
        return made_of(asked, first, problems, place(search(problems, asked.search, progress)))
    given = first.replace(tolerance=asked.tolerance).tolerance
    tolerances = given or tolerances_of(first)[0]
    check_limits(problems, tolerances)
    searches = search(problems, asked.search, progress)
    return made_of(
        asked, first, problems, *robust_search(asked, tolerances, searches, progress, place)
    )


def specification_of(spec: Any, robot: Robot | None) -> tuple[DesignSpec, Robot]:
    """Return a specification given in any form, and the robot to begin with.

    Raises:
        InputError: It is not allowed, or its robot cannot be read.
    """
    if isinstance(spec, str | os.PathLike):
        asked, named = read_design(spec)
        return asked, robot or named
    if isinstance(spec, Mapping):
        spec = spec_from_table(spec)
    if not isinstance(spec, DesignSpec):
        raise InputError.WRONG_TYPE(
            f"a design needs a design file, its table or a DesignSpec; got {short_repr(spec)}"
        )
    return spec, robot or load_robot(spec.robot)


def made_of(
    spec: DesignSpec,
    first: Robot,
    problems: list[DesignProblem],
    searches: Searches,
    yields: tuple[YieldOf, ...] = (),
) -> Design:
    """Make the result of the best of some searches."""
    best = searches.best
    problem, one, variables = best.problem, best.evaluation, best.problem.solver.variables
    initial = problem.initial
    missed = [id(problem.rows[number].wish) for number in missed_rows(best)]
    lacking = [part.title for part in yields if not part.met]
    wishes = tuple(
        WishResult(
            title=wish.title,
            unit=wish.unit,
            asked=asked_in_words(wish),
            achieved=tuple(wish.measure(one.point).values.tolist()),
            before=() if initial is None else tuple(wish.measure(initial.point).values.tolist()),
            met=None
            if isinstance(wish.asked, DesignObjective)
            else id(wish) not in missed and wish.title not in lacking,
            parts=wish.labels,
        )
        for wish in problem.wishes
    )
    reason = _reason(searches, bool(missed), bool(lacking))
    values = zip(variables.columns, one.point.x.tolist(), variables.start.tolist(), strict=True)
    return Design(
        spec=spec,
        before=first,
        robot=remember_source(one.point.robot, source_of(first)),
        converged=not reason,
        reason=reason,
        wishes=wishes,
        variables=tuple(
            VariableResult(column.name, column.unit, value, before, column.lower, column.upper)
            for column, value, before in values
        ),
        explanation=(
            *yield_sentences(yields),
            *chosen_form(spec, one.point.robot, len(problems)),
            *explain(searches.optimum),
        ),
        solves=sum(form.solver.counts["solves"] for form in problems),
        gradients=sum(form.solver.counts["gradients"] for form in problems),
        starts=len(searches.outcomes),
        outcome=best,
        yields=yields,
    )


def _reason(searches: Searches, is_missed: bool, lacks_yield: bool) -> str:
    """Return why a design has not converged, "" if it has."""
    best = searches.best
    if searches.interrupted:
        return "interrupted; this is the best robot so far"
    if lacks_yield:
        return "the wanted yield cannot be reached; this is the robot that comes nearest"
    if is_missed:
        grid = best.problem.solver.variables.grid
        where = f" on a grid of {grid:g} mm" if grid else ""
        return f"not all constraints can be met{where}; this is the robot that comes nearest"
    if far := curves_missed(best):
        return far[0].rstrip(".")
    if not best.is_stationary:
        return "the search ended before it settled; try more starts or iterations"
    return ""
