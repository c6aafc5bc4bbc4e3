"""The friction rig: estimate, interval and test against what is known of synthetic readings."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import stats

import notchflex as nf
from notchflex.fit import constancy, weight_held
from notchflex.fit.scattered import fit_line, mean_interval, outliers
from refusals import refused

MU = 0.15


def readings(seed, count=40, *, scatter=0.01, by_load=0.0, by_turn=0.0, error=0.0, given=False):
    """Readings at four loads; the coefficient scatters, weight 2 is read with a relative error."""
    random = np.random.default_rng(seed)
    load = random.choice([50.0, 100.0, 200.0, 400.0], count)
    first, second = np.radians(random.uniform(40.0, 110.0, (2, count)))
    mu = MU + by_load * np.log(load / 150.0) + by_turn * (first + second - np.radians(150.0))
    held = weight_held(load, mu + scatter * random.standard_normal(count), first, second)
    told = np.minimum(held * (1.0 + error * random.standard_normal(count)), load)
    deviation = np.full((count, 4), np.nan)
    if given:
        deviation[:, 1] = error * told
    return nf.FrictionReadings(load, told, first, second, deviation)


def test_exact_readings_give_the_coefficient_to_rounding():
    rig = nf.friction_rig(readings(0, scatter=0.0))
    assert rig.coefficient == pytest.approx(MU, abs=1e-12)
    np.testing.assert_allclose(rig.interval, MU, atol=1e-12)
    assert rig.constancy.enough is None
    assert "agree to rounding" in rig.words[-1]


def test_without_deviations_it_is_the_mean_with_students_interval():
    rig = nf.friction_rig(readings(1, 12))
    y = rig.readings.coefficient
    error = y.std(ddof=1) / np.sqrt(12)
    assert rig.coefficient == pytest.approx(y.mean(), rel=1e-12)
    assert rig.standard_error == pytest.approx(error, rel=1e-9)
    np.testing.assert_allclose(rig.interval, stats.t.interval(0.95, 11, y.mean(), error), rtol=1e-7)
    assert rig.spread == pytest.approx(y.std(ddof=1))
    assert rig.scatter == pytest.approx(rig.spread, rel=1e-6)


def test_with_deviations_that_explain_everything_it_is_the_weighted_mean():
    for seed in range(20):
        rig = nf.friction_rig(readings(seed, scatter=0.0, error=0.02, given=True))
        if rig.scatter == 0.0:
            break
    y, s = rig.readings.coefficient, rig.readings.coefficient_deviation
    weight = 1.0 / s**2
    assert rig.scatter == 0.0
    assert rig.coefficient == pytest.approx(weight @ y / weight.sum(), rel=1e-10)
    assert rig.standard_error == pytest.approx(weight.sum() ** -0.5, rel=1e-10)
    assert any("which explain the spread" in words for words in rig.words)


def test_the_likeliest_scatter_is_the_highest_of_the_likelihood():
    rig = readings(3, scatter=0.01, error=0.02, given=True)
    y, known = rig.coefficient, rig.coefficient_deviation**2
    ones = np.ones((len(y), 1))
    best = fit_line(ones, y, known)

    def likelihood(rest, mean):
        return stats.norm.logpdf(y, mean, np.sqrt(known + rest)).sum()

    assert best.log_likelihood == pytest.approx(likelihood(best.rest, best.values[0]), rel=1e-9)
    for rest in best.rest * np.array([0.5, 0.98, 1.02, 2.0]):
        for mean in best.values[0] + np.array([-1e-4, 0.0, 1e-4]):
            assert likelihood(rest, mean) < best.log_likelihood


def test_propagation_of_the_errors_of_a_reading():
    # Many draws of one reading with errors in all four numbers.
    random = np.random.default_rng(5)
    load, first, second = 200.0, 1.2, 0.9
    exact = np.array([load, float(weight_held(load, MU, first, second)), first, second])
    spread = np.array([0.4, 0.3, 0.01, 0.02])
    drawn = exact + spread * random.standard_normal((20_000, 4))
    many = nf.FrictionReadings(*drawn.T)
    one = nf.FrictionReadings(*exact[:, None], spread[None])
    # 20,000 draws tell a standard deviation to 0.5 %.
    assert many.coefficient.std() == pytest.approx(one.coefficient_deviation[0], rel=0.025)


@pytest.mark.parametrize(
    ("draws", "options"), [(200, {}), (60, {"scatter": 0.005, "error": 0.02, "given": True})]
)
def test_intervals_cover_and_the_test_keeps_its_size(draws, options):
    rigs = [nf.friction_rig(readings(seed, **options)) for seed in range(draws)]
    covered = sum(rig.interval[0] <= MU <= rig.interval[1] for rig in rigs)
    refused = sum(rig.constancy.enough is False for rig in rigs)
    named = sum(bool(rig.outliers) for rig in rigs)
    # Binomial bounds that a right procedure leaves in one of 1000 runs.
    low, high = stats.binom.interval(0.999, draws, 0.95)
    assert low <= covered <= high
    low, high = stats.binom.interval(0.999, draws, 0.05)
    assert low <= refused <= high
    assert named <= high


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"by_load": -0.01}, r"mu falls by 0\.00\d+ when the load doubles"),
        ({"by_turn": 0.03}, r"mu rises by 0\.00\d+ for 10 deg more of turn"),
    ],
)
def test_a_coefficient_that_varies_is_found(options, words):
    tests = [constancy(readings(seed, 100, **options)) for seed in range(20)]
    assert sum(one.enough is False for one in tests) >= 19
    ((name, true),) = options.items()
    for one in tests:
        assert abs(getattr(one, name) - true) < 4.0 * getattr(one, f"{name}_error")
        assert ("not enough" in one.words) == (one.enough is False)
    assert sum(bool(re.search(words, one.words)) for one in tests) >= 18


def test_outliers_are_named_with_their_line_and_do_not_hide_each_other(tmp_path):
    data = readings(7, 30)
    held = data.weight_2.copy()
    held[[4, 11, 20]] *= 0.75
    table = np.stack([data.weight_1, held, np.degrees(data.turn_1), np.degrees(data.turn_2)], 1)
    lines = ["weight_1_g,weight_2_g,turn_1_deg,turn_2_deg"]
    lines += [",".join(map(repr, row)) for row in table.tolist()]
    (tmp_path / "rig.csv").write_text("\n".join(lines))
    rig = nf.friction_rig(nf.read_friction_rig(tmp_path / "rig.csv"))
    assert rig.outliers == (4, 11, 20)
    told = [words for words in rig.words if "look at this reading" in words]
    assert [words.split(":")[0].split()[-1] for words in told] == ["6", "13", "22"]
    assert rig.without_outliers == pytest.approx(MU, abs=0.006)
    assert rig.coefficient > rig.without_outliers + 0.005


def test_no_outlier_among_few():
    y = np.array([0.1, 0.1001, 0.0999, 0.5])
    assert outliers(np.ones((4, 1)), y, np.zeros(4)) == (3,)
    assert outliers(np.ones((2, 1)), y[2:], np.zeros(2)) == ()


def test_one_reading():
    alone = nf.friction_rig(nf.FrictionReadings([200.0], [150.0], [1.5], [1.5]))
    assert np.isnan(alone.interval).all()
    assert np.isnan(alone.standard_error)
    assert len(alone.words) == 2
    assert "not known" in alone.words[0]
    known = nf.FrictionReadings([200.0], [150.0], [1.5], [1.5], [[np.nan, 1.0, np.nan, np.nan]])
    rig = nf.friction_rig(known)
    half = 1.959964 * known.coefficient_deviation[0]
    np.testing.assert_allclose(rig.interval, rig.coefficient + half * np.array([-1.0, 1.0]))


def test_a_reading_of_unknown_error_is_as_good_as_the_others_and_not_exact():
    turn = [0.5 * np.pi] * 3
    deviation = np.full((3, 4), np.nan)
    deviation[1:, 1] = 1.0
    readings = nf.FrictionReadings([200.0] * 3, [150.0, 151.0, 152.0], turn, turn, deviation)
    rig = nf.friction_rig(readings)
    low, high = rig.interval
    assert rig.coefficient == pytest.approx(readings.coefficient.mean(), rel=1e-3)
    assert high - low > 0.5 * rig.spread


def test_readings_that_agree_to_rounding_or_rub_too_much_are_doubted():
    said = " ".join(
        nf.friction_rig(nf.FrictionReadings([200.0] * 2, [150.0] * 2, *[[1.6] * 2] * 2)).words
    )
    assert "how far mu can be trusted is not known" in said
    assert "in degrees" not in said
    small = np.radians([[1.57] * 2] * 2)  # radians that were read as degrees
    rubs = nf.friction_rig(nf.FrictionReadings([200.0] * 2, [150.0, 151.0], *small))
    assert "are the turns in degrees?" in " ".join(rubs.words)


def test_what_cannot_be_tested_is_said():
    same = nf.FrictionReadings([200.0] * 5, np.linspace(149.0, 151.0, 5), [1.5] * 5, [1.5] * 5)
    test = constancy(same)
    assert test.enough is None
    assert "one load and one turn" in test.words
    few = nf.FrictionReadings([100.0, 200.0], [80.0, 160.5], [1.5] * 2, [1.5] * 2)
    assert "2 readings are too few" in constancy(few).words
    held = [80.0, 81.0, 80.0, 79.0, 140.0, 141.0, 140.0, 142.0]
    turn = [1.5] * 8
    test = constancy(nf.FrictionReadings([100.0] * 4 + [200.0] * 4, held, turn, turn))
    assert test.degrees_of_freedom == 1
    assert np.isnan(test.by_turn)
    assert test.by_load > 0.0


def test_equal_numbers_have_an_interval_of_nothing():
    assert mean_interval(np.full(3, 0.2), np.zeros(3)) == pytest.approx((0.2, 0.2))


@pytest.mark.parametrize(
    ("text", "code", "name"),
    [
        ("weight_1_g,weight_2_g\n1,1\n", "TABLE_COLUMNS", "columns turn_1_deg, turn_2_deg are"),
        ("a\n1\n", "TABLE_COLUMNS", "weight_1_g, weight_2_g, turn_1_deg, turn_2_deg"),
        ("weight_1_g,weight_2_g,turn_1_deg\n1,1,1\n", "TABLE_COLUMNS", "column turn_2_deg is"),
        ("{h}\n# note\n200,150,90,90\n150,200,90,90\n", "OUT_OF_RANGE", "line 4: weight 2"),
        ("{h}\n200,150,0,0\n", "OUT_OF_RANGE", "line 2: the string"),
        ("{h}\n200,150,-1,90\n", "OUT_OF_RANGE", "by 0 or more"),
        ("{h}\n200,,90,90\n", "NOT_A_NUMBER", "line 2: weight_2_g"),
        ("{h},turn_1_sd_deg\n200,150,90,90,0\n", "OUT_OF_RANGE", "line 2: turn_1_sd_deg is 0"),
    ],
)
def test_bad_files_are_told_in_one_sentence(tmp_path, text, code, name):
    file = tmp_path / "rig.csv"
    file.write_text(text.format(h="weight_1_g,weight_2_g,turn_1_deg,turn_2_deg"))
    with refused(code, name) as told:
        nf.read_friction_rig(file)
    assert "rig.csv" in str(told.value)


@pytest.mark.parametrize(
    ("arguments", "code", "name"),
    [
        (([], [], [], []), "NO_DATA", "readings"),
        (([1.0], [1.0, 2.0], [1.0], [1.0]), "WRONG_SHAPE", "four numbers"),
        (([1.0], [np.nan], [1.0], [1.0]), "NOT_FINITE", "finite"),
        (([1.0], [1.0], [1.0], [1.0], [[0.0, 1.0, 1.0, 1.0]]), "NOT_FINITE", "above 0 or NaN"),
    ],
)
def test_bad_readings_are_refused(arguments, code, name):
    with refused(code, name):
        nf.FrictionReadings(*arguments)
