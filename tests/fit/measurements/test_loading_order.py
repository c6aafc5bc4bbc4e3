"""What the order of rows says: pulls from rest, repeats, loading paths, and what is unclear."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import read_measurements
from notchflex.fit.measurements.loading_order import branches, loading_order
from refusals import refused

UP, DOWN = [0.0, 1.0, 2.0, 3.0], [2.0, 1.0, 0.0]
LOOP = [*UP, *DOWN]


def order(values, labels=None):
    return loading_order([("force", np.array(values, float))], labels, len(values))


@pytest.mark.parametrize(
    ("values", "pulls"),
    [
        (UP, "1111"),
        ([0.7], "1"),
        ([1.0, 1.0, 1.0], "111"),
        (UP + UP, "11112222"),
        ([0.4, 1.0, 1.6] * 3, "111222333"),
        ([-0.01, 1.0, 2.0, 0.02, 0.9, 2.1], "111222"),
        ([2.0, 2.5, 3.0, 2.0, 2.6, 2.9], "111222"),
        ([*UP, 0.0], "11111"),  # the free robot again
        ([0.0, 3.0, 0.0, 2.0, 0.0], "11111"),
        ([0.0, 1.0, 2.0, 1.97, 3.0], "11111"),  # noise of a gauge
        ([0.0, 1.0, 2.0, 2.0, 1.8, 3.0], "111111"),
    ],
)
def test_rising_commands_are_pulls_from_rest(values, pulls):
    found = order(values)
    assert found.from_rest
    assert found.unclear is None
    assert "".join(found.pull) == pulls
    assert ("begins again" in found.words) == (len(set(pulls)) > 1)


@pytest.mark.parametrize(
    ("values", "pulls"),
    [
        (LOOP, "1111111"),
        ([*UP, 3.0, *DOWN], "11111111"),  # the peak twice
        (LOOP + LOOP[1:], "1" * 13),
        ([0.0, 1.5, 3.0, 1.5, 0.0], "11111"),
        ([*UP, 2.0, 1.0, 2.0, 3.0], "1" * 8),  # a minor loop
        ([*UP, 2.6, 2.2, 2.6, 3.0], "1" * 8),
        ([3.0, *DOWN], "1111"),  # unloading only
        (UP + LOOP, "1111" + "2222222"),
    ],
)
def test_commands_that_fall_step_by_step_are_a_path(values, pulls):
    found = order(values)
    assert not found.from_rest
    assert "".join(found.pull) == pulls
    assert "--from-rest" in found.words


@pytest.mark.parametrize(
    ("values", "row"),
    [
        ([1.0, 3.0, 2.0, 4.0], 2),
        ([2.0, 0.1, 3.0, 1.2, 0.7, 2.4], 1),
        ([*UP, 1.5], 4),
        ([0.5, 1.0, 2.0, 3.0, 0.5], 4),  # unloaded at once, or the next pull
        ([0.5, 1.0, 0.5, 1.0], 2),
    ],
)
def test_other_orders_are_unclear(values, row):
    assert order(values).unclear[0] == row


def test_shuffled_readings_are_unclear():
    random = np.random.default_rng(1)
    for _ in range(50):
        assert order(random.permutation(np.linspace(0.1, 2.0, 12))).unclear is not None


def test_labels_are_kept():
    labels = tuple("aaaabbbb")
    assert order(UP + UP, labels).pull == labels
    assert order(UP + UP, labels).words == ""
    assert not order([*UP, 3.0, *DOWN], ["a"] * 8).from_rest
    assert order([0.5, 1.0, 0.5, 1.0], tuple("aabb")).unclear is None


def test_rows_of_both_branches():
    values = np.array([*LOOP, *LOOP[1:]], float)
    expected = [1, 1, 1, 1, -1, -1, -1, 1, 1, 1, -1, -1, -1]
    assert branches([("force", values)], ["1"] * 13).tolist() == expected
    again = np.array(UP + UP)
    assert branches([("force", again)], ["1"] * 8).tolist() == [1] * 8
    # one tendon taut, the other one slack again
    other = np.array([3.0, 2.0, 1.0, 0.0])
    assert branches([("1", np.array(UP)), ("2", other)], ["1"] * 4).tolist() == [1, 0, 0, 0]


@pytest.fixture
def read(tmp_path):
    robot = nf.load_robot("pacheco2021-a")

    def reader(column, values, more="", **options):
        head, _, entry = more.partition("=")
        rows = [f"{value},20{',' + entry if entry else ''}" for value in values]
        text = "\n".join([f"{column},total_deg{',' + head if head else ''}", *rows])
        (tmp_path / "d.csv").write_text(text)
        return read_measurements(tmp_path / "d.csv", robot, **options)

    return reader


@pytest.mark.parametrize("column", ["tendon_force_N", "tendon_displacement_mm"])
def test_the_reader_goes_by_the_order_of_rows(read, column):
    loop = read(column, LOOP)
    assert not loop.from_rest
    assert "falls within a pull" in loop.order
    assert repr(loop).endswith("7 rows of 1 pull, each pull one path; total_angle>")
    again = read(column, UP + UP)
    assert again.from_rest
    assert again.pulls == ("1", "2")


def test_what_the_file_or_the_caller_says_goes_before_the_order(read):
    force = "tendon_force_N"
    assert read(force, LOOP, "from_rest=1").from_rest
    assert read(force, LOOP, "from_rest=1").order == ""
    assert read(force, LOOP, from_rest=True).from_rest
    assert not read(force, UP, from_rest=False).from_rest
    assert read(force, UP + UP, from_rest=False).pulls == ("1",)
    assert read(force, [1.0, 3.0, 2.0, 4.0], from_rest=True).from_rest
    assert not read(force, [1.0, 3.0, 2.0, 4.0], from_rest=False).from_rest
    with refused("UNSUPPORTED", "d.csv, line 4: the force falls from 3 to 2"):
        read(force, [1.0, 3.0, 2.0, 4.0])
