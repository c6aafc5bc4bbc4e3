"""What steers the tip and what is sensed, without a browser."""

import threading
import time

import numpy as np
import pytest

import notchflex as nf
from notchflex.viewer.controls import STROKE, reach_of
from notchflex.viewer.overlays import NOISE, Background, intervals, read, turning_points
from notchflex.viewer.session import Session, steer


@pytest.fixture(scope="module")
def ends():
    return reach_of(nf.load_robot("pacheco2021-a"))


def test_the_tip_goes_to_places_of_both_branches(ends):
    """Each place needs another tension on the way back."""
    wrist = nf.load_robot("pacheco2021-a")
    session = Session(wrist)
    path = nf.simulate(wrist, nf.pull(0.3, 1.5, steps=4).release())
    for number, tip in enumerate(path.tip_position):
        controls, error = steer(session, ends, tip)
        assert error <= 1e-3
        assert not session.go(controls)
        assert session.controls.value[0] == pytest.approx(path.tension[number, 0], abs=2e-3)


def test_a_place_out_of_reach_is_approached_within_the_slider(ends):
    session = Session(nf.load_robot("pacheco2021-a"))
    controls, error = steer(session, ends, np.array([60.0, 0.0, 0.0]))
    assert 0.0 <= controls.value[0] <= ends.tension[0]
    assert not session.go(controls)
    assert session.state.tip_position[0] > 3.0
    assert error > 40.0


@pytest.mark.nightly
def test_strokes_are_driven_where_no_tension_is_given(ends):
    wrist = nf.load_robot("pacheco2021-a")
    session = Session(wrist)
    session.go(session.controls.with_tendon(0, STROKE, 0.2))
    tip = nf.solve(wrist, nf.Load(stroke=0.9)).tip_position
    controls, _ = steer(session, ends, tip)
    assert controls.by == (STROKE,)
    assert controls.value[0] == pytest.approx(0.9, abs=1e-3)


@pytest.mark.nightly
def test_a_tube_that_lies_on_its_side_is_steered_in_the_world(ends):
    session = Session(nf.load_robot("pacheco2021-a"), "sideways")
    controls = session.controls.with_numbers([0.9, 0.0, 0.0, 0.0, 1.0])  # a weight
    assert not session.go(controls)
    tip = np.array(session.state.tip_position)
    again = Session(session.robot, "sideways")
    again.go(again.controls.with_numbers([0.0, 0.0, 0.0, 0.0, 1.0]))
    assert steer(again, ends, tip)[0].value[0] == pytest.approx(0.9, abs=2e-3)


def test_turns_of_tension_and_stroke_are_read():
    rows = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [1.5, 2.0], [1.0, 1.0], [1.0, 1.2]])
    assert turning_points(rows).tolist() == [2, 3, 4, 5]
    session = Session(nf.load_robot("pacheco2021-a"))
    assert len(read(session.history)[0]) == 0  # at rest there is nothing to sense by


@pytest.mark.nightly
def test_the_interval_holds_the_force_of_the_slider():
    session = Session(nf.load_robot("pacheco2021-a"))
    for numbers in ([0.6], [1.2], [0.8], [0.8, 0.015], [0.8, 0.03]):
        full = [*numbers, 0.0, 0.0, 0.0, 0.0][:5]
        assert not session.go(session.controls.with_numbers(full))
    found = nf.sense(session.robot, *read(session.history), noise=NOISE, known=nf.Load())
    assert found.contact[-1]
    low, high = intervals(found, np.zeros(3), 1.0)[0]
    assert low[0] < 0.03 < high[0]
    assert low[1:].tolist() == high[1:].tolist()


def test_the_last_request_counts():
    tasks, done, gate = [], [], threading.Event()
    background = Background(tasks.append)

    def work(number):
        gate.wait(10.0)
        return number

    for number in range(4):
        background.request(number, lambda number=number: work(number), done.append)
        while number == 0 and not background._last.running():
            time.sleep(0.001)
    gate.set()
    end = time.monotonic() + 10.0
    while len(tasks) < 4 and time.monotonic() < end:
        time.sleep(0.001)
    for task in tasks:
        task()
    assert done == [3]


def test_what_goes_wrong_beside_is_raised_by_the_solver_thread():
    tasks = []
    Background(tasks.append).request(1, lambda: 1 / 0, lambda one: None)
    end = time.monotonic() + 10.0
    while not tasks and time.monotonic() < end:
        time.sleep(0.001)
    with pytest.raises(ZeroDivisionError):
        tasks[0]()
