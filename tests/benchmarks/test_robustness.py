"""A small draw of the fuzz: nothing silent, nothing wrong, reasons for what is not solved."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf
from swept import digests

FOLDER = Path(__file__).parents[2] / "benchmarks"
# One shape of each kind of notch, friction and load; all of them are drawn by the benchmark.
NUMBERS = (0, 1, *(pytest.param(one, marks=pytest.mark.nightly) for one in (2, 5, 8)))
DRAWN = (1, 2)  # with hysteresis; linear under loads in the plane
FORM = 0


@pytest.fixture(scope="module")
def robustness():
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are no part of this installation")
    sys.path.insert(0, str(FOLDER))
    yield import_module("robustness")
    sys.path.remove(str(FOLDER))


@pytest.mark.nightly
@pytest.mark.parametrize("number", NUMBERS)
def test_a_draw_is_solved_or_says_why(robustness, number):
    follow_draws(robustness, "shapes", number)


@pytest.mark.nightly
@pytest.mark.parametrize("number", DRAWN)
def test_a_draw_as_the_tube_makes_it_is_solved_or_says_why(robustness, number):
    follow_draws(robustness, "drawn", number)


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::notchflex.errors.InputWarning")  # unusual robots on purpose
def test_a_draw_of_a_form_is_solved_or_says_why(robustness):
    follow_draws(robustness, "forms", FORM)


@pytest.mark.nightly
def test_a_result_with_one_wrong_quantity_is_found(robustness):
    assert not robustness.CHECKS["spoiled"](1, 1)


@pytest.mark.nightly
def test_edges_of_a_notch_that_also_twists_are_where_they_are_seen(robustness):
    """The edge angle lacks bending of the rings, no part of notch angle less precurvature."""
    wrist = nf.load_robot("pacheco2021-a-true")
    robot = wrist.replace(
        notch=wrist.notches[:1],
        tendon=[nf.Tendon(0.7, path="straight")],
        friction=nf.Frictionless(),
        material=nf.Linear(60_000.0, poisson_ratio=0.33),
    )
    load = nf.Load(tension=1.0, tip_force=(0.0, 1.0, 0.0), tip_moment=(0.0, 0.0, 1.0))
    path = nf.simulate(robot, load).raise_if_failed()
    assert import_module("random_robots.judge").wrong(robot, load, path) == []


def test_faces_turn_less_by_what_bends_beyond_them(robustness, margin):
    """Exactly so, whatever sideways bending and twist there is between the faces."""
    edge_angle = import_module("random_robots.arcs").edge_angle
    beyond = 0.03
    rng = np.random.default_rng(3)
    for faces in Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (8, 3))):
        half = Rotation.from_rotvec([0.0, 0.5 * beyond, 0.0])
        turn = (half * faces * half).as_matrix()
        seen = edge_angle(faces.as_matrix(), 0.0)
        margin.within("turned back", edge_angle(turn, beyond) - seen, 1e-14, "rad")
        margin.within("difference", edge_angle(turn, 0.0) - beyond - seen, 1e-14, "rad")


@pytest.mark.nightly
def test_draws_in_pieces_are_those_without(robustness, tmp_path):
    """A lost piece is made again, with the same bytes; other draws are refused."""
    pytest.importorskip("polars")
    chosen = robustness.Chosen("shapes", 7, 0, 16 * 9, "wrist", "none")
    assert chosen.numbers == [16 * one for one in range(9)]
    folder = robustness.PieceFolder(tmp_path / "draws")

    def told(draws):
        return [
            (form, one.number, one.step, bool(one.reason))
            for form, outcomes in draws
            for one in outcomes
        ]

    wanted = told(robustness.judged(chosen, number) for number in chosen.numbers)
    assert told(robustness.in_pieces(chosen, folder)) == wanted
    before = digests(tmp_path)
    assert len(before) == 4
    (tmp_path / "draws" / "pieces" / "piece-000000001.parquet").unlink()
    assert told(robustness.in_pieces(chosen, folder)) == wanted
    assert digests(tmp_path) == before
    with pytest.raises(nf.InputError) as caught:
        list(robustness.in_pieces(chosen._replace(seed=8), folder))
    assert caught.value.code.name == "CONFLICT"


def follow_draws(robustness, robots, number):
    """Follow two draws of a shape or form, and solve them in one more way."""
    chosen = robustness.Chosen(robots, 7, 0, 64, None, None)
    for draw in [one for one in chosen.numbers if chosen.place(one) == number][:2]:
        for outcome in robustness.judged(chosen, draw)[1]:
            assert not outcome.silent
            assert not outcome.wrong
            assert outcome.reason == "" or len(outcome.reason) > 20
