"""Random ways of pulling the tendons, whose states are targets that the robot can reach."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# Targets change a little slower than the tendons may, so that a policy can catch up.
_PART_OF_RATE = 0.8


def random_pull(
    random: np.random.Generator, directions: Float[np.ndarray, " t"]
) -> Float[np.ndarray, " t"]:
    """Return tensions toward a random side, as parts of the largest, by a random amount.

    Args:
        random: Source of random numbers.
        directions: Directions of the tendons across the tube, rad.
    """
    amount, tendon = random.uniform(), random.integers(len(directions))
    around = directions[tendon] + random.uniform(-0.5 * np.pi, 0.5 * np.pi)
    pull = np.maximum(np.cos(directions - around), 0.0)
    return amount * pull / pull.max()


def random_tensions(
    random: np.random.Generator,
    directions: Float[np.ndarray, " t"],
    largest: Float[np.ndarray, " t"],
    rate: float,
    steps: int,
) -> Float[np.ndarray, "s t"]:
    """Return tensions that go from 0 to one random pull after the other, N.

    Args:
        random: Source of random numbers.
        directions: Directions of the tendons across the tube, rad.
        largest: Largest tension of every tendon, N.
        rate: Largest change of a tension in one step, N.
        steps: How many steps.
    """
    begin, parts, count = np.zeros(len(directions)), [], 0
    while count < steps:
        end = largest * random_pull(random, directions)
        number = max(1, int(np.ceil(np.abs(end - begin).max() / (_PART_OF_RATE * rate))))
        way = np.arange(1, min(number, steps - count) + 1)[:, None] / number
        parts.append(begin + way * (end - begin))
        begin, count = end, count + number
    return np.concatenate(parts)
