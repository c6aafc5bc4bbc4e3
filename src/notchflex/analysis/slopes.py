"""Slopes of a solved path by numbers of its robot and by its loads.

Compiled programs differentiate the arrays of a robot, and the states along the path.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.batch import BatchRows, BatchTable, FollowedRows, LoadRows
from notchflex.analysis.forward_model import nearby, prepared_like, slope
from notchflex.analysis.outputs import OUTPUTS, STEPS, check_outputs
from notchflex.analysis.tangent import (
    Change,
    Gradient,
    PathTangents,
    StepLayouts,
    adjoint_step,
    path_gradient,
    tangent_step,
)
from notchflex.analysis.varied import Chains, VariedRobots, single_chains
from notchflex.errors import InputError
from notchflex.loads.command import (
    FOLLOWING,
    LOADED,
    SIDEWAYS,
    BodyLoads,
    Command,
    load_slopes,
    make_commands,
)
from notchflex.loads.load_path import TENDONS, TIP, LoadPath
from notchflex.mechanics.chain import Chain
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.numbers import PartsForm, Place, differing, parts_of, places_by_name
from notchflex.robot.value_names import number_at, parse_path
from notchflex.solver.programs.assembled import chain_gradient, chain_slopes
from notchflex.solver.programs.compiled import number_of_cores, on_cores
from notchflex.solver.programs.run import SolverRun

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
    by = derivatives(path, changes(path, names), outputs)
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
    return {name: load.numbers(name) if name in LOADS else np.array(values[name]) for name in names}


@lru_cache(maxsize=64)
def _variable(robot: Robot, names: tuple[str, ...]) -> list[float]:
    """Return numbers by their names; raise where one cannot be varied."""
    values = [number_at(robot, name) for name in names]
    for name, value in zip(names, values, strict=True):
        nearby(_moved(robot, name, names), value, 2)
    return values


def _sizes(load: LoadPath, names: Sequence[str]) -> list[int]:
    """Return how many numbers every name stands for."""
    return [load.numbers(name).size if name in LOADS else 1 for name in names]


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
    numbers = set(PartsForm.of(parts_of(robot), [one for own in places for one in own]).places)
    traced = [number for number, own in enumerate(places) if numbers.issuperset(own)]
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
    robot = robot_at(at)

    def difference(form: PartsForm) -> Float[np.ndarray, "1 numbers"]:
        return slope(lambda v: form.numbers_of(parts_of(robot_at(v))), at, order=order)[None]

    varied = differing(parts_of(robot), parts_of(nearby(robot_at, at, order)))
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
    alone = {one for one in names if parse_path(one).number is not None} - {name}
    kept = {} if parse_path(name).number else {one: number_at(robot, one) for one in alone}
    return lambda value: robot.with_values({name: value, **kept})


def derivatives(
    path: EquilibriumPath, along: Sequence[Change], outputs: tuple[str, ...]
) -> dict[str, np.ndarray]:
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
        columns = PathTangents(path, outputs).along(along)
        return {name: np.stack([one[name] for one in columns]) for name in outputs}
    slopes = {name: np.empty((len(along), *shape)) for name, shape in shapes.items()}
    for name, shape in shapes.items():
        for index in np.ndindex(shape):
            weight = np.zeros(shape)
            weight[index] = 1.0
            by = path_gradient(path, {name: weight})
            slopes[name][:, *index] = [by.along(one) for one in along]
    return slopes


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


# Slopes of many robots and loads at once: rows of values, solved as batches are.


@dataclass(frozen=True, eq=False)
class RobotRows:
    """Robots under loads as rows of values.

    Attributes:
        path: The path at the present values.
        start: Present values of the parameters, by name.
        forms: Where every output is in a row of them, the shape of its values, and their kind.
        refinement: More strain modes, as for `simulate`.
    """

    path: EquilibriumPath
    start: Mapping[str, np.ndarray]
    forms: Mapping[str, tuple[slice, tuple[int, ...], str]]
    refinement: int

    def values(self, at: Float[np.ndarray, "k n"]) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Return the outputs of every row, side by side, and which rows are known."""
        return self._pieces(self._values, self._size, at)

    def along(
        self, at: Float[np.ndarray, "k n"], change: Float[np.ndarray, "k n"]
    ) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Return the changes of the outputs along a change of every row's values."""
        return self._pieces(self._along, self._size, at, change)

    def back(
        self, at: Float[np.ndarray, "k n"], weights: Float[np.ndarray, "k m"]
    ) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Return the derivatives of a weighted sum of every row's outputs by its values."""
        return self._pieces(self._back, at.shape[1], at, weights)

    @cached_property
    def _size(self) -> int:
        return max(part.stop for part, _, _ in self.forms.values())

    @cached_property
    def _columns(self) -> dict[str, slice]:
        """Where the numbers of each name are in a row of values."""
        ends = np.cumsum([0, *(at.size for at in self.start.values())]).tolist()
        return dict(zip(self.start, map(slice, ends, ends[1:]), strict=True))

    @cached_property
    def _numbers(self) -> list[int]:
        """Where the numbers of the robot are in a row of values."""
        return [part.start for name, part in self._columns.items() if name not in LOADS]

    @cached_property
    def _kind(self) -> int:
        """What acts, as bits; loads at the tip may point anywhere."""
        loads = LoadRows(self.path.load, len(self.path))
        kind = int(loads.kinds(self.path.robot, np.zeros(1, int))[0])
        free = any(name in TIP for name in self.start)
        return kind | (LOADED | SIDEWAYS | FOLLOWING) * free

    @cached_property
    def _units(self) -> Float[np.ndarray, "n s command"]:
        """The change of the packed loads per unit of each value."""
        still = np.zeros((1, *self.path.commands.packed().shape))
        units = [load_units(self.path, one) if one in LOADS else still for one in self.start]
        return np.concatenate(units)

    def _possible_loads(self, at: Float[np.ndarray, "k n"]) -> Bool[np.ndarray, " k"]:
        """Return which values loads can have."""
        possible = np.isfinite(at).all(axis=1)
        if "tension" in self.start:  # a tendon that is not commanded may have any
            given = ~np.isnan(self.path.load.tension).ravel()
            possible &= (at[:, self._columns["tension"]][:, given] >= 0.0).all(axis=1)
        return possible

    def _table(self, at: Float[np.ndarray, "k n"]) -> BatchTable | None:
        """Return the rows of possible loads as those of a batch; None where no program has them."""
        path, parts = self.path, self._columns.items()
        distinct, robot_of = np.unique(at[:, self._numbers], axis=0, return_inverse=True)
        numbers = (name for name in self.start if name not in LOADS)
        robots = VariedRobots(
            [path.robot], np.zeros(len(distinct), int), dict(zip(numbers, distinct.T, strict=True))
        )
        every = np.arange(len(at))
        own = {name: at[:, part].reshape(-1, *self.start[name].shape) for name, part in parts}
        own = {name: values for name, values in own.items() if name in LOADS}
        loads = LoadRows(path.load, len(path)).varied(0 * every, own)
        settings, outputs = path.settings, (*dict.fromkeys((*self.forms, "converged")),)
        robot_of = robot_of.reshape(-1)
        rows = BatchRows(robots, loads, robot_of, every, outputs, settings, self.refinement)
        chains = single_chains({0: path.prepared})
        if self._numbers:
            form = next(robots.forms(np.arange(len(robots))))
            chains = form.chains(self._kind, self.refinement)
        if chains is None:
            return None
        return BatchTable(rows, np.flatnonzero(rows.valid), chains, self._kind)

    def _pieces(
        self,
        work: Callable[..., tuple[np.ndarray, np.ndarray]],
        size: int,
        at: np.ndarray,
        *others: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Evaluate the valid rows piece by piece, on all cores; others are known to be NaN."""
        results, known = np.full((len(at), size), np.nan), np.ones(len(at), bool)
        places = np.flatnonzero(self._possible_loads(at))
        if not len(places):
            return results, known
        table = self._table(at[places])
        # Loads on what weighs something depend on the numbers of the robot.
        weighs = bool(self._numbers) and self.path.chain.loaded and bool(others)
        if table is None or weighs:
            return results, ~known
        pieces = [places[table.rows[index]] for index in table.pieces(number_of_cores())]

        def solved(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return work(table, np.searchsorted(places, rows), *(one[rows] for one in others))

        for rows, (values, alike) in zip(pieces, on_cores(solved, pieces), strict=True):
            results[rows], known[rows] = values, alike
        return results, known

    def _packed(self, by_name: Mapping[str, np.ndarray], count: int) -> Float[np.ndarray, "k m"]:
        """Return outputs or their changes side by side; 0 for what has no change."""
        rows = np.zeros((count, self._size))
        for name, (part, _, _) in self.forms.items():
            if name in by_name:
                rows[:, part] = by_name[name].reshape(count, -1)
        return rows

    def _values(self, table: BatchTable, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        outputs, alike = table.solved(rows)
        return self._packed(outputs, len(rows)), alike

    def _layouts(self, chains: Chains, followed: FollowedRows) -> StepLayouts:
        outputs = tuple(name for name in self.forms if name in SLOPING)
        varies = chains.programs is not None
        return StepLayouts(chains.structure, followed.layout, chains.ready.state, outputs, varies)

    def _steps(self, table: BatchTable, followed: FollowedRows) -> list[np.ndarray]:
        """Return what programs take of every step; rows, then steps."""
        found = followed.outputs
        rest = np.broadcast_to(table.chains.ready.rest_vector, found["states"][:, :1].shape)
        before = np.concatenate([rest, found["states"][:, :-1]], axis=1)
        return [before, *(found[name] for name in STEPS), followed.commands]

    def _along(
        self, table: BatchTable, rows: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        followed, chains = table.followed(rows, STEPS), table.chains
        alike, by_robot = followed.alike, np.zeros(1)
        if chains.programs is not None and chains.form is not None:
            numbers = chains.form.table(table.batch.robot_of[rows])
            moved = change[:, self._numbers] @ chains.form.units
            by_robot, same = chains.programs.along(numbers, moved)
            alike = alike & same
        tables = *self._steps(table, followed), np.tensordot(change, self._units, 1)
        carried, by_row = np.zeros_like(tables[0][:, 0]), followed.chains.ndim == 2
        layouts, parts = self._layouts(chains, followed), list[dict[str, np.ndarray]]()
        for step in range(len(self.path)):
            vectors = (carried, followed.chains, by_robot, *(one[:, step] for one in tables))
            which = (True, by_row, by_row, *(True,) * len(tables))
            carried, by = tangent_step.rows(*map(Packed, vectors, repeat(None), which), layouts)
            parts.append(by)
        turn = self.path.load.base_to_world
        slopes = {
            name: REGISTERED[name].turned(np.stack([by[name] for by in parts], axis=1), turn)
            for name in layouts.outputs
        }
        return self._packed(slopes, len(rows)), alike

    def _back(
        self, table: BatchTable, rows: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        followed, chains = table.followed(rows, STEPS), table.chains
        layouts = self._layouts(chains, followed)._replace(chain_varies=False)
        tables = *self._steps(table, followed), self._seeds(weights, layouts.outputs)
        carried, by_load = np.zeros_like(tables[0][:, 0]), np.zeros_like(followed.commands)
        by_chain, alike = np.zeros((len(rows), chains.structure.size)), followed.alike
        by_row = (True, followed.chains.ndim == 2, *(True,) * len(tables))
        counts = np.zeros((len(rows), 1), bool)
        for step in reversed(range(len(self.path))):
            vectors = carried, followed.chains, *(one[:, step] for one in tables)
            before, by = adjoint_step.rows(*map(Packed, vectors, repeat(None), by_row), layouts)
            # No step beyond the last that counts: one that failed there must not matter.
            counts |= tables[-1][:, step].any(axis=1, keepdims=True)
            carried = np.where(counts, before, 0.0)
            by_load[:, step] = np.where(counts, by["load"], 0.0)
            by_chain += np.where(counts, by["chain"], 0.0)
        gradient = np.tensordot(by_load, self._units, ((1, 2), (1, 2)))
        if chains.programs is not None and chains.form is not None:
            numbers, units = chains.form.table(table.batch.robot_of[rows]), chains.form.units
            varied = np.flatnonzero(units.any(axis=0))
            by_number, same = chains.programs.gradient(numbers, by_chain, varied)
            gradient[:, self._numbers] += by_number @ units[:, varied].T
            alike = alike & same
        return gradient, alike

    def _seeds(
        self, weights: Float[np.ndarray, "k m"], outputs: Sequence[str]
    ) -> Float[np.ndarray, "k s outputs"]:
        """Return weights of outputs in the frame of the base, step by step."""
        turn = self.path.load.base_to_world
        seeds: list[np.ndarray] = []
        for name in outputs:
            part, shape, _ = self.forms[name]
            table = weights[:, part].reshape(-1, *shape)
            own = REGISTERED[name].turned(table, None if turn is None else turn.T)
            seeds.append(own.reshape(len(weights), shape[0], -1))
        return np.concatenate(seeds, axis=2)
