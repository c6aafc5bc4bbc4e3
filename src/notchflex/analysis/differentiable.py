"""A robot under loads as a function of its numbers that JAX can differentiate, map and compile."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from math import prod
from typing import Any

import numpy as np
from jax.core import ShapedArray, Tracer
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, Bool, Float

from notchflex._jax import jax, jnp
from notchflex._summary import Displayed, Summary
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.outputs import OutputTable, check_outputs
from notchflex.analysis.slopes import (
    LOADS,
    SLOPING,
    RobotRows,
    changes,
    derivatives,
    gradient_by,
    start_of,
)
from notchflex.analysis.solve import check_refinement
from notchflex.analysis.tangent import Kink, kinks, path_gradient
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.load import check_is_robot, short_repr
from notchflex.loads.load_path import TIP, load_path
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings
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
    solved in three parts or more, whose memory is not followed; smaller steps help. Inside a
    program that JAX traces, numbers that no robot can have give NaN, and `converged` is
    false there, as where a load does not converge.

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
    start = {name: jnp.asarray(at) for name, at in start_of(robot, path, names).items()}
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
        self._check(complete)
        plain = np.concatenate([np.ravel(value) for value in complete.values()])
        values = self._solver.table(plain)
        return OutputTable({name: jnp.asarray(value) for name, value in values.items()})

    def _summary(self) -> Summary:
        shapes = {
            name: "×".join(map(str, at.shape)) or "a number" for name, at in self.start.items()
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
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
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
        at, along = self._complete(values), self._complete(direction)
        along = {name: along[name] if name in direction else 0.0 * along[name] for name in along}
        size = max(float(jnp.max(jnp.abs(step))) for step in along.values())
        if size == 0.0:
            raise InputError.NO_DATA(
                "the direction changes nothing; give a change of some parameter"
            )

        def outputs(part: float) -> dict[str, np.ndarray]:
            moved = {name: at[name] + part * along[name] for name in at}
            path = self._path(moved).raise_if_failed()
            every = {name: np.asarray(getattr(path, name)) for name in self.outputs}
            return {name: one for name, one in every.items() if one.dtype != bool}

        middle = outputs(0.0)

        def side(step: float) -> dict[str, np.ndarray]:
            near, far = outputs(step), outputs(2.0 * step)
            return {
                name: (4.0 * near[name] - 3.0 * middle[name] - far[name]) / (2.0 * step)
                for name in middle
            }

        return side(-_ASIDE / size), side(_ASIDE / size)

    def _path(self, values: Mapping[str, Any]) -> EquilibriumPath:
        """Solve the path at some values."""
        return self.model.solve(self._robot(values), self.load.commanding(values))

    def _robot(self, values: Mapping[str, Any]) -> Robot:
        return self._robots(tuple(float(values[name]) for name in self.numbers))

    @cached_property
    def _robots(self) -> Callable[[tuple[float, ...]], Robot]:
        """Robots of some numbers; the same is asked for again for other loads."""

        def made(numbers: tuple[float, ...]) -> Robot:
            values = zip(self.numbers, numbers, strict=True)
            return self.robot.with_values(values) if numbers else self.robot

        return lru_cache(maxsize=4)(made)

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
        return {name: self._value(name, values.get(name, at)) for name, at in self.start.items()}

    def _check(self, values: dict[str, Array]) -> None:
        """Refuse what no robot or load can have; traced values only set `converged` to false."""
        numbers = {name: float(values[name]) for name in self.numbers}
        if numbers != {name: float(self.start[name]) for name in self.numbers}:
            self._robot(values)
        if "tension" in values and not (values["tension"] >= 0.0).all():
            raise InputError.OUT_OF_RANGE("a tendon can only pull; give tensions of 0 N or more")

    def _value(self, name: str, value: Any) -> Array:
        shape = self.start[name].shape
        if isinstance(value, Tracer) and (value.shape, value.dtype) == (shape, float):
            return value  # JAX would compile even a conversion that changes nothing
        try:
            plain = [one for one in jax.tree.leaves(value) if not isinstance(one, Tracer)]
            if any(np.asarray(one).dtype.kind in "USO" for one in plain):
                raise TypeError("text")
            return jnp.broadcast_to(jnp.asarray(value, float), shape)
        except (TypeError, ValueError):
            raise InputError.WRONG_SHAPE(
                f"`{name}` must be numbers of shape {shape}; got {short_repr(value)}"
            ) from None

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the parameters that are numbers of the robot."""
        return tuple(name for name in self.start if name not in LOADS)

    @cached_property
    def model(self) -> ForwardModel:
        """The forward model of the robot and its loads."""
        free = any(name in TIP for name in self.start)
        return ForwardModel(self.robot, self.load, self.settings, self.refinement, any_load=free)

    @cached_property
    def _solver(self) -> VectorSolver:
        start = {name: np.asarray(at) for name, at in self.start.items()}
        return VectorSolver(start, self.outputs, self._path, self.refinement)

    @cached_property
    def _traced(self) -> Callable[[dict[str, Array]], OutputTable]:
        """The function of named values for JAX, as one program: JAX compiles each step else."""
        function = outputs_function(self._solver)
        return jax.jit(
            lambda values: function(jnp.concatenate([values[name].ravel() for name in self.start]))
        )


