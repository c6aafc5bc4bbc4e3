"""What of a table's rows a path has: quantities that hold numbers, and the spans of its tendons."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex._quantity import Quantity

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath


def holds(path: EquilibriumPath, quantity: Quantity) -> bool:
    """Tell whether a path has a quantity; an optional one without any number counts as missing."""
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
