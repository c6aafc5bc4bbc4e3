"""A robot under loads as a function of its numbers that JAX can differentiate, map and compile."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import repeat
from math import prod
from typing import Any

import numpy as np
from jax.core import ShapedArray, Tracer
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, Bool, Float

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.batch import BatchRows, BatchTable, FollowedRows, LoadRows
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.outputs import (
    LOADS,
    STEPS,
    Arrays,
    OutputTable,
    check_outputs,
    slices_of,
)
from notchflex.analysis.slopes import (
    SLOPING,
    changes,
    derivatives,
    gradient_by,
    load_units,
    start_of,
)
from notchflex.analysis.solve import check_refinement
from notchflex.analysis.tangent import (
    Kink,
    StepLayouts,
    adjoint_step,
    kinks,
    path_gradient,
    tangent_step,
)
from notchflex.analysis.varied import VariedRobots, single_chains
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import LoadKind
from notchflex.loads.load import check_is_robot, short_repr
from notchflex.loads.load_path import TIP, load_path
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.numbers import places_by_name
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.compiled import Packed, number_of_cores, on_cores
from notchflex.solver.programs.static_structure import as_kind

# Largest change of a parameter in one-sided differences.
_ASIDE = 1e-5


def differentiable(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    parameters: Sequence[str],
    *,
    outputs: Sequence[str] = ("total_angle", "tip_position"),
    settings: Settings | None = None,
    refinement: int = 0,
) -> Differentiable:
    """Make a robot under loads a function of some of its numbers.

    The function takes a table of values by name and returns a table of outputs by name. `jax.jvp`,
    `jax.grad`, `jax.vmap` and `jax.jit` compose with it. Loads are followed with friction history,
    and so are the derivatives. Where a contact changes between sticking and sliding, lips meet or
    the material's law has a kink, the derivative is that of one side: `kinks` lists such contacts
    and notches, `one_sided` gives both sides. With friction it is NaN from a load on that was
    solved in three parts or more, whose memory is not followed; smaller steps help. What is not
    known of a state (NaN), such as strains of a table, has the slope 0. Inside a program that JAX
    traces, numbers that no robot can have give NaN, and `converged` is false there, as where a load
    does not converge.

    Args:
        robot: The robot.
        loads: A path, or loads in order.
        parameters: What may vary: numbers of the robot by name (as for `Robot.with_value`, in the
            units of the robot file), and of the loads "tension" (N, steps by tendons), "stroke"
            (mm), "tip_force" (N, steps by 3) and "tip_moment" (N mm).
        outputs: What to return, by names of `EquilibriumPath`. `jax.jacfwd` and `jax.jacrev` take
            numbers alone, no truth values such as `converged`.
        settings: How hard the solver tries.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The function; its `start` are the present values.

    Raises:
        InputError: There is no such number, output or refinement, or the loads are invalid.

    Example:
        >>> import jax
        >>> from notchflex import load_robot, pull
        >>> wrist = load_robot("pacheco2021-a")
        >>> bend = differentiable(wrist, pull(1.0, 1.0, steps=1), ["notch.depth", "tension"])
        >>> by = jax.grad(lambda values: bend(values)["total_angle"][-1])(bend.start)
        >>> f"{by['notch.depth']:.2f} rad/mm, {by['tension'][0, 0]:.3f} rad/N"
        '13.30 rad/mm, 1.520 rad/N'
    """
    path = load_path(loads, check_is_robot(robot).number_of_tendons)
    check_refinement(refinement)
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    if not names or len(set(names)) < len(names):
        raise InputError.NO_DATA("parameters must name at least one number, and none of them twice")
    start = {name: jnp.asarray(value) for name, value in start_of(robot, path, names).items()}
    return Differentiable(
        robot, path, start, check_outputs(outputs), settings or DEFAULT, refinement
    )


@dataclass(frozen=True, eq=False, repr=False)
class Differentiable(Displayed):
    """A robot under loads as a function of some of its numbers; see `differentiable`.

    Attributes:
        robot: The robot as it is.
        load: The loads.
        start: Present values of the parameters.
        outputs: Names of what is returned.
        settings: How hard the solver tries.
        refinement: More strain modes.
    """

    robot: Robot
    load: LoadPath
    start: dict[str, Array]
    outputs: tuple[str, ...]
    settings: Settings
    refinement: int

    def __call__(self, values: Mapping[str, Any] | None = None) -> OutputTable:
        """Return the outputs of every state by name, loads as leading axis.

        Args:
            values: By name of the parameter, in the shape of `start`; those left out stay.

        Raises:
            InputError: Values of another name or shape, or, where nothing is traced, of a robot
                that cannot exist.
        """
        complete = self._complete(values)
        if any(isinstance(value, Tracer) for value in complete.values()):
            return self._traced(complete)
        plain = np.concatenate([np.ravel(value) for value in complete.values()])
        values = self._solver.table(plain)
        return OutputTable({name: jnp.asarray(value) for name, value in values.items()})

    def _summary(self) -> Summary:
        shapes = {
            name: "×".join(map(str, value.shape)) or "a number"
            for name, value in self.start.items()
        }
        rows = [*shapes.items(), ("outputs", ", ".join(self.outputs))]
        title = f"Function of {self.robot.name} under {len(self.load)} loads"
        return Summary(title, rows, ".start holds the present values; call it with others by name")

    def kinks(self, values: Mapping[str, Any] | None = None, *, within: float = 1e-6) -> list[Kink]:
        """List the contacts and notches at a switch, where derivatives are those of one side.

        Args:
            values: As for a call.
            within: Distance from the switch up to which they count; see `Kink.distance`.

        Raises:
            InputError: Values of another name or shape, or a robot that cannot be.
        """
        return kinks(self._path(self._complete(values)), within)

    def one_sided(
        self, direction: Mapping[str, Any], values: Mapping[str, Any] | None = None
    ) -> tuple[Arrays, Arrays]:
        """Find the derivatives along a direction from its two sides, by differences.

        Away from kinks both are the directional derivative that JAX gives; at a kink that one is
        one of the two.

        Args:
            direction: Change of the parameters by name, in the shape of `start`; those left out
                stay.
            values: Where; as for a call.

        Returns:
            The derivatives of every output but truth values, against the direction and along it,
            right to about 1e-7 of the output per unit of the direction.

        Raises:
            InputError: Values of another name or shape, a robot that cannot exist, or a load that
                does not converge.
        """
        point, along = self._complete(values), self._complete(direction)
        along = {name: along[name] if name in direction else 0.0 * along[name] for name in along}
        size = max(float(jnp.max(jnp.abs(step))) for step in along.values())
        if size == 0.0:
            raise InputError.NO_DATA(
                "the direction changes nothing; give a change of some parameter"
            )

        def outputs(part: float) -> Arrays:
            moved = {name: point[name] + part * along[name] for name in point}
            path = self._path(moved).raise_if_failed()
            arrays = {name: np.asarray(getattr(path, name)) for name in self.outputs}
            return {name: array for name, array in arrays.items() if array.dtype != bool}

        middle = outputs(0.0)

        def side(step: float) -> Arrays:
            near, far = outputs(step), outputs(2.0 * step)
            return {
                name: (4.0 * near[name] - 3.0 * middle[name] - far[name]) / (2.0 * step)
                for name in middle
            }

        return side(-_ASIDE / size), side(_ASIDE / size)

    def _path(self, values: Mapping[str, Any]) -> EquilibriumPath:
        """Solve the path at some values."""
        numbers = tuple((name, float(value)) for name, value in values.items() if name not in LOADS)
        return self.model.solve(_varied(self.robot, numbers), self.load.commanding(values))

    def _complete(self, values: Mapping[str, Any] | None) -> dict[str, Array]:
        """Return values of all parameters, in their shapes."""
        if not isinstance(values, Mapping | None):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError.WRONG_TYPE(
                f"give values by name of the parameter; got {short_repr(values)}"
            )
        values = dict(values or {})
        unknown = [name for name in values if name not in self.start]
        if unknown:
            raise InputError.UNKNOWN_NAME(
                f"`{unknown[0]}` is not one of the parameters {', '.join(self.start)}"
            )
        return {
            name: self._value(name, values.get(name, present))
            for name, present in self.start.items()
        }

    def _value(self, name: str, value: Any) -> Array:
        shape = self.start[name].shape
        if isinstance(value, Tracer) and (value.shape, value.dtype) == (shape, float):
            return value  # JAX would compile even a conversion that changes nothing
        try:
            plain = [leaf for leaf in jax.tree.leaves(value) if not isinstance(leaf, Tracer)]
            if any(np.asarray(leaf).dtype.kind in "USO" for leaf in plain):
                raise TypeError("text")
            return jnp.broadcast_to(jnp.asarray(value, float), shape)
        except (TypeError, ValueError):
            raise InputError.WRONG_SHAPE(
                f"`{name}` must be numbers of shape {shape}; got {short_repr(value)}"
            ) from None

    @cached_property
    def model(self) -> ForwardModel:
        """The forward model of the robot and its loads."""
        free = any(name in TIP for name in self.start)
        # Programs assemble robots of its form: a notch whose number varies is a notch of its own.
        robot, _ = places_by_name(self.robot, [name for name in self.start if name not in LOADS])
        return ForwardModel(robot, self.load, self.settings, self.refinement, any_load=free)

    @cached_property
    def _solver(self) -> VectorSolver:
        start = {name: np.asarray(value) for name, value in self.start.items()}
        return VectorSolver(start, self.outputs, self._path, self.refinement)

    @cached_property
    def _traced(self) -> Callable[[dict[str, Array]], OutputTable]:
        """The function of named values for JAX, as one program: JAX compiles each step else."""
        # Invalid values give NaN for numbers and false for flags, as a program cannot raise.
        solver = self._solver

        def function(named: dict[str, Array]) -> OutputTable:
            point = jnp.concatenate([named[name].ravel() for name in self.start])
            flat = _VALUES.bind(point, solver=solver)
            table = OutputTable()
            for name, (part, shape, kind) in solver.forms.items():
                values = flat[part].reshape(shape)
                table[name] = values if kind == "f" else as_kind(jnp.nan_to_num(values), kind)
            return table

        return jax.jit(function)


@lru_cache(maxsize=16)
def _varied(robot: Robot, values: tuple[tuple[str, float], ...]) -> Robot:
    """Return a robot with other numbers; the same is asked for again for other loads."""
    return robot.with_values(values) if values else robot


# A robot under loads as primitives of JAX: outputs, their change along one, and the transpose.
#
# JAX calls back to compiled programs of the library, so that user code around it does not compile
# the mechanics again. A call takes any number of rows, so that a map of JAX is one call.


@dataclass(frozen=True, eq=False)
class VectorSolver:
    """Outputs and their derivatives by compiled programs, for rows of plain values."""

    start: Mapping[str, np.ndarray]  # present values of the parameters
    outputs: tuple[str, ...]
    solve: Callable[[Mapping[str, Any]], EquilibriumPath]  # raises `InputError` for invalid values
    refinement: int

    @cached_property
    def first(self) -> Float[np.ndarray, " n"]:
        """The present values as a row."""
        return np.concatenate([value.ravel() for value in self.start.values()])

    @cached_property
    def _path(self) -> EquilibriumPath:
        """The path at the present values."""
        return self._path_at(self.first)

    @cached_property
    def forms(self) -> dict[str, tuple[slice, tuple[int, ...], str]]:
        """Where every output is in a row of them, its shape, and its kind of numbers."""
        values = self.table(self.first)
        parts = slices_of(values)
        return {
            name: (parts[name], array.shape, array.dtype.kind) for name, array in values.items()
        }

    @cached_property
    def size(self) -> int:
        """Number of all outputs."""
        return max(part.stop for part, _, _ in self.forms.values())

    @cached_property
    def _sloping(self) -> tuple[str, ...]:
        return tuple(name for name in self.outputs if name in SLOPING)

    def table(self, point: Float[np.ndarray, " n"]) -> Arrays:
        """Return the outputs; raise `InputError` for values that no robot or load can have."""
        path = self._path_at(point)
        values = {name: np.asarray(getattr(path, name)) for name in self.outputs}
        for name in self._sloping if not path.converged.all() else ():
            values[name] = values[name].copy()
            values[name][~path.converged] = np.nan
        return values

    def values(self, points: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k m"]:
        """Return the outputs of rows of values, as rows; NaN where values are refused."""

        def single(point: np.ndarray) -> np.ndarray:
            return self._packed({name: array[None] for name, array in self.table(point).items()})

        def batched(table: BatchTable, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            outputs, alike = table.solved(rows)
            return self._packed(outputs), alike

        return self._each(single, batched, self.size, points)

    def along(
        self, points: Float[np.ndarray, "k n"], change: Float[np.ndarray, "j n"]
    ) -> Float[np.ndarray, "j m"]:
        """Return the changes of the outputs along changes of the values."""

        def single(point: np.ndarray, change: np.ndarray) -> np.ndarray:
            path = self._path_at(point)
            directions = changes(path, (*self.start,), change)
            return self._packed(derivatives(path, directions, self._sloping))

        return self._each(single, self._along, self.size, points, change)

    def back(
        self, points: Float[np.ndarray, "k n"], weights: Float[np.ndarray, "j m"]
    ) -> Float[np.ndarray, "j n"]:
        """Return the derivatives of weighted sums of the outputs by the values."""

        def single(point: np.ndarray, weights: np.ndarray) -> np.ndarray:
            path = self._path_at(point)
            parts = {name: self.forms[name] for name in self._sloping}
            gradients = [
                path_gradient(
                    path,
                    {name: row[part].reshape(shape) for name, (part, shape, _) in parts.items()},
                )
                for row in weights
            ]
            return np.stack([gradient_by(path, gradient, (*self.start,)) for gradient in gradients])

        return self._each(single, self._back, len(self.first), points, weights)

    def _packed(self, by_name: Mapping[str, np.ndarray]) -> Float[np.ndarray, "k m"]:
        """Return outputs or their changes side by side; 0 for what has no change."""
        rows = np.zeros((len(next(iter(by_name.values()))), self.size))
        for name in by_name.keys() & self.forms.keys():
            rows[:, self.forms[name][0]] = by_name[name].reshape(len(rows), -1)
        return rows

    def _each(
        self,
        single: Callable[..., np.ndarray],
        batched: Callable[..., tuple[np.ndarray, Bool[np.ndarray, " k"]]],
        size: int,
        points: np.ndarray,
        *others: np.ndarray,
    ) -> np.ndarray:
        """Evaluate one row, with some directions, or rows, which are solved at once if possible."""
        if len(points) == 1:
            return self._safe(single, size, points[0], *others)
        results, solved = np.empty((len(points), size)), np.zeros(len(points), bool)
        places = np.flatnonzero((np.isfinite(points) & (points >= self._least)).all(axis=1))
        table = self._rows(points[places]) if len(places) else None
        # Loads on what weighs something depend on the numbers of the robot.
        weighs = bool(self._numbers) and self._path.chain.loaded and bool(others)
        if table is not None and not weighs:
            pieces = list(table.pieces(number_of_cores()))
            solving = on_cores(
                lambda rows: batched(table, rows, *(vectors[places[rows]] for vectors in others)),
                pieces,
            )
            for rows, (values, alike) in zip(pieces, solving, strict=True):
                results[places[rows]], solved[places[rows]] = values, alike
        for row in np.flatnonzero(~solved):
            directions = (vectors[row : row + 1] for vectors in others)
            results[row] = self._safe(single, size, points[row], *directions)
        return results

    def _safe(
        self, single: Callable[..., np.ndarray], size: int, point: np.ndarray, *others: np.ndarray
    ) -> np.ndarray:
        """Evaluate one row; NaN where its values are refused."""
        try:
            return single(point, *others)
        except InputError:
            return np.full((max(map(len, others), default=1), size), np.nan)

    @cached_property
    def _columns(self) -> dict[str, slice]:
        """Where the numbers of each name are in a row of values."""
        return slices_of(self.start)

    @cached_property
    def _numbers(self) -> list[int]:
        """Where the numbers of the robot are in a row of values."""
        return [part.start for name, part in self._columns.items() if name not in LOADS]

    @cached_property
    def _least(self) -> Float[np.ndarray, " n"]:
        """The least that each value may be; a tendon that is not commanded may have any."""
        least = np.full(len(self.first), -np.inf)
        if "tension" in self.start:
            slack = np.isnan(self._path.load.tension).ravel()
            least[self._columns["tension"]] = np.where(slack, -np.inf, 0.0)
        return least

    @cached_property
    def _units(self) -> Float[np.ndarray, "n s command"]:
        """The change of the packed loads per unit of each value."""
        still = np.zeros((1, *self._path.commands.packed().shape))
        units = [load_units(self._path, name) if name in LOADS else still for name in self.start]
        return np.concatenate(units)

    def _rows(self, points: Float[np.ndarray, "k n"]) -> BatchTable | None:
        """Return values as rows of a batch, those that make robots; None if they need Python."""
        path, row_numbers = self._path, np.arange(len(points))
        distinct, robot_of = np.unique(points[:, self._numbers], axis=0, return_inverse=True)
        of_robots, of_loads = Arrays(), Arrays()
        for name, start in self.start.items():
            if name in LOADS:
                of_loads[name] = points[:, self._columns[name]].reshape(-1, *start.shape)
            else:
                of_robots[name] = distinct[:, len(of_robots)]
        robots = VariedRobots([path.robot], np.zeros(len(distinct), int), of_robots)
        loads = LoadRows(path.load, len(path)).varied(0 * row_numbers, of_loads)
        outputs = tuple(dict.fromkeys((*self.outputs, "converged")))
        settings = outputs, path.settings, self.refinement
        rows = BatchRows(robots, loads, robot_of.reshape(-1), row_numbers, *settings)
        chain = path.chain
        kind = (
            LoadKind.LOADED * chain.loaded
            | LoadKind.SIDEWAYS * (chain.level == "space")
            | LoadKind.FOLLOWING * chain.follows
            | LoadKind.DRAWN * path.load.draws
        )
        chains = single_chains({0: path.prepared})
        if of_robots:
            chains = next(robots.forms(np.arange(len(robots)))).chains(kind, self.refinement)
        return chains and BatchTable(rows, np.flatnonzero(rows.valid), chains, kind)

    def _steps(self, table: BatchTable, rows: np.ndarray) -> tuple[FollowedRows, StepLayouts, Any]:
        """Follow rows; return also what programs take of every step, rows and steps as axes."""
        followed, ready = table.followed(rows, STEPS), table.chains.ready
        outputs = followed.outputs
        rest = np.broadcast_to(ready.rest_vector, outputs["states"][:, :1].shape)
        before = np.concatenate([rest, outputs["states"][:, :-1]], axis=1)
        structure, varies = table.chains.structure, bool(self._numbers)
        layouts = StepLayouts(structure, followed.layout, ready.state, self._sloping, varies)
        return followed, layouts, (before, *(outputs[name] for name in STEPS), followed.commands)

    def _along(
        self, table: BatchTable, rows: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the changes of the outputs of rows of a batch, and which are right."""
        followed, layouts, tables = self._steps(table, rows)
        robots = table.batch.robot_of[rows]
        by_robot, alike = table.chains.along(robots, change[:, self._numbers])
        tables = (*tables, np.einsum("kn,nsc->ksc", change, self._units))
        carried, by_row = np.zeros_like(tables[0][:, 0]), followed.chains.ndim == 2
        have_rows = (True, by_row, by_row, *(True,) * len(tables))
        parts: list[Arrays] = []
        for step in range(len(self._path)):
            vectors = (carried, followed.chains, by_robot, *(array[:, step] for array in tables))
            carried, by = tangent_step.rows(*map(Packed, vectors, repeat(None), have_rows), layouts)
            parts.append(by)
        turn = self._path.load.base_to_world
        slopes = {
            name: REGISTERED[name].turned(np.stack([by[name] for by in parts], axis=1), turn)
            for name in self._sloping
        }
        return self._packed(slopes), alike & followed.alike

    def _back(
        self, table: BatchTable, rows: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of weighted sums of rows of a batch, and which are right."""
        followed, layouts, tables = self._steps(table, rows)
        layouts = layouts._replace(chain_varies=False)
        turn, seeds = self._path.load.base_to_world, list[np.ndarray]()
        for name in self._sloping:
            part, shape, _ = self.forms[name]
            seed = weights[:, part].reshape(-1, *shape)
            seed = REGISTERED[name].turned(seed, None if turn is None else turn.T)
            seeds.append(seed.reshape(*seed.shape[:2], -1))
        tables = (*tables, np.concatenate(seeds, axis=2))
        carried, by_load = np.zeros_like(tables[0][:, 0]), np.zeros_like(followed.commands)
        by_chain = np.zeros((len(rows), layouts.chain.size))
        by_row = (True, followed.chains.ndim == 2, *(True,) * len(tables))
        counts = np.zeros((len(rows), 1), bool)
        for step in reversed(range(len(self._path))):
            vectors = carried, followed.chains, *(array[:, step] for array in tables)
            before, by = adjoint_step.rows(*map(Packed, vectors, repeat(None), by_row), layouts)
            # No step beyond the last that counts: one that failed there must not matter.
            counts |= tables[-1][:, step].any(axis=1, keepdims=True)
            carried = np.where(counts, before, 0.0)
            by_load[:, step] = np.where(counts, by["load"], 0.0)
            by_chain += np.where(counts, by["chain"], 0.0)
        gradient = np.einsum("ksc,nsc->kn", by_load, self._units)
        by_number, alike = table.chains.back(table.batch.robot_of[rows], by_chain)
        gradient[:, self._numbers] += by_number
        return gradient, alike & followed.alike

    def _path_at(self, point: Float[np.ndarray, " n"]) -> EquilibriumPath:
        """Solve the path at some values; the last one is cached for its derivatives."""
        if not np.isfinite(point).all():  # a tension that is not a number would mean a slack tendon
            raise InputError.NOT_FINITE("values must be finite numbers")
        key = point.tobytes()
        if key not in self._last:
            parts = {name: point[part] for name, part in self._columns.items()}
            shaped = {name: parts[name].reshape(start.shape) for name, start in self.start.items()}
            path = self.solve(shaped)
            self._last.clear()
            self._last[key] = path
        return self._last[key]

    @cached_property
    def _last(self) -> dict[bytes, EquilibriumPath]:
        return {}


def _primitive(name: str, method: Callable[..., np.ndarray], size: Callable[..., int]) -> Primitive:
    """Make a primitive of rows of values and, for each, of a vector; see `VectorSolver`."""
    primitive = Primitive(f"notchflex_{name}")

    def evaluate(solver: VectorSolver, *arrays: Any) -> np.ndarray:
        plain = [np.asarray(array) for array in arrays]
        shape = np.broadcast_shapes(*(array.shape[:-1] for array in plain))
        if plain[0].size > plain[0].shape[-1]:
            plain[0] = np.broadcast_to(plain[0], (*shape, plain[0].shape[-1]))
        rows = [array.reshape(-1, array.shape[-1]) for array in plain]
        return method(solver, *rows).reshape(*shape, size(solver))

    def form(*arrays: Any, solver: VectorSolver) -> Any:
        shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        return ShapedArray((*shape, size(solver)), np.dtype(float))

    def lowered(*arrays: Array, solver: VectorSolver) -> Array:
        # Compiled now: within a program of JAX nothing may be traced.
        rows = np.tile(solver.first, (min(prod(arrays[0].shape[:-1]), 2), 1))
        evaluate(solver, rows, *(np.ones((len(rows), array.shape[-1])) for array in arrays[1:]))
        shape = jax.ShapeDtypeStruct(form(*arrays, solver=solver).shape, float)
        return jax.pure_callback(partial(evaluate, solver), shape, *arrays)

    def mapped(arrays: Any, axes: Any, *, solver: VectorSolver) -> tuple[Array, int]:
        moved = [
            jnp.expand_dims(array, 0)
            if axis is batching.not_mapped
            else jnp.moveaxis(array, axis, 0)
            for array, axis in zip(arrays, axes, strict=True)
        ]
        count = max(len(array) for array in moved)
        # Vectors have all leading axes, so that the transpose has the same.
        vectors = [jnp.broadcast_to(array, (count, *array.shape[1:])) for array in moved[1:]]
        return primitive.bind(moved[0], *vectors, solver=solver), 0

    primitive.def_impl(lambda *arrays, solver: jnp.asarray(evaluate(solver, *arrays)))
    primitive.def_abstract_eval(form)
    mlir.register_lowering(primitive, mlir.lower_fun(lowered, multiple_results=False))
    batching.primitive_batchers[primitive] = mapped
    return primitive


_VALUES = _primitive("values", VectorSolver.values, lambda solver: solver.size)
_ALONG = _primitive("along", VectorSolver.along, lambda solver: solver.size)
_BACK = _primitive("back", VectorSolver.back, lambda solver: len(solver.first))


def _values_along(primals: Any, tangents: Any, *, solver: VectorSolver) -> tuple[Array, Any]:
    (point,), (change,) = primals, tangents
    values = _VALUES.bind(point, solver=solver)
    if type(change) is ad.Zero:
        return values, jnp.zeros_like(values)
    return values, _ALONG.bind(point, change, solver=solver)


def _linear(primitive: Primitive, transpose: Primitive) -> None:
    """Tell JAX that a primitive is linear in its vector, and what its transpose is."""

    def moved(primals: Any, tangents: Any, *, solver: VectorSolver) -> tuple[Array, Array]:
        (point, vector), (change, by_vector) = primals, tangents
        if type(change) is not ad.Zero:
            raise InputError.UNSUPPORTED(
                "a robot under loads can be differentiated once, not twice: take differences of "
                "its gradients, or minimise by a method that needs first derivatives only"
            )
        values = primitive.bind(point, vector, solver=solver)
        return values, primitive.bind(point, by_vector, solver=solver)

    def back(cotangent: Any, point: Array, vector: Any, *, solver: VectorSolver) -> tuple[Any, Any]:
        if type(cotangent) is ad.Zero:
            return None, ad.Zero(vector.aval)
        return None, transpose.bind(point, cotangent, solver=solver)

    ad.primitive_jvps[primitive] = moved
    ad.primitive_transposes[primitive] = back


ad.primitive_jvps[_VALUES] = _values_along
_linear(_ALONG, _BACK)
_linear(_BACK, _ALONG)
