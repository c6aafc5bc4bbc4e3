"""Wrapper of a plain function with a Jacobian that JAX can differentiate, map and compile.

JAX calls back to compiled programs of the library, so that user code around it does not compile
the mechanics again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.analysis.derivatives.forward_model import Change, ForwardModel
from notchflex.analysis.outputs import OutputTable
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.results.path import EquilibriumPath

TENDONS = ("tension", "stroke")
TIP = ("tip_force", "tip_moment")
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
