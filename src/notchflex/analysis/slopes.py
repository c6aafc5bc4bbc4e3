"""Slopes of a solved path by numbers of its robot and by its loads.

Compiled programs differentiate the arrays of a robot, and the states along the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.forward_model import nearby, prepared_like, slope
from notchflex.analysis.outputs import LOADS, OUTPUTS, Arrays, check_outputs
from notchflex.analysis.tangent import Change, Gradient, PathTangents, path_gradient
from notchflex.errors import InputError
from notchflex.loads.command import Command, load_slopes, make_commands
from notchflex.loads.load_path import LoadPath
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.numbers import PartsForm, Place, parts_of, places_by_name
from notchflex.robot.value_names import number_at, parse_path
from notchflex.solver.programs.assembled import chain_gradient, chain_slopes
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.run import SolverRun

SLOPING = tuple(name for name in OUTPUTS if name in REGISTERED and REGISTERED[name].kind is float)
"""Quantities that have slopes."""

# The slopes of a chain by so many numbers are cached for all loads and weights; by more it is
# differentiated along what is needed. `notchflex bench` has both: links by 3 and by 27 numbers.
_FEW = 8

# Cost of the gradient of one number, in derivatives along single directions.
_ADJOINT = 4


def jacobian(
    path: EquilibriumPath, names: str | Sequence[str], outputs: str | Sequence[str]
) -> Arrays:
    """Differentiate quantities of a path; see `EquilibriumPath.jacobian`."""
    names, outputs = _checked(path, names), check_outputs(outputs, SLOPING)
    by = derivatives(path, changes(path, names), outputs)
    return {name: np.moveaxis(values, 0, -1) for name, values in by.items()}


def gradient(path: EquilibriumPath, weights: Mapping[str, Any]) -> PathGradient:
    """Differentiate a weighted sum of quantities of a path; see `EquilibriumPath.gradient`."""
    _checked(path, ())
    arrays: Arrays = {}
    for name in check_outputs(tuple(weights), SLOPING):
        shape = np.shape(path.quantity(name))
        try:
            arrays[name] = np.broadcast_to(np.asarray(weights[name], float), shape)
        except (TypeError, ValueError):
            raise InputError.WRONG_SHAPE(
                f"the weights of {name} must be numbers of shape {shape}; "
                f"got the shape {np.shape(weights[name])}"
            ) from None
    return PathGradient(path, path_gradient(path, arrays))


@dataclass(frozen=True, eq=False, repr=False)
class PathGradient(Displayed):
    """Derivatives of a weighted sum of quantities of a path by all numbers that it depends on.

    They are computed for the names that are asked for; all names share one adjoint of the path.

    Attributes:
        path: The path.
        by_arrays: Derivatives by the arrays of the robot and of the loads.

    Example:
        >>> from notchflex import load_robot, pull, simulate
        >>> path = simulate(load_robot("pacheco2021-a"), pull(1.0, 1.0, steps=1))
        >>> gradient = path.gradient({"total_angle": 1.0})
        >>> gradient.by(["notch.depth", "tension"]).round(2).tolist()
        [13.3, 1.52]
    """

    path: EquilibriumPath
    by_arrays: Gradient

    def __getitem__(self, name: str) -> Any:
        """Return the derivative by a number, or by all numbers of a load, steps as leading axis.

        Raises:
            InputError: There is no such number.
        """
        values = self.by(name)
        return values.reshape(len(self.path), -1) if name in LOADS else float(values[0])

    def by(self, names: str | Sequence[str]) -> Float[np.ndarray, " k"]:
        """Return the derivatives by all numbers of some names, as columns of a Jacobian are.

        Raises:
            InputError: There is no such number.
        """
        return gradient_by(self.path, self.by_arrays, _checked(self.path, names))

    def _summary(self) -> Summary:
        hint = "[name] is the derivative by a number of the robot file or by a load"
        return Summary(f"Gradient of a path of {self.path.robot.name}", [], hint)


def _checked(path: EquilibriumPath, names: str | Sequence[str]) -> tuple[str, ...]:
    """Return names of numbers and loads, checked."""
    if not isinstance(path.run, SolverRun):
        raise InputError.UNSUPPORTED(
            "a path that was read from a file has no slopes; simulate it again"
        )
    names = (names,) if isinstance(names, str) else tuple(names)
    start_of(path.robot, path.load, names)
    return names


def start_of(robot: Robot, load: LoadPath, names: Sequence[str]) -> Arrays:
    """Return the present values of numbers and loads by name; raise for one that cannot vary."""
    for warning in load.replaced(names):
        raise InputError.CONFLICT(str(warning))
    numbers = tuple(name for name in names if name not in LOADS)
    values = dict(zip(numbers, _variable(robot, numbers), strict=True))
    return {name: load.numbers(name) if name in LOADS else np.array(values[name]) for name in names}


@lru_cache(maxsize=64)
def _variable(robot: Robot, names: tuple[str, ...]) -> list[float]:
    """Return numbers by their names; raise where one cannot be varied."""
    values = [number_at(robot, name) for name in names]
    for name, value in zip(names, values, strict=True):
        nearby(_moved(robot, name, names), value, 2)
    return values


def load_units(path: EquilibriumPath, name: str) -> Float[np.ndarray, "n s command"]:
    """Return the change of all packed loads per unit of each of the n numbers of a load."""
    steps, size = path.load.numbers(name).shape
    # Loads are linear in tension, stroke, tip force and moment.
    none, *units = (
        _packed_loads(path, path.load.commanding({name: np.tile(row, (steps, 1))}))
        for row in np.eye(size + 1)[:, 1:]
    )
    by_step = np.stack([unit - none for unit in units], axis=1)
    return (np.eye(steps)[:, None, :, None] * by_step[:, :, None]).reshape(-1, *none.shape)


def _packed_loads(path: EquilibriumPath, load: LoadPath) -> Float[np.ndarray, "s command"]:
    return make_commands(load, path.robot, path.chain).packed()


def load_change(path: EquilibriumPath, load: LoadPath) -> Float[np.ndarray, "s command"]:
    """Compute the difference of other loads from those of a path, packed."""
    return _packed_loads(path, load) - path.commands.packed()


def changes(
    path: EquilibriumPath, names: Sequence[str], along: Float[np.ndarray, "k n"] | None = None
) -> list[Change]:
    """Differentiate what a path is computed from by numbers of its robot and of its loads.

    Args:
        path: The path, as solved.
        names: Names of numbers and loads.
        along: Directions, each a change of all the numbers; each number alone where not given.

    Raises:
        InputError: A number cannot be varied.
    """
    sizes = [path.load.numbers(name).size if name in LOADS else 1 for name in names]
    along = np.eye(sum(sizes)) if along is None else along
    first = np.cumsum([0, *sizes])[:-1].tolist()
    columns = [column for column, name in zip(first, names, strict=True) if name not in LOADS]
    by_direction = [Change(None, None)] * len(along)
    if along[:, columns].any():
        numbers = [name for name in names if name not in LOADS]
        by_direction = _by_numbers(path, numbers, along[:, columns])
    for column, size, name in zip(first, sizes, names, strict=True):
        if name in LOADS:
            loads = np.tensordot(along[:, column : column + size], load_units(path, name), 1)
            by_direction = [
                change.plus(Change(load, None))
                for change, load in zip(by_direction, loads, strict=True)
            ]
    return by_direction


def _by_numbers(
    path: EquilibriumPath, names: Sequence[str], along: Float[np.ndarray, "k names"]
) -> list[Change]:
    """Differentiate arrays and loads of a path along changes of numbers of its robot."""
    few = len(names) <= _FEW
    directions = np.eye(len(names)) if few else along
    traced, slopes = _slopes(path.robot, path.prepared, (*names,), directions.tobytes())
    by_direction = None if slopes is None else _changes(path, along @ slopes if few else slopes)
    untraced = set(range(len(names))).difference([] if by_direction is None else traced)
    by_direction = by_direction or [Change(None, None)] * len(along)
    for number in sorted(untraced):
        name = names[number]
        by = differences(path, _moved(path.robot, name, names), number_at(path.robot, name))
        by_direction = [
            change.plus(by, size) if size else change
            for change, size in zip(by_direction, along[:, number].tolist(), strict=True)
        ]
    return by_direction


@lru_cache(maxsize=16)
def _slopes(
    robot: Robot, ready: PreparedChain, names: tuple[str, ...], directions: bytes
) -> tuple[list[int], Float[np.ndarray, "k chain"] | None]:
    """Return by which of some numbers programs differentiate, and slopes of the chain, cached."""
    along = np.frombuffer(directions).reshape(-1, len(names))
    robot, places = places_by_name(robot, names)
    traced, varied = _traced(robot, places)
    traced_places = [places[number] for number in traced]
    if not varied:
        return traced, None
    return traced, chain_slopes(
        robot, ready.chain, varied, lambda form: along[:, traced] @ _units(traced_places, form)
    )


def _traced(robot: Robot, places: Sequence[list[Place]]) -> tuple[list[int], list[Place]]:
    """Return which of some numbers programs differentiate by, and the places of these."""
    numbers = set(PartsForm.of(parts_of(robot), list(chain(*places))).places)
    traced = [number for number, named in enumerate(places) if numbers.issuperset(named)]
    return traced, [place for number in traced for place in places[number]]


def _units(places: Sequence[list[Place]], form: PartsForm) -> Float[np.ndarray, "k numbers"]:
    """Return which of the numbers of a form stand at some places."""
    return np.array([[place in named for place in form.places] for named in places], float)


def _changes(path: EquilibriumPath, slopes: Float[np.ndarray, "k chain"]) -> list[Change]:
    """Return changes of a path's chain with those of the loads on it."""
    loads: Any = [None] * len(slopes)
    if path.chain.loaded:
        change, commands = path.prepared.chain_layout.unpack(slopes), path.commands
        none: Any = np.zeros((len(slopes), *np.shape(commands.target)))
        bend = None if commands.bend is None else none[..., 0]
        by_stroke = None if commands.by_stroke is None else none
        still = Command(none, by_stroke, load_slopes(path.load, path.chain, change), bend)
        loads = path.prepared.command_layout(commands).pack(still, leading=2)
    return [Change(*both) for both in zip(loads, slopes, strict=True)]


