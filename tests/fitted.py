"""One fit that several tests look at, made once in a process."""

from __future__ import annotations

import functools

import notchflex as nf
from notchflex.fit import Calibration, Measurements, calibrate, simulate_measurements

ROBOT = "pacheco2021-a"
NAMES = ("friction.coefficient", "material.elastic_modulus")
# What every fit of these tests measures: so all of them share the compiled programs.
OBSERVED = ("notch_angle", "total_angle")
DEVIATION = {"notch_angle": 0.01, "total_angle": 0.01}


def measured(seed: int = 1) -> Measurements:
    """Six rows of two pulls of wrist A of Pacheco 2021, made from the model."""
    wrist = nf.load_robot(ROBOT)
    pulls = ("a", "a", "a", "b", "b", "b")
    load = [nf.Load(tension=force) for force in (0.4, 1.0, 1.6, 0.4, 1.0, 1.6)]
    return simulate_measurements(
        wrist, load, observed=OBSERVED, deviation=DEVIATION, seed=seed, pull=pulls
    )


@functools.cache
def fitted() -> Calibration:
    """The fit of two constants to them."""
    return calibrate(nf.load_robot(ROBOT), measured(), NAMES, starts=1, priors=False)
