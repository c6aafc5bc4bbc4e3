"""Wrist A of Pacheco 2021 by hand for numba: the speed that the library is compared with.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/compiled_wrist.py

The wrist is marched from notch to notch. None of the library's care is here: no load is cut into
parts, and there is no search along a line. `compiled_chain.py` does the same for Gao's robot.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

try:
    from numba import njit, prange
except ImportError:
    raise SystemExit("this benchmark needs numba and scipy: pip install numba scipy") from None

SMALL = 1e-9  # a last step this small (rad) leaves an error of about its square
MOST = 40  # iterations
compiled = njit(cache=False, fastmath=False, error_model="numpy")
spread = njit(cache=False, fastmath=False, error_model="numpy", parallel=True)


class Wrist(NamedTuple):
    """Height, second moment, r_o - ybar, r_i + ybar, closing angle by notch; law and friction."""

    notches: np.ndarray
    law: np.ndarray


def wrist_arrays(robot: Any) -> Wrist:
    """Read the numbers of the wrist off the library's chain."""
    from notchflex.mechanics.chain import assemble

    chain, law = assemble(robot, "tendons"), robot.material
    rods, section = chain.rods, chain.rods.section
    height, lever = rods.length.sum(axis=1), chain.groups[0].across[:, 0, 0]
    each = (height, section.second_moment_weak[:, 0], section.edge_spine[:, 0], lever)
    numbers = (law.elastic_modulus, law.superelastic_modulus, law.transition_strain)
    numbers += (law.plastic_strain, law.plastic_modulus, law.plastic_exponent)
    closed = height / rods.closure[:, 0]
    notches = np.stack([*each, closed], axis=1)
    return Wrist(notches, np.array([*numbers, robot.friction.coefficient]))


@compiled
def _slide(notch, law, tension, sign, angle):
    """Angle of a notch over which the tendon slides toward the base (1) or the tip (-1)."""
    height, inertia, fibre, lever, closed = notch
    elastic, flat, first, second, plastic, exponent, mu = law
    for _ in range(MOST):
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


@compiled
def _bend(w, tension, angles, gaps):
    """Follow one tension (N); angles (rad) and gap tensions are those before, then those after."""
    for j in range(len(angles)):
        held = np.exp(w.law[6] * angles[j])
        if gaps[j] * held < tension or gaps[j] > tension * held:
            sign = 1.0 if gaps[j] * held < tension else -1.0
            angles[j] = _slide(w.notches[j], w.law, tension, sign, angles[j])
            gaps[j] = tension * np.exp(-sign * w.law[6] * angles[j])
        tension = gaps[j]


@compiled
def wrist_path(w, tensions):
    """Follow tensions (N) with memory; returns angles (rad), (steps, notches)."""
    angles, gaps = np.zeros((len(tensions), len(w.notches))), np.zeros(len(w.notches))
    for step in range(len(tensions)):
        angles[step] = angles[max(step - 1, 0)]
        _bend(w, tensions[step], angles[step], gaps)
    return angles


@spread
def wrist_batch(w, tensions):
    """Solve each tension (N) from rest; returns angles (rad), (loads, notches)."""
    angles = np.zeros((len(tensions), len(w.notches)))
    gaps = np.zeros(angles.shape)
    for j in prange(len(tensions)):
        _bend(w, tensions[j], angles[j], gaps[j])
    return angles


def median_us(work: Callable[[], object], rounds: int = 31) -> float:
    """Median time of a piece of work, us; the first run, which compiles, is left out."""
    work()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e6 * statistics.median(times)


def wrist_times() -> dict[str, float]:
    """Times of wrist A, us: one solve at 2 N, a step of a path to 3 N and back, one of a batch."""
    from notchflex import load_robot

    w, one = wrist_arrays(load_robot("pacheco2021-a")), np.array([2.0])
    up = np.linspace(0.0, 3.0, 1000)
    there = np.r_[np.linspace(0.0, 3.0, 31), np.linspace(3.0, 0.0, 31)]
    return {
        "wrist A, one solve": median_us(lambda: wrist_path(w, one), 301),
        "wrist A, path, per step": median_us(lambda: wrist_path(w, there)) / len(there),
        "wrist A, batch, per solve": median_us(lambda: wrist_batch(w, up)) / len(up),
    }


def print_table(times: dict[str, float]) -> None:
    """Print times beside that of a linear system of 135 unknowns."""
    generator = np.random.default_rng(0)
    matrix, right = generator.random((135, 135)), generator.random(135)
    times = {"LU135": median_us(lambda: np.linalg.solve(matrix, right), 301)} | times
    for name, value in times.items():
        print(f"{name:28} {value:10.2f} us {value / times['LU135']:9.4f} LU135")


if __name__ == "__main__":
    print_table(wrist_times())
