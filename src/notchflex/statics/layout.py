"""What may change at one flexure, in order: the columns of all rows of the linear step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Array

from notchflex._jax import constant
from notchflex.chain import Chain


class Units(NamedTuple):
    """Rows of one 1 each, for every number that may change, in the order of the rows' axis."""

    modes: Array
    lips: list[Array]
    log_ratio: list[Array]
    older: list[Array]
    turn: Array
    tension: list[Array]
    handed: list[Array]
    outside: Array
    drawn: list[Array]
    stretch: list[Array]


@dataclass(frozen=True)
class Layout:
    """Where everything stands among the numbers that may change at one flexure."""

    modes: int
    lips: tuple[int, ...]
    tendons: tuple[int, ...]
    older: int
    wrench: int
    turn: int

    @property
    def unknowns(self) -> int:
        """Own unknowns of a flexure."""
        return self.modes + sum(self.lips) + 2 * sum(self.tendons)

    @property
    def carried(self) -> int:
        """Numbers that say how what is carried on changes."""
        return self.older * self.wrench + self.turn + sum(self.tendons)

    @property
    def beyond(self) -> int:
        """Numbers that come back, tendons' drawn and stretched lengths last."""
        return self.older * self.wrench + bool(self.turn) * self.wrench + 2 * sum(self.tendons)

    def units(self) -> Units:
        """Unit rows of everything, in order."""
        wrench = [self.wrench] * self.older
        outside = self.wrench if self.turn else 0
        sizes = [
            (self.modes,),
            self.lips,
            [2 * count for count in self.tendons],
            wrench,
            (self.turn,),
            self.tendons,
            wrench,
            (outside,),
            self.tendons,
            self.tendons,
        ]
        ends = np.cumsum([size for group in sizes for size in group])
        rows = map(constant, np.split(np.eye(ends[-1]), ends[:-1]))
        modes, lips, log_ratio, older, turn, tension, handed, far, drawn, stretch = (
            [next(rows) for _ in group] for group in sizes
        )
        return Units(
            modes[0], lips, log_ratio, older, turn[0], tension, handed, far[0], drawn, stretch
        )


def layout(chain: Chain) -> Layout:
    """The layout of a chain."""
    wrench = chain.rods.basis.shape[-2] if chain.forces_on_bodies else 0
    return Layout(
        modes=chain.stiffness.shape[-1],
        lips=tuple(group.closes.shape[-1] for group in chain.lips),
        tendons=tuple(len(group.numbers) for group in chain.groups),
        older=chain.window - 1 if wrench else 0,
        wrench=wrench,
        turn=(3 if wrench == 6 else 1) if chain.loaded else 0,
    )
