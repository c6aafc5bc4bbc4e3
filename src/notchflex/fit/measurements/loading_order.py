"""Loading order of the rows of a table: each from rest, or along a path.

Friction makes a robot bend less while it is loaded than while it is unloaded. A row on the way back
is therefore no pull from rest, and the order of the rows shows which of the two they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int

# Parts of the range of a command. A reversal by less than TURN is noise of a sensor; a gradual fall
# by less than _FALL, or a fall in one step by less than _JUMP, is scatter of a rising force.
TURN = 0.02
_FALL, _JUMP = 0.05, 0.1
# A reading lies between two others if it is farther than this part of their difference from both;
# a pull begins again if a command comes back this near to where it began (part of its range).
_BETWEEN, _AGAIN = 0.1, 0.15
# More branches than that, of fewer steps in the mean, are readings in no order.
_BRANCHES, _STEPS = 4, 2


class Fall(NamedTuple):
    """A command that falls within its pull.

    Attributes:
        top: Row of its highest value, before the fall.
        start: The first row near its lowest value.
        rows: Rows behind the highest value, down to the lowest.
        kind: "unloading" if readings lie between the two; in one step "restart" if the next pull
            begins there, "unloaded" if nothing is commanded there; else, and where a pull turns at
            nearly every row, "unclear".
    """

    top: int
    start: int
    rows: Int[np.ndarray, " n"]
    kind: Literal["unloading", "restart", "unloaded", "unclear"]


@dataclass(frozen=True)
class Order:
    """Loading of rows inferred from their order.

    Attributes:
        from_rest: Whether every row is a pull from rest.
        pull: Label of the pull of every row.
        unclear: A row that falls neither gradually nor to a new pull: its number, the command, the
            values before and in it; None if the order is clear.
        words: How the rows were understood, "" if they only rise.
    """

    from_rest: bool
    pull: tuple[str, ...]
    unclear: tuple[int, str, float, float] | None = None
    words: str = ""


Command = tuple[str, Float[np.ndarray, " p"]]
"""What is commanded, "force" or "displacement", and its values; NaN where it is not commanded."""


def commands_of(
    tension: Float[np.ndarray, "p t"], stroke: Float[np.ndarray, "p t"]
) -> list[Command]:
    """Return the tension (N) and stroke (mm) of every tendon that is commanded."""
    tendons = tension.shape[1]
    return [
        (word if tendons == 1 else f"{word} of tendon {tendon + 1}", table[:, tendon])
        for tendon in range(tendons)
        for word, table in (("force", tension), ("displacement", stroke))
        if np.isfinite(table[:, tendon]).any()
    ]


def loading_order(commands: Sequence[Command], pull: Sequence[str] | None, rows: int) -> Order:
    """Distinguish pulls from rest and loading paths by the order of the rows.

    A command that only rises within its pull is a pull from rest. One that falls step by step is
    unloading: the rows of each pull are one path. One that rises step by step and falls in one step
    to where it began is the next pull from rest. `pull` holds the labels of the rows, if known.

    Example:
        >>> up, loop = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0, 1.0, 0.0])
        >>> loading_order([("force", up)], None, 6).pull
        ('1', '1', '1', '2', '2', '2')
        >>> loading_order([("force", loop)], None, 5).from_rest
        False
    """
    labels = ("1",) * rows if pull is None else tuple(pull)
    begins = np.zeros(rows, int)
    falling = ""
    for name, values in commands:
        for fall in _falls(values, labels):
            if fall.kind == "unloading":
                falling = falling or name
            elif fall.kind == "restart":
                begins[fall.start] = 1
            elif fall.kind == "unclear":
                unclear = fall.start, name, float(values[fall.top]), float(values[fall.start])
                return Order(True, labels, unclear)
    if pull is None:
        labels = tuple(map(str, np.cumsum(begins) + 1))
    count = len(set(labels))
    words = ""
    if falling:
        each = "each pull" if count > 1 else "the pull"
        words = (
            f"the {falling} falls within a pull, so the rows of {each} are taken as one loading "
            "path, in their order, with friction history; give --from-rest if every row was "
            "loaded from rest"
        )
    elif count > 1 and pull is None:
        words = (
            f"the {commands[0][0]} begins again {count - 1} time{'s' * (count > 2)}, so "
            f"the rows are taken as {count} pulls, each row loaded from rest; give --path if they "
            "are one loading path"
        )
    return Order(not falling, labels, words=words)


def branches(commands: Sequence[Command], pull: Sequence[str]) -> Int[np.ndarray, " p"]:
    """Distinguish loading rows (1) and unloading rows (-1) of every pull, in their order.

    0 stands where one tendon is loaded while another one is unloaded.

    Example:
        >>> loop = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
        >>> branches([("force", loop)], ["1"] * 5).tolist()
        [1, 1, 1, -1, -1]
    """
    total = np.zeros(len(pull), int)
    for _, values in commands:
        is_known = np.isfinite(values)
        branch = is_known.astype(int)
        for fall in _falls(values, pull):
            if fall.kind != "restart":
                branch[fall.rows] = -1
        if np.ptp(values[is_known]) > 0.0:
            total += branch
    return np.sign(total)


def turning_points(values: Float[np.ndarray, " n"], least: float) -> list[int]:
    """Return the rows at which a command turns back by more than `least`, but for a first rise."""
    points: list[int] = []
    sign, farthest = 1.0, 0  # rising, and the farthest row that way since the last turn
    for row, value in enumerate(values):
        change = sign * (value - values[farthest])
        if change > 0.0:
            farthest = row
        elif change < -least:
            if farthest > 0:
                points.append(farthest)
            sign, farthest = -sign, row
    return points


def _falls(values: Float[np.ndarray, " p"], pull: Sequence[str]) -> Iterator[Fall]:
    """Yield every fall of a command in the pulls in which it is commanded."""
    is_known = np.isfinite(values)
    span = float(np.ptp(values[is_known])) if is_known.any() else 0.0
    for label in dict.fromkeys(pull) if span else ():
        rows = np.flatnonzero(is_known & (np.array(pull) == label))
        yield from _falls_of_pull(values[rows], rows, span)


def _falls_of_pull(
    values: Float[np.ndarray, " n"], rows: Int[np.ndarray, " n"], span: float
) -> Iterator[Fall]:
    points = [0, *turning_points(values, TURN * span), len(values) - 1]
    shuffled = len(points) > _BRANCHES and len(values) - 1 < _STEPS * (len(points) - 1)
    began = 0  # where the present pull began
    ends = [*points[2:], -1]  # of the next rise; none follows the last branch
    for (top, bottom), end in zip(pairwise(points), ends, strict=True):
        depth, branch = values[top] - values[bottom], values[top : bottom + 1]
        if depth < _FALL * span:
            continue
        start = top + int(np.argmax(branch <= values[bottom] + _BETWEEN * depth))
        begins_again = values[start] <= values[began] + _AGAIN * span
        if _has_between(branch):
            kind = "unclear" if shuffled else "unloading"
        elif depth < _JUMP * span:
            continue
        elif begins_again and all(
            map(_has_between, (values[began : top + 1], values[bottom : end + 1]))
        ):
            kind, began = "restart", start
        else:
            kind = "unloaded" if abs(values[bottom]) <= TURN * span else "unclear"
        yield Fall(int(rows[top]), int(rows[start]), rows[top + 1 : bottom + 1], kind)


def _has_between(values: Float[np.ndarray, " n"]) -> bool:
    """Whether a branch has a reading between its ends."""
    if len(values) < 3:
        return False
    low, high = float(np.min(values)), float(np.max(values))
    margin = _BETWEEN * (high - low)
    return bool(((values > low + margin) & (values < high - margin)).any())
