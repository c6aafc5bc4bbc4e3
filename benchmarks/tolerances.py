"""Tolerances of a wrist: gradients against draws, time of the draws, coverage of the interval.

Prints a table; 40 s of CPU. `python benchmarks/tolerances.py`
"""

from __future__ import annotations

import sys
import time

import numpy as np

import notchflex as nf
from notchflex.tolerancing import Study, replicates, yield_interval
from notchflex.tolerancing.analysis import linear_effects
from notchflex.tolerancing.spec import criteria_of

WRIST = nf.load_robot("pacheco2021-a")
LOADS = {"pulled": nf.pull(0.45, 0.9, steps=2)}
SMALL = {
    "notch.depth": {"plus": 2e-4, "minus": 2e-4},
    "tube.inner_diameter": {"plus": 2e-4, "minus": 2e-4},
    "material.elastic_modulus": {"plus": "0.2 %", "minus": "0.2 %"},
}
SHOP = {
    "notch.depth": {"plus": 0.005, "minus": 0.005, "per_notch": True},
    "notch.height": 0.005,
    "tube.inner_diameter": 0.003,
    "material.elastic_modulus": "5 %",
    "friction.coefficient": {"plus": "20 %", "minus": "20 %"},
}
REPETITIONS, EACH = 400, 64


def study_of(tolerances: dict, *limits: nf.AcceptanceLimit) -> Study:
    """Return a wrist with tolerances and limits."""
    spec = nf.ToleranceSpec(limits, LOADS, tolerances)
    paths = {name: nf.simulate(WRIST, load) for name, load in LOADS.items()}
    chosen = WRIST.replace(tolerance=tolerances).tolerance
    return Study(WRIST, chosen, paths, criteria_of(spec, paths))


def against_draws() -> None:
    """Compare gradients with a million independent draws of small tolerances."""
    study = study_of(
        SMALL,
        nf.AcceptanceLimit("total_angle", lower=0.0),
        nf.AcceptanceLimit("tip_position", axis="x", lower=0.0),
        nf.AcceptanceLimit("peak_strain", notch=1, upper=1.0),
    )
    effects = linear_effects(study)
    drawn = study.at_levels(np.random.default_rng(1).random((1_000_000, len(study.sources)))).values
    for index, one in enumerate(study.criteria):
        spread = drawn[:, index].std() / effects.sd[index] - 1.0
        ends = np.array([drawn[:, index].min(), drawn[:, index].max()]) - effects.nominal[index]
        worst = ends / (effects.worst_case[index] - effects.nominal[index]) - 1.0
        print(
            f"{one.name:16s} RSS against 1e6 draws {100 * spread:+.2f} %, worst case "
            f"{100 * worst[0]:+.2f} and {100 * worst[1]:+.2f} %"
        )


def time_of_draws() -> Study:
    """Time a hundred thousand draws, the first with compiling."""
    study = study_of(SHOP, nf.AcceptanceLimit("total_angle", lower=0.735, upper=0.9))
    levels = np.concatenate(replicates(len(study.sources), 4096, 0))
    for what in ("first", "again"):
        wall, cpu = time.perf_counter(), time.process_time()
        study.at_levels(levels)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        print(f"{len(levels)} draws of a wrist, {what}: {wall:.2f} s, {cpu:.2f} s of processor")
    return study


def coverage(study: Study) -> None:
    """Count how often the 95 % interval holds the yield of very many draws."""
    many = np.random.default_rng(7)
    count = len(study.sources)
    parts = [study.at_levels(many.random((250_000, count))).accepted.mean() for _ in range(8)]
    truth = float(np.mean(parts))
    # All repetitions in one batch: a call of its own for each costs more than its solves.
    levels = [np.concatenate(replicates(count, EACH, 1000 + k)) for k in range(REPETITIONS)]
    accepted = study.at_levels(np.concatenate(levels)).accepted.reshape(REPETITIONS, -1, EACH)
    ends = np.array([yield_interval(one.sum(axis=1), EACH) for one in accepted])
    held = int(np.sum((ends[:, 0] <= truth) & (truth <= ends[:, 1])))
    width = float(np.sum(ends[:, 1] - ends[:, 0]))
    plain = 2.0 * 1.96 * np.sqrt(truth * (1.0 - truth) / (25 * EACH))
    print(
        f"yield {100 * truth:.2f} %; its interval of {25 * EACH} draws holds it in "
        f"{100 * held / REPETITIONS:.2f} % of {REPETITIONS}, and is "
        f"{width / REPETITIONS / plain:.2f} of one of independent draws"
    )


if __name__ == "__main__":
    against_draws()
    sys.stdout.flush()
    coverage(time_of_draws())
