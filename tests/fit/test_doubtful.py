"""Data that a careless user gives: what is said of them, and what is never told of them."""

import numpy as np
import pytest

import notchflex as nf
from fitted import DEVIATION, NAMES, OBSERVED, ROBOT, fitted, measured
from notchflex.cli.verbs.calibrate import print_calibration
from notchflex.fit import (
    Constant,
    LeastSquares,
    Measurements,
    SumOfRobotErrors,
    calibrate,
    calibration_document,
    diagnose,
    leave_out,
    next_measurement,
    read_measurements,
    sample_posterior,
    simulate_measurements,
    write_fitted,
)
from notchflex.fit.residuals import Samples
from notchflex.fit.search import FitProblem
from notchflex.plotting import Curve, calibration_picture
from refusals import refused

WRIST = nf.load_robot(ROBOT)
FRICTION, MODULUS = NAMES


def panel_of(found, title):
    """The panel of its picture with a title."""
    cells = calibration_picture(found).cells
    return next(cell.panel for cell in cells if cell.panel.title == title)


def said_of(found):
    return " ".join(diagnose(found))


def untold(seen):
    """The same measurements without standard deviations."""
    return Measurements("untold", seen.load, seen.pull, seen.from_rest, seen.observed)


def test_what_deviates_from_the_drawing_leaves_no_noise_to_estimate():
    """Of two numbers, tolerances explain what a constant leaves."""
    seen = untold(measured())
    seen.observed["notch_angle"][2:] = seen.observed["notch_angle"][:, 1:] = np.nan
    seen.observed["total_angle"][:] = np.nan
    found = calibrate(WRIST, seen, MODULUS, starts=1)
    assert len(found.residuals) == 2
    assert found.intervals[MODULUS].lower is found.intervals[MODULUS].upper is None
    assert found.deviations[MODULUS] == np.inf
    assert "the noise of the measurement" in said_of(found)


def test_a_fit_through_every_number_does_not_tell_how_far_to_trust_it(tmp_path):
    seen = untold(measured())
    seen.observed["notch_angle"][1:] = seen.observed["notch_angle"][:, 1:] = np.nan
    seen.observed["total_angle"][:] = np.nan
    found = calibrate(WRIST, seen, MODULUS, starts=1, priors=False)
    assert len(found.residuals) == 1
    interval = found.intervals[MODULUS]
    assert interval.lower is interval.upper is None
    assert found.deviations[MODULUS] == np.inf
    assert said_of(found).count(".") == 2
    assert "Fewer numbers were measured than it takes" in said_of(found)
    assert found.allows(MODULUS, 1.01 * found.values[MODULUS])
    (file,) = write_fitted(found, tmp_path / "fitted")
    assert "the noise is unknown" in file.read_text(encoding="utf-8")
    for ask in (sample_posterior, lambda fit: next_measurement(fit, nf.pull(0.2, 1.0, steps=2))):
        with refused("TOO_FEW_DATA", "noise"):
            ask(found)


def test_coordinates_may_be_missing_one_by_one_also_on_a_turned_base(tmp_path):
    load = nf.pull(0.4, 1.4, steps=3)
    turned = nf.LoadPath(load.tension, load.stroke, np.array([0.3, -0.2, 0.5]))
    noise = {"tip_position": 0.05}
    whole = simulate_measurements(
        WRIST, turned, observed=("tip_position",), deviation=noise, seed=1
    )
    whole.deviation["tip_position"][:, 2] = 5.0  # in the world, where it was measured
    some = whole.observed["tip_position"].copy()
    some[:, 2] = np.nan
    part = Measurements("part", turned, whole.pull, True, {"tip_position": some}, whole.deviation)
    nf.write_measurements(part, tmp_path / "part.csv")
    found = calibrate(
        WRIST, read_measurements(tmp_path / "part.csv", WRIST), FRICTION, starts=1, priors=False
    )
    assert len(found.residuals) == 6
    # What is hardly known counts as little as what was not measured at all.
    hardly = calibrate(WRIST, whole, FRICTION, starts=1, priors=False, intervals=False)
    assert found.values[FRICTION] == pytest.approx(hardly.values[FRICTION], abs=2e-4)
    at = simulate_measurements(found.robots[WRIST.name], turned, observed=("tip_position",))
    left = at.observed["tip_position"][:, :2] - some[:, :2]
    np.testing.assert_allclose(found.residuals.values, left.ravel(), atol=1e-7)
    # drawn in the world too, as it was measured
    drawn = panel_of(found, "tip position, x").items
    marks = next(one for one in drawn if isinstance(one, Curve) and one.hollow)
    np.testing.assert_allclose(marks.rows[:, 1], some[:, 0])


