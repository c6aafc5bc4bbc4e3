"""Tolerances of a wrist: gradients against draws, time of the draws, coverage of the interval.

python benchmarks/tolerances.py [gradients] [time] [coverage]     # 40 s of CPU
"""

from __future__ import annotations

import numpy as np
from harness import options, share, show, timed

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


def shop() -> Study:
    """Return the wrist with the tolerances of a shop."""
    return study_of(SHOP, nf.AcceptanceLimit("total_angle", lower=0.735, upper=0.9))


def gradients():
    """Compare gradients with a million independent draws of small tolerances."""
    study = study_of(
        SMALL,
        nf.AcceptanceLimit("total_angle", lower=0.0),
        nf.AcceptanceLimit("tip_position", axis="x", lower=0.0),
        nf.AcceptanceLimit("peak_strain", notch=1, upper=1.0),
    )
    effects = linear_effects(study)
    levels = np.random.default_rng(1).random((1_000_000, len(study.sources)))
    values = study.at_levels(levels).values
    spread = values.std(axis=0) / effects.sd - 1.0
    ends = np.stack([values.min(axis=0), values.max(axis=0)], axis=1) - effects.nominal[:, None]
    worst = ends / (effects.worst_case - effects.nominal[:, None]) - 1.0
    for k, criterion in enumerate(study.criteria):
        yield {
            "1e6 draws of": criterion.name,
            "SD by RSS, %": float(100 * spread[k]),
            "ends by worst case, %": (100 * worst[k]).round(2).tolist(),
        }


def time_of_draws():
    """Time a hundred thousand draws, the first with compiling."""
    study = shop()
    levels = np.concatenate(replicates(len(study.sources), 4096, 0))
    for call in ("first", "again"):
        with timed() as seconds:
            study.at_levels(levels)
        yield {"draws": len(levels), "call": call} | seconds


def coverage():
    """Count how often the 95 % interval holds the yield of very many draws."""
    study = shop()
    many, count = np.random.default_rng(7), len(study.sources)
    parts = [study.at_levels(many.random((250_000, count))).accepted.mean() for _ in range(8)]
    truth = float(np.mean(parts))
    # All repetitions in one batch: a call of its own for each costs more than its solves.
    levels = [np.concatenate(replicates(count, EACH, 1000 + k)) for k in range(REPETITIONS)]
    accepted = study.at_levels(np.concatenate(levels)).accepted.reshape(REPETITIONS, -1, EACH)
    low, high = np.transpose([yield_interval(one.sum(axis=1), EACH) for one in accepted])
    draws = accepted[0].size
    independent = 2.0 * 1.96 * np.sqrt(truth * (1.0 - truth) / draws)
    yield {
        "yield, %": 100 * truth,
        "draws": draws,
        "interval holds it": share((low <= truth) & (truth <= high)),
        "width over that of independent draws": float(np.mean(high - low) / independent),
    }


if __name__ == "__main__":
    parts = {"gradients": gradients, "time": time_of_draws, "coverage": coverage}
    for name in options(__doc__, parts).cases:
        show(parts[name]())
