"""The procedure of Liu 2022: friction from the two-weight rig, the modulus from single notches.

    python benchmarks/fit_liu2022.py [--seed 0]

The paper's readings are not public: 100 readings of the rig and three single-notch samples are made
from the model, with noise; then friction by eq. 21 with its spread, whether a constant coefficient
is enough (fig. 8), and the modulus of the samples with that friction.
"""

from __future__ import annotations

import argparse
import dataclasses

import numpy as np

import notchflex as nf
from notchflex.fit import (
    FrictionReadings,
    calibrate,
    friction_rig,
    simulate_measurements,
    weight_held,
)

TRUE_FRICTION, TRUE_MODULUS = 0.2, 1000.406
ANGLE_NOISE = np.radians(0.3)


def main() -> None:
    """Read what is asked, and run all of it."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seed", type=int, default=0)
    random = np.random.default_rng(arguments.parse_args().seed)
    for label, slope in (("constant", 0.0), ("falls with load", -0.02)):
        rig = friction_rig(readings(random, slope))
        print(f"rig, coefficient {label}:")
        for sentence in rig.words:
            print(f"  {sentence}")
    friction = friction_rig(readings(random, 0.0)).coefficient
    robot = nf.load_robot("liu2022").with_value("friction.coefficient", TRUE_FRICTION)
    single = dataclasses.replace(
        robot,
        notch=(dataclasses.replace(robot.notch[0], repeat=1),),
        tendon=tuple(dataclasses.replace(one, end_body=1) for one in robot.tendon),
    )
    load = nf.pull(1.0, 9.0, steps=9)
    samples = [
        simulate_measurements(single, load, deviation={"notch_angle": ANGLE_NOISE}, seed=random)
        for _ in range(3)
    ]
    start = single.with_values(
        {"friction.coefficient": friction, "material.elastic_modulus": 800.0}
    )
    found = calibrate(start, samples, "material.elastic_modulus", starts=1)
    interval = found.intervals["material.elastic_modulus"]
    print(
        f"modulus {found.values['material.elastic_modulus']:.2f} MPa, 95 % {interval.lower:.2f} to "
        f"{interval.upper:.2f} (true {TRUE_MODULUS}), with friction {friction:.4f} from the rig"
    )


def readings(random: np.random.Generator, slope: float) -> FrictionReadings:
    """100 readings; the coefficient may depend on the load, by its logarithm."""
    weight_1 = random.uniform(50.0, 500.0, 100)
    turn_1, turn_2 = np.radians(random.uniform(20.0, 90.0, (2, 100)))
    coefficient = TRUE_FRICTION + slope * np.log(weight_1 / 150.0)
    coefficient = coefficient + 0.01 * random.standard_normal(100)
    weight_2 = weight_held(weight_1, coefficient, turn_1, turn_2)
    return FrictionReadings(weight_1, weight_2, turn_1, turn_2, source="made from the model")


if __name__ == "__main__":
    main()
