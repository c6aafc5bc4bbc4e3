"""Draws of robustness.py in pieces that are kept: by several processes, gone on with after a stop.

A piece is a few draws, in the order of their shapes; its file has a row for each of their states.
What a process solved before decides which constants its programs share, and with them last digits:
so times and numbers in reasons are left out of the files.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple

import polars
from draw import Draw, draw
from judge import plain
from robustness import Outcome, follow
from shapes import DRAWN, SHAPES

from notchflex.pieces import Manifest, PieceFolder, PieceTask, piece_file
from notchflex.solver.programs.store import code_digest

KIND = "robustness"
EACH = 8
"""Draws of a piece."""


class Chosen(NamedTuple):
    """Which robots are drawn; see the options of robustness.py."""

    seed: int
    first: int
    count: int
    drawn: bool
    shape: str | None

    @property
    def numbers(self) -> list[tuple[int, int]]:
        """Places of shapes and numbers of draws, in the order of the shapes."""
        shapes = DRAWN if self.drawn else SHAPES
        return [
            (place, number)
            for place, shape in enumerate(shapes)
            for number in range(place, self.first + self.count, len(shapes))
            if number >= self.first and self.shape in (None, shape.name)
        ]


@dataclass(frozen=True)
class DrawsTask(PieceTask):
    """Draws that are followed and judged, in pieces.

    Args:
        chosen: Which.
    """

    chosen: Chosen

    @cached_property
    def manifest(self) -> Manifest:
        """Which robots, and the code that solves them."""
        chosen = self.chosen
        return Manifest.of(KIND, len(chosen.numbers), EACH, code=code_digest(), **chosen._asdict())

    @property
    def shapes(self) -> list[Any]:
        """Shapes of the robots."""
        return DRAWN if self.chosen.drawn else SHAPES

    def _draws(self, number: int) -> Iterator[list[Draw]]:
        """Yield the draws of a piece, those of one shape together."""
        start, stop = self.manifest.between(number)
        for place, alike in groupby(self.chosen.numbers[start:stop], lambda one: one[0]):
            yield [draw(one, self.chosen.seed, self.shapes[place]) for _, one in alike]

    def piece(self, number: int) -> tuple[polars.DataFrame, dict[str, Any]]:
        """Follow and judge the draws of one piece."""
        rows: list[dict[str, Any]] = []
        codes = [0, 0, 0, 0]
        for alike in self._draws(number):
            for one in alike:
                found = list(follow(one))
                bad = any(state.silent or state.wrong for state in found)
                codes[1 if bad else 2 if found[-1].reason else 0] += 1
                rows += [_row(one.shape.name, state) for state in found]
        schema = dict.fromkeys(rows[0], polars.String) | {
            "draw": polars.Int64,
            "step": polars.Int64,
        }
        return polars.DataFrame(rows, schema=schema), {"codes": codes}


def _row(shape: str, state: Outcome) -> dict[str, Any]:
    """Return a state as a row of a file."""
    return {
        "shape": shape,
        "draw": state.number,
        "step": state.step,
        "reason": plain(state.reason),
        "silent": "\n".join(state.silent),
        "wrong": "\n".join(state.wrong),
    }


def followed(chosen: Chosen, folder: PieceFolder) -> dict[str, list[Outcome]]:
    """Follow draws in pieces; what came of their states, by shape.

    Args:
        chosen: Which.
        folder: Where pieces are kept.
    """
    task = DrawsTask(chosen)
    folder.run(task, cores=1, progress=lambda *told: print(f"\r{told[0]} of {told[1]}", end=""))
    print()
    outcomes: dict[str, list[Outcome]] = {}
    for piece in range(task.manifest.pieces):
        for one in polars.read_parquet(piece_file(folder.directory, piece)).to_dicts():
            state = Outcome(one["draw"], one["step"], reason=one["reason"])
            state.silent, state.wrong = (
                [text for text in one[name].split("\n") if text] for name in ("silent", "wrong")
            )
            outcomes.setdefault(one["shape"], []).append(state)
    return outcomes
