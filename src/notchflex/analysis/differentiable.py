"""A robot under loads as a function of its numbers that JAX can differentiate, map and compile."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex._summary import Displayed, Summary
from notchflex.analysis.forward_model import Change, ForwardModel
from notchflex.analysis.outputs import OutputTable, check_outputs
from notchflex.analysis.solve import check_refinement
from notchflex.analysis.tangent import Kink, kinks
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.load import check_is_robot, short_repr
from notchflex.loads.load_path import TENDONS, TIP, load_path
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.value_names import number_at
from notchflex.solver.newton import DEFAULT, Settings

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
    start = {name: jnp.asarray(_present(robot, path, name), float) for name in names}
    return Differentiable(
        robot, path, start, check_outputs(outputs), settings or DEFAULT, refinement
    )


def _present(robot: Robot, path: LoadPath, name: str) -> Any:
    """Return the present value of a parameter."""
    return path.numbers(name) if name in (*TENDONS, *TIP) else number_at(robot, name)


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
        return self._function(self._flat(complete))

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
        return self.model.solve(self._robot(values), self._load(values))

    def _robot(self, values: Mapping[str, Any]) -> Robot:
        return self._robots(tuple(float(values[name]) for name in self.numbers))

    @cached_property
    def _robots(self) -> Callable[[tuple[float, ...]], Robot]:
        """Robots of some numbers; the same is asked for again for other loads."""

        def made(numbers: tuple[float, ...]) -> Robot:
            values = zip(self.numbers, numbers, strict=True)
            return self.robot.with_values(values) if numbers else self.robot

        return lru_cache(maxsize=4)(made)

    def _load(self, values: Mapping[str, Any]) -> LoadPath:
        load = self.load.commanding(values)
        tip = {name: np.asarray(values[name]) for name in self._tip}
        if tip:
            external = tuple(
                dataclasses.replace(one, **{name: tuple(at[step]) for name, at in tip.items()})
                for step, one in enumerate(load.external)
            )
            load = dataclasses.replace(load, external=external)
        return load

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
        return tuple(name for name in self.start if name not in (*TENDONS, *TIP))

    @cached_property
    def _tip(self) -> tuple[str, ...]:
        return tuple(name for name in TIP if name in self.start)

    @cached_property
    def model(self) -> ForwardModel:
        """The forward model of the robot and its loads."""
        free = bool(self._tip)
        return ForwardModel(self.robot, self.load, self.settings, self.refinement, any_load=free)

    @cached_property
    def _traced(self) -> Callable[[dict[str, Array]], OutputTable]:
        """The function of named values for JAX, as one program: JAX compiles each step else."""
        return jax.jit(lambda values: self._function(self._flat(values)))

    def _flat(self, values: dict[str, Array]) -> Array:
        return jnp.concatenate([values[name].ravel() for name in self.start])

    @cached_property
    def _function(self) -> Callable[[Array], OutputTable]:
        """All values as one vector to the outputs, as a function of JAX."""
        start = np.concatenate([np.ravel(self.start[name]) for name in self.start])
        solver = VectorSolver(
            self.model, self.start, self.outputs, self.numbers, self._path, self._load
        )
        return outputs_function(solver, start)


# Wrapper of a plain function with a Jacobian that JAX can differentiate, map and compile.
#
# JAX calls back to compiled programs of the library, so that user code around it does not compile
# the mechanics again.

# Number of robots whose derivatives by their numbers are cached.
_REMEMBERED = 16


@dataclass(frozen=True, eq=False)
class VectorSolver:
    """Outputs and their Jacobian by compiled programs, for plain vectors of values.

    Attributes:
        model: The forward model.
        start: Present values of the parameters, by name.
        outputs: Names of the outputs.
        numbers: Names of the parameters that are numbers of the robot.
        solve: Solves the path at named values; raises `InputError` for invalid values.
        load: Returns the loads at named values.
    """

    model: ForwardModel
    start: Mapping[str, Array]
    outputs: tuple[str, ...]
    numbers: tuple[str, ...]
    solve: Callable[[Mapping[str, Any]], EquilibriumPath]
    load: Callable[[Mapping[str, Any]], LoadPath]

    def values(self, flat: Float[np.ndarray, " k"]) -> dict[str, np.ndarray]:
        """Return the outputs; raise `InputError` for values that no robot or load can have."""
        path = self._path(flat)
        values = {name: np.asarray(getattr(path, name)) for name in self.outputs}
        for name, each in values.items():
            if _is_float(path, name) and not path.converged.all():
                values[name] = each.copy()
                values[name][~path.converged] = np.nan
        return values

    def slopes(self, flat: Float[np.ndarray, " k"], output: str) -> np.ndarray:
        """Return the derivatives of an output by every value, as last axis.

        Tangents give those of all outputs at once, which are cached; the adjoint one by one.
        """
        path = self._path(flat)
        kept = self._kept_slopes.setdefault(path, {})
        if output in kept:
            return kept[output]
        if output == "residual":  # the remaining error of the solver does not depend on the values
            return np.zeros((len(path), len(flat)))
        names = (output,)
        if not self.model.takes_adjoint(path, names, len(flat)):
            names = tuple(name for name in self.outputs if _is_float(path, name))
        changes = self._changes(path, self._named(flat))
        by_change = self.model.derivatives(path, changes, names)
        kept |= {name: np.moveaxis(one, 0, -1) for name, one in by_change.items()}
        return kept[output]

    def _named(self, flat: Float[np.ndarray, " k"]) -> dict[str, np.ndarray]:
        return {name: flat[part].reshape(shape) for name, part, shape in self._parts}

    @cached_property
    def _parts(self) -> list[tuple[str, slice, tuple[int, ...]]]:
        """Name, slice of the vector and shape of every value."""
        shapes = [np.shape(at) for at in self.start.values()]
        ends = np.cumsum([0, *(math.prod(shape) for shape in shapes)]).tolist()
        parts = [slice(*ends[number : number + 2]) for number in range(len(shapes))]
        return list(zip(self.start, parts, shapes, strict=True))

    def _path(self, flat: Float[np.ndarray, " k"]) -> EquilibriumPath:
        """Solve the path at some values; the last one is cached for its derivatives."""
        if not np.isfinite(flat).all():  # a tension that is not a number would mean a slack tendon
            raise InputError.NOT_FINITE("values must be finite numbers")
        key = flat.tobytes()
        if key not in self._last:
            path = self.solve(self._named(flat))
            self._last.clear()
            self._last[key] = path
        return self._last[key]

    @cached_property
    def _last(self) -> dict[bytes, EquilibriumPath]:
        return {}

    @cached_property
    def _kept_slopes(self) -> WeakKeyDictionary[EquilibriumPath, dict[str, np.ndarray]]:
        return WeakKeyDictionary()

    @cached_property
    def _kept(self) -> dict[Any, dict[str, Change]]:
        return {}

    def _changes(self, path: EquilibriumPath, values: Mapping[str, np.ndarray]) -> Iterator[Change]:
        """Compute the change of loads and chain per unit of every value."""
        # One program for all: with a change of the chain where any value changes it.
        still = np.zeros(self.model.ready.long.chain_layout.size) if self.numbers else None
        by_number = self._by_numbers(path, values)
        for name, value in values.items():
            if name in by_number:
                yield by_number[name]
                continue
            for index in np.ndindex(value.shape):
                varied = np.array(value)
                varied[index] += 1.0  # loads are linear in tension, stroke, tip force and moment
                more = self.load({**values, name: varied})
                yield Change(self.model.load_change(path, more), still)

    def _by_numbers(
        self, path: EquilibriumPath, values: Mapping[str, np.ndarray]
    ) -> Mapping[str, Change]:
        """Compute the changes by numbers of the robot, cached for the next tensions and strokes."""
        numbers = [float(values[one]) for one in self.numbers]
        key = (*numbers, *(values[one].tobytes() for one in values if one in TIP))
        if key not in self._kept:
            if len(self._kept) >= _REMEMBERED:
                del self._kept[next(iter(self._kept))]
            changes = self.model.changes(path.robot, path.load, self.numbers)
            self._kept[key] = dict(zip(self.numbers, changes, strict=True))
        return self._kept[key]


def _is_float(path: EquilibriumPath, name: str) -> bool:
    return name != "residual" and np.asarray(getattr(path, name)).dtype.kind == "f"


def outputs_function(
    solver: VectorSolver, start: Float[np.ndarray, " k"]
) -> Callable[[Array], OutputTable]:
    """Wrap a solver as a function of JAX.

    Invalid values give NaN for numbers and false for flags, as a program of JAX cannot raise.

    Args:
        solver: Gives outputs and Jacobians.
        start: Valid values, whose outputs define the shapes.

    Returns:
        A function of a vector of values, differentiable once, forward and reverse.
    """
    shapes = {
        name: jax.ShapeDtypeStruct(value.shape, value.dtype)
        for name, value in solver.values(start).items()
    }
    floats = {name: shape for name, shape in shapes.items() if shape.dtype.kind == "f"}
    others = {name: shape for name, shape in shapes.items() if name not in floats}
    values_of_others = _callback(solver.values, others)
    values_of_floats = _differentiable_once(solver, start, floats)

    def function(at: Array) -> OutputTable:
        if not isinstance(at, Tracer):
            values = solver.values(np.asarray(at))
            return OutputTable({name: jnp.asarray(value) for name, value in values.items()})
        outputs = dict(values_of_floats(at)) if floats else {}
        if others:
            outputs |= values_of_others(jax.lax.stop_gradient(at))
        return OutputTable({name: outputs[name] for name in shapes})

    return function


def _differentiable_once(
    solver: VectorSolver, start: np.ndarray, shapes: dict[str, Any]
) -> Callable[[Array], dict[str, Array]]:
    """Return the outputs of some shapes as a function with a first derivative."""
    names = tuple(shapes)
    slope_shapes = {
        name: jax.ShapeDtypeStruct((*shape.shape, len(start)), shape.dtype)
        for name, shape in shapes.items()
    }
    values_of = _callback(solver.values, shapes)
    # One for each, so that JAX omits those of outputs that are not differentiated.
    slopes_of = {
        name: _callback(lambda at, name=name: {name: solver.slopes(at, name)}, {name: shape})
        for name, shape in slope_shapes.items()
    }
    compiled: list[bool] = []

    @jax.custom_jvp
    def slopes(at: Array) -> dict[str, Array]:
        return {name: slopes_of[name](at)[name] for name in names}

    @slopes.defjvp
    def _(primals: Any, tangents: Any) -> Any:
        raise InputError.UNSUPPORTED(
            "a robot under loads can be differentiated once, not twice: take differences of its "
            "gradients, or minimise by a method that needs first derivatives only"
        )

    @jax.custom_jvp
    def values(at: Array) -> dict[str, Array]:
        return values_of(at)

    @values.defjvp
    def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Any, Any]:
        (at,), (change,) = primals, tangents
        # Compiled now: within a program of JAX nothing may be traced.
        if not compiled:
            for name in names:
                solver.slopes(start, name)
            compiled.append(True)
        by = slopes(at)
        return values(at), {name: by[name] @ change for name in names}

    return values


def _callback(
    function: Callable[[np.ndarray], Any], shapes: dict[str, Any]
) -> Callable[[Array], dict[str, Array]]:
    """Return a plain function as one that JAX can trace; NaN or 0 where it refuses its values."""

    def safe(at: Any) -> dict[str, np.ndarray]:
        try:
            values = function(np.asarray(at))
            return {name: np.asarray(values[name], one.dtype) for name, one in shapes.items()}
        except InputError:
            return {
                name: np.full(one.shape, np.nan if one.dtype.kind == "f" else 0, one.dtype)
                for name, one in shapes.items()
            }

    # Compiled once: a callback on its own is compiled at every call.
    compiled = jax.jit(lambda at: jax.pure_callback(safe, shapes, at, vmap_method="sequential"))

    def call(at: Array) -> dict[str, Array]:
        return compiled(at) if isinstance(at, Tracer) else jax.tree.map(jnp.asarray, safe(at))

    return call