def test_a_robot_of_which_nothing_is_fitted_counts_but_moves_nothing():
    robots = {"A": WRIST, "B": WRIST}
    data = {"A": measured(), "B": measured(2)}
    found = calibrate(robots, data, f"B:{FRICTION}", starts=1, priors=False, intervals=False)
    alone = calibrate(WRIST, measured(2), FRICTION, starts=1, priors=False, intervals=False)
    assert found.values[f"B:{FRICTION}"] == pytest.approx(alone.values[FRICTION], rel=1e-8)
    assert not found.residuals.slopes[found.residuals.robot == 0].any()


def test_what_nothing_depends_on_was_not_pushed_to_its_limit():
    found = calibrate(WRIST, measured(), "sensor.stroke_slack", starts=1, priors=False)
    assert found.values["sensor.stroke_slack"] == 0.0
    assert "do not determine sensor.stroke_slack" in said_of(found)
    assert "limit" not in said_of(found)
    beyond = Constant(FRICTION, lower=0.3, upper=0.5)
    pushed = calibrate(WRIST, measured(), beyond, starts=1, priors=False, intervals=False)
    assert "went to its lower limit, 0.3" in said_of(pushed)


def test_angles_in_the_wrong_unit_give_a_modulus_that_is_doubted():
    seen = measured()
    small = {name: np.radians(one) for name, one in seen.observed.items()}
    noise = {name: np.radians(one) for name, one in seen.deviation.items()}
    wrong = Measurements("rad", seen.load, seen.pull, True, small, noise)
    found = calibrate(WRIST, wrong, MODULUS, starts=1, priors=False, intervals=False)
    assert "look at the units" in said_of(found)
    assert "look at the units" not in said_of(fitted())


def test_a_prior_that_the_data_contradict_is_told():
    off = Constant(FRICTION, prior=(0.5, 0.02))
    assert "from its prior" in said_of(
        calibrate(WRIST, measured(), off, starts=1, priors=False, intervals=False)
    )
    near = Constant(FRICTION, prior=(0.15, 0.02))
    found = calibrate(WRIST, measured(), near, starts=1, priors=False, intervals=False)
    assert "from its prior" not in said_of(found)


def test_angles_about_0_are_not_called_loose_for_being_small():
    found = calibrate(WRIST, measured(), "notch[1].precurvature_deg", starts=1, priors=False)
    interval = found.intervals["notch[1].precurvature_deg"]
    assert interval.upper - interval.lower > abs(found.values["notch[1].precurvature_deg"])
    assert not said_of(found)


def looped(**options):
    """Loading and unloading of a wrist with known constants and noise, as one path."""
    load = nf.pull(0.2, 1.6, steps=8).release()
    return simulate_measurements(
        WRIST, load, observed=OBSERVED, deviation=DEVIATION, from_rest=False, **options
    )


def test_unloading_taken_as_pulls_from_rest_is_doubted():
    loop = looped(seed=2)
    wrong = Measurements("loop", loop.load, loop.pull, True, loop.observed, loop.deviation)
    found = calibrate(WRIST, wrong, NAMES, starts=1, priors=False, intervals=False)
    (said,) = [one for one in diagnose(found) if "Unloading" in one]
    residuals = found.residuals
    total = residuals.values[residuals.quantity == 1]
    assert f"Unloading rows of loop are {-np.degrees(total[8:].mean()):.2g} deg above" in said
    assert f"loading rows {np.degrees(total[:8].mean()):.2g} deg below" in said
    assert "--path" in said
    right = calibrate(WRIST, loop, NAMES, starts=1, priors=False)
    assert not diagnose(right)
    for name, value in zip(NAMES, (0.13, 10_000.0), strict=True):
        assert right.intervals[name].lower < value < right.intervals[name].upper
    assert "Unloading" not in said_of(fitted())