def differences(
    path: EquilibriumPath, robot_at: Callable[[float], Robot], value: float, order: int = 6
) -> Change:
    """Differentiate by what decides the form, such as a direction, by differences."""

    def packed(value: float) -> Float[np.ndarray, " packed"]:
        robot = robot_at(value)
        ready = prepared_like(robot, path.prepared)
        loads = make_commands(path.load, robot, ready.chain).packed()
        return np.concatenate([ready.vector, loads.ravel()])

    size = path.prepared.chain_layout.size
    by_number = slope(packed, value, order=order)
    return Change(by_number[size:].reshape(len(path), -1), by_number[:size])


def _moved(robot: Robot, name: str, names: Iterable[str]) -> Callable[[float], Robot]:
    """Return the robot as a function of a number; what has a name of its own stays."""
    alone = {other for other in names if parse_path(other).number is not None} - {name}
    unchanged = (
        {} if parse_path(name).number else {other: number_at(robot, other) for other in alone}
    )
    return lambda value: robot.with_values({name: value, **unchanged})


def derivatives(path: EquilibriumPath, along: Sequence[Change], outputs: tuple[str, ...]) -> Arrays:
    """Differentiate a solved path along changes of what it is computed from.

    Args:
        path: The path, as solved.
        along: Directions, one or more.
        outputs: Quantities that the solver reports as floats.

    Returns:
        By name, directions and then steps as leading axes, in the world. NaN from the first
        step that did not converge, or whose derivatives are not known.
    """
    shapes = {name: np.shape(path.quantity(name)) for name in outputs}
    if _ADJOINT * sum(map(math.prod, shapes.values())) > len(along):
        return PathTangents(path, outputs).along(along)
    slopes = {name: np.empty((len(along), *shape)) for name, shape in shapes.items()}
    for name, shape in shapes.items():
        for index in np.ndindex(shape):
            weight = np.zeros(shape)
            weight[index] = 1.0
            by = path_gradient(path, {name: weight})
            slopes[name][:, *index] = [by.along(change) for change in along]
    return slopes


def gradient_by(
    path: EquilibriumPath, by: Gradient, names: Sequence[str]
) -> Float[np.ndarray, " k"]:
    """Return the derivatives of a weighted sum by numbers of the robot and of the loads."""
    numbers = [name for name in names if name not in LOADS]
    by_number = None
    # Loads on what weighs something depend on the numbers of the robot.
    if len(numbers) > _FEW and not path.chain.loaded:
        robot, places = places_by_name(path.robot, numbers)
        traced, varied = _traced(robot, places)
        if len(traced) == len(numbers):
            units = partial(_units, places)
            by_number = chain_gradient(robot, path.chain, varied, by.chain, units)
    if by_number is None:
        directions = changes(path, numbers)
        by_number = np.array([by.along(change) for change in directions])
    rest = iter(by_number)
    columns = [
        np.tensordot(load_units(path, name), by.loads, 2) if name in LOADS else next(rest)
        for name in names
    ]
    return np.hstack([*columns, np.zeros(0)])
