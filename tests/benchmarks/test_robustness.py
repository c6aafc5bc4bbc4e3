"""A small draw of the fuzz: nothing silent, nothing wrong, reasons for what is not solved."""

from __future__ import annotations

import sys
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


@pytest.fixture(scope="module")
def robustness():
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are no part of this installation")
    sys.path.insert(0, str(FOLDER))
    yield __import__("robustness")
    sys.path.remove(str(FOLDER))


@pytest.mark.nightly
@pytest.mark.parametrize("number", NUMBERS)
def test_a_draw_is_solved_or_says_why(robustness, number):
    follow_draws(robustness, __import__("shapes").SHAPES, number)


@pytest.mark.nightly
@pytest.mark.parametrize("number", DRAWN)
def test_a_draw_as_the_tube_makes_it_is_solved_or_says_why(robustness, number):
    follow_draws(robustness, __import__("shapes").DRAWN, number)


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
    assert __import__("judge").wrong(robot, load, path) == []


def test_faces_turn_less_by_what_bends_beyond_them(robustness, margin):
    """Exactly so, whatever sideways bending and twist there is between the faces."""
    edge_angle = __import__("arcs").edge_angle
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
    pieces, shape = __import__("robustness_pieces"), __import__("shapes").SHAPES[0]
    draws = [__import__("draw").draw(16 * one, 7, shape) for one in range(9)]
    chosen = pieces.Chosen(7, 0, 16 * 9, False, shape.name)
    assert [number for _, number in chosen.numbers] == [one.number for one in draws]
    folder = pieces.PieceFolder(tmp_path / "draws")
    found = pieces.followed(chosen, folder)
    wanted = [state for one in draws for state in robustness.follow(one)]
    assert [(one.number, one.step, bool(one.reason)) for one in found[shape.name]] == [
        (one.number, one.step, bool(one.reason)) for one in wanted
    ]
    before = digests(tmp_path)
    assert len(before) == 4
    (tmp_path / "draws" / "pieces" / "piece-000000001.parquet").unlink()
    pieces.followed(chosen, folder)
    assert digests(tmp_path) == before
    with pytest.raises(nf.InputError) as caught:
        pieces.followed(chosen._replace(seed=8), folder)
    assert caught.value.code.name == "CONFLICT"


def follow_draws(robustness, shapes, number):
    """Follow two draws of a shape."""
    draw = __import__("draw")
    for row in range(2):
        one = draw.draw(number + row * len(shapes), 7, shapes[number])
        for outcome in robustness.follow(one):
            assert not outcome.silent
            assert not outcome.wrong
            assert outcome.reason == "" or len(outcome.reason) > 20
