"""A sum that some versions of JAX compute wrong on the processor: the canary of `notchflex doctor`.

jax-ml/jax#39103: compiled by 0.10.2 and 0.11.0, the last of many squared norms comes out too small.
"""

from typing import NamedTuple

from notchflex._jax import jax, jnp


class Canary(NamedTuple):
    """What a sum should be and what JAX makes of it."""

    expected: float
    computed: float

    @property
    def sings(self) -> bool:
        """Whether the sum is right."""
        return self.expected == self.computed


def canary() -> Canary:
    """Compute a sum that is known, in the way in which it went wrong.

    Example:
        >>> canary().sings
        True
    """
    last = 16_384.0
    rows = jnp.zeros((16_385, 3)).at[:, 0].set(jnp.arange(last + 1.0))
    squares = jax.jit(jax.vmap(lambda row: jnp.sum((jnp.eye(3) @ row) ** 2)))(rows)
    return Canary(last**2, float(squares[-1]))
