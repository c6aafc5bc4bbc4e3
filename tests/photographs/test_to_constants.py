"""The whole way: photographs of a loaded wrist, measured, then fitted."""

import cv2
import pytest

import notchflex as nf
from notchflex.fit import calibrate, read_measurements, simulate_measurements
from photographs.renderer import Scene, render

ROBOT = nf.load_robot("pacheco2021-a")
TRUE = {"material.elastic_modulus": 9200.0, "friction.coefficient": 0.18}
TENSIONS = (0.7, 1.2, 1.6, 1.1, 0.6, 0.3)


@pytest.mark.nightly
def test_constants_of_a_wrist_that_was_photographed(tmp_path):
    """Loading, then unloading: the 95 % intervals hold the constants that drew the photographs."""
    load = [nf.Load(tension=one) for one in TENSIONS]
    bent = simulate_measurements(ROBOT.with_values(TRUE), load, from_rest=False)
    files = []
    for number, (tension, angles) in enumerate(
        zip(TENSIONS, bent.observed["notch_angle"], strict=True)
    ):
        scene = Scene(
            size=(720, 620), scale=46.0, place=(450.0, 150.0), direction=75.0,
            roll=8.0 - 3.0 * number, tilt=5.0 - 2.0 * number, seed=number, stripe=80.0,
        )  # fmt: skip
        files.append(str(tmp_path / f"wrist_{tension}N.png"))
        cv2.imwrite(files[-1], render(ROBOT, angles, scene))
    found = nf.measure(files, ROBOT, pattern="wrist_{tension}N")
    assert [one.reason for one in found.photographs] == [""] * len(files)
    found.write_csv(str(tmp_path / "measured.csv"))
    read = read_measurements(tmp_path / "measured.csv", ROBOT)
    assert not read.from_rest
    # The tolerances of the drawing leave the modulus of this wrist open by 5 %.
    for priors, width in ((True, 0.15), (False, 0.05)):
        fitted = calibrate(ROBOT, read, list(TRUE), starts=1, priors=priors)
        assert fitted.converged
        for name, value in TRUE.items():
            interval = fitted.intervals[name]
            assert interval.lower < value < interval.upper
            assert interval.upper - interval.lower < width * value
