"""The library beside what was written by hand for numba, in turns: ratios taken in one run.

    OPENBLAS_NUM_THREADS=1 python benchmarks/compared.py

Same robots, same loads, both on all cores where there is a batch. The library is called as users
call it, tip and `converged` included; what is written by hand returns angles or modes alone.
"""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from compiled_chain import SIDEWAYS, gao_batch, gao_solve
from compiled_sections import gao_arrays
from compiled_wrist import median_us, wrist_arrays, wrist_batch, wrist_path

import notchflex as nf

ROUNDS = 25


class Pair(NamedTuple):
    """What is compared: the library, by hand, how often a round, and how many solves it is."""

    library: Callable[[], Any]
    by_hand: Callable[[], Any]
    repeats: int
    solves: int


def pairs() -> dict[str, Pair]:
    """All that is compared, by name."""
    wrist, links = nf.load_robot("pacheco2021-a"), nf.load_robot("gao2017")
    w, c = wrist_arrays(wrist), gao_arrays(links)
    many, loads = np.linspace(0.0, 2.5, 10_000), nf.pull(0.0, 2.5, steps=10_000)
    found = {
        "wrist A, one solve": Pair(
            lambda: nf.solve(wrist, nf.Load(tension=2.0)).total_angle,
            lambda: wrist_path(w, np.array([2.0])),
            60,
            1,
        ),
        "wrist A, batch": Pair(
            lambda: nf.solve_batch(wrist, loads), lambda: wrist_batch(w, many), 3, 10_000
        ),
    }
    for name, force in (("Gao", 0.0), ("Gao, 50 g", SIDEWAYS)):
        found |= _of_links(name, links, c, force)
    return found


def _of_links(name: str, links: nf.Robot, c: Any, force: float) -> dict[str, Pair]:
    tip: dict[str, Any] = {"tip_force": (force, 0.0, 0.0)} if force else {}
    path, tensions = nf.pull(0.0, 8.0, steps=1000).loaded(**tip), np.linspace(0.0, 8.0, 1000)
    return {
        f"{name}, one solve": Pair(
            lambda: nf.solve(links, nf.Load(tension=6.0, **tip)).total_angle,
            lambda: gao_solve(c, 6.0, -force * 1j),
            40,
            1,
        ),
        f"{name}, batch": Pair(
            lambda: nf.solve_batch(links, path),
            lambda: gao_batch(c, tensions, -force * 1j),
            1,
            1000,
        ),
    }


def main() -> None:
    """Print a line for each pair, us of one solve and the ratio."""
    print(f"{'':24} {'library, us':>12} {'by hand, us':>12} {'ratio':>8}")
    for name, pair in pairs().items():
        rounds = [
            (median_us(pair.library, pair.repeats), median_us(pair.by_hand, pair.repeats))
            for _ in range(ROUNDS)
        ]
        library, by_hand = (median(times) / pair.solves for times in zip(*rounds, strict=True))
        ratio = median(first / second for first, second in rounds)
        print(f"{name:24} {library:12.3f} {by_hand:12.3f} {ratio:8.2f}", flush=True)


if __name__ == "__main__":
    main()
