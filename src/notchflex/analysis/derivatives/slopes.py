"""Slopes of a solved path by numbers of its robot and by its loads.

Compiled programs differentiate the arrays of a robot, and the states along the path.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.forward_model import (
    nearby,
    prepared_like,
    slope,
)
from notchflex.analysis.outputs import OUTPUTS, check_outputs
from notchflex.analysis.tangent import (
    Change,
    Gradient,
    PathTangents,
    path_gradient,
)
from notchflex.errors import InputError
from notchflex.loads.command import (
    BodyLoads,
    Command,
    load_slopes,
    make_commands,
)
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import Chain
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.numbers import (
    PartsForm,
    Place,
    differing,
    is_number,
    is_of_one,
    parts_of,
    places_by_name,
)
from notchflex.robot.value_names import number_at
from notchflex.solver.programs.assembled import chain_gradient, chain_slopes
from notchflex.solver.programs.run import SolverRun

TENDONS = ("tension", "stroke")
TIP = ("tip_force", "tip_moment")
LOADS = (*TENDONS, *TIP)
"""Names of the loads that slopes are taken by."""
SLOPING = tuple(name for name in OUTPUTS if name in REGISTERED and REGISTERED[name].kind is float)
"""Quantities that have slopes."""

# Cost of the gradient of one number, in derivatives along single directions.
_ADJOINT = 4


def jacobian(
    path: EquilibriumPath, names: str | Sequence[str], outputs: str | Sequence[str]
) -> dict[str, np.ndarray]:
    """Differentiate quantities of a path; see `EquilibriumPath.jacobian`."""
    names, outputs = _checked(path, names), check_outputs(outputs, SLOPING)
    count = sum(size for size in _sizes(path.load, names))
    if not _takes_adjoint(path, outputs, count):
        by = derivatives(path, changes(path, names), outputs)
    else:
        by = _by_adjoints(path, outputs, count, lambda one: gradient_by(path, one, names))
    return {name: np.moveaxis(values, 0, -1) for name, values in by.items()}


def gradient(path: EquilibriumPath, weights: Mapping[str, Any]) -> PathGradient:
    """Differentiate a weighted sum of quantities of a path; see `EquilibriumPath.gradient`."""
    _checked(path, ())
    arrays: dict[str, np.ndarray] = {}
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


def start_of(robot: Robot, load: LoadPath, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the present values of numbers and loads by name.

    Raises:
        InputError: There is no such number, or it cannot be varied.
    """
    numbers = tuple(name for name in names if name not in LOADS)
    values = dict(zip(numbers, _variable(robot, numbers), strict=True))
    return {
        name: load_numbers(load, name) if name in LOADS else np.array(values[name])
        for name in names
    }


@lru_cache(maxsize=64)
def _variable(robot: Robot, names: tuple[str, ...]) -> list[float]:
    """Return numbers by their names; raise where one cannot be varied."""
    values = [number_at(robot, name) for name in names]
    for name, value in zip(names, values, strict=True):
        nearby(_moved(robot, name, names), value, 2)
    return values


def _sizes(load: LoadPath, names: Sequence[str]) -> list[int]:
    """Return how many numbers every name stands for."""
    return [load_numbers(load, name).size if name in LOADS else 1 for name in names]


def load_numbers(load: LoadPath, name: str) -> Float[np.ndarray, "s k"]:
    """Return the numbers of a load by its name, steps as leading axis.

    Raises:
        InputError: The loads give none.
    """
    if name in TIP:
        return np.array([getattr(one, name) for one in load.external])
    commanded = getattr(load, name)
    if np.isnan(commanded).all():
        raise InputError.NO_DATA(f"the loads give no {name} that could vary")
    return np.nan_to_num(commanded)


def with_loads(load: LoadPath, values: Mapping[str, Any]) -> LoadPath:
    """Return loads with other numbers by name; tendons that are not commanded stay so."""
    for name in TENDONS:
        if name in values:
            commanded = getattr(load, name)
            value = np.where(np.isnan(commanded), np.nan, np.asarray(values[name]))
            load = dataclasses.replace(load, **{name: value})
    tip = {name: np.asarray(values[name]) for name in TIP if name in values}
    if tip:
        external = tuple(
            dataclasses.replace(one, **{name: tuple(at[step]) for name, at in tip.items()})
            for step, one in enumerate(load.external)
        )
        load = dataclasses.replace(load, external=external)
    return load


def load_units(path: EquilibriumPath, name: str) -> Float[np.ndarray, "n s command"]:
    """Return the change of all packed loads per unit of each of the n numbers of a load."""
    start = load_numbers(path.load, name)
    steps, size = start.shape
    if name in TIP:
        moved = [with_loads(path.load, {name: start + row}) for row in np.eye(size)]
        by_step = np.stack([load_change(path, load) for load in moved])
    else:
        by_step = np.zeros((size, *path.commands.packed().shape))
        for tendon, index in enumerate(path.prepared.command_layout(path.commands).indices[0]):
            by_step[tendon, :, index] = ~np.isnan(getattr(path.load, name)[:, tendon])
    units = np.eye(steps)[:, None, :, None] * by_step.swapaxes(0, 1)[:, :, None]
    return units.reshape(steps * size, steps, -1)


