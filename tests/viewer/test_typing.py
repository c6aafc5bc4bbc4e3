"""Numbers that are typed while the solver thread shows the current ones."""

import threading
import time
from types import SimpleNamespace

import pytest

from notchflex.viewer.page import Input, Slider
from notchflex.viewer.tasks import PAUSE, Tasks


class Handle:
    """The part of viser's handles that the page uses; `arrive` is a message from a browser."""

    def __init__(self, *numbers):
        self.value = numbers[-1]

    def on_update(self, callback):
        self.callback = callback

    def run_callback(self):
        with pytest.raises(StopIteration):
            self.callback(SimpleNamespace(client=object())).send(None)


@pytest.fixture
def viewer():
    gui = SimpleNamespace(add_slider=lambda label, *numbers: Handle(*numbers))
    held = []
    return SimpleNamespace(
        server=SimpleNamespace(gui=gui),
        tasks=Tasks(),
        targets=SimpleNamespace(hold=held.append),
        reach=SimpleNamespace(ends=lambda number, by: (0.0, 10.0)),
        session=SimpleNamespace(controls=SimpleNamespace(by=("tension",) * 5)),
        held=held,
    )


@pytest.fixture(params=["slider", "field"])
def control(request, viewer):
    viewer.done = []
    viewer.set = lambda number, value, by: viewer.done.append(value)
    if request.param == "slider":
        return Slider(viewer, 0, "tension")
    return Input(viewer, Handle(0.0), viewer.done.append, PAUSE)


def test_a_number_that_arrived_is_not_overwritten_before_its_callback_has_run(viewer, control):
    control.put(2.0)
    handle = control.handle
    assert handle.value == 2.0
    handle.value = 7.0  # viser sets it first and runs the callback later
    control.put(2.0)  # the solver thread shows what it last solved
    assert handle.value == 7.0
    handle.run_callback()
    control.put(2.0)  # the typed number waits for its pause
    assert handle.value == 7.0
    viewer.tasks.take(timeout=2.0)()
    assert viewer.done == [7.0]
    control.put(7.0)
    control.put(3.0)  # and then the page follows the robot again
    assert handle.value == 3.0


def test_a_jump_of_a_slider_holds_the_robot_at_once(viewer):
    slider = Slider(viewer, 4, "tension")
    for value, held in ((0.1, []), (5.0, [4])):
        slider.handle.value = value
        slider.handle.run_callback()
        assert viewer.held == held


def test_a_slow_hold_does_not_drop_the_number_that_was_typed(viewer):
    """The event loop may be slow: the solver must not take the number before the robot holds."""
    order = []
    viewer.set = lambda *_: order.append("set")
    slider = Slider(viewer, 0, "tension")
    solver = threading.Thread(target=lambda: viewer.tasks.take(timeout=10.0)())

    def slow_hold(number):
        solver.start()
        time.sleep(1.5 * PAUSE)
        order.append("held")

    viewer.targets.hold = slow_hold
    slider.handle.value = 5.0
    slider.handle.run_callback()
    solver.join(20.0)
    assert order == ["held", "set"]
