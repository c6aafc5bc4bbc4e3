"""Series over arrays of any shape, with the terms as leading axis."""

import numpy as np

from notchflex._arrays import xp
from notchflex._jax import jax


def broadcast_terms(constants: np.ndarray, like: jax.Array) -> jax.Array:
    """Shape one constant for each term so that it combines with `like[None]`.

    Args:
        constants: Constants, shape (terms,).
        like: Array that the terms are functions of, any shape.

    Returns:
        The constants, shape (terms, 1, …, 1) with as many ones as `like` has axes; explicit
        because silent broadcasting across ranks is an error in the tests.
    """
    return xp.asarray(constants).reshape((-1, *([1] * like.ndim)))
