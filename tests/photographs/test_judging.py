"""What makes a fit doubtful: shifted lines, notches unlike the robot file, parts that are not seen.

The fits are made up: an outline with edges at known distances.
"""

import numpy as np
import pytest

import notchflex as nf
from notchflex.photographs.edges import Contrast, Edges
from notchflex.photographs.fitting import Fit, missing
from notchflex.photographs.outline import NUMBERS, SIDE, SPINE, OutlineModel, PlanarRobot

MODEL = OutlineModel(PlanarRobot(nf.load_robot("pacheco2021-a")))
SCALE = 60.0  # px/mm


def made_up(residual, cut=0.0):
    numbers = np.zeros(NUMBERS + 5)
    numbers[3], numbers[8] = np.log(SCALE), cut
    offset = np.broadcast_to(residual, MODEL.kind.shape).astype(float)
    looked = np.ones(len(offset), bool)
    jacobian = np.random.default_rng(0).normal(size=(len(offset), len(numbers)))
    outline = MODEL.outline(numbers)
    contrast = Contrast(np.zeros((900, 1200), np.float32), 5.0, np.array([1200.0, 900.0]))
    edges = Edges(offset, looked, looked.astype(float))
    return Fit(MODEL, numbers, contrast, outline, jacobian, edges)


def test_a_shift_of_all_lines_is_no_misfit():
    """Blur, or a tube thinner than in its file, shifts all lines; one line shifted alone counts."""
    assert made_up(1.6).cost < 0.01
    assert made_up(1.6).noise < 0.1
    one = np.where((MODEL.kind == SPINE) & (MODEL.ring == 2), 2.0, 0.0)
    assert made_up(one).cost > 0.01
    assert made_up(5.0).cost > 0.3


def test_notches_unlike_the_robot_file_are_a_misfit():
    """Mirror images fit alike with deeper notches: 0.05 mm is 5 standard deviations of a cut."""
    more = made_up(0.0, cut=0.05).misfit(0.1) - made_up(0.0).misfit(0.1)
    assert more == pytest.approx((0.05 / (0.006 * 1.62)) ** 2, rel=0.02)


def test_notches_of_another_depth_are_refused():
    assert missing(made_up(0.0)) == ""
    inner = (MODEL.kind == SPINE) & (MODEL.which > 0.0)
    assert "depth" in missing(made_up(np.where(inner, np.nan, 0.0)))


def test_one_side_of_one_ring_may_look_like_the_background():
    """The other side shows the ring; where two rings lack a side, or one both, nothing is said."""
    side = MODEL.kind == SIDE

    def hidden(*lines):
        off = np.zeros(len(side))
        for ring, which in lines:
            off[side & (MODEL.ring == ring) & (MODEL.which == which)] = np.nan
        return missing(made_up(off))

    assert hidden((3, 1.0)) == ""
    assert "before notch 1" in hidden((0, 1.0), (3, 1.0))
    assert "behind notch 3" in hidden((3, 1.0), (3, -1.0))
