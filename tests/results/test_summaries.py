"""What a notebook shows of loads and results: a few lines, with units, and a small table."""

import re
from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from notchflex._summary import course


@pytest.fixture(scope="module")
def failed(wrist):
    return nf.simulate(wrist, nf.stroke_path(0.0, 9.0, steps=4))


def test_a_path_is_a_few_lines(loop):
    lines = repr(loop).splitlines()
    assert len(lines) <= 12
    assert max(map(len, lines)) <= 100
    text = repr(loop)
    assert "Pacheco 2021, wrist A, 8 steps" in text
    assert re.search(r"tendon tension +0 to 3 to 0 N", text)
    assert re.search(r"total angle +0\.0 to 153\.1 to 0\.0 deg", text)
    assert re.search(r"converged +all steps", text)
    assert ".plot()" in text


def test_a_state_shows_load_angle_tip_and_convergence(loop):
    text = repr(loop[1])
    assert "step 2 of 8" in text
    assert re.search(r"load +tension 1 N", text)
    assert re.search(rf"total angle +{np.degrees(loop.total_angle[1]):.2f} deg", text)
    x, _, z = loop.tip_position[1]
    assert f"({x:.3f}, 0.000, {z:.3f}) mm" in text
    assert re.search(r"converged +yes", text)


def test_what_did_not_converge_says_so_and_why(failed):
    text = repr(failed[-1])
    assert text.startswith("Last good state")
    assert re.search(r"load +stroke 9 mm", text)
    assert "not tried, because step 3" in text
    assert re.search(r"2 of 4 steps; step 3: every notch closed", repr(failed))


def test_steps_that_were_not_tried_repeat_the_last_state(failed):
    assert failed.run.tried.tolist() == [True, True, True, False]
    for name in ("total_angle", "notch_angle", "tip_position", "tension", "stroke", "gap"):
        values = getattr(failed, name)
        np.testing.assert_array_equal(values[3], values[2], err_msg=name)
    np.testing.assert_array_equal(failed.tendon_work[3], failed.tendon_work[2])
    assert failed.total_angle[3] > 2.0


def test_a_state_with_external_loads_shows_them(wrist):
    load = nf.Load(tension=0.5, tip_force=(0.0, 0.0, 0.02), tip_mass=2.0)
    text = repr(nf.solve(wrist, load))
    assert "tension 0.5 N, tip force (0, 0, 0.02) N, tip mass 2 g" in text


def test_notebooks_get_an_escaped_table(loop):
    robot = loop.robot.replace(name="<b>wrist & co</b>")
    shown = replace(loop, robot=robot)._repr_html_()
    assert "&lt;b&gt;wrist &amp; co&lt;/b&gt;" in shown
    assert "<b>" not in shown
    assert shown.count("<tr>") == len(loop._summary().rows)
    assert "153.1" in shown
    assert "total angle" in loop[1]._repr_html_()


def test_loads_and_their_steps():
    path = nf.pull(0.0, 3.0, steps=4).release().loaded(tip_mass=5.0)
    assert repr(path).splitlines() == [
        "Load path of 8 steps",
        "  tendon tension  0 to 3 to 0 N",
        "  external load   tip mass 5 g",
    ]
    assert path[1] == nf.Load(tension=1.0, tip_mass=5.0)
    assert path[-1].tension == 0.0
    assert [one.tension for one in path][:4] == [0.0, 1.0, 2.0, 3.0]
    two = nf.pull(0.0, 1.0, 2).then(nf.stroke_path(0.0, 0.5, 2, tendon=2))
    assert two[3] == nf.Load(stroke=[None, 0.5])
    with pytest.raises(IndexError, match="step 8 of a load path of 8 steps"):
        path[8]


def test_a_batch_says_rows_ranges_and_units(wrist):
    found = nf.solve_batch(wrist, nf.pull(0.0, 2.0, steps=5))
    lines = repr(found).splitlines()
    assert lines[0] == "Batch of 5 rows"
    assert any(re.search(r"total_angle +5, 0 to 2\.\d+ rad", line) for line in lines)
    assert any(re.search(r"converged +5, 5 of 5 true", line) for line in lines)
    assert "tip_position" in found._repr_html_()


def test_a_state_to_continue_from_and_closing(loop, wrist):
    assert repr(loop.state).startswith("State of Pacheco 2021, wrist A\n")
    text = repr(nf.closing(wrist))
    assert "notch 1  30.63 deg, 1.615 N" in text
    assert len(text.splitlines()) == 6


def test_a_series_that_turns_often_shows_its_range():
    assert course(np.tile([0.0, 1.0], 9)) == "between 0 and 1"
    assert course([0.0, np.nan, 2.0, 2.0, -1.0]) == "0 to 2 to -1"
