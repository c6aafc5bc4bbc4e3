"""The root of a function that grows, between two bounds."""

from __future__ import annotations

from collections.abc import Callable

from jaxtyping import Array

from notchflex._jax import jax, jnp

# A bilinear law takes three iterations, one with a plastic branch more.
_ITERATIONS = 20


def bracketed_root(
    at: Callable[[Array], tuple[Array, Array]], start: Array, least: Array, most: Array
) -> Array:
    """Find the root by Newton's method within bounds that close in; not differentiable.

    Args:
        at: The function, which does not fall, and its slope.
        start: Where to start.
        least: Lower bound of the root.
        most: Upper bound of the root; the nearer bound is approached where there is no root.

    Returns:
        The root.
    """

    def improve(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
        found, least, most, last = search
        beyond, slope = at(found)
        least = jnp.where(beyond <= 0.0, found, least)
        most = jnp.where(beyond >= 0.0, found, most)
        step = -beyond / slope
        new = found + step
        good = (new >= least) & (new <= most) & (jnp.abs(step) <= 0.5 * last)
        new = jnp.where(good, new, 0.5 * (least + most))
        return new, least, most, jnp.abs(new - found)

    search = start, least, most, 2.0 * (most - least)
    return jax.lax.fori_loop(0, _ITERATIONS, improve, search)[0]
