"""Friction and stiffness of a sheath, and the wrist's friction, from loops at the drive."""

from __future__ import annotations

import numpy as np

import notchflex as nf
from notchflex.fit import calibrate, simulate_measurements
from notchflex.fit.measurements.csv import read_measurements, write_measurements
from robots import ready

TRUE = {
    "tendon.sheath_friction": 0.15,
    "tendon.sheath_wire_stiffness": 14137.0,
    "friction.coefficient": 0.13,
}
LEG = (0.4, 0.8, 1.2, 1.5, 1.2, 0.9, 0.6, 0.4, 0.3, 0.6, 0.9, 1.2, 1.0, 0.7)
LOADS = [nf.Load(tension=t, sheath_bend_deg=bend) for bend in (60.0, 200.0) for t in LEG]


def sheathed() -> nf.Robot:
    sheath = {"tendon.sheath_length": 1000.0, "tendon.sheath_bend_deg": 180.0}
    return ready("a").with_values(sheath | TRUE)


def loops(**options):
    return simulate_measurements(
        sheathed(),
        LOADS,
        observed=("drive_stroke",),
        pull=["straight"] * len(LEG) + ["bent"] * len(LEG),
        from_rest=False,
        **options,
    )


def test_exact_loops_give_the_constants_back(margin):
    start = sheathed().with_values(dict(zip(TRUE, (0.1, 9000.0, 0.1), strict=True)))
    found = calibrate(start, loops(), [*TRUE], starts=1, priors=False, intervals=False)
    for name, value in TRUE.items():
        margin.within(name, found.values[name] / value - 1.0, 1e-5)


def test_noisy_loops_give_intervals_that_hold_them():
    seen = loops(deviation={"drive_stroke": 0.003}, seed=1)
    found = calibrate(sheathed(), seen, [*TRUE], starts=1, priors=False)
    for name, value in TRUE.items():
        interval = found.intervals[name]
        assert interval.lower < value < interval.upper, name
        assert interval.upper - interval.lower < 0.5 * value, name


def test_files_keep_the_bend_and_the_drive(tmp_path):
    seen = loops(deviation={"drive_stroke": 0.003}, seed=1)
    file = tmp_path / "read.csv"
    file.write_text(
        "pull,tendon_force_N,sheath_bend_deg,tendon_drive_displacement_mm,from_rest\n"
        "1,0.5,60,0.4,0\n1,1.0,0,0.9,0\n1,1.0,,0.95,0\n"
    )
    bends = [load.sheath_bend_deg for load in read_measurements(file, sheathed()).load.external]
    assert bends == [60.0, 0.0, None]
    write_measurements(seen, tmp_path / "loops.csv")
    again = read_measurements(tmp_path / "loops.csv", sheathed())
    bends = [load.sheath_bend_deg for load in again.load.external]
    assert bends == [load.sheath_bend_deg for load in LOADS]
    assert ",200.0," in (tmp_path / "loops.csv").read_text()
    np.testing.assert_allclose(again.observed["drive_stroke"], seen.observed["drive_stroke"])


def test_files_keep_a_temperature_of_zero(tmp_path):
    wrist = ready("a").with_value("material.reference_temperature", 22.0)
    cold = nf.pull(0.5, 1.0, steps=2).loaded(temperature=0.0)
    seen = simulate_measurements(wrist, cold, observed=("total_angle",))
    write_measurements(seen, tmp_path / "cold.csv")
    again = read_measurements(tmp_path / "cold.csv", wrist)
    assert [load.temperature for load in again.load.external] == [0.0, 0.0]
