"""The table of quantities: names, symbols, units and texts of everything that a result holds.

Each is registered beside its formula: `solver/derived/quantities.py` for what the solver reports of
a state, `path_formulas.py` for what follows along a path; see `notchflex._quantity`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex._quantity import DEGREES as DEGREES
from notchflex._quantity import Quantity
from notchflex.results.quantities.properties import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

AXES = ("x", "y", "z")

CONTACT_STATES = {0: "stick", 1: "slip toward base", -1: "slip toward tip"}
"""What the numbers of `contact_state` mean. Loading makes a tendon slip toward the base."""


def span_names(count: int) -> list[str]:
    """Return the names of the spans of a tendon, base to tip.

    Args:
        count: Number of spans, 2 m for a tendon that runs through m bodies to its end.

    Example:
        >>> span_names(4)
        ['proximal', 'gap_1', 'body_1', 'gap_2']
    """
    names = ["proximal"]
    for index in range(1, count):
        names.append(f"gap_{(index + 1) // 2}" if index % 2 else f"body_{index // 2}")
    return names


def units() -> dict[str, str]:
    """Return the unit of every JSON key that has one, for the head of a document."""
    return {q.key: q.unit for q in QUANTITIES.values() if q.key and q.unit}


def holds(path: EquilibriumPath, quantity: Quantity) -> bool:
    """Return whether a path has a quantity; an optional one without any number is missing."""
    values = getattr(path, quantity.name, None)
    if values is None:
        return False
    return not quantity.optional or bool(np.isfinite(values).any())


def spans_of(path: EquilibriumPath, tendon: int) -> int:
    """Return how many spans a tendon (counted from 0) has: two for each body that it runs through.

    Contacts lie between the spans, so there is one fewer of them.
    """
    # A tendon has a span before every edge that it meets; -1 only fills the table up.
    return int((np.asarray(path.chain.contacts)[tendon] >= 0).sum())
