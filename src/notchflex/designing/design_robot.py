"""`nf.design` and `nf.design_front`: robots from a specification, in every allowed form.

A front is found by a genetic search (NSGA-II of pymoo, one batch a generation) that spreads over
it; every point is then polished by SLSQP: the first objective least, the others no worse.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Robot
from notchflex.designing.problem import (
    DesignEvaluation,
    DesignProblem,
    ObjectiveWish,
    Progress,
    Row,
    direction_of,
    wishes_of,
)
from notchflex.designing.result import (
    Design,
    DesignFront,
    VariableResult,
    WishResult,
    chosen_form,
    curves_missed,
    explain,
    missed_rows,
    told_yields,
)
from notchflex.designing.robust import YieldOf, check_limits, robust_search
from notchflex.designing.search import Searches, SearchResult, drawn_robots, on_grid, search
from notchflex.designing.solver import BODIES, COMPLIANCE, OF_STATES, Point, Reading, Solver
from notchflex.designing.specification import (
    DesignSpec,
    RobustOptions,
)
from notchflex.designing.variables import Probe, drives_of, load_steps, variables_of
from notchflex.search.slsqp import TOLERANCE, minimise
from notchflex.specification import placed, with_robot
from notchflex.support import (
    AnyPath,
    check_number,
    from_table,
    need,
    numbers_at,
    remember_source,
    source_of,
    to_table,
    tolerances_of,
)

MAX_FORMS = 200
_MAX_OBJECTIVES = 3
# Objectives and violations of a robot that cannot be solved.
_UNSOLVED = 1e6
# Largest violation of a robot of the genetic search that is polished.
_NEARLY = 1e-3
# A point is kept beside another if it differs by this part of the range of an objective.
_APART = 1e-3


def problems_of(spec: DesignSpec, robot: Robot) -> list[DesignProblem]:
    """Make a problem for every size and every number of notches that a design may choose.

    Raises:
        InputError: What is asked does not fit the robot or itself.
    """
    _check_chosen(spec, robot)
    return [_problem(spec, form) for form in _forms(spec, robot)]


def _problem(spec: DesignSpec, robot: Robot) -> DesignProblem:
    """Make the problem of one form: its wishes, and the loads that they need."""
    drives = drives_of(spec.load, robot.number_of_tendons)
    wishes = wishes_of(spec, robot)
    used: list[str] = []
    probes: list[Probe] = []
    outputs: list[str] = []
    for asked, curve in ((wish.asked, wish.curve) for wish in wishes):
        loads = [name for name in (asked.load, asked.minus) if name is not None]
        if asked.quantity == COMPLIANCE:
            probes += [(name, direction_of(asked), side) for name in loads for side in (1, -1)]
            outputs.append("tip_position")
        elif curve is not None:
            used.append(curve.load)
            outputs += BODIES
        elif asked.quantity in OF_STATES:
            used += loads
            outputs.append(asked.quantity)
    variables = variables_of(robot, spec.variable, drives)
    unique = tuple(dict.fromkeys(outputs))
    return DesignProblem(Solver(variables, load_steps(spec.load, used, probes), unique), wishes)


def _check_chosen(spec: DesignSpec, robot: Robot) -> None:
    """Raise if a number is chosen twice, by stocks or variables."""
    paths = [(f"stock[{k}]", p, False) for k, one in enumerate(spec.stock, 1) for p in one.values]
    paths += [(f"variable[{k}]", one.value, one.is_load) for k, one in enumerate(spec.variable, 1)]
    chosen: dict[str, str] = {}
    for place, path, is_load in paths:
        with placed(f"`{place}`"):
            for number in [path] if is_load else numbers_at(robot, path):
                if number in chosen:
                    raise InputError.CONFLICT(
                        f"`{number}` is already chosen by `{chosen[number]}`; leave one out."
                    )
                chosen[number] = place


def _forms(spec: DesignSpec, robot: Robot) -> list[Robot]:
    sizes = [
        [dict(zip(stock.values, size, strict=True)) for size in stock.sizes] for stock in spec.stock
    ]
    combinations: list[Any] = list(itertools.product(spec.number_of_notches or [None], *sizes))
    if len(combinations) > MAX_FORMS:
        raise InputError.OUT_OF_RANGE(
            f"there are {len(combinations)} combinations of sizes and numbers of notches; at most "
            f"{MAX_FORMS} can be searched."
        )
    robots: list[Robot] = []
    problem: InputError | None = None
    for count, *chosen in combinations:
        values = {path: value for size in chosen for path, value in size.items()}
        try:
            form = robot if count is None else with_notches(robot, count)
            robots.append(form.with_values(values) if values else form)
        except InputError as error:
            problem = error  # a size that does not suit the robot; others may
    if problem is not None and not robots:
        raise InputError(f"no size and number of notches makes a robot: {problem}", problem.code)
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
    spec: DesignSpec | Mapping[str, Any] | AnyPath,
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
    asked, first = with_robot(spec, DesignSpec, "design file", robot)
    if not 0.0 <= check_number(grid, "grid") < np.inf:
        raise InputError.OUT_OF_RANGE(f"grid must be 0 mm or more and finite; got {grid:g} mm.")
    if robust and not asked.is_robust:
        asked = replace(asked, robust=RobustOptions())
    problems = problems_of(asked, first)
    place = partial(on_grid, grid=grid)
    if not asked.is_robust:
        return made_of(asked, first, problems, place(search(problems, asked.search, progress)))
    tolerances = first.replace(tolerance=asked.tolerance).tolerance or tolerances_of(first)[0]
    check_limits(problems, tolerances)
    searches = search(problems, asked.search, progress)
    found = robust_search(asked, tolerances, searches, progress, place)
    return made_of(asked, first, problems, *found)


def made_of(
    spec: DesignSpec,
    first: Robot,
    problems: list[DesignProblem],
    searches: Searches,
    yields: tuple[YieldOf, ...] = (),
) -> Design:
    """Make the result of the best of some searches."""
    best = searches.best
    problem, point, variables = best.problem, best.evaluation.point, best.problem.solver.variables
    initial = problem.initial
    missed = [id(problem.rows[number].wish) for number in missed_rows(best)]
    lacking = [part.title for part in yields if not part.met]
    wishes = tuple(
        WishResult(
            title=wish.title,
            unit=wish.unit,
            asked=wish.words,
            achieved=tuple(wish.measure(point)[:, 0].tolist()),
            before=() if initial is None else tuple(wish.measure(initial.point)[:, 0].tolist()),
            met=None
            if isinstance(wish, ObjectiveWish)
            else id(wish) not in missed and wish.title not in lacking,
            parts=tuple(wish.labels),
        )
        for wish in problem.wishes
    )
    reason = _reason(searches, bool(missed), bool(lacking))
    values = zip(variables.columns, point.x.tolist(), variables.start.tolist(), strict=True)
    return Design(
        spec=spec,
        before=first,
        robot=remember_source(point.robot, source_of(first)),
        converged=not reason,
        reason=reason,
        wishes=wishes,
        variables=tuple(
            VariableResult(column.title, column.unit, value, before, column.lower, column.upper)
            for column, value, before in values
        ),
        explanation=(
            *(part.sentence for part in told_yields(yields)),
            *chosen_form(spec, point.robot, len(problems)),
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


def design_front(
    spec: DesignSpec | Mapping[str, Any] | AnyPath,
    *,
    robot: Robot | None = None,
    points: int = 12,
    generations: int = 20,
    progress: Progress | None = None,
) -> DesignFront:
    """Find the front between two or three objectives of a design.

    Args:
        spec: As for `design`.
        robot: As for `design`.
        points: Most points of the front.
        generations: Generations of the genetic search, each of four times as many robots.
        progress: Called with the stage, what is done of it and how much there is.

    Returns:
        The front; every point is a `Design`.

    Raises:
        InputError: Not two or three objectives, pymoo is not installed, or as for `design`.
    """
    need("pymoo", "design", "a front between objectives")
    asked, first = with_robot(spec, DesignSpec, "design file", robot)
    if not 2 <= len(asked.objective) <= _MAX_OBJECTIVES or asked.curve:
        raise InputError.UNSUPPORTED(
            f"a front needs 2 or {_MAX_OBJECTIVES} objectives, and curves as one of them; got "
            f"{len(asked.objective)}"
        )
    if asked.is_robust:
        raise InputError.UNSUPPORTED(
            "a front is of robots as drawn: leave out `robust` and `wanted_yield`, then name the "
            "point that you choose as `robot` of the design file and make that one robust."
        )
    if points < 2 or generations < 1:
        raise InputError.OUT_OF_RANGE("a front needs 2 points and 1 generation or more")
    problems = problems_of(asked, first)
    report: Progress = progress or (lambda stage, done, total: None)
    spread: list[SearchResult] = []
    polished: list[SearchResult] = []
    reason = ""
    try:
        for number, problem in enumerate(problems):
            report("spreading over the front", number, len(problems))
            spread += _spread(problem, points, generations, asked.search.seed)
        chosen = _chosen(spread, points)
        for number, point in enumerate(chosen):
            report("polishing", number, len(chosen))
            polished += _polished(point, asked.search.iterations)
    except KeyboardInterrupt:
        reason = "interrupted; these are the robots so far"
    best = _chosen(polished, points)
    if not best:
        raise InputError.UNSUPPORTED("no robot meets all constraints; try `notchflex design` first")
    designs = (made_of(asked, first, problems, Searches([one])) for one in best)
    return DesignFront(asked, tuple(replace(one, explanation=()) for one in designs), reason)


def _sums(problem: DesignProblem, here: DesignEvaluation) -> Float[np.ndarray, " m"]:
    """Return what each objective adds to the sum that is minimised."""
    return np.array([wish.term(here.point)[0, 0] for wish in problem.objectives])


class _Cap(NamedTuple):
    """A constraint: what an objective adds to the sum may be no more."""

    objective: ObjectiveWish
    most: float

    @property
    def rows(self) -> list[Row]:
        return [Row(self.objective, "", -np.inf, self.most)]

    def row_numbers(self, point: Point) -> Reading:
        return self.objective.term(point)


def _spread(problem: DesignProblem, points: int, generations: int, seed: int) -> list[SearchResult]:
    """Return the last generation of a genetic search of one form of robots."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem as PymooProblem
    from pymoo.optimize import minimize

    size, widths = 4 * points, (len(problem.objectives), len(problem.rows))
    start: Any = drawn_robots(problem, size, seed)
    problem.set_sizes(list(filter(None, problem.evaluate_all(start))))

    class Batched(PymooProblem):  # pyright: ignore[reportUntypedBaseClass]
        """One batch a generation."""

        def _evaluate(self, x: np.ndarray, out: dict[str, Any], *_: Any, **__: Any) -> None:
            robots = problem.evaluate_all(x)
            out["F"], out["G"] = (np.full((len(x), width), _UNSOLVED) for width in widths)
            out["robot"] = np.array(robots, object)
            for row, robot in enumerate(robots):
                if robot is not None:
                    out["F"][row] = _sums(problem, robot)
                    out["G"][row] = np.abs(problem.violation(robot)) - _NEARLY

    batched: Any = Batched(problem.count, widths[0], n_ieq_constr=widths[1], xl=0.0, xu=1.0)
    algorithm: Any = NSGA2(pop_size=size, sampling=start)
    result: Any = minimize(batched, algorithm, ("n_gen", generations), seed=seed, verbose=False)
    return [SearchResult(problem, robot) for robot in filter(None, result.pop.get("robot"))]


