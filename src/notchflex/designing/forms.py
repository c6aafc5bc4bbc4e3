"""Robots of several forms: every size of the stock with every number of notches."""

from __future__ import annotations

import itertools
from typing import Any

from notchflex.designing.model.load_states import StatePaths, check_states, state_paths
from notchflex.designing.model.quantities import COMPLIANCE, CURVE, OF_STATES
from notchflex.designing.model.resolving import wishes_of
from notchflex.designing.model.solver import Solver
from notchflex.designing.model.variables import variables_of
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.problem import DesignProblem
from notchflex.designing.specification.spec import DesignSpec
from notchflex.errors import InputError
from notchflex.robot import Robot, from_table, to_table
from notchflex.robot.robot import remember_source, source_of
from notchflex.robot.value_names import numbers_at

MAX_FORMS = 200


def problems_of(spec: DesignSpec, robot: Robot) -> list[DesignProblem]:
    """Make a problem for every size and every number of notches that a design may choose.

    Raises:
        InputError: What is asked does not fit the robot or itself.
    """
    _check_stock(spec, robot)
    robots = _forms(spec, robot)
    problems: list[DesignProblem] = []
    for one in robots:
        check_states(spec.state, one.number_of_tendons)
        wishes = wishes_of(spec, one)
        paths = _paths(spec, wishes, one)
        variables = variables_of(one, spec.variable, paths.states)
        outputs = _outputs(wishes)
        problems.append(DesignProblem(Solver(variables, paths, outputs), wishes))
    return problems


def _check_stock(spec: DesignSpec, robot: Robot) -> None:
    seen: dict[str, int] = {}
    for number, stock in enumerate(spec.stock, start=1):
        for path in stock.values:
            try:
                single = numbers_at(robot, path)
            except InputError as error:
                raise InputError(f"`stock[{number}]`: {error}", error.code) from None
            for one in single:
                if one in seen:
                    raise InputError.CONFLICT(f"`stock[{number}]`: `{path}` is given twice.")
                seen[one] = number
    for number, variable in enumerate(spec.variable, start=1):
        if variable.value.startswith("state."):
            continue
        try:
            both = [one for one in numbers_at(robot, variable.value) if one in seen]
        except InputError as error:
            raise InputError(f"`variable[{number}]`: {error}", error.code) from None
        if both:
            raise InputError.CONFLICT(
                f"`variable[{number}]`: `{both[0]}` is chosen by `stock[{seen[both[0]]}]` too; "
                "leave one of them out."
            )


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


def _paths(spec: DesignSpec, wishes: tuple[Wish, ...], robot: Robot) -> StatePaths:
    """Lay out the states that anything is asked of."""
    used: list[str] = []
    probes: list[tuple[str, tuple[float, float, float]]] = []
    curves = {f"{CURVE}{one.name}": one.state for one in spec.curve}
    for wish in wishes:
        asked = wish.asked
        names = [one for one in (asked.state, asked.minus) if one is not None]
        if asked.quantity == COMPLIANCE:
            probes += [(name, wish.direction) for name in names]
        elif asked.quantity in curves:
            used.append(curves[asked.quantity])
        else:
            used += names
    return state_paths(spec.state, robot.number_of_tendons, list(dict.fromkeys(used)), probes)


def _outputs(wishes: tuple[Wish, ...]) -> tuple[str, ...]:
    names: list[str] = []
    for wish in wishes:
        quantity = wish.asked.quantity
        if quantity in OF_STATES:
            names.append(quantity)
        elif quantity == COMPLIANCE:
            names.append("tip_position")
        elif quantity.startswith(CURVE):
            names += ["body_position", "body_rotation"]
    return tuple(dict.fromkeys(names)) or ("total_angle",)
