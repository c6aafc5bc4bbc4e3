"""Trajectories of searches: a search ends at a point that a converged one has visited.

Two searches through nearly the same robot end at the same one, so the later one is redundant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

Vector = Float[np.ndarray, " v"]

# Largest difference of scaled variables of equal robots.
_MAX_DIFFERENCE = 0.01


class DuplicateSearch(Exception):  # noqa: N818 - no error
    """Ends a search that repeats an earlier, converged one.

    Attributes:
        number: Which of the others.
    """

    def __init__(self, number: int) -> None:
        """Keep the number."""
        super().__init__(number)
        self.number = number


@dataclass(eq=False)
class SearchTrajectory:
    """The trajectory of a search.

    Attributes:
        others: Trajectories of converged searches, with their end points.
        steps: Scaled variables after each step.
    """

    others: Sequence[Sequence[Vector]] = ()
    steps: list[Vector] = field(default_factory=list[Vector])

    def record(self, z: Vector) -> None:
        """Record a step.

        Raises:
            DuplicateSearch: A converged search has visited this point.
        """
        self.steps.append(z)
        for number, other in enumerate(self.others):
            if any(np.abs(z - point).max(initial=0.0) <= _MAX_DIFFERENCE for point in other):
                raise DuplicateSearch(number)
