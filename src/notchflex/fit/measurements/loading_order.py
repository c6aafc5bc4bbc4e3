"""How the rows of a table were loaded: each from rest, or one after the other along a path.

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
    """A command that falls: rows of its highest and its lowest value, counted in its pull.

    Attributes:
        top: The last row before it.
        start: The first row near the lowest value.
        bottom: The row of the lowest value.
        kind: "unloading" if readings lie between the two; in one step "restart" if the next pull
            begins there, "unloaded" if nothing is commanded there; else, and where a pull turns at
            nearly every row, "unclear".
    """

    top: int
    start: int
    bottom: int
    kind: Literal["unloading", "restart", "unloaded", "unclear"]


@dataclass(frozen=True)
class Order:
    """What the order of rows says.

    Attributes:
        from_rest: Whether every row is a pull from rest.
        pull: Label of the pull of every row.
        unclear: Row that falls neither gradually nor to a new pull, its command (such as
            "force", from what, to what); None where the order is clear.
        words: How the rows were understood, "" where they rise only.
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
    """Tell pulls from rest and loading paths apart by the order of the rows.

    A command that only rises within its pull is a pull from rest. One that falls step by step is
    unloading: the rows of each pull are one path. One that rises step by step and falls in one step
    to where it began is the next pull from rest.

    Args:
        commands: What was commanded, P values each.
        pull: Label of the pull of every row; None where the table has none.
        rows: P.

    Returns:
        What the order says.

    Example:
        >>> up, loop = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0, 1.0, 0.0])
        >>> loading_order([("force", up)], None, 6).pull
        ('1', '1', '1', '2', '2', '2')
        >>> loading_order([("force", loop)], None, 5).from_rest
        False
    """
    labels = ("1",) * rows if pull is None else tuple(pull)
    begins: set[int] = set()
    falling = ""
    for name, values in commands:
        for mine, fall in _falls_of_pulls(values, labels):
            if fall.kind == "unloading":
                falling = falling or name
            elif fall.kind == "restart":
                begins.add(int(mine[fall.start]))
            elif fall.kind == "unclear":
                first, last = (float(values[mine[row]]) for row in (fall.top, fall.start))
                return Order(True, labels, (int(mine[fall.start]), name, first, last))
    if pull is None:
        number = np.cumsum([row in begins for row in range(rows)]) + 1
        labels = tuple(str(one) for one in number)
    count = len(set(labels))
    if falling:
        each = "each pull" if count > 1 else "the pull"
        words = (
            f"the {falling} falls within a pull, so the rows of {each} are taken as one loading "
            "path, in their order, with friction history; give --from-rest if every row was "
            "loaded from rest"
        )
        return Order(False, labels, words=words)
    words = ""
    if begins and pull is None:
        words = (
            f"the {commands[0][0]} begins again {len(begins)} time{'s' * (len(begins) > 1)}, so "
            f"the rows are taken as {count} pulls, each row loaded from rest; give --path if they "
            "are one loading path"
        )
    return Order(True, labels, words=words)


def branches(commands: Sequence[Command], pull: Sequence[str]) -> Int[np.ndarray, " p"]:
    """Tell the loading rows (1) from the unloading rows (-1) of every pull, in their order.

    Args:
        commands: As for `loading_order`.
        pull: Label of the pull of every row.

    Returns:
        P numbers; 0 where one tendon is loaded while another one is unloaded.

    Example:
        >>> loop = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
        >>> branches([("force", loop)], ["1"] * 5).tolist()
        [1, 1, 1, -1, -1]
    """
    total = np.zeros(len(pull), int)
    for _, values in commands:
        way = np.isfinite(values).astype(int)
        for mine, fall in _falls_of_pulls(values, pull):
            if fall.kind != "restart":
                way[mine[fall.top + 1 : fall.bottom + 1]] = -1
        if np.ptp(values[np.isfinite(values)]) > 0.0:
            total += way
    return np.sign(total)


def turning_points(values: Float[np.ndarray, " n"], least: float) -> list[int]:
    """Rows at which a command turns back by more than `least`; the first rise is no turn."""
    points: list[int] = []
    way, farthest = 1.0, 0  # rising, and the farthest row that way since the last turn
    for place, value in enumerate(values):
        gone = way * (value - values[farthest])
        if gone > 0.0:
            farthest = place
        elif gone < -least:
            if farthest > 0:
                points.append(farthest)
            way, farthest = -way, place
    return points


def _falls_of_pulls(
    values: Float[np.ndarray, " p"], pull: Sequence[str]
) -> Iterator[tuple[Int[np.ndarray, " n"], Fall]]:
    """Yield every fall of a command with the rows of its pull in which it is commanded."""
    known = np.isfinite(values)
    reach = float(np.ptp(values[known])) if known.any() else 0.0
    if reach == 0.0:
        return
    labels = np.array(pull)
    for label in dict.fromkeys(pull):
        mine = np.flatnonzero(known & (labels == label))
        for fall in _falls(values[mine], reach):
            yield mine, fall


def _falls(values: Float[np.ndarray, " n"], reach: float) -> Iterator[Fall]:
    points = [0, *turning_points(values, TURN * reach), len(values) - 1]
    shuffled = len(points) > _BRANCHES and len(values) - 1 < _STEPS * (len(points) - 1)
    began = 0  # where the present pull began
    for number, (top, bottom) in enumerate(pairwise(points)):
        depth = values[top] - values[bottom]
        if depth < _FALL * reach:
            continue
        near = values[top : bottom + 1] <= values[bottom] + _BETWEEN * depth
        start = top + int(np.argmax(near))
        if _has_between(values[top : bottom + 1]):
            yield Fall(top, start, bottom, "unclear" if shuffled else "unloading")
        elif depth >= _JUMP * reach:
            again = values[start] <= values[began] + _AGAIN * reach
            rise = (
                values[bottom : points[number + 2] + 1] if number + 2 < len(points) else values[:0]
            )
            if again and _has_between(values[began : top + 1]) and _has_between(rise):
                yield Fall(top, start, bottom, "restart")
                began = start
            elif abs(values[bottom]) <= TURN * reach:
                yield Fall(top, start, bottom, "unloaded")
            else:
                yield Fall(top, start, bottom, "unclear")


def _has_between(values: Float[np.ndarray, " n"]) -> bool:
    """Whether a branch has a reading between its ends."""
    if len(values) < 3:
        return False
    low, high = float(np.min(values)), float(np.max(values))
    margin = _BETWEEN * (high - low)
    return bool(((values > low + margin) & (values < high - margin)).any())


__all__ = ["TURN", "Order", "branches", "commands_of", "loading_order", "turning_points"]
