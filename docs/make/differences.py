"""A table of worst differences, as every part of the validation page has one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from page import table


class Difference(NamedTuple):
    """Numbers of the package against others.

    Attributes:
        what: What is compared.
        count: How many numbers.
        worst: Largest difference.
        unit: Its unit; "" where it is relative.
    """

    what: str
    count: int
    worst: float
    unit: str


def difference(what: str, found: ArrayLike, wanted: ArrayLike, unit: str) -> Difference:
    """Compare two arrays; without a unit relative to the wanted one."""
    found, wanted = np.broadcast_arrays(np.asarray(found, float), np.asarray(wanted, float))
    error = np.abs(found - wanted) if unit else np.abs(found / wanted - 1.0)
    return Difference(what, error.size, float(error.max()), unit)


def joined(rows: list[Difference]) -> list[Difference]:
    """Put rows that compare the same things together: all their numbers, the worst of them."""
    found: dict[tuple[str, str], Difference] = {}
    for row in rows:
        old = found.get((row.what, row.unit), Difference(row.what, 0, 0.0, row.unit))
        worst = max(old.worst, row.worst)
        found[row.what, row.unit] = Difference(row.what, old.count + row.count, worst, row.unit)
    return list(found.values())


def table_of(rows: list[Difference]) -> str:
    """Return the table in Markdown; what is below 1e-12 is rounding and said to be that."""
    return table(
        ("compared", "numbers", "worst difference"),
        [(row.what, row.count, f"{worst(row)} {row.unit or '(relative)'}") for row in rows],
    )


def worst(row: Difference) -> str:
    """Return the worst difference with one digit."""
    return "below 1e-12" if row.worst < 1e-12 else f"{row.worst:.0e}"
