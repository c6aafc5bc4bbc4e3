"""The table of quantities: names, symbols, units and texts of everything that a result holds.

Each is registered beside its formula: `solver/derived/quantities.py` for what the solver reports of
a state, `path_formulas.py` for what follows along a path; see `notchflex._quantity`.
"""

from __future__ import annotations

from notchflex._quantity import DEGREES, Quantity
from notchflex.results.quantities.properties import QUANTITIES

AXES = ("x", "y", "z")

CONTACT_STATES = {0: "stick", 1: "slip toward base", -1: "slip toward tip"}
"""What the numbers of `contact_state` mean. Loading makes a tendon slip toward the base."""


def span_names(count: int) -> list[str]:
    """Return the names of the spans of a tendon, base to tip.

    Args:
        count: Number of spans, 2 m for a tendon that runs through m bodies to its end.

    Returns:
        `["proximal", "gap_1", "body_1", "gap_2", ...]`, `count` names.

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


__all__ = [
    "AXES",
    "CONTACT_STATES",
    "DEGREES",
    "QUANTITIES",
    "Quantity",
    "span_names",
    "units",
]