@pytest.fixture(scope="module")
def uneven():
    """Three pulls, each by a wrist of another modulus: rows of a pull err together."""
    load = nf.pull(0.3, 1.2, steps=6)
    pulls = [
        simulate_measurements(
            WRIST.with_value(MODULUS, modulus), load, observed=OBSERVED, deviation=DEVIATION,
            seed=seed, pull=[str(seed)] * 6,
        )
        for seed, modulus in enumerate((9_700.0, 10_050.0, 10_250.0))
    ]  # fmt: skip
    observed, deviation = (
        {name: np.concatenate([getattr(one, held)[name] for one in pulls]) for name in OBSERVED}
        for held in ("observed", "deviation")
    )
    labels = tuple(label for one in pulls for label in one.pull)
    loads = load.then(load).then(load)
    return calibrate(
        WRIST,
        Measurements("uneven", loads, labels, True, observed, deviation),
        MODULUS,
        starts=1,
        priors=False,
    )


def test_intervals_are_by_whole_pulls_where_these_differ(uneven, tmp_path):
    wider = uneven.by_pulls.wider[0]
    assert wider > 1.73  # root of chi squared over its 2 degrees of freedom, 5 %
    interval = uneven.intervals[MODULUS]
    spread = float(np.sqrt(uneven.covariance_by_rows[0, 0])) * wider
    half = 0.5 * (interval.upper - interval.lower)
    assert half == pytest.approx(4.303 * spread, rel=0.1)  # Student's t, three pulls
    assert uneven.deviations[MODULUS] == pytest.approx(spread)
    assert uneven.allows(MODULUS, interval.lower + 0.02 * half)
    assert not uneven.allows(MODULUS, interval.lower - 0.02 * half)
    said = said_of(uneven)
    assert f"By whole pulls, whose rows may err together: the interval of {MODULUS}" in said
    assert "There are 3;" in said
    assert not uneven.trusted  # moduli that differ bend wrists by shares of the angle
    document = calibration_document(uneven)
    assert document["constants"][0]["interval_by"] == "pulls"
    assert document["constants"][0]["interval_95"] == [interval.lower, interval.upper]
    (file,) = write_fitted(uneven, tmp_path / "fitted")
    note = f"{interval.lower:.5g} to {interval.upper:.5g} MPa (95 %, by 3 whole pulls)"
    assert note in file.read_text(encoding="utf-8")
    assert uneven.half_width(np.ones((1, 1)))[0] == pytest.approx(4.303 * spread, rel=1e-3)
    # never narrower than by rows
    by_rows = 1.96 * np.sqrt(np.diag(fitted().covariance_by_rows))
    assert (fitted().half_width(np.eye(2)) >= 0.999 * by_rows).all()


def test_spread_of_pulls_is_that_of_fits_to_each(uneven):
    """In a straight-line view: the deviation of the mean of constants fitted to single pulls."""
    whole = uneven.problem.samples.every[0].measured
    each = [
        calibrate(
            WRIST, whole.of_pulls([label]), MODULUS, starts=1, priors=False, intervals=False
        ).values
        for label in whole.pulls
    ]
    spread = np.std([one[MODULUS] for one in each], ddof=1) / np.sqrt(3.0)
    assert np.sqrt(uneven.by_pulls.covariance[0, 0]) == pytest.approx(spread, rel=0.1)


def test_sums_of_norms_without_priors_have_deviations_by_pulls():
    found = calibrate(
        WRIST, measured(), NAMES, objective=SumOfRobotErrors(), starts=1, priors=False
    )
    deviations = np.array([*found.deviations.values()])
    assert ((deviations > 0.0) & (deviations < np.inf)).all()
    rows = calibration_document(found)["constants"]
    assert [row["standard_deviation_by_pulls"] for row in rows] == deviations.tolist()


def test_totals_that_are_sums_are_not_counted(capsys):
    seen = measured()
    sums = {**seen.observed, "total_angle": seen.observed["notch_angle"].sum(axis=1)}
    added = Measurements("sums", seen.load, seen.pull, True, sums)
    found = calibrate(WRIST, added, NAMES, starts=1, priors=False, intervals=False)
    assert (len(found.residuals), found.counted) == (36, 30)
    document = calibration_document(found)
    assert (document["numbers_measured"], document["numbers_counted"]) == (36, 30)
    print_calibration(found)
    assert "30 numbers measured (and 6 total angles, the sum of the notches)" in (
        capsys.readouterr().out
    )
    panel = panel_of(found, "model less measured")
    drawn = sum(len(one.rows) for one in panel.items if isinstance(one, Curve))
    assert drawn == 30


