"""What lies beyond an edge of a notch: the uncut ring and what holds its far edge."""

from __future__ import annotations

from notchflex._jax import jax
from notchflex._pytree import Pytree, static

BOUNDARIES = ("between", "clamped", "free")


class Side(Pytree, eq=True):
    """The uncut ring beside a notch.

    Attributes:
        boundary: "between" two notches, "clamped" to a rigid plate (the base), or "free" (the
            ring beyond the last notch).
        length: Uncut length c from the edge of the notch to the next notch, to the plate or to
            the free end, mm.
    """

    boundary: str = static()
    length: float | jax.Array
