"""Errors that all edges of one line share: blur, highlights and paper lines shift or turn it.

Every side of a ring, end of a ring and edge of a spine is one line. Its edges have errors of their
own, and share a shift and a turn, which are unknowns with a spread. All lines share one shift
outward, which blur and shading cause. The spread is that of most lines; a line that lies farther
off has a spread of its own size and counts less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.chain.chain_table import Numbers
from notchflex.photographs.chain.outline import OutlineModel

FIRST_SPREAD = (0.3, 0.08)
"""Spreads of the shift and of the turn of a line before they are known, px."""

_MIN_SPREAD, _MAX_SPREAD = (0.06, 0.04), 2.0  # px
_MIN_POINTS = 5
_ROBUST = 2.5  # spreads: lines farther off count less
_ROUNDS = 4


class Lines(NamedTuple):
    """Lines of an outline with N points.

    Attributes:
        which: Number of the line of each point, (N,).
        place: Place of each point on its line, -1 to 1, (N,).
        number: Number of lines.
        shift: Spread of the shift that all lines share, px.
    """

    which: NDArray[np.int_]
    place: Numbers
    number: int
    shift: float

    def columns(self) -> Numbers:
        """Return what one px of each shift, of each turn and of the common shift adds, (N, m)."""
        columns = np.zeros((len(self.which), 2 * self.number + 1))
        row = np.arange(len(self.which))
        columns[row, self.which] = 1.0
        columns[row, self.number + self.which] = self.place
        columns[:, -1] = 1.0
        return columns

    def errors(
        self, offset: Numbers, robust: float, strength: Numbers | float = 1.0
    ) -> tuple[Numbers, Numbers]:
        """Fit a shift and a turn to each line, by reweighted least squares.

        Args:
            offset: Distance of each edge from the outline, px, (N,); NaN if there is none.
            robust: Distance from the line beyond which an edge counts less, px.
            strength: Strengths of the edges (`Edges`), by whose square they count, (N,).

        Returns:
            Shift and turn, px, (number, 2), NaN for lines of few edges; offsets less these, (N,).
        """
        is_edge = np.isfinite(offset)
        value, position = np.where(is_edge, offset, 0.0), self.place

        def total(one: Numbers) -> Numbers:
            return np.bincount(self.which, one, self.number).astype(float)

        is_fitted = total(is_edge.astype(float)) >= _MIN_POINTS
        shift, turn = np.zeros(self.number), np.zeros(self.number)
        starts = [value[is_edge & (self.which == one)] for one in range(self.number)]
        shift[:] = [np.median(one) if len(one) else 0.0 for one in starts]
        left = value - shift[self.which]
        for _ in range(_ROUNDS):
            weight = is_edge * strength**2 / (1.0 + (left / robust) ** 2)
            w, wx = total(weight), total(weight * position)
            wxx = total(weight * position**2) + 1e-9
            wy, wxy = total(weight * value), total(weight * position * value)
            determinant = np.maximum(w * wxx - wx**2, 1e-12)
            shift = np.where(is_fitted, (wxx * wy - wx * wxy) / determinant, shift)
            turn = np.where(is_fitted, (w * wxy - wx * wy) / determinant, 0.0)
            left = value - shift[self.which] - turn[self.which] * position
        both = np.stack([shift, turn], axis=1)
        both[~is_fitted] = np.nan
        return both, np.where(is_edge, left, np.nan)

    def spreads(self, errors: Numbers, fitted: int | None) -> Numbers:
        """Return the spreads of all columns, px, (m,).

        Args:
            errors: Shifts and turns of the lines, (number, 2).
            fitted: How many unknowns were fitted to the lines, which makes their errors look
                small; None in first rounds, whose errors say little about the lines.
        """
        finite = errors[np.isfinite(errors[:, 0])]
        own = relative(errors)
        typical = np.array(FIRST_SPREAD)
        if fitted is not None and len(finite):
            freedom = max(0.25, 1.0 - fitted / max(1, 2 * len(finite)))
            typical = 1.4826 * np.nanmedian(np.abs(own), axis=0) / np.sqrt(freedom)
            typical = np.clip(np.nan_to_num(typical, nan=_MAX_SPREAD), _MIN_SPREAD, _MAX_SPREAD)
        far = np.nan_to_num(np.abs(own), nan=_MAX_SPREAD)
        spread = np.hypot(typical, far / _ROBUST)
        return np.concatenate([spread[:, 0], spread[:, 1], [self.shift]])


def lines_of(model: OutlineModel) -> Lines:
    """Return the lines of an outline."""
    name = model.kind * 10000 + model.ring * 2 + (model.which > 0)
    names, which = np.unique(name, return_inverse=True)
    low = np.array([model.place[which == one].min() for one in range(len(names))])
    high = np.array([model.place[which == one].max() for one in range(len(names))])
    position = 2.0 * (model.place - low[which]) / (high - low)[which] - 1.0
    return Lines(which, position, len(names), model.shift)


def relative(errors: Numbers) -> Numbers:
    """Return shifts and turns of lines, (number, 2), with the shifts from their median."""
    finite = errors[np.isfinite(errors[:, 0]), 0]  # none where a start lies beside the tube
    return errors - np.array([np.median(finite) if len(finite) else 0.0, 0.0])