def test_a_fit_prints_its_constants_and_what_is_doubted(uneven):
    text = repr(uneven)
    interval = uneven.intervals[MODULUS]
    assert f"95 %: {interval.lower:.5g} to {interval.upper:.5g} MPa" in text
    assert diagnose(uneven)[-1] in text
    assert len(text.splitlines()) == 3 + len(diagnose(uneven))
    alone = calibrate(WRIST, measured().of_pulls(["a"]), NAMES, starts=1, priors=False)
    assert repr(alone).endswith("No problems found.")
    assert fitted()._repr_html_().startswith("<pre>Pacheco 2021, wrist A: 36 numbers")


def test_whether_a_model_misses_is_judged_by_numbers_of_known_noise_alone():
    seen = measured().taken([0, 1, 2])  # without the repeats
    noise = {"total_angle": np.array([0.01, 0.01, np.nan])}
    mixed = Measurements("mixed", seen.load, seen.pull, True, seen.observed, noise)
    found = calibrate(WRIST, mixed, FRICTION, starts=1, priors=False, intervals=False)
    known = ~found.noise.estimated
    assert 0 < known.sum() < len(known)
    share = found.residuals.values[known] / found.noise.deviation[known]
    found.noise.deviation[known] *= np.sqrt(np.sum(share**2) / (known.sum() - 1) / 1.7)
    assert found.reduced_chi_squared == pytest.approx(1.7)
    assert not found.misses  # one number that is 1.3 times its noise off says nothing


@pytest.mark.parametrize(
    ("ask", "code", "name"),
    [
        (lambda: calibrate(WRIST, measured(), FRICTION, seed=-1), "OUT_OF_RANGE", "seed"),
        (lambda: calibrate(ROBOT, measured(), FRICTION), "WRONG_TYPE", "Robot"),
        (lambda: calibrate(WRIST, None, FRICTION), "NO_DATA", "got None"),
        (lambda: read_measurements(5, WRIST), "WRONG_TYPE", "CSV is needed; got 5"),
        (lambda: calibrate(WRIST, [measured(), measured()], FRICTION), "CONFLICT", "synthetic"),
        (lambda: calibrate({"each": WRIST}, {"each": measured()}, FRICTION), "CONFLICT", "each"),
        (
            lambda: calibrate(WRIST, measured(), Constant("tube.inner_diameter", 5.0, 9.0)),
            "NOT_CONVERGED",
            "1.62",
        ),
        (lambda: leave_out(fitted(), by="pull", seed=-1), "OUT_OF_RANGE", "seed"),
        (lambda: leave_out(fitted(), by="pull", starts=0), "OUT_OF_RANGE", "starts"),
        (lambda: sample_posterior(fitted(), draws=3), "OUT_OF_RANGE", "draws"),
        (
            lambda: next_measurement(fitted(), nf.pull(0.2, 1, steps=2), deviation={"x": 0.0}),
            "OUT_OF_RANGE",
            "deviation",
        ),
        (lambda: Constant(FRICTION, prior=0.1), "OUT_OF_RANGE", "prior"),
        (lambda: Constant(FRICTION, prior=("a", "b")), "OUT_OF_RANGE", "prior"),
        (lambda: Constant(FRICTION, lower="0"), "NOT_FINITE", "limits"),
    ],
)
def test_what_cannot_be_is_one_sentence(ask, code, name):
    with refused(code, name):
        ask()


def test_why_no_robot_can_be_is_forgotten_with_the_next_try():
    samples = Samples.of({WRIST.name: WRIST}, {WRIST.name: [measured()]}, fitted().problem.unknowns)
    problem = FitProblem(samples, LeastSquares())
    assert problem(np.array([-1.0, 1e4])) is None
    assert "friction.coefficient" in samples.refused
    assert problem(np.array([0.1, 1e4])) is not None
    assert not samples.refused
