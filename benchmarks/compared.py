"""Wrist A of Pacheco 2021 by the library and by hand for numba, in turns: time of one solve.

    OPENBLAS_NUM_THREADS=1 python benchmarks/compared.py

Both take the same loads, on all cores where there is a batch. The library is called as users call
it, tip and `converged` included. By hand the wrist is marched from notch to notch, without any of
the library's care: no load is cut into parts, and there is no search along a line.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
from harness import options, show

import notchflex as nf

try:
    from numba import njit, prange
except ImportError:
    raise SystemExit("this benchmark needs numba and scipy: pip install numba scipy") from None

SMALL = 1e-9  # a last step this small (rad) leaves an error of about its square
MOST_ITERATIONS = 40


def wrist_arrays(robot: nf.Robot) -> tuple[np.ndarray, np.ndarray]:
    """Read the numbers of the wrist off the library's chain.

    Returns:
        Height, second moment, r_o - ybar, r_i + ybar, closing angle by notch; law and friction.
    """
    from notchflex.mechanics.chain import assemble

    chain, law = assemble(robot, "tendons"), robot.material
    rods, section = chain.rods, chain.rods.section
    height, lever = rods.length.sum(axis=1), chain.groups[0].across[:, 0, 0]
    columns = (height, section.second_moment_weak[:, 0], section.edge_spine[:, 0], lever)
    numbers = (law.elastic_modulus, law.superelastic_modulus, law.transition_strain)
    numbers += (law.plastic_strain, law.plastic_modulus, law.plastic_exponent)
    notches = np.stack([*columns, height / rods.closure[:, 0]], axis=1)
    return notches, np.array([*numbers, robot.friction.coefficient])


@njit(error_model="numpy")
def _slide(notch, law, tension, sign, angle):
    """Angle of a notch over which the tendon slides toward the base (1) or the tip (-1)."""
    height, inertia, fibre, lever, closed = notch
    elastic, flat, first, second, plastic, exponent, mu = law
    for _ in range(MOST_ITERATIONS):
        strain = angle * fibre / height  # eq. 16
        stress, modulus = elastic * strain, elastic
        if strain > first:  # eq. 13
            stress, modulus = elastic * first + flat * (min(strain, second) - first), flat
        if strain > second:
            hard = plastic * np.exp(exponent / (strain - second))
            stress, modulus = stress + hard, -exponent * hard / (strain - second) ** 2
        pull = tension * lever * np.exp(-sign * mu * angle)
        rise = inertia / height * modulus + sign * mu * pull
        new = min(angle - (inertia / fibre * stress - pull) / rise, closed)
        step, angle = abs(new - angle), new
        if step < SMALL:
            break
    return angle


@njit(error_model="numpy")
def wrist_solve(notches, law, tension):
    """Solve one tension (N) from rest; returns angles (rad) by notch."""
    angles = np.zeros(len(notches))
    for j in range(len(notches)):
        angles[j] = _slide(notches[j], law, tension, 1.0, 0.0)
        tension *= np.exp(-law[6] * angles[j])
    return angles


@njit(error_model="numpy", parallel=True)
def wrist_batch(notches, law, tensions):
    """Solve each tension (N) from rest; returns angles (rad), (loads, notches)."""
    angles = np.zeros((len(tensions), len(notches)))
    for j in prange(len(tensions)):
        angles[j] = wrist_solve(notches, law, tensions[j])
    return angles


def median_us(work: Callable[[], object], repeats: int) -> float:
    """Median time of a piece of work, us."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e6 * median(times)


def compare(library: Callable[[], Any], by_hand: Callable[[], Any], solves: int, repeats: int):
    """Time both in turns, 25 times; the first calls, which compile, are left out."""
    library(), by_hand()
    rounds = [[median_us(work, repeats) / solves for work in (library, by_hand)] for _ in range(25)]
    ours, other = np.transpose(rounds)
    return {
        "library, us": float(median(ours)),
        "by hand, us": float(median(other)),
        "ratio": float(median(ours / other)),
    }


def main() -> None:
    """Print a row for one solve and for a batch of 10,000."""
    options(__doc__)
    wrist, many = nf.load_robot("pacheco2021-a"), np.linspace(0.0, 2.5, 10_000)
    notches, law = wrist_arrays(wrist)
    loads = nf.pull(0.0, 2.5, steps=len(many))
    pairs = {
        "one solve": (
            lambda: nf.solve(wrist, nf.Load(tension=2.0)).total_angle,
            lambda: wrist_solve(notches, law, 2.0),
            1,
            60,
        ),
        "batch": (
            lambda: nf.solve_batch(wrist, loads),
            lambda: wrist_batch(notches, law, many),
            len(many),
            3,
        ),
    }
    show({"wrist A": name} | compare(*pair) for name, pair in pairs.items())


if __name__ == "__main__":
    main()