def _polished(point: SearchResult, iterations: int) -> list[SearchResult]:
    """Make the first objective least, the others no worse; none where no constraints are met."""
    problem, (first, *others) = point.problem, point.problem.objectives
    most = _sums(problem, point.evaluation)
    most += 1e-9 * np.maximum(np.abs(most), 1.0)
    caps = [_Cap(*pair) for pair in zip(others, most[1:].tolist(), strict=True)]
    capped = DesignProblem(problem.solver, [first, *problem.constraints, *caps])
    capped.sizes[: len(problem.sizes)] = problem.sizes
    start = capped.read(point.evaluation.point, point.evaluation.z)
    minimum = minimise(*capped.program(start), iterations)
    if minimum is None or capped.worst(minimum.reached.source) > TOLERANCE:
        return []
    end: DesignEvaluation = minimum.reached.source
    settled = minimum._replace(is_stationary=True)
    return [SearchResult(problem, problem.read(end.point, end.z), settled)]


def _chosen(candidates: list[SearchResult], points: int) -> list[SearchResult]:
    """Choose points that none of the others beats, spread evenly, by the first objective."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    feasible = [point for point in candidates if point.merit[0] <= 2.0 * _NEARLY]
    if not feasible:
        return []
    values = np.array([_sums(point.problem, point.evaluation) for point in feasible])
    span = np.ptp(values, axis=0)
    scaled = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    # By the first objective, each of those that are nearly alike once.
    _, apart = np.unique(np.round(scaled / _APART), axis=0, return_index=True)
    best = NonDominatedSorting().do(scaled[apart], only_non_dominated_front=True)
    kept = apart[np.sort(best)]
    spread = np.linspace(0, len(kept) - 1, min(points, len(kept)))
    return [feasible[number] for number in kept[spread.round().astype(int)]]
