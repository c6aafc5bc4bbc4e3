"""Layout of the columns of a flexure's linearised rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Array

from notchflex._jax import constant, jnp
from notchflex.mechanics.chain import Chain


class UnitRows(NamedTuple):
    """Unit rows of all columns, in order.

    Motions of bodies depend on few columns: their rows are short, over the modes and the motions of
    earlier bodies only, until `spread` inserts the others.
    """

    modes: Array
    contact_pairs: list[Array]
    log_ratio: list[Array]
    older: list[Array]
    turn: Array
    tension: list[Array]
    transmitted: list[Array]
    external: Array
    released_length: list[Array]
    tension_length: list[Array]

    @property
    def motions(self) -> list[Array]:
        """Short unit rows of the motions of bodies further back."""
        modes, count = len(self.modes), sum(len(rows) for rows in self.older)
        units = np.eye(modes + count)[modes:]
        return [constant(rows) for rows in np.split(units, max(len(self.older), 1)) if len(rows)]

    def of_modes(self, rows: Array) -> Array:
        """Return the rows over the modes as short rows."""
        return _pad(rows, sum(len(motion) for motion in self.older))

    def spread(self, rows: Array) -> Array:
        """Return short rows as rows over all columns."""
        modes, columns = self.modes.shape
        between = sum(len(rows) for rows in (*self.contact_pairs, *self.log_ratio))
        beyond = columns - rows.shape[-1] - between
        return jnp.concatenate(
            [_pad(rows[..., :modes], between), _pad(rows[..., modes:], beyond)], axis=-1
        )


def _pad(rows: Array, columns: int) -> Array:
    return jnp.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, columns)])


@dataclass(frozen=True)
class RowLayout:
    """Sizes of the parts of a row: own unknowns, then carried from the base, then from the tip.

    A tendon passes its released length and its tension times length from the tip. Slip over a
    contact depends only on a sum of the two, which suffices where no stroke is commanded.
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
        """Number of unknowns of a flexure."""
        return self.modes + sum(self.contact_pairs) + 2 * sum(self.tendons)

    @property
    def carried(self) -> int:
        """Number of columns carried from the base: motions, turn, tensions last."""
        return self.older * self.wrench + self.turn + sum(self.tendons)

    @property
    def beyond(self) -> int:
        """Number of columns that come from the tip: wrenches, loads, tendon lengths last."""
        lengths = (1 + self.by_stroke) * sum(self.tendons)
        return self.older * self.wrench + self.external + lengths

    @property
    def external(self) -> int:
        """Number of columns of the external loads beyond.

        Dead forces change with the rotation of the body in whose frame they are given; only their
        moment comes from the tip.
        """
        return self.wrench if self.turn and self.follows else self.turn

    def unit_rows(self) -> UnitRows:
        """Return the unit rows of all columns, in order."""
        wrenches = [self.wrench] * self.older
        edges = [2 * count for count in self.tendons]
        lengths = self.tendons if self.by_stroke else ()
        own = [[self.modes], self.contact_pairs, edges]
        carried = [wrenches, [self.turn], self.tendons]
        groups = [*own, *carried, wrenches, [self.external], self.tendons, lengths]
        ends = np.cumsum([size for group in groups for size in group])
        rows = map(constant, np.split(np.eye(ends[-1]), ends[:-1]))
        parts = [[next(rows) for _ in group] for group in groups]
        single = {0, 4, 7}  # modes, turn and external loads
        return UnitRows(*(part[0] if i in single else part for i, part in enumerate(parts)))  # pyright: ignore[reportArgumentType]


def row_layout(chain: Chain, *, by_stroke: bool) -> RowLayout:
    """Return the layout for a chain whose tendons are given by tension alone, or some by stroke."""
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
