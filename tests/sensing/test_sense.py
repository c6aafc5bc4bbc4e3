"""Forces sensed from simulated readings: found again, with intervals that hold the truth."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.sensing import SensorNoise, sense
from notchflex.sensing.history import estimate, own_readings, with_noise
from notchflex.sensing.model import SensingModel, unknown_force
from notchflex.sensing.readings import merged, readings_of
from notchflex.sensing.tables import sensed_document
from refusals import refused

EXACT = SensorNoise(tension=0.0, stroke=0.0, tip=0.0, angle=0.0)


def read(robot, tension, force, **more):
    """The path of a robot with tensions (s,) of its first tendon and forces along x (s,)."""
    tensions = np.zeros((len(tension), robot.number_of_tendons))
    tensions[:, 0] = tension
    external = tuple(nf.Load(tip_force=(one, 0.0, 0.0), **more).external for one in force)
    return nf.simulate(
        robot, nf.LoadPath(tensions, np.full_like(tensions, np.nan), external=external)
    ).raise_if_failed()


COMES = np.array([0.0, 0.0, 0.01, 0.02, 0.02, -0.01, 0.0])
TENSIONS = np.array([0.2, 0.4, 0.6, 0.8, 0.6, 0.4, 0.5])


def test_a_force_that_comes_changes_and_goes_is_found_reading_by_reading(wrist, margin):
    path = read(wrist, TENSIONS, COMES)
    sensed = sense(wrist, path.tension, path.stroke, noise=EXACT)
    margin.within("force", sensed.force[:, 0] - COMES, 1e-9, "N")
    assert ((sensed.low[:, 0] <= COMES) & (sensed.high[:, 0] >= COMES)).all()
    assert sensed.components == ("x",)
    assert not sensed.reason


def test_it_is_wrong_to_take_the_history_for_one_load_from_rest(wrist):
    # What the contacts remember is part of the answer: a reading of the way back alone gives
    # another force.
    path = read(wrist, TENSIONS, COMES)
    alone = sense(wrist, path.tension[5:6], path.stroke[5:6], noise=EXACT)
    assert abs(alone.force[0, 0] - COMES[5]) > 1e-3


STUCK = [0.4, 0.8, 0.784]  # let go a little, so that the tendon sticks, N


def test_forces_that_a_stuck_tendon_hides_are_all_in_the_interval(wrist):
    forces = (-0.002, 0.002)
    paths = [read(wrist, STUCK, [0.0, 0.0, one]) for one in forces]
    # The readings are the same to what a sensor, and the model of a stuck tendon, can resolve.
    assert np.abs(paths[0].stroke - paths[1].stroke).max() < 1e-5
    for path in paths:
        sensed = sense(wrist, path.tension, path.stroke, noise=EXACT)
        assert sensed.low[-1, 0] <= forces[0]
        assert forces[1] <= sensed.high[-1, 0]
        assert sensed.stuck[-1, 0]
        assert any("stick" in text for text in sensed.not_observable)


def test_ends_of_the_interval_fit_the_readings_and_what_is_beyond_does_not(wrist):
    # Both ends, solved as histories of their own, against the readings.
    path = read(wrist, STUCK, [0.0, 0.0, 0.0])
    sensed = sense(wrist, path.tension, path.stroke, noise=EXACT)
    low, high = sensed.low[-1, 0], sensed.high[-1, 0]
    width = high - low
    for force, fits in (
        (low + 0.02 * width, True),
        (high - 0.02 * width, True),
        (low - 0.2 * width, False),
        (high + 0.2 * width, False),
    ):
        other = read(wrist, STUCK, [0.0, 0.0, force])
        assert (abs(other.stroke[-1, 0] - path.stroke[-1, 0]) < 4e-5) == fits


def test_what_one_tendon_cannot_know_is_said_with_its_direction(wrist):
    path = read(wrist, [0.2, 0.5, 0.8], [0.02, 0.02, 0.02])
    sensed = sense(wrist, path.tension, path.stroke, components="xz")
    (direction,) = sensed.hidden[-1]
    assert any("not observable" in text for text in sensed.not_observable)
    assert sensed.limited[-1].any()
    # Solved again with more force along it, the stroke changes by less than the noise.
    x, z = 0.02 * direction
    moved = nf.solve(
        wrist, nf.Load(tension=0.8, tip_force=(0.02 + x, 0.0, z)), from_state=path.state_at(1)
    )
    assert abs(moved.stroke[0] - path.stroke[-1, 0]) < 0.01
    across = nf.solve(
        wrist, nf.Load(tension=0.8, tip_force=(0.02 + z, 0.0, -x)), from_state=path.state_at(1)
    )
    assert abs(across.stroke[0] - path.stroke[-1, 0]) > 0.02
    # A measured tip removes it.
    seen = sense(wrist, path.tension, path.stroke, tip=path.tip_position, components="xz")
    assert not len(seen.hidden[-1])
    assert seen.force[-1] == pytest.approx([0.02, 0.0], abs=1e-5)


def test_a_direction_that_noise_alone_hides_is_not_said_to_stick(wrist):
    # A force along z moves the tip of a bent robot little: its deviation is beyond a tenth of the
    # range, and the tendon slides.
    load = nf.Load(tension=0.8, tip_force=(0.02, 0.0, 0.0))
    here = nf.solve(wrist, load)
    drawn = (here.tension[None], here.stroke[None])
    noise = SensorNoise(tension=0.01, stroke=0.01, tip=0.05)
    sensed = sense(wrist, *drawn, tip=here.tip_position[None], noise=noise, components="xz")

    def at(tension, x, z):
        one = nf.solve(wrist, nf.Load(tension=tension, tip_force=(x, 0.0, z)))
        return np.append(one.stroke, one.tip_position[[0, 2]])

    # Least squares with differences: noise of the stroke and the tip, and of what drives the model.
    step = 1e-4
    moves = ((0.0, step, 0.0), (0.0, 0.0, step), (step, 0.0, 0.0))
    x, z, drive = (
        (at(0.8 + t, 0.02 + x, z) - at(0.8 - t, 0.02 - x, -z)) / (2.0 * step) for t, x, z in moves
    )
    covariance = np.diag([0.01, 0.05, 0.05]) ** 2 + 0.01**2 * np.outer(drive, drive)
    slopes = np.stack([x, z], axis=1)
    expected = np.linalg.inv(slopes.T @ np.linalg.solve(covariance, slopes))
    assert np.sqrt(np.linalg.eigvalsh(expected)[-1]) > 0.1 * sensed.largest
    # Differences of this step agree with the slopes to a thousandth.
    np.testing.assert_allclose(sensed.covariance[0], expected, rtol=1e-3)
    assert not sensed.stuck.any()
    assert not sensed.not_observable


def test_readings_that_no_force_explains_are_told(wrist):
    path = read(wrist, [0.4, 0.8], [0.02, 0.02])
    tip = path.tip_position.copy()
    noise = SensorNoise(tension=0.001, stroke=0.001, tip=0.01)
    good = sense(wrist, path.tension, path.stroke, tip=tip, noise=noise)
    assert not good.unexplained.any()
    tip[1, 2] += 1.0  # a hundred times the noise, where the force along x moves the tip sideways
    bad = sense(wrist, path.tension, path.stroke, tip=tip, noise=noise)
    assert bad.unexplained.tolist() == [False, True]
    assert "not explained" in str(bad)
    document = sensed_document(bad)
    assert [one["explained"] for one in document["readings"]] == [True, False]


@pytest.mark.nightly
def test_a_force_is_found_across_the_crease_where_a_contact_begins_to_slide():
    # Gauss-Newton steps stopped at the crease, with the interval beside the force.
    robot = nf.load_robot("two-axis-wrist")
    pulled = [
        0.20686388169386827,
        0.2637277633877365,
        0.3205916450816048,
        0.3774555267754731,
        0.43431940846934136,
        0.4911832901632096,
        0.548047171857078,
    ]
    tension = np.full((len(pulled), 4), 0.15)
    tension[:, 0] = pulled
    force = np.zeros((len(pulled), 3))
    force[-1, :2] = [-0.011813493902268758, -0.007339284233082442]
    external = tuple(nf.Load(tip_force=tuple(one)).external for one in force.tolist())
    path = nf.simulate(
        robot, nf.LoadPath(tension, np.full_like(tension, np.nan), external=external)
    ).raise_if_failed()
    sensed = sense(robot, path.tension, path.stroke, noise=EXACT, components="xy")
    assert not sensed.reason
    assert np.abs(sensed.force - force[:, :2]).max() < 1e-8
    assert ((sensed.low <= force[:, :2]) & (force[:, :2] <= sensed.high)).all()


def test_the_standard_deviation_is_that_of_repeated_readings(wrist):
    path = read(wrist, [0.3, 0.6, 0.8], [0.0, 0.01, 0.02])
    rng, found = np.random.default_rng(5), []
    for _ in range(60):
        noise = 0.01 * rng.normal(size=(2, 3, 1))
        drawn = (path.tension + noise[0], path.stroke + noise[1])
        readings = readings_of(wrist, *drawn, None, None, SensorNoise())
        model = SensingModel(wrist, readings, unknown_force(wrist, "x", "tip", None), 0.2)
        history = with_noise(estimate(model))
        found.append((history.best[-1].variables[0], np.linalg.norm(history.gain[-1])))
    forces, deviations = np.transpose(found)
    # The deviation of 60 draws is itself known to a tenth: three of its deviations.
    assert forces.std(ddof=1) == pytest.approx(deviations.mean(), rel=0.3)
    assert abs(forces.mean() - 0.02) < 3.0 * deviations.mean() / np.sqrt(60)


def test_readings_that_noise_explains_are_averaged():
    robot = nf.load_robot("pacheco2021-a")
    tension = [0.50, 0.51, 0.49, 0.80, 0.81, 0.50]
    stroke = [0.60, 0.61, 0.59, 0.98, 0.98, 0.98]
    made, group = merged(readings_of(robot, tension, stroke, None, None, SensorNoise()))
    assert group.tolist() == [0, 0, 0, 1, 1, 2]
    assert made.count.tolist() == [3.0, 2.0, 1.0]
    assert made.tension[:, 0] == pytest.approx([0.5, 0.805, 0.5])
    assert made.stroke[:, 0] == pytest.approx([0.6, 0.98, 0.98])
    _, apart = merged(readings_of(robot, tension, stroke, None, None, EXACT))
    assert apart.tolist() == [0, 1, 2, 3, 4, 5]


def test_holding_still_does_not_make_the_force_drift(wrist):
    # Noise that a model followed would pull the contacts to and fro, and the force with it.
    tensions = np.append(np.linspace(0.1, 0.8, 6), np.full(25, 0.8))
    forces = np.append(np.zeros(3), np.full(28, 0.02))
    path = read(wrist, tensions, forces)
    noise = 0.01 * np.random.default_rng(0).normal(size=(2, 31, 1))
    sensed = sense(wrist, path.tension + noise[0], path.stroke + noise[1])
    assert sensed.low[-1, 0] <= 0.02 <= sensed.high[-1, 0]
    assert abs(sensed.force[-1, 0] - 0.02) < 0.005
    assert sensed.deviation[-1, 0] < 0.5 * sensed.deviation[4, 0]
    assert len(sensed.path) < 12


def test_a_force_that_noise_could_explain_is_in_the_interval_of_its_own_reading(wrist):
    # Pulled, let go by a third, then touched at the held tension: the stroke changes by less than
    # three standard deviations of a difference, and both readings are averaged.
    tensions = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.0, 0.8, 0.8])
    forces = np.append(np.zeros(8), 0.03)
    path = read(wrist, tensions, forces)
    sensed = sense(wrist, path.tension, path.stroke)
    assert sensed.group[-1] == sensed.group[-2]
    assert ((sensed.low[:, 0] <= forces) & (forces <= sensed.high[:, 0])).all()
    assert ((sensed.low <= sensed.force) & (sensed.force <= sensed.high)).all()
    # The estimates are on their own sides of that of the mean.
    assert sensed.force[-2, 0] < 0.005 < 0.01 < sensed.force[-1, 0]
    # Finer sensors tell them apart.
    fine = sense(wrist, path.tension, path.stroke, noise=SensorNoise(tension=1e-3, stroke=1e-3))
    assert fine.group[-1] != fine.group[-2]
    assert fine.force[-1, 0] == pytest.approx(0.03, abs=2e-3)


def test_a_reading_alone_is_its_own_mean(wrist):
    readings = readings_of(wrist, [0.3, 0.6, 0.6], [0.37, 0.76, 0.77], None, None, SensorNoise())
    means, group = merged(readings)
    model = SensingModel(wrist, means, unknown_force(wrist, "x", "tip", None), 0.2)
    history = with_noise(estimate(model))
    (alone,), (first, second) = own_readings(history, readings, group)
    np.testing.assert_array_equal(alone.step.measured, history.steps[0].measured)
    assert not alone.extra.any()
    assert not alone.more.any()
    # Half the noise of one reading is in the mean of two, the other half is its own.
    one = first.step.noise + (first.step.driving * 2.0) @ (history.by_drive[1] ** 2).T
    assert first.extra == pytest.approx(0.5 * np.diag(one))
    assert first.step.measured - means.stroke[1] == pytest.approx([-0.005])
    assert second.step.measured - means.stroke[1] == pytest.approx([0.005])
    assert (first.part, second.part) == (0.0, 0.0)


@pytest.mark.nightly
def test_intervals_hold_while_a_force_changes_at_a_held_tension(wrist):
    holds = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        tensions = np.array([0.4, 0.8, 1.1, *([0.8] * 5)])
        forces = np.zeros(8)
        forces[-int(rng.integers(1, 5)) :] = rng.uniform(-0.03, 0.03)
        path = read(wrist, tensions, forces)
        noise = 0.01 * rng.normal(size=(2, 8, 1))
        sensed = sense(wrist, path.tension + noise[0], path.stroke + noise[1])
        inside = (sensed.low[:, 0] <= forces) & (forces <= sensed.high[:, 0])
        holds += inside[forces != 0.0].tolist()
    assert np.mean(holds) > 0.9


def test_contact_is_shown_by_a_force_and_not_by_noise(wrist):
    tensions = np.linspace(0.2, 0.8, 7)
    path = read(wrist, tensions, [0.0] * 4 + [0.03] * 3)
    noise = 0.01 * np.random.default_rng(0).normal(size=(2, 7, 1))
    sensed = sense(wrist, path.tension + noise[0], path.stroke + noise[1])
    assert sensed.contact.tolist() == [False] * 4 + [True] * 3
    assert (sensed.contact_probability[:4] > 0.05).all()


def test_the_place_is_found_where_angles_tell_it(wrist):
    load = nf.Load(tension=0.5, body_forces=[nf.BodyForce(3, (0.05, 0.0, 0.0))])
    state = nf.solve(wrist, load)
    fine = SensorNoise(angle=1e-4)
    sensed = sense(
        wrist, [0.5], state.stroke[None], angles=state.notch_angle[None], noise=fine, place="search"
    )
    assert sensed.place == 3
    assert sensed.other_places == []
    assert sensed.force[-1, 0] == pytest.approx(0.05, abs=1e-6)
    # Tension and stroke of one tendon fit a force on any body.
    blind = sense(wrist, [0.5], state.stroke[None], place="search", largest=2.0)
    assert len(blind.other_places) == wrist.number_of_notches
    assert any("place" in text for text in blind.not_observable)


def test_known_loads_are_taken_into_account(wrist):
    path = read(wrist, [0.3, 0.6], [0.0, 0.02], tip_mass=2.0, gravity=(9.81, 0.0, 0.0))
    known = nf.Load(tip_mass=2.0, gravity=(9.81, 0.0, 0.0))
    sensed = sense(wrist, path.tension, path.stroke, noise=EXACT, known=known)
    assert sensed.force[:, 0] == pytest.approx([0.0, 0.02], abs=1e-6)
    ignored = sense(wrist, path.tension, path.stroke, noise=EXACT)
    assert ignored.force[0, 0] > 0.01


@pytest.mark.nightly
def test_a_stroke_drives_where_no_tension_was_measured(wrist):
    path = read(wrist, [0.3, 0.6], [0.01, 0.02])
    sensed = sense(wrist, None, path.stroke, tip=path.tip_position, noise=EXACT, largest=0.1)
    assert sensed.force[:, 0] == pytest.approx([0.01, 0.02], abs=1e-6)


def test_the_stroke_of_a_slack_tendon_is_not_compared():
    robot = nf.load_robot("liu2022")
    readings = readings_of(robot, [[2.0, 0.0]], [[1.0, 0.0]], None, None, SensorNoise())
    assert np.isfinite(readings.read["stroke"]).tolist() == [[True, False]]


def test_without_an_equilibrium_the_result_ends_and_says_why(wrist):
    path = read(wrist, [0.2, 0.4], [0.0, 0.0])
    tension = np.append(path.tension[:, 0], np.nan)
    stroke = np.append(path.stroke[:, 0], 50.0)  # more than closed notches allow
    sensed = sense(wrist, tension, stroke)
    assert sensed.converged.tolist() == [True, True, False]
    assert sensed.reason.startswith("reading 3 of 3: ")
    assert np.isnan(sensed.force[2]).all()
    with pytest.raises(nf.ConvergenceError):
        sensed.raise_if_failed()
    assert sensed_document(sensed)["readings"][2]["converged"] is False


BAD = {
    "text": ("WRONG_TYPE", {"tensions": "0.5"}),
    "objects": ("WRONG_TYPE", {"strokes": [object()]}),
    "infinite": ("NOT_FINITE", {"strokes": [np.inf]}),
    "two tendons": ("WRONG_SHAPE", {"tensions": [[0.5, 0.5]]}),
    "lengths": ("WRONG_SHAPE", {"tensions": [0.5, 0.6]}),
    "empty": ("NO_DATA", {"tensions": [], "strokes": []}),
    "neither": ("MISSING_VALUE", {"tensions": [np.nan], "strokes": [np.nan]}),
    "tension alone": ("TOO_FEW_DATA", {"strokes": None}),
    "slack": ("TOO_FEW_DATA", {"tensions": [0.0]}),
    "negative noise": ("OUT_OF_RANGE", {"noise": -1.0}),
    "noise": ("WRONG_TYPE", {"noise": 0.01}),
    "axis": ("UNKNOWN_NAME", {"components": "q"}),
    "twice": ("UNKNOWN_NAME", {"components": "xx"}),
    "number of axes": ("UNKNOWN_NAME", {"components": 3}),
    "no such body": ("OUT_OF_RANGE", {"place": 9}),
    "base": ("OUT_OF_RANGE", {"place": 0}),
    "no such place": ("UNKNOWN_NAME", {"place": "middle"}),
    "half a body": ("WRONG_TYPE", {"place": 1.5}),
    "known": ("WRONG_TYPE", {"known": 3}),
    "largest": ("OUT_OF_RANGE", {"largest": 0.0}),
    "not a number": ("OUT_OF_RANGE", {"largest": np.nan}),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_has_a_code(wrist, case):
    code, change = BAD[case]
    given = {"tensions": [0.5], "strokes": [0.6]} | change
    with refused(code):
        if given.get("noise") == -1.0:
            given["noise"] = SensorNoise(stroke=-1.0)
        sense(wrist, given.pop("tensions"), given.pop("strokes"), **given)
