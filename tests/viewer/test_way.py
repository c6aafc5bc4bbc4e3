"""Settings that come faster than they are solved: none that turns back is lost."""

import numpy as np

from notchflex.viewer import Controls, Way

REST = Controls(("tension", "tension"), (0.0, 0.0))
STRIDE = np.array([0.5, 0.5, 0.1, 0.1, 0.1, 5.0])


def steps(way):
    found = []
    while (one := way.next()) is not None:
        found.append(one)
    return found


def test_a_long_way_is_gone_in_equal_steps():
    way = Way(REST, STRIDE)
    way.add(REST.with_tendon(0, "tension", 2.0))
    assert [one.value for one in steps(way)] == [(0.5, 0.0), (1.0, 0.0), (1.5, 0.0), (2.0, 0.0)]
    assert way.here == way.end == REST.with_tendon(0, "tension", 2.0)
    assert way.next() is None


def test_a_slider_pushed_up_and_back_has_been_up():
    way = Way(REST, STRIDE)
    for value in (0.3, 1.0, 2.0, 1.2, 0.4):
        way.add(REST.with_tendon(0, "tension", value))
    assert len(way) == 2  # up, and down
    values = [one.value[0] for one in steps(way)]
    assert max(values) == 2.0
    assert values[-1] == 0.4
    turn = values.index(2.0)
    assert values[:turn] == sorted(values[:turn])
    assert values[turn:] == sorted(values[turn:], reverse=True)


def test_sliders_moved_one_after_the_other_are_moved_in_that_order():
    way = Way(REST, STRIDE)
    first = REST.with_tendon(0, "tension", 1.0)
    way.add(first)
    way.add(first.with_tendon(1, "tension", 1.0))
    assert [one.value for one in steps(way)] == [(0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0)]


def test_another_kind_of_command_is_one_step():
    way = Way(REST, STRIDE)
    way.add(REST.with_tendon(0, "stroke", 3.0))
    assert [one.by[0] for one in steps(way)] == ["stroke"]


def test_clearing_leaves_nothing_ahead():
    way = Way(REST, STRIDE)
    way.add(REST.with_tendon(0, "tension", 2.0))
    way.next()
    way.clear(REST)
    assert way.next() is None
    assert way.here == REST
    way.add(REST)
    assert len(way) == 0