def load_change(path: EquilibriumPath, load: LoadPath) -> Float[np.ndarray, "s command"]:
    """Compute the difference of other loads from those of a path, packed."""
    return make_commands(load, path.robot, path.chain).packed() - path.commands.packed()


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
    sizes = _sizes(path.load, names)
    along = np.eye(sum(sizes)) if along is None else along
    first = np.cumsum([0, *sizes])[:-1].tolist()
    columns = [at for at, name in zip(first, names, strict=True) if name not in LOADS]
    made = [Change(None, None)] * len(along)
    if along[:, columns].any():
        numbers = [name for name in names if name not in LOADS]
        made = _by_numbers(path, numbers, along[:, columns])
    for at, size, name in zip(first, sizes, names, strict=True):
        if name in LOADS:
            loads = np.tensordot(along[:, at : at + size], load_units(path, name), 1)
            made = [one.plus(Change(load, None)) for one, load in zip(made, loads, strict=True)]
    return made


def _by_numbers(
    path: EquilibriumPath, names: Sequence[str], along: Float[np.ndarray, "k names"]
) -> list[Change]:
    """Differentiate arrays and loads of a path along changes of numbers of its robot."""
    robot, places = places_by_name(path.robot, names)
    traced, varied = _traced(robot, places)
    made = [Change(None, None)] * len(along)
    if traced:

        def units(form: PartsForm) -> Float[np.ndarray, "k numbers"]:
            own = [[place in places[number] for place in form.places] for number in traced]
            return along[:, traced] @ np.array(own, float)

        key = (*names, along.tobytes())
        by_programs = _along(path, robot, varied, units, key)
        traced = [] if by_programs is None else traced
        made = by_programs or made
    for number in sorted(set(range(len(names))) - set(traced)):
        name = names[number]
        by = differences(path, _moved(path.robot, name, names), number_at(path.robot, name))
        made = [
            one.plus(by, size) if size else one
            for one, size in zip(made, along[:, number].tolist(), strict=True)
        ]
    return made


def _traced(robot: Robot, places: Sequence[list[Place]]) -> tuple[list[int], list[Place]]:
    """Return which of some numbers programs differentiate by, and the places of these."""
    parts = parts_of(robot)
    traced = [
        number
        for number, own in enumerate(places)
        if all(is_number(getattr(parts[part], key)) and key != "direction_deg" for part, key in own)
    ]
    return traced, [place for number in traced for place in places[number]]


def change_along(
    path: EquilibriumPath, robot_at: Callable[[float], Robot], at: float, *, order: int = 6
) -> Change:
    """Differentiate arrays and loads of a path along a family of robots.

    Args:
        path: The path, of the robot at the number.
        robot_at: The robot of a number; only its geometry and loads on its mass may vary.
        at: The number at which to differentiate.
        order: Order of accuracy of the slopes of the robot's numbers, as for `slope`.

    Raises:
        InputError: The number cannot be varied.
    """
    robot, parts = robot_at(at), parts_of(robot_at(at))

    def difference(form: PartsForm) -> Float[np.ndarray, "1 numbers"]:
        return slope(lambda v: form.numbers_of(parts_of(robot_at(v))), at, order=order)[None]

    varied = differing(parts, parts_of(nearby(robot_at, at, order)))
    by_programs = None if varied is None else _along(path, robot, varied, difference)
    return by_programs[0] if by_programs else differences(path, robot_at, at, order)


def _along(
    path: EquilibriumPath,
    robot: Robot,
    varied: Collection[Place],
    along: Callable[[PartsForm], np.ndarray],
    key: tuple[Any, ...] | None = None,
) -> list[Change] | None:
    """Differentiate along changes of numbers; None where the form changes with them."""
    chain, known = path.chain, path.prepared.slopes
    slopes = known.get(key)
    if slopes is None and (slopes := chain_slopes(robot, chain, varied, along)) is None:
        return None
    if key is not None:  # the last ones serve the next loads of the same robot
        known.clear()
        known[key] = slopes
    loads: Any = [None] * len(slopes)
    if chain.loaded:
        change = path.prepared.chain_layout.unpack(slopes)
        loads = _packed(path, load_slopes(path.load, robot, chain, change))
    return [Change(*both) for both in zip(loads, slopes, strict=True)]


def _packed(path: EquilibriumPath, by: BodyLoads) -> Float[np.ndarray, "k s command"]:
    """Pack changes of the loads on bodies."""
    commands = path.commands
    none: Any = np.zeros((len(by.dead_force), *np.shape(commands.target)))
    still = Command(none, None if commands.by_stroke is None else none, by)
    return path.prepared.command_layout(commands).pack(still, leading=2)


