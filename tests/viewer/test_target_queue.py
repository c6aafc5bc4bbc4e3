"""The way of the robot to its settings: in small steps, and turned at once by a new one."""

from dataclasses import replace

import numpy as np

from notchflex.viewer import Controls, TargetQueue

REST = Controls(("tension", "tension"), (0.0, 0.0))
STRIDE = np.array([0.5, 0.5, 0.1, 0.1, 0.1, 5.0])


def steps(way):
    found = []
    while (one := way.next()) is not None:
        found.append(one)
    return found


def test_a_long_way_is_gone_in_equal_steps():
    way = TargetQueue(REST, STRIDE)
    way.add(REST.with_tendon(0, "tension", 2.0))
    assert [one.value for one in steps(way)] == [(0.5, 0.0), (1.0, 0.0), (1.5, 0.0), (2.0, 0.0)]
    assert way.here == way.end == REST.with_tendon(0, "tension", 2.0)
    assert way.next() is None


def values(way, tendon=0):
    return [round(one.value[tendon], 12) for one in steps(way)]


def test_a_number_set_anew_is_obeyed_from_where_the_robot_is():
    way = TargetQueue(REST, STRIDE)
    way.set_number(0, 3.0)
    assert way.next().value == (0.5, 0.0)
    assert way.next().value == (1.0, 0.0)
    way.set_number(0, 0.2)
    assert len(way) == 1
    assert values(way) == [0.5, 0.2]
    assert way.here.value == (0.2, 0.0)


def test_a_number_set_anew_leaves_the_goals_of_others_in_their_order():
    way = TargetQueue(REST, STRIDE)
    way.set_number(0, 3.0)
    assert way.next().value == (0.5, 0.0)
    way.set_number(1, 1.0)
    way.set_number(0, 0.0)
    assert [one.value for one in steps(way)] == [(0.5, 0.5), (0.5, 1.0), (0.0, 1.0)]


def test_numbers_set_one_after_the_other_are_reached_in_that_order():
    way = TargetQueue(REST, STRIDE)
    way.set_number(0, 1.0)
    way.set_number(1, 1.0)
    assert [one.value for one in steps(way)] == [(0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0)]


def test_a_number_that_is_held_stays_and_a_cycle_of_it_is_dropped():
    way = TargetQueue(REST, STRIDE)
    for value in (0.0, 2.0, 0.0):
        way.add(way.end.with_tendon(0, "tension", value))
    assert way.next().value == (0.5, 0.0)
    way.hold(0)
    assert way.next() is None
    assert way.here.value == (0.5, 0.0)


def test_a_way_goes_on_from_elsewhere_but_not_by_another_command():
    way = TargetQueue(REST, STRIDE)
    way.set_number(0, 2.0)
    other = replace(REST, pointing="down")
    way.restart(other)
    assert way.end == other.with_tendon(0, "tension", 2.0)
    way.restart(REST.with_tendon(0, "stroke", 0.3))
    assert way.next() is None


def test_another_kind_of_command_is_one_step():
    way = TargetQueue(REST, STRIDE)
    way.add(REST.with_tendon(0, "stroke", 3.0))
    assert [one.by[0] for one in steps(way)] == ["stroke"]


def test_clearing_leaves_nothing_ahead():
    way = TargetQueue(REST, STRIDE)
    way.add(REST.with_tendon(0, "tension", 2.0))
    way.next()
    way.clear(REST)
    assert way.next() is None
    assert way.here == REST
    way.add(REST)
    assert len(way) == 0
