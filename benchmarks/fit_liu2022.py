"""The procedure of Liu 2022: friction from the two-weight rig, the modulus from single notches.

    python benchmarks/fit_liu2022.py [--seed 0]

The paper's readings are not public: 100 readings of the rig and three single-notch samples are made
from the model, with noise; then friction by eq. 21 with its spread, whether a constant coefficient
is enough (fig. 8), and the modulus of the samples with that friction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from harness import options

import notchflex as nf
from notchflex.fit import (
    FrictionReadings,
    calibrate,
    friction_rig,
    simulate_measurements,
    weight_held,
)

TRUE_FRICTION, TRUE_MODULUS = 0.2, 1000.406
FRICTION, MODULUS = "friction.coefficient", "material.elastic_modulus"
ANGLE_NOISE = np.radians(0.3)


def main() -> None:
    """Print what the rig says, and the modulus."""
    random = np.random.default_rng(options(__doc__, seed=0).seed)
    for label, slope in (("constant", 0.0), ("falls with load", -0.02)):
        print(
            f"rig, coefficient {label}:", *friction_rig(readings(random, slope)).words, sep="\n  "
        )
    friction = friction_rig(readings(random, 0.0)).coefficient
    robot = nf.load_robot("liu2022").with_value(FRICTION, TRUE_FRICTION)
    single = robot.replace(
        notch=(replace(robot.notch[0], repeat=1),),
        tendon=tuple(replace(tendon, end_body=1) for tendon in robot.tendon),
    )
    load, deviation = nf.pull(1.0, 9.0, steps=9), {"notch_angle": ANGLE_NOISE}
    samples = [
        simulate_measurements(single, load, deviation=deviation, seed=random) for _ in range(3)
    ]
    start = single.with_values({FRICTION: friction, MODULUS: 800.0})
    found = calibrate(start, samples, MODULUS, starts=1)
    interval = found.intervals[MODULUS]
    print(
        f"modulus {found.values[MODULUS]:.2f} MPa, 95 % {interval.lower:.2f} to "
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
