"""Errors that all edges of one line share: blur, highlights and paper lines shift or turn it.

Every side of a ring, end of a ring and edge of a spine is one line. Its edges have errors of their
own, and share a shift and a turn, which are unknowns with a spread. All lines share one shift
outward, which blur and shading cause. The spread is that of most lines; a line that lies farther
off has a spread of its own size and counts less.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.chain_table import Numbers

_FIRST_SPREAD = (0.3, 0.08)  # px: spreads of shift and turn of a line before they are known
_MIN_SPREAD, _MAX_SPREAD = (0.06, 0.04), 2.0  # px
_MIN_POINTS = 5
_FAR_LINE = 2.5  # spreads: lines farther off count less
_ROUNDS = 4


class Lines:
    """Lines of an outline with N points.

    Args:
        names: Name of the line of each point, (N,).
        place: Place of each point along it, (N,).
        shift: How far blur and shading may shift all lines alike, px.

    Attributes:
        which: Number of the line of each point, (N,).
        place: Place of each point on its line, -1 to 1, (N,).
        number: Number of lines.
        columns: What one px of each shift, of each turn and of the common shift adds, (N, m).
    """

    def __init__(self, names: NDArray[np.int_], place: Numbers, shift: float) -> None:
        self.which = np.unique(names, return_inverse=True)[1]
        self.number, self._shift = int(self.which.max()) + 1, shift
        lines = [place[self.which == line] for line in range(self.number)]
        low, high = np.array([(places.min(), places.max()) for places in lines])[self.which].T
        self.place = 2.0 * (place - low) / (high - low) - 1.0
        on_line = np.eye(self.number)[self.which]
        common = np.ones((len(place), 1))
        self.columns = np.hstack([on_line, on_line * self.place[:, None], common])

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

        def total(values: Numbers) -> Numbers:
            return np.bincount(self.which, values, self.number).astype(float)

        is_fitted = total(is_edge.astype(float)) >= _MIN_POINTS
        lines = [value[is_edge & (self.which == line)] for line in range(self.number)]
        shift = np.array([np.median(values) if len(values) else 0.0 for values in lines])
        turn = np.zeros(self.number)
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
        finite = np.count_nonzero(np.isfinite(errors[:, 0]))
        apart = from_median(errors)
        typical = np.array(_FIRST_SPREAD)
        if fitted is not None and finite:
            freedom = max(0.25, 1.0 - fitted / (2 * finite))
            typical = 1.4826 * np.nanmedian(np.abs(apart), axis=0) / np.sqrt(freedom)
            typical = np.clip(np.nan_to_num(typical, nan=_MAX_SPREAD), _MIN_SPREAD, _MAX_SPREAD)
        far = np.nan_to_num(np.abs(apart), nan=_MAX_SPREAD)
        spread = np.hypot(typical, far / _FAR_LINE)
        return np.concatenate([spread[:, 0], spread[:, 1], [self._shift]])


def median_shift(errors: Numbers) -> float:
    """Return the median shift of all lines, px."""
    finite = errors[np.isfinite(errors[:, 0]), 0]  # none where a start lies beside the tube
    return float(np.median(finite)) if len(finite) else 0.0


def from_median(errors: Numbers) -> Numbers:
    """Return shifts and turns of lines, (number, 2), with the shifts from their median."""
    return errors - np.array([median_shift(errors), 0.0])
