"""Numbers that are typed while the solver thread shows the current ones."""

import threading
import time
from types import SimpleNamespace

import pytest

from notchflex.viewer.page.folders import NumberField, Slider
from notchflex.viewer.tasks import PAUSE, Tasks


class Handle:
    """The part of viser's handles that the page uses; `arrive` is a message from a browser."""

    def __init__(self, *numbers):
        low, high, step, value = numbers if len(numbers) > 1 else (0.0, 10.0, 0.1, *numbers)
        self.min, self.max, self.step, self.value = low, high, step, value

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
        held=held,
    )


@pytest.fixture(params=["slider", "field"])
def control(request, viewer):
    viewer.set = []
    if request.param == "slider":
        return Slider(viewer, 0, "tension [N]", (0.0, 10.0), viewer.set.append)
    return NumberField(viewer, Handle(0.0), ("field", "name"), viewer.set.append)


def test_a_number_that_arrived_is_not_overwritten_before_its_callback_has_run(viewer, control):
    control.put(2.0)
    handle = control._handle
    assert handle.value == 2.0
    handle.value = 7.0  # viser sets it first and runs the callback later
    control.put(2.0)  # the solver thread shows what it last solved
    assert handle.value == 7.0
    handle.run_callback()
    control.put(2.0)  # the typed number waits for its pause
    assert handle.value == 7.0
    viewer.tasks.take(timeout=2.0)()
    assert viewer.set == [7.0]
    control.put(7.0)
    control.put(3.0)  # and then the page follows the robot again
    assert handle.value == 3.0


def test_a_jump_of_a_slider_holds_the_robot_at_once(viewer):
    slider = Slider(viewer, 4, "tension [N]", (0.0, 10.0), [].append)
    for value, held in ((0.1, []), (5.0, [4])):
        slider._handle.value = value
        slider._handle.run_callback()
        assert viewer.held == held


def test_a_slow_hold_does_not_drop_the_number_that_was_typed(viewer):
    """The event loop may be slow: the solver must not take the number before the robot holds."""
    order = []
    slider = Slider(viewer, 0, "tension [N]", (0.0, 10.0), lambda _: order.append("set"))
    solver = threading.Thread(target=lambda: viewer.tasks.take(timeout=10.0)())

    def slow_hold(number):
        solver.start()
        time.sleep(1.5 * PAUSE)
        order.append("held")

    viewer.targets.hold = slow_hold
    slider._handle.value = 5.0
    slider._handle.run_callback()
    solver.join(20.0)
    assert order == ["held", "set"]
