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
) -> Callable[[Array], dict[str, Array]]:
    """Make a solver a function of JAX.

    Values that the solver refuses give NaN for numbers and false for truth values, as a program of
    JAX cannot raise.

    Args:
        solver: Gives outputs and Jacobians.
        start: Values at which it has outputs; their shapes are those of all others.

    Returns:
        A function of a vector of values, differentiable once, forward and reverse.
    """
    first = solver.values(start)
    floats = tuple(name for name, value in first.items() if value.dtype.kind == "f")
    others = tuple(name for name in first if name not in floats)

    def shapes(names: tuple[str, ...], *more: int) -> dict[str, Any]:
        own = {name: (*first[name].shape, *more) for name in names}
        return {name: jax.ShapeDtypeStruct(own[name], first[name].dtype) for name in names}

    def called(function: Callable[[np.ndarray], Any], result: dict[str, Any]) -> Any:
        def safe(at: Any) -> dict[str, np.ndarray]:
            try:
                found = function(np.asarray(at))
                return {name: np.asarray(found[name], one.dtype) for name, one in result.items()}
            except InputError:
                return {name: _nothing(one) for name, one in result.items()}

        # Compiled once: a callback on its own is compiled at every call.
        compiled = jax.jit(lambda at: jax.pure_callback(safe, result, at, vmap_method="sequential"))

        def call(at: Array) -> dict[str, Array]:
            return compiled(at) if isinstance(at, Tracer) else jax.tree.map(jnp.asarray, safe(at))

        return call

    values_of_floats = called(solver.values, shapes(floats))
    values_of_others = called(solver.values, shapes(others))
    slopes_of_floats = called(lambda at: solver.jacobian(at, floats), shapes(floats, len(start)))

    compiled: list[bool] = []

    @jax.custom_jvp
    def of_floats(at: Array) -> dict[str, Array]:
        return values_of_floats(at)

    @of_floats.defjvp
    def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Any, Any]:
        (at,), (change,) = primals, tangents
        # Compiled now: within a program of JAX nothing may be traced.
        if not compiled:
            solver.jacobian(start, floats)
            compiled.append(True)
        slopes = slopes_of_floats(at)
        return of_floats(at), {name: slopes[name] @ change for name in floats}

    def function(at: Array) -> dict[str, Array]:
        if not isinstance(at, Tracer):
            return {
                name: jnp.asarray(value) for name, value in solver.values(np.asarray(at)).items()
            }
        found = dict(of_floats(at)) if floats else {}
        if others:
            found |= values_of_others(jax.lax.stop_gradient(at))
        return {name: found[name] for name in first}

    return function


def _nothing(of: Any) -> np.ndarray:
    return np.full(of.shape, np.nan if of.dtype.kind == "f" else 0).astype(of.dtype)