# A robot under loads as primitives of JAX: outputs, their change along one, and the transpose.
#
# JAX calls back to compiled programs of the library, so that user code around it does not compile
# the mechanics again. A call takes any number of rows, so that a map of JAX is one call.


@dataclass(frozen=True, eq=False)
class VectorSolver:
    """Outputs and their derivatives by compiled programs, for rows of plain values.

    Attributes:
        start: Present values of the parameters, by name.
        outputs: Names of the outputs.
        solve: Solves the path at named values; raises `InputError` for invalid values.
        refinement: More strain modes.
    """

    start: Mapping[str, np.ndarray]
    outputs: tuple[str, ...]
    solve: Callable[[Mapping[str, Any]], EquilibriumPath]
    refinement: int

    @cached_property
    def first(self) -> Float[np.ndarray, " n"]:
        """The present values as a row."""
        return np.concatenate([at.ravel() for at in self.start.values()])

    @cached_property
    def forms(self) -> dict[str, tuple[slice, tuple[int, ...], str]]:
        """Where every output is in a row of them, its shape, and its kind of numbers."""
        values = self.table(self.first)
        ends = np.cumsum([0, *(one.size for one in values.values())]).tolist()
        parts = map(slice, ends, ends[1:])
        return {
            name: (part, one.shape, one.dtype.kind)
            for part, (name, one) in zip(parts, values.items(), strict=True)
        }

    @cached_property
    def size(self) -> int:
        """Number of all outputs."""
        return max(part.stop for part, _, _ in self.forms.values())

    @cached_property
    def _sloping(self) -> tuple[str, ...]:
        return tuple(name for name in self.outputs if name in SLOPING)

    @cached_property
    def _rows(self) -> RobotRows:
        return RobotRows(self._path(self.first), self.start, self.forms, self.refinement)

    def table(self, at: Float[np.ndarray, " n"]) -> dict[str, np.ndarray]:
        """Return the outputs; raise `InputError` for values that no robot or load can have."""
        path = self._path(at)
        values = {name: np.asarray(getattr(path, name)) for name in self.outputs}
        for name in self._sloping if not path.converged.all() else ():
            values[name] = values[name].copy()
            values[name][~path.converged] = np.nan
        return values

    def values(self, at: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k m"]:
        """Return the outputs of rows of values, as rows; NaN where values are refused."""

        def single(at: np.ndarray) -> np.ndarray:
            return np.hstack([one.ravel() for one in self.table(at).values()])[None]

        return self._each(single, RobotRows.values, self.size, at)

    def along(
        self, at: Float[np.ndarray, "k n"], change: Float[np.ndarray, "j n"]
    ) -> Float[np.ndarray, "j m"]:
        """Return the changes of the outputs along changes of the values."""

        def single(at: np.ndarray, change: np.ndarray) -> np.ndarray:
            path = self._path(at)
            slopes = np.zeros((len(change), self.size))
            by = derivatives(path, changes(path, (*self.start,), change), self._sloping)
            for name, values in by.items():
                slopes[:, self.forms[name][0]] = values.reshape(len(change), -1)
            return slopes

        return self._each(single, RobotRows.along, self.size, at, change)

    def back(
        self, at: Float[np.ndarray, "k n"], weights: Float[np.ndarray, "j m"]
    ) -> Float[np.ndarray, "j n"]:
        """Return the derivatives of weighted sums of the outputs by the values."""

        def single(at: np.ndarray, weights: np.ndarray) -> np.ndarray:
            path = self._path(at)
            gradients: list[np.ndarray] = []
            for row in weights:
                parts = {name: self.forms[name] for name in self._sloping}
                named = {name: row[part].reshape(form) for name, (part, form, _) in parts.items()}
                gradients.append(gradient_by(path, path_gradient(path, named), (*self.start,)))
            return np.stack(gradients)

        return self._each(single, RobotRows.back, len(self.first), at, weights)

    def _each(
        self,
        single: Callable[..., np.ndarray],
        several: Callable[..., tuple[np.ndarray, Bool[np.ndarray, " k"]]],
        size: int,
        at: np.ndarray,
        *others: np.ndarray,
    ) -> np.ndarray:
        """Evaluate one row, with some directions, or rows, which are solved at once if possible."""

        def safe(*arguments: np.ndarray) -> np.ndarray:
            try:
                return single(*arguments)
            except InputError:
                return np.full((len(arguments[-1]) if others else 1, size), np.nan)

        if len(at) == 1:
            return safe(at[0], *others)
        results, solved = several(self._rows, at, *others)
        for row in np.flatnonzero(~solved):
            results[row] = safe(at[row], *(other[row : row + 1] for other in others))
        return results

    def _path(self, at: Float[np.ndarray, " n"]) -> EquilibriumPath:
        """Solve the path at some values; the last one is cached for its derivatives."""
        if not np.isfinite(at).all():  # a tension that is not a number would mean a slack tendon
            raise InputError.NOT_FINITE("values must be finite numbers")
        key = at.tobytes()
        if key not in self._last:
            ends = np.cumsum([one.size for one in self.start.values()])[:-1]
            pairs = zip(self.start.items(), np.split(at, ends), strict=True)
            path = self.solve({name: part.reshape(one.shape) for (name, one), part in pairs})
            self._last.clear()
            self._last[key] = path
        return self._last[key]

    @cached_property
    def _last(self) -> dict[bytes, EquilibriumPath]:
        return {}


def outputs_function(solver: VectorSolver) -> Callable[[Array], OutputTable]:
    """Wrap a solver as a function of JAX.

    Invalid values give NaN for numbers and false for flags, as a program of JAX cannot raise.

    Args:
        solver: Gives outputs and derivatives.

    Returns:
        A function of a vector of values that JAX traces, differentiable once, forward and reverse.
    """

    def function(at: Array) -> OutputTable:
        flat = _VALUES.bind(at, solver=solver)
        table = OutputTable()
        for name, (part, shape, kind) in solver.forms.items():
            values = flat[part].reshape(shape)
            table[name] = values if kind == "f" else as_kind(jnp.nan_to_num(values), kind)
        return table

    return function


def _primitive(name: str, method: Callable[..., np.ndarray], size: Callable[..., int]) -> Primitive:
    """Make a primitive of rows of values and, for each, of a vector; see `VectorSolver`."""
    primitive = Primitive(f"notchflex_{name}")

    def evaluate(solver: VectorSolver, *arrays: Any) -> np.ndarray:
        plain = [np.asarray(one) for one in arrays]
        shape = np.broadcast_shapes(*(one.shape[:-1] for one in plain))
        if plain[0].size > plain[0].shape[-1]:
            plain[0] = np.broadcast_to(plain[0], (*shape, plain[0].shape[-1]))
        rows = [one.reshape(-1, one.shape[-1]) for one in plain]
        return method(solver, *rows).reshape(*shape, size(solver))

    def form(*arrays: Any, solver: VectorSolver) -> Any:
        shape = np.broadcast_shapes(*(one.shape[:-1] for one in arrays))
        return ShapedArray((*shape, size(solver)), np.dtype(float))

    def lowered(*arrays: Array, solver: VectorSolver) -> Array:
        # Compiled now: within a program of JAX nothing may be traced.
        rows = np.tile(solver.first, (min(prod(arrays[0].shape[:-1]), 2), 1))
        evaluate(solver, rows, *(np.ones((len(rows), one.shape[-1])) for one in arrays[1:]))
        shape = jax.ShapeDtypeStruct(form(*arrays, solver=solver).shape, float)
        return jax.pure_callback(partial(evaluate, solver), shape, *arrays)

    def mapped(arrays: Any, axes: Any, *, solver: VectorSolver) -> tuple[Array, int]:
        moved = [
            jnp.expand_dims(one, 0) if axis is batching.not_mapped else jnp.moveaxis(one, axis, 0)
            for one, axis in zip(arrays, axes, strict=True)
        ]
        count = max(len(one) for one in moved)
        # Vectors have all leading axes, so that the transpose has the same.
        vectors = [jnp.broadcast_to(one, (count, *one.shape[1:])) for one in moved[1:]]
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
    (at,), (change,) = primals, tangents
    values = _VALUES.bind(at, solver=solver)
    if type(change) is ad.Zero:
        return values, jnp.zeros_like(values)
    return values, _ALONG.bind(at, change, solver=solver)


def _linear(primitive: Primitive, transpose: Primitive) -> None:
    """Tell JAX that a primitive is linear in its vector, and what its transpose is."""

    def moved(primals: Any, tangents: Any, *, solver: VectorSolver) -> tuple[Array, Array]:
        (at, vector), (change, by_vector) = primals, tangents
        if type(change) is not ad.Zero:
            raise InputError.UNSUPPORTED(
                "a robot under loads can be differentiated once, not twice: take differences of "
                "its gradients, or minimise by a method that needs first derivatives only"
            )
        values = primitive.bind(at, vector, solver=solver)
        return values, primitive.bind(at, by_vector, solver=solver)

    def back(cotangent: Any, at: Array, vector: Any, *, solver: VectorSolver) -> tuple[Any, Any]:
        if type(cotangent) is ad.Zero:
            return None, ad.Zero(vector.aval)
        return None, transpose.bind(at, cotangent, solver=solver)

    ad.primitive_jvps[primitive] = moved
    ad.primitive_transposes[primitive] = back


ad.primitive_jvps[_VALUES] = _values_along
_linear(_ALONG, _BACK)
_linear(_BACK, _ALONG)
