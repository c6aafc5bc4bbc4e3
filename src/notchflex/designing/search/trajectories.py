"""The ways of searches, which end where another search has been that settled.

Two searches that come to nearly the same robot end at the same one: the later one would only solve
again what is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

Vector = Float[np.ndarray, " v"]

# Searches are at the same robot where none of the scaled variables differ by more.
_MAX_DIFFERENCE = 0.01


class DuplicateSearch(Exception):  # noqa: N818 - no error
    """Ends a search that has come to where another one has been.

    Attributes:
        number: Which of the others.
    """

    def __init__(self, number: int) -> None:
        """Say which."""
        super().__init__(number)
        self.number = number


@dataclass(eq=False)
class SearchTrajectory:
    """The way of a search.

    Attributes:
        others: The ways of searches that settled, with where they ended.
        steps: Scaled variables after each step.
    """

    others: Sequence[Sequence[Vector]] = ()
    steps: list[Vector] = field(default_factory=list[Vector])

    def record(self, z: Vector) -> None:
        """Keep a step.

        Raises:
            DuplicateSearch: Another search has been here.
        """
        self.steps.append(z)
        for number, other in enumerate(self.others):
            if any(np.abs(z - point).max(initial=0.0) <= _MAX_DIFFERENCE for point in other):
                raise DuplicateSearch(number)
