"""Times of the wrist: one solve, a path, a batch; in microseconds and as multiples of LU135.

LU135 is `numpy.linalg.solve` of a random 135 x 135 system, timed in the same run: absolute times
belong to a machine, the multiples can be compared. Run it with one thread for LU135:

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/wrist.py
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

import notchflex as nf

ROUNDS = 15


def median_us(work: Callable[[], object], repeats: int = 1) -> float:
    """Median time of a piece of work, us; the first run, which may compile, is left out."""
    work()
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        for _ in range(repeats):
            work()
        times.append((time.perf_counter() - start) / repeats)
    return 1e6 * statistics.median(times)


def main() -> None:
    """Print the table."""
    generator = np.random.default_rng(0)
    matrix, right = generator.random((135, 135)), generator.random(135)
    wrist = nf.load_robot("pacheco2021-a")
    rows = {
        "LU135": median_us(lambda: np.linalg.solve(matrix, right), 50),
        "one solve, 1 N": median_us(lambda: nf.solve(wrist, nf.Load(tension=1.0)), 5),
        "one solve, stroke 1.2 mm": median_us(lambda: nf.solve(wrist, nf.Load(stroke=1.2)), 5),
        "path, 31 steps to 3 N": median_us(lambda: nf.simulate(wrist, nf.pull(0.0, 3.0))),
        "path, 31 steps up, 31 down": median_us(
            lambda: nf.simulate(wrist, nf.pull(0.0, 3.0).release())
        ),
        "batch of 1,000 from rest": median_us(
            lambda: nf.solve_each(wrist, nf.pull(0.0, 3.0, steps=1000))
        ),
    }
    rows["  per solve of the batch"] = rows["batch of 1,000 from rest"] / 1000.0
    for name, value in rows.items():
        print(f"{name:30} {value:10.0f} us {value / rows['LU135']:8.2f} LU135")


if __name__ == "__main__":
    main()
