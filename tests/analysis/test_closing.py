"""When notches close: a tension at which the solver fails costs a trial, not the answer."""

from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.closing_loads import closing_tensions, closing_tensions_of

YORK = nf.load_robot("york2015")


@pytest.mark.parametrize("modulus", [40000.0, 30000.0])
def test_every_notch_of_york_closes(modulus):
    """One unconverged solve made the whole search NaN, shown as "never"."""
    robot = YORK.with_value("material.elastic_modulus", modulus)
    found = nf.closing(robot)
    assert list(found.status) == ["closes"] * 5
    tensions = found.tension[:, None] * (1.0 + np.array([-1e-9, 1e-9]))
    path = nf.solve_each(robot, [nf.Load(tension=float(one)) for one in tensions.ravel()])
    assert path.converged.all()
    closed = path.closed[:, :].reshape(5, 2, 5)
    assert [closed[number, :, number].tolist() for number in range(5)] == [[False, True]] * 5


@pytest.mark.parametrize("notch", range(5))
def test_the_solver_passes_where_lips_just_meet(notch):
    """A gap that was a rounding error held up every step at itself, over 2e-8 N of tension."""
    tension = nf.closing(YORK).tension[notch] + np.linspace(-3e-8, 3e-8, 41)
    path = nf.solve_each(YORK, [nf.Load(tension=float(one)) for one in tension])
    assert path.converged.all()
    assert path.iterations.max() <= 12  # 730 and more


def overlap_of(roots, failing):
    """Overlaps that rise through zero at given tensions, with a kink, and NaN where it fails."""

    def overlap(tension, _asked):
        rise = tension - roots
        value = np.where(rise > 0.0, 5.0 * rise, 0.2 * rise)
        bad = np.zeros(len(tension), bool)
        for low, high in failing:
            bad |= (tension >= low) & (tension <= high)
        return np.where(bad, np.nan, value)

    return overlap


@pytest.mark.parametrize(
    "failing",
    [
        [],
        [(0.9, 1.05)],  # just below some roots
        [(1.0001, 1.02), (2.5, 2.9)],
        [(4.0, 1e9)],  # the robot bears no more
        [(1.1001, 1e9)],  # it fails as soon as the last notch has closed
    ],
)
def test_failures_beside_a_closing_cost_a_trial(failing):
    roots = np.array([0.3, 0.85, 1.0999999])
    tension, status = closing_tensions(overlap_of(roots, failing), np.array([0.2, 4.5, 1.0]))
    assert list(status) == ["closes"] * 3
    assert tension == pytest.approx(roots, rel=1e-10)


def test_what_is_not_found_is_told_from_never():
    roots = np.array([1.0, 1000.0, 2.0, 1000.0])
    own = np.array([False, False, False, True])

    def overlap(tension, _asked):
        # The third fails around its root, the last from 20 N on.
        value = overlap_of(roots, [])(tension, None)
        around = (np.abs(tension - 2.0) < 0.5) & (roots == 2.0)
        return np.where(around | (own & (tension > 20.0)), np.nan, value)

    tension, status = closing_tensions(overlap, np.ones(4))
    assert list(status) == ["closes", "never", "not found", "not found"]
    assert np.isfinite(tension).tolist() == [True, False, False, False]


def test_slots_that_never_close_and_those_that_do():
    found = nf.closing(nf.load_robot("gao2017"))
    assert found.status[0] == "never"
    assert found.status[1] == "closes"
    assert (np.isfinite(found.tension) == (found.status == "closes")).all()


def test_kinks_and_jumps_of_any_size_are_found():
    """A slope that differs beyond the root by a factor of three cost 100 trials, and the root."""
    random = np.random.default_rng(2)
    roots = random.uniform(0.1, 50.0, 500)
    below, above = 10.0 ** random.uniform(-4.0, 4.0, (2, 500))
    jump = np.where(random.random(500) < 0.2, random.uniform(0.01, 2.0, 500), 0.0)

    def overlap(tension, _asked):
        rise = tension - roots
        return np.where(rise > 0.0, above * rise + jump, below * rise)

    tension, status = closing_tensions(overlap, np.ones(500))
    assert set(status) == {"closes"}
    assert tension == pytest.approx(roots, rel=1e-10)


WRIST = nf.load_robot("pacheco2021-a")


@pytest.mark.parametrize(
    ("depth", "radius", "tube"),
    [(1.5, 0.3, WRIST.tube), (2.16, 1.1, nf.Tube(2.4, 2.2))],
    ids=["lever", "thin wall"],
)
def test_every_notch_of_these_wrists_closes(depth, radius, tube):
    """One tension each was not found, and shown as NaN."""
    robot = WRIST.replace(
        tube=tube,
        notch=tuple(replace(notch, depth=depth) for notch in WRIST.notch),
        tendon=(nf.Tendon(radius),),
    )
    found = nf.closing(robot)
    assert list(found.status) == ["closes"] * 5
    beside = found.tension[:, None] * (1.0 + np.array([-1e-9, 1e-9]))
    path = nf.solve_each(robot, [nf.Load(tension=float(one)) for one in beside.ravel()])
    closed = path.closed.reshape(5, 2, 5)
    assert [closed[number, :, number].tolist() for number in range(5)] == [[False, True]] * 5


def test_closings_of_many_robots_are_those_of_each(wrist):
    """A depth over which the first notch closes first or last."""
    depth = wrist.notches[0].depth * np.linspace(0.985, 1.015, 300)
    friction = 0.13 * (1.0 + 0.2 * np.sin(np.arange(300)))
    numbers = {"notch[1].depth": depth, "friction.coefficient": friction}
    found = closing_tensions_of(wrist, numbers)
    for row in range(0, 300, 50):
        robot = wrist.with_values({name: one[row] for name, one in numbers.items()})
        assert found[row] == pytest.approx(nf.closing(robot).tension, rel=1e-8)
    assert (found.argmin(axis=1) != found[0].argmin()).any()


def test_closings_of_few_robots_are_found_one_by_one():
    numbers = {"notch[1].depth": YORK.notches[0].depth * np.array([0.99, 1.0, 9.0])}
    found = closing_tensions_of(YORK, numbers)
    assert np.isnan(found[2]).all()  # no robot has such a depth
    assert found[1] == pytest.approx(nf.closing(YORK).tension, rel=1e-9)
    assert found[0, 0] > found[1, 0]
