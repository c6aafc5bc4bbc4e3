"""Uncut ring beside a notch, with the boundary condition at its far edge."""

from __future__ import annotations

from typing import Literal, NamedTuple


class Side(NamedTuple):
    """The uncut ring beside a notch.

    Attributes:
        boundary: "between" two notches, "clamped" to a rigid plate (the base), or "free" (the
            ring beyond the last notch).
        length: Uncut length c from the edge of the notch to the next notch, to the plate or to
            the free end, mm.
        turned: Whether the notch beyond the ring opens to another side of the tube.
    """

    boundary: Literal["between", "clamped", "free"]
    length: float
    turned: bool = False
