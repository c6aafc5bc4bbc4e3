"""Random robots under random loads, each from rest, and what came of them.

    python benchmarks/robustness.py [--count 640] [--seed 1] [--json FILE] [--part I/N]
    python benchmarks/robustness.py --first 17 --count 1 --tell 1
    python benchmarks/robustness.py spoiled  # or inputs, compliance: other checks

A row for each form of robot: how many states were solved, how many were not and for which reason,
how many failed silently (NaN in a state that is called solved, an exception, a failure without a
reason), how many are wrong, and how long a state took. Wrong is what does not balance when it is
added up outside the solver (random_robots/judge.py), and what is another when the same draw is
solved in another way (random_robots/follow.py): one of several (`--way`).

Draw i of a seed is the same whatever the count (random_robots/robots.py). Each is solved state by
state; then its last load is held and changed a little, and the whole is solved once more. The
first draw of a form compiles its programs, which is no part of the times. Exit code 1: something
is silent or wrong.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from harness import options, show, trials
from random_robots import compliance, inputs, spoiled
from random_robots.follow import Outcome, compared, follow
from random_robots.judge import plain
from random_robots.robots import VARIANTS, draw

import notchflex as nf

CHECKS: dict[str, Callable[[int, int], bool]] = {
    "spoiled": spoiled.failed,
    "inputs": inputs.failed,
    "compliance": compliance.failed,
}


def judged(seed: int, number: int, way: str = "") -> tuple[str, list[Outcome]]:
    """Solve and judge a draw in every way; return its form, and what came of its states."""
    try:
        robot = draw(seed, number)
    except nf.InputError as error:
        return "no robots", [Outcome(number, 0, reason=f"refused: {error}")]
    except nf.ConvergenceError as error:
        return "no pretension", [Outcome(number, 0, reason=f"spool: {error}")]
    outcomes, paths = [], []
    for outcome, path in follow(robot):
        outcomes.append(outcome)
        paths.append(path)
    if paths[-1] is not None:
        try:
            outcomes[-1].wrong += compared(robot, paths, way or None)
        except Exception as error:  # whatever it is, it is counted
            outcomes[-1].silent.append(f"{type(error).__name__}: {error}")
    return robot.form, outcomes


def tell(row: dict[str, Any], chosen: argparse.Namespace) -> None:
    """Print every state that is silent, wrong or not solved, with what reproduces it."""
    for state in row["states"]:
        if what := [*state["silent"], *state["wrong"], *filter(None, [state["reason"]])]:
            kind = "silent" if state["silent"] else "wrong" if state["wrong"] else "unsolved"
            place = f"{kind}: draw {row['number']} ({row['form']}) step {state['step']}"
            print(f"{place}: " + "\n    ".join(what), flush=True)
    if chosen.tell:
        print(*draw(chosen.seed, row["number"]), sep="\n")


def summary(form: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Make the row of a form, or of all: counts, and times in ms."""
    states = [state for row in rows for state in row["states"]]
    # The first draw of a form compiles.
    seconds = [
        state["seconds"] for row in rows if row["number"] % VARIANTS for state in row["states"]
    ]
    times = 1e3 * np.nanquantile(np.array([*seconds, np.nan], float), [0.5, 0.95, 1.0])
    return {
        "form": form,
        "draws": len(rows),
        "states": len(states),
        "solved": sum(not (state["reason"] or state["silent"]) for state in states),
        "unsolved": sum(bool(state["reason"]) for state in states),
        "silent": sum(bool(state["silent"]) for state in states),
        "wrong": sum(bool(state["wrong"]) for state in states),
        "median, 95 %, most, ms": times.round(1).tolist(),
    }


def main() -> int:
    """Draw, solve, judge, print."""
    chosen = options(
        __doc__, ("draws", *CHECKS), count=640, first=0, seed=1, part="0/1", way="", tell=0
    )
    warnings.simplefilter("ignore", nf.InputWarning)  # unusual robots on purpose
    failed = [name for name in CHECKS if name in chosen.cases and CHECKS[name](chosen.seed, 40)]
    by_form: dict[str, list[dict[str, Any]]] = {}
    if "draws" in chosen.cases:

        def trial(number: int) -> dict[str, Any]:
            form, outcomes = judged(chosen.seed, number, chosen.way)
            return {"form": form, "states": [asdict(outcome) for outcome in outcomes]}

        for row in trials(trial, chosen, f"seed {chosen.seed}"):
            tell(row, chosen)  # at once: a run that is stopped loses nothing
            by_form.setdefault(row["form"], []).append(row)
    every = [row for rows in by_form.values() for row in rows]
    show(summary(form, rows) for form, rows in (by_form | {"all": every}).items() if rows)
    states = [state for row in every for state in row["states"]]
    reasons = Counter(plain(state["reason"]) for state in states if state["reason"])
    show({"unsolved": reason, "times": times} for reason, times in reasons.most_common())
    return int(bool(failed) or any(state["silent"] or state["wrong"] for state in states))


if __name__ == "__main__":
    sys.exit(main())
