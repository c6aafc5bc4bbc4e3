"""Random robots under random loads, each from rest, and what came of them.

A row for each shape (or form) of robot: how many states were solved, how many were not and for
which reason, how many failed silently (NaN in a state that is called solved, an exception, a
failure without a reason), how many are wrong, and how long a state took. Wrong is what does not
balance when it is added up outside the solver (random_robots/judge.py), and what is another when
the same draw is solved in another way (random_robots/follow.py).

    python benchmarks/robustness.py [--count 640] [--seed 1] [--robots shapes] [--json FILE]
    python benchmarks/robustness.py --robots forms --first 17 --count 1 --tell
    python benchmarks/robustness.py --only spoiled  # or inputs, compliance: other checks

Robots come from two generators that know nothing of each other: `shapes` (by_shape.py), `drawn`
(its shapes with elastic ends, fibres, memory of the material) and `forms` (by_form.py). Draw i of
a seed is the same whatever the count. Each is solved state by state; then its
last load is held and changed a little, and the whole is solved once more in one of several ways
(`--way`; `none` leaves that out). Exit code 1: something silent or wrong.

Draws of one shape are judged one after the other and share their programs; the first compiles one,
which is no part of the times. With `--folder DIR` the draws are worked on in pieces that are kept,
without times: the same call goes on where it was stopped, and `--workers N` takes so many
processes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars
from random_robots import by_form, by_shape, compliance, inputs, spoiled
from random_robots.draws import Draw
from random_robots.follow import WAYS, Outcome, compared, follow
from random_robots.judge import plain
from rich.console import Console
from rich.table import Table

import notchflex as nf
from notchflex.pieces import Manifest, PieceFolder, PieceTask, piece_file
from notchflex.solver.programs.store import code_digest

EACH = 8
"""Draws of a piece."""
CHECKS = {
    "spoiled": spoiled.failed,
    "inputs": inputs.failed,
    "compliance": compliance.failed,
}
SHAPES = {"shapes": by_shape.SHAPES, "drawn": by_shape.DRAWN}


class Chosen(NamedTuple):
    """Which robots are drawn, and in which way they are solved again; see the options."""

    robots: str
    seed: int
    first: int
    count: int
    form: str | None
    way: str | None

    def place(self, number: int) -> int:
        """Place of the shape or form of a draw: draws of one share their programs."""
        if self.robots == "forms":
            return number // by_form.VARIANTS
        return number % len(SHAPES[self.robots])

    @property
    def numbers(self) -> list[int]:
        """Numbers of the draws, those of one shape after one another."""
        numbers = sorted(range(self.first, self.first + self.count), key=self.place)
        if self.form is None or self.robots == "forms":
            return numbers
        names = [shape.name for shape in SHAPES[self.robots]]
        return [number for number in numbers if names[self.place(number)] == self.form]

    def draw(self, number: int) -> Draw:
        """Draw a robot and its loads."""
        if self.robots == "forms":
            return by_form.draw(self.seed, number)
        return by_shape.draw(self.seed, number, SHAPES[self.robots])


def judged(chosen: Chosen, number: int) -> tuple[str, list[Outcome]]:
    """Solve and judge a draw in every way; its shape or form, and what came of its states."""
    try:
        draw = chosen.draw(number)
    except nf.InputError as error:
        if chosen.robots != "forms":
            raise  # a fault of the generator
        return "no robots", [Outcome(number, 0, reason=f"refused: {error}")]
    outcomes, paths = [], []
    for outcome, path in follow(draw, near=chosen.way != "none"):
        outcomes.append(outcome)
        paths.append(path)
    if paths[-1] is not None and chosen.way != "none":
        try:
            outcomes[-1].wrong += compared(draw, paths, chosen.way)
        except Exception as error:  # whatever it is, it is counted
            outcomes[-1].silent.append(f"{type(error).__name__}: {error}")
    return draw.form, outcomes


@dataclass(frozen=True)
class DrawsTask(PieceTask):
    """Draws that are followed and judged, in pieces, with a row for each of their states.

    What a process solved before decides which constants its programs share, and with them last
    digits: so times and numbers in reasons are left out of the files.
    """

    chosen: Chosen

    @cached_property
    def manifest(self) -> Manifest:
        """Which robots, and the code that solves them."""
        content = self.chosen._asdict()
        draws = len(self.chosen.numbers)
        return Manifest.of("robustness", draws, EACH, code=code_digest(), **content)

    def piece(self, number: int) -> tuple[polars.DataFrame, dict[str, Any]]:
        """Follow and judge the draws of one piece."""
        rows: list[dict[str, Any]] = []
        codes = [0, 0, 0, 0]
        start, stop = self.manifest.between(number)
        for draw in self.chosen.numbers[start:stop]:
            form, outcomes = judged(self.chosen, draw)
            bad = any(one.silent or one.wrong for one in outcomes)
            codes[1 if bad else 2 if outcomes[-1].reason else 0] += 1
            rows += [asdict(one) | {"form": form, "reason": plain(one.reason)} for one in outcomes]
        lists = dict.fromkeys(("silent", "wrong"), polars.List(polars.String))
        frame = polars.DataFrame(rows, schema_overrides=lists).drop("seconds")
        return frame, {"codes": codes}


def in_pieces(chosen: Chosen, folder: PieceFolder) -> Iterator[tuple[str, list[Outcome]]]:
    """Follow draws in pieces that are kept; yield what came of each."""
    task = DrawsTask(chosen)
    folder.run(task, cores=1, progress=lambda *told: print(f"\r{told[0]} of {told[1]}", end=""))
    print()
    for piece in range(task.manifest.pieces):
        rows = polars.read_parquet(piece_file(folder.directory, piece)).to_dicts()
        for _, states in groupby(rows, lambda row: row["number"]):
            forms, outcomes = zip(
                *((one.pop("form"), Outcome(**one)) for one in states), strict=True
            )
            yield forms[0], list(outcomes)


def one_by_one(chosen: Chosen, compiled: dict[str, float]) -> Iterator[tuple[str, list[Outcome]]]:
    """Follow draws; yield what came of each, and keep the time to compile a shape's programs, s."""
    for _, numbers in groupby(chosen.numbers, chosen.place):
        start = None
        for number in numbers:
            if start is None:
                start = time.perf_counter()
                form, _ = judged(chosen, number)
                compiled[form] = time.perf_counter() - start
            yield judged(chosen, number)