def differences(
    path: EquilibriumPath, robot_at: Callable[[float], Robot], at: float, order: int = 6
) -> Change:
    """Differentiate by what decides the form, such as a direction, by differences."""

    def packed(value: float) -> Float[np.ndarray, " packed"]:
        robot = robot_at(value)
        ready = prepared_like(robot, path.prepared)
        loads = make_commands(path.load, robot, ready.chain).packed()
        return np.concatenate([ready.vector, loads.ravel()])

    size = path.prepared.chain_layout.size
    by_number = slope(packed, at, order=order)
    return Change(by_number[size:].reshape(len(path), -1), by_number[:size])


def _moved(robot: Robot, name: str, names: Iterable[str]) -> Callable[[float], Robot]:
    """Return the robot as a function of a number; what has a name of its own stays."""
    others = [] if is_of_one(name) else filter(is_of_one, names)
    kept = {other: number_at(robot, other) for other in others}
    return lambda value: robot.with_values({name: value, **kept})


def derivatives(
    path: EquilibriumPath,
    along: Iterable[Change],
    outputs: tuple[str, ...],
    *,
    remembers: bool = True,
) -> dict[str, np.ndarray]:
    """Differentiate a solved path along changes of what it is computed from.

    Args:
        path: The path, as solved.
        along: Directions, one or more.
        outputs: Quantities that the solver reports as floats.
        remembers: Whether changes pass from state to state through the memory of the contacts.

    Returns:
        By name, directions and then steps as leading axes, in the world. NaN from the first
        step that did not converge, or whose derivatives are not known.
    """
    every = tuple(along)
    if remembers and _takes_adjoint(path, outputs, len(every)):
        return _by_adjoints(
            path, outputs, len(every), lambda by: np.array([by.along(one) for one in every])
        )
    columns = PathTangents(path, outputs, remembers).along(every)
    return {name: np.stack([one[name] for one in columns]) for name in outputs}


def _takes_adjoint(path: EquilibriumPath, outputs: tuple[str, ...], count: int) -> bool:
    """Return whether the adjoint is cheaper for a number of directions."""
    numbers = sum(np.asarray(path.quantity(name)).size for name in outputs)
    return _ADJOINT * numbers <= count


def _by_adjoints(
    path: EquilibriumPath,
    outputs: tuple[str, ...],
    count: int,
    by: Callable[[Gradient], Float[np.ndarray, " k"]],
) -> dict[str, np.ndarray]:
    """Differentiate one number of the outputs after the other by all directions."""
    every: dict[str, np.ndarray] = {}
    for name in outputs:
        shape = np.shape(path.quantity(name))
        every[name] = np.empty((count, *shape))
        for index in np.ndindex(shape):
            weight = np.zeros(shape)
            weight[index] = 1.0
            every[name][:, *index] = by(path_gradient(path, {name: weight}))
    return every


def gradient_by(
    path: EquilibriumPath, by: Gradient, names: Sequence[str]
) -> Float[np.ndarray, " k"]:
    """Return the derivatives of a weighted sum by numbers of the robot and of the loads."""
    numbers = [name for name in names if name not in LOADS]
    by_number = dict(zip(numbers, _gradient_by_numbers(path, by, numbers), strict=True))
    columns = [
        np.tensordot(load_units(path, name), by.loads, 2) if name in LOADS else by_number[name]
        for name in names
    ]
    return np.hstack([*columns, np.zeros(0)])


def _gradient_by_numbers(
    path: EquilibriumPath, by: Gradient, names: Sequence[str]
) -> Float[np.ndarray, " k"]:
    if not names:
        return np.zeros(0)
    robot, places = places_by_name(path.robot, names)
    traced, varied = _traced(robot, places)
    varied = list(dict.fromkeys(varied))
    by_place = None
    if traced:
        weights = by.chain + _through_loads(path, by) if path.chain.loaded else by.chain
        by_place = chain_gradient(robot, path.chain, varied, weights)
    if by_place is None:
        traced, varied, by_place = [], [], np.zeros(0)
    values = dict(zip(varied, by_place.tolist(), strict=True))
    gradient = np.array([sum(values.get(place, 0.0) for place in own) for own in places])
    others = sorted(set(range(len(names))) - set(traced))
    if others:
        units = np.eye(len(names))[others]
        gradient[others] = [by.along(one) for one in _by_numbers(path, names, units)]
    return gradient


def _through_loads(path: EquilibriumPath, by: Gradient) -> Float[np.ndarray, " chain"]:
    """Return the derivatives by the masses and lengths of bodies, through the loads on them."""
    chain, layout = path.chain, path.prepared.chain_layout
    indices: Chain = layout.unpack_indices()
    own = [getattr(indices, name) for name in ("body_mass", "body_centre", "body_length")]
    every = np.concatenate([one.ravel() for one in own])
    mass, centre, length = (
        np.where(every[(..., *(None,) * one.ndim)] == one, 1.0, 0.0) for one in own
    )
    unit: Any = {"body_mass": mass, "body_centre": centre, "body_length": length}
    by_loads = load_slopes(path.load, path.robot, chain, dataclasses.replace(chain, **unit))
    weights = np.zeros(layout.size)
    weights[every] = np.tensordot(_packed(path, by_loads), by.loads, 2)
    return weights
