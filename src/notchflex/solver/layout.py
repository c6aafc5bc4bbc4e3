"""What may change at one flexure, in order: the columns of all rows of the linear step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Array

from notchflex._jax import constant, jnp
from notchflex.mechanics.chain import Chain


class UnitRows(NamedTuple):
    """Rows of one 1 each, for every number that may change, in the order of the rows' axis.

    How bodies move depends on few of them: rows of motions are short, over the modes and the
    motions of bodies further back alone, until `spread` puts them among the others.
    """

    modes: Array
    contact_pairs: list[Array]
    log_ratio: list[Array]
    older: list[Array]
    turn: Array
    tension: list[Array]
    handed: list[Array]
    outside: Array
    released_length: list[Array]
    stretch: list[Array] | None

    @property
    def motions(self) -> list[Array]:
        """Short unit rows of the motions of bodies further back."""
        modes, count = len(self.modes), sum(len(rows) for rows in self.older)
        units = np.eye(modes + count)[modes:]
        return [constant(rows) for rows in np.split(units, max(len(self.older), 1)) if len(rows)]

    def of_modes(self, rows: Array) -> Array:
        """Rows over the modes as short rows."""
        return _padded(rows, sum(len(motion) for motion in self.older))

    def spread(self, rows: Array) -> Array:
        """Short rows over all numbers that may change."""
        modes, whole = self.modes.shape
        between = sum(len(own) for own in (*self.contact_pairs, *self.log_ratio))
        beyond = whole - rows.shape[-1] - between
        return jnp.concatenate(
            [_padded(rows[..., :modes], between), _padded(rows[..., modes:], beyond)], axis=-1
        )


def _padded(rows: Array, behind: int) -> Array:
    return jnp.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, behind)])


@dataclass(frozen=True)
class RowLayout:
    """Where everything stands among the numbers that may change at one flexure.

    Of a tendon beyond come back the length that is set free and the stretch (tension times length).
    What slides over a contact depends on one sum of the two alone, and only that comes back where
    no stroke is demanded.
    """

    modes: int
    contact_pairs: tuple[int, ...]
    tendons: tuple[int, ...]
    older: int
    wrench: int
    turn: int
    follows: bool
    by_stroke: bool

    @property
    def unknowns(self) -> int:
        """Own unknowns of a flexure."""
        return self.modes + sum(self.contact_pairs) + 2 * sum(self.tendons)

    @property
    def carried(self) -> int:
        """Numbers that say how what is carried on changes."""
        return self.older * self.wrench + self.turn + sum(self.tendons)

    @property
    def beyond(self) -> int:
        """Numbers that come back, tendons' drawn and stretched lengths last."""
        lengths = (1 + self.by_stroke) * sum(self.tendons)
        return self.older * self.wrench + self.outside + lengths

    @property
    def outside(self) -> int:
        """Numbers that say how the external loads beyond change.

        Forces that keep their direction change as the body turns that they are seen from; only
        their moment comes back.
        """
        return self.wrench if self.turn and self.follows else self.turn

    def units(self) -> UnitRows:
        """Unit rows of everything, in order."""
        wrench = [self.wrench] * self.older
        sizes = [
            (self.modes,),
            self.contact_pairs,
            [2 * count for count in self.tendons],
            wrench,
            (self.turn,),
            self.tendons,
            wrench,
            (self.outside,),
            self.tendons,
            self.tendons if self.by_stroke else (),
        ]
        ends = np.cumsum([size for group in sizes for size in group])
        rows = map(constant, np.split(np.eye(ends[-1]), ends[:-1]))
        (
            modes,
            contact_pairs,
            log_ratio,
            older,
            turn,
            tension,
            handed,
            far,
            released_length,
            stretch,
        ) = ([next(rows) for _ in group] for group in sizes)
        strokes = stretch if self.by_stroke else None
        return UnitRows(
            modes[0],
            contact_pairs,
            log_ratio,
            older,
            turn[0],
            tension,
            handed,
            far[0],
            released_length,
            strokes,
        )


def row_layout(chain: Chain, *, by_stroke: bool) -> RowLayout:
    """The row_layout of a chain whose tendons are given by tension alone, or some by stroke."""
    wrench = chain.rods.basis.shape[-2] if chain.forces_on_bodies else 0
    return RowLayout(
        modes=chain.stiffness.shape[-1],
        contact_pairs=tuple(group.has_contact.shape[-1] for group in chain.contact_pairs),
        tendons=tuple(len(group.numbers) for group in chain.groups),
        older=chain.window - 1 if wrench else 0,
        wrench=wrench,
        turn=(3 if wrench == 6 else 1) if chain.loaded else 0,
        follows=chain.follows,
        by_stroke=by_stroke,
    )
