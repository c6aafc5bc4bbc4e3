"""A table of worst differences, as every part of the validation page has one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from page import table


class Differences:
    """Numbers of the package against others: how many are compared, and the worst difference.

    Attributes:
        rows: Number and worst difference by what is compared and its unit; "" is relative.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.rows: dict[tuple[str, str], tuple[int, float]] = {}

    def add(self, what: str, ours: ArrayLike, wanted: ArrayLike, unit: str = "") -> None:
        """Compare two arrays, without a unit relative to the wanted one."""
        ours, wanted = np.broadcast_arrays(np.asarray(ours, float), np.asarray(wanted, float))
        error = np.abs(ours - wanted) if unit else np.abs(ours / wanted - 1.0)
        count, worst = self.rows.get((what, unit), (0, 0.0))
        self.rows[what, unit] = count + error.size, max(worst, float(error.max()))

    def table(self) -> str:
        """Return the table in Markdown; what is below 1e-12 is rounding and said to be that."""
        rows = []
        for (what, unit), (count, worst) in self.rows.items():
            text = "below 1e-12" if worst < 1e-12 else f"{worst:.0e}"
            rows.append((what, count, f"{text} {unit or '(relative)'}"))
        return table(("compared", "numbers", "worst difference"), rows)
