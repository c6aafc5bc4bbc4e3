"""Bracketed root of an increasing function."""

from __future__ import annotations

from collections.abc import Callable

from jaxtyping import Array

from notchflex._jax import jax, jnp

# A bilinear law takes three iterations, one with a plastic branch more.
_ITERATIONS = 20


def bracketed_root(
    function: Callable[[Array], tuple[Array, Array]], start: Array, low: Array, high: Array
) -> Array:
    """Find the root by Newton's method with bisection in a bracket; not differentiable.

    Args:
        function: Value and slope of a function that does not decrease.
        start: Initial guess.
        low: Lower bound of the root.
        high: Upper bound of the root; without a root the nearer bound is approached.

    Returns:
        The root.
    """

    def improve(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
        root, low, high, last_step = search
        value, slope = function(root)
        low = jnp.where(value <= 0.0, root, low)
        high = jnp.where(value >= 0.0, root, high)
        step = -value / slope
        new = root + step
        newton_step = (new >= low) & (new <= high) & (jnp.abs(step) <= 0.5 * last_step)
        new = jnp.where(newton_step, new, 0.5 * (low + high))
        return new, low, high, jnp.abs(new - root)

    search = start, low, high, 2.0 * (high - low)
    return jax.lax.fori_loop(0, _ITERATIONS, improve, search)[0]
