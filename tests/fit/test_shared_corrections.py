"""One constant for unlike values: added to them, their factor, their ratio; the force factor."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import Constant, calibrate, simulate_measurements, write_fitted
from notchflex.fit.constants import unknowns
from notchflex.fit.residuals import Samples
from refusals import refused

# Its notches are cut to unlike depths.
WRIST = nf.load_robot("pacheco2021-c")
BENT = nf.load_robot("pacheco2021-b-specimen")
UP = nf.pull(0.1, 0.7, steps=5)
NOISE = {"notch_angle": 0.01}


def deeper(robot, by):
    numbers = range(1, robot.number_of_notches + 1)
    return robot.with_values(
        {f"notch[{n}].depth": robot.notches[n - 1].depth + by for n in numbers}
    )


def test_an_offset_of_all_depths_is_found_and_written(tmp_path):
    seen = simulate_measurements(deeper(WRIST, 0.012), UP, deviation=NOISE)
    exact = simulate_measurements(deeper(WRIST, 0.012), UP)
    seen = nf.Measurements(
        "bench.csv", seen.load, seen.pull, True, exact.observed, dict(seen.deviation)
    )
    found = calibrate(WRIST, seen, "offset:notch.depth", starts=1, priors=False)
    assert found.values["offset:notch.depth"] == pytest.approx(0.012, abs=1e-7)
    assert found.units["offset:notch.depth"] == "mm"
    interval = found.intervals["offset:notch.depth"]
    assert interval.lower < 0.012 < interval.upper
    (file,) = write_fitted(found, tmp_path / "fitted")
    again = nf.load_robot(file)
    assert again.notches[3].depth == pytest.approx(1.462, abs=1e-7)
    text = file.read_text()
    assert text.count("fitted by notchflex to bench.csv: `offset:notch.depth` = 0.012 mm") == 4


def test_each_robot_or_notch_has_an_offset_of_its_own_with_a_prior():
    fit = Constant("each:offset:notch.depth", prior=(0.0, 0.01))
    first, second = unknowns({"B": BENT, "C": WRIST}, fit)
    assert (first.name, second.name) == ("B:offset:notch.depth", "C:offset:notch.depth")
    assert first.prior == second.prior == (0.0, 0.01)
    assert [one.path for one in first.sets] == ["notch.depth"]  # alike: one value
    assert [one.base for one in second.sets] == [1.36, 1.39, 1.42, 1.45]
    every = unknowns({"B": BENT, "C": WRIST}, "C:offset:notch[each].depth")
    assert [(one.name, one.sets[0].base) for one in every][1] == (
        "C:offset:notch[2].depth",
        1.39,
    )


def test_a_factor_and_a_ratio_move_unlike_values_together():
    (factor,) = unknowns({"B": BENT}, "factor:notch.precurvature_deg")
    assert (factor.start, factor.unit, len(factor.sets)) == (1.0, "", 5)
    assert factor.sets[1].slope == BENT.notches[1].precurvature_deg
    (ratio,) = unknowns({"A": nf.load_robot("pacheco2021-a"), "B": BENT}, RATIO)
    assert ratio.unit == "deg/mm"
    assert [(one.label, one.slope) for one in ratio.sets] == [("A", 0.8), ("B", 0.5)]


RATIO = "notch.precurvature_deg/height"


def test_precurvature_as_one_constant_times_the_height_of_two_wrists():
    wrists = {"A": nf.load_robot("pacheco2021-a"), "B": BENT}
    made = {
        name: one.with_value("notch.precurvature_deg", 2.86 * one.notches[0].height)
        for name, one in wrists.items()
    }
    seen = {name: simulate_measurements(one, UP) for name, one in made.items()}
    found = calibrate(wrists, seen, RATIO, starts=1, priors=False, intervals=False)
    assert found.values[RATIO] == pytest.approx(2.86, abs=1e-6)
    assert found.robots["B"].notches[4].precurvature_deg == pytest.approx(1.43, abs=1e-6)


@pytest.mark.parametrize(
    "name", ["offset:notch.depth", "factor:notch.depth", RATIO, "sensor.force_factor"]
)
def test_derivatives_are_those_of_the_residuals(name):
    constants = unknowns({"C": WRIST}, [name, "sensor.force_offset"])
    samples = Samples.of({"C": WRIST}, {"C": [simulate_measurements(WRIST, UP)]}, constants)
    at = np.array([constants[0].start, 0.01])
    step = np.array([1e-6 * max(1.0, constants[0].scale), 0.0])
    here, there, back = (samples.residuals(at + part * step) for part in (0.0, 1.0, -1.0))
    difference = (there.values - back.values) / (2.0 * step[0])
    np.testing.assert_allclose(here.slopes[:, 0], difference, rtol=2e-5, atol=1e-7)


def test_the_tension_that_acts_is_the_factor_times_the_reading_less_the_offset():
    factor, offset = 1.08, 0.03
    acting = factor * (UP.tension - offset)
    truth = simulate_measurements(WRIST, nf.LoadPath(np.maximum(acting, 0.0), UP.stroke))
    seen = nf.Measurements("shown", UP, truth.pull, True, truth.observed)
    names = ("sensor.force_factor", "sensor.force_offset")
    found = calibrate(WRIST, seen, names, starts=1, priors=False, intervals=False)
    assert list(found.values.values()) == pytest.approx([factor, offset], abs=1e-6)
    assert found.robots[WRIST.name] == WRIST


@pytest.mark.parametrize(
    ("fit", "code", "name"),
    [
        ("times:notch.depth", "UNKNOWN_NAME", "times"),
        ("offset:notch.depth/height", "UNKNOWN_NAME", "offset:notch.depth"),
        ("offset:notch.dpth", "UNKNOWN_NAME", "depth"),
        ("notch.precurvature_deg/hight", "UNKNOWN_NAME", "height"),
        ("factor:notch.precurvature_deg", "MISSING_VALUE", "precurvature_deg"),
        (("offset:notch.depth", "notch[2].depth"), "CONFLICT", "notch[2].depth"),
        ("sensor.force_fctor", "UNKNOWN_NAME", "sensor"),
        ("notch.depth", "UNSUPPORTED", "unlike values"),
    ],
)
def test_what_makes_no_constant_is_refused_in_words(fit, code, name):
    with refused(code, name):
        unknowns({"C": WRIST}, fit)


def test_no_robot_is_called_like_a_word_of_names():
    with refused("CONFLICT", "offset"):
        unknowns({"offset": WRIST}, Constant("friction.coefficient"))
