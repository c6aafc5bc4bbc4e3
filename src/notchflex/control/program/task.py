"""Input of the compiled search: a target, limits and layouts, packed as vectors."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex.solver.programs.pytree_layout import PytreeLayout
from notchflex.solver.programs.static_structure import StaticStructure


class Task(NamedTuple):
    """Task of the program; n numbers of a response, t tendons.

    Attributes:
        goal: What the numbers are to become, (n,).
        weights: What an error of each counts, 0 of one that is free, (n,).
        miss: Weighted differences from the target at the present drives, (n,).
        slopes: Their slopes there, of a tendon that sticks as it last slid; zero where they are not
            known, (n, t).
        present: Drives to start from, (t,).
        low: Lowest drives, (t,).
        high: Highest drives, (t,).
        driven: 1 where a tendon is driven, 0 where it is held, (t,).
        turn: Rotation from the base to the world, (3, 3).
        tolerance: Weighted error at which the target is met.
        unit: Drive that about closes a notch, N or mm.
        rounds: How many loads may be solved.
        corrections: How many times the drives may be corrected after each.
        redundant: 1 where drives are made as small as the target allows.
    """

    goal: Float[Array, " n"]
    weights: Float[Array, " n"]
    miss: Float[Array, " n"]
    slopes: Float[Array, "n t"]
    present: Float[Array, " t"]
    low: Float[Array, " t"]
    high: Float[Array, " t"]
    driven: Float[Array, " t"]
    turn: Float[Array, "3 3"]
    tolerance: Float[Array, ""]
    unit: Float[Array, ""]
    rounds: Float[Array, ""]
    corrections: Float[Array, ""]
    redundant: Float[Array, ""]


def blank_task(numbers: int, tendons: int, turn: np.ndarray) -> Task:
    """Return the task of solving one load, without drives and without a target.

    Args:
        numbers: How many numbers a response has.
        tendons: Number of tendons.
        turn: Rotation from the base to the world.
    """
    none, drives, slopes = np.zeros(numbers), np.zeros(tendons), np.zeros((numbers, tendons))
    number, one = np.zeros(()), np.ones(())
    fields: list[Any] = [none, none, none, slopes, *[drives] * 4, turn]
    fields += [number, one, one, number, number]  # one load, no correction
    return Task._make(fields)


class SearchLayouts(NamedTuple):
    """Layouts of chain, load, state and task as vectors, and the reported quantities.

    Attributes:
        chain: Structure and layout of the chain.
        command: Layout of one load.
        state: Layout of a state.
        task: Layout of a task.
        first_contact: Where a packed state has the log ratios of the first contacts of all tendons,
            and their largest.
        outputs: Names of the quantities.
    """

    chain: StaticStructure
    command: PytreeLayout
    state: PytreeLayout
    task: PytreeLayout
    first_contact: tuple[tuple[int, ...], tuple[int, ...]]
    outputs: tuple[str, ...]