def tell(form: str, outcomes: list[Outcome]) -> None:
    """Print every state that is silent, wrong or not solved, with what reproduces it."""
    for one in outcomes:
        what = [*one.silent, *one.wrong, *([one.reason] if one.reason else [])]
        if what:
            kind = "silent" if one.silent else "wrong" if one.wrong else "unsolved"
            place = f"{kind}: draw {one.number} ({form}) step {one.step}"
            print(f"{place}: " + "\n    ".join(what), flush=True)


def row(form: str, outcomes: list[Outcome]) -> dict[str, Any]:
    """Counts and times (ms) of one shape or form, or of all."""
    seconds = [one.seconds for one in outcomes if np.isfinite(one.seconds)]
    middle, late, last = 1e3 * np.quantile(seconds, [0.5, 0.95, 1.0]) if seconds else [None] * 3
    reasons = Counter(plain(one.reason) for one in outcomes if one.reason)
    return {
        "form": form,
        "draws": len({one.number for one in outcomes}),
        "states": len(outcomes),
        "solved": sum(not one.reason and not one.silent for one in outcomes),
        "unsolved": dict(reasons.most_common()),
        "silent": sum(bool(one.silent) for one in outcomes),
        "wrong": sum(bool(one.wrong) for one in outcomes),
        "median_ms": middle,
        "p95_ms": late,
        "max_ms": last,
    }


def show(rows: list[dict[str, Any]]) -> None:
    """Print the table and, below, the reasons."""
    table = Table(*rows[0], box=None)
    for one in rows:
        shown = one | {"unsolved": sum(one["unsolved"].values())}
        table.add_row(*(f"{x:.2f}" if isinstance(x, float) else str(x) for x in shown.values()))
    Console(width=120).print(table)
    for one in rows[:-1]:
        for reason, count in one["unsolved"].items():
            print(f"{one['form']}: {count} x {reason}")


def main() -> int:
    """Draw, solve, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", choices=[*SHAPES, "forms"], default="shapes")
    parser.add_argument("--count", type=int, default=640, help="robots to draw")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first draw")
    parser.add_argument("--form", help="only draws of this shape")
    parser.add_argument("--way", choices=[*WAYS, "none"], help="how all are solved once more")
    parser.add_argument("--only", choices=CHECKS, help="another check, of no solved draws")
    parser.add_argument("--tell", action="store_true", help="print robots and loads")
    parser.add_argument("--json", type=Path, help="write rows and every state that is not good")
    parser.add_argument("--folder", type=Path, help="keep pieces here, and go on with them")
    parser.add_argument("--workers", type=int, help="processes that work on the pieces")
    given = vars(parser.parse_args())
    if given["only"]:
        return int(CHECKS[given["only"]](given["seed"], given["count"]))
    chosen = Chosen(**{name: given[name] for name in Chosen._fields})
    compiled: dict[str, float] = {}
    by_name: dict[str, list[Outcome]] = {}
    if given["folder"]:
        draws = in_pieces(chosen, PieceFolder(given["folder"], given["workers"]))
    else:
        draws = one_by_one(chosen, compiled)
    for form, outcomes in draws:
        tell(form, outcomes)  # at once: a run that is stopped loses nothing
        by_name.setdefault(form, []).extend(outcomes)
        if given["tell"]:
            print(*chosen.draw(outcomes[0].number), sep="\n")
    every = sorted((one for some in by_name.values() for one in some), key=lambda o: o.number)
    rows = [row(name, some) for name, some in (by_name | {"all": every}).items()]
    print(f"\n{chosen.robots}, seed {chosen.seed}, draws {chosen.first} to {every[-1].number}")
    show(rows)
    if given["json"]:
        bad = [vars(one) for one in every if one.reason or one.silent or one.wrong]
        content = {**chosen._asdict(), "rows": rows, "compiled_s": compiled, "not_good": bad}
        given["json"].write_text(json.dumps(content, indent=1) + "\n")
    return int(any(one.silent or one.wrong for one in every))


if __name__ == "__main__":
    sys.exit(main())
