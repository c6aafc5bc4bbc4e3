"""A plain function with a Jacobian as a function that JAX can differentiate, map and compile.

JAX calls back to compiled programs of the library, so that nothing of the mechanics is compiled
again for what users write around it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.analysis.outputs import OutputTable
from notchflex.errors import InputError


class Solver(Protocol):
    """Outputs by name, and the derivatives of those that are floats."""

    def values(self, flat: Float[np.ndarray, " k"]) -> dict[str, np.ndarray]:
        """Return the outputs at some values; raise `InputError` where there are none."""
        ...

    def jacobian(
        self, flat: Float[np.ndarray, " k"], outputs: tuple[str, ...]
    ) -> dict[str, np.ndarray]:
        """Return derivatives of some outputs by every value, as last axis."""
        ...


def outputs_function(
    solver: Solver, start: Float[np.ndarray, " k"]
) -> Callable[[Array], OutputTable]:
    """Make a solver a function of JAX.

    Values that the solver refuses give NaN for numbers and false for truth values, as a program of
    JAX cannot raise.

    Args:
        solver: Gives outputs and Jacobians.
        start: Values at which it has outputs; their shapes are those of all others.

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
    solver: Solver, start: np.ndarray, shapes: dict[str, Any]
) -> Callable[[Array], dict[str, Array]]:
    """Return the outputs of some shapes as a function with a first derivative."""
    names = tuple(shapes)
    slope_shapes = {
        name: jax.ShapeDtypeStruct((*shape.shape, len(start)), shape.dtype)
        for name, shape in shapes.items()
    }
    values_of = _callback(solver.values, shapes)
    slopes_of = _callback(lambda at: solver.jacobian(at, names), slope_shapes)
    compiled: list[bool] = []

    @jax.custom_jvp
    def slopes(at: Array) -> dict[str, Array]:
        return slopes_of(at)

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
            solver.jacobian(start, names)
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
