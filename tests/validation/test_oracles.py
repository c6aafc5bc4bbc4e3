"""The tests' own answers against the reference numbers: an oracle must be right before it judges.

Nothing of the package runs here.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from oracles import frames, wrist
from oracles.wrist import WRISTS, Material
from reference_data import CUTS, choose, reference


@pytest.mark.parametrize("cut", [0, 1])
@pytest.mark.parametrize("name", "ABC")
def test_pull_is_the_reference_curve(cut, name, margin):
    one = WRISTS[name].with_(cut=CUTS[cut])
    rows = choose(reference("pacheco_force_curves.csv"), cut=(0, cut), wrist=(1, "ABC".index(name)))
    states = one.march(rows[:, 2])
    angle = np.array([s.angle for s in states])
    margin.within("oracle angle", angle - np.radians(rows[:, 3 : 3 + one.n]), 1e-9, "rad")
    margin.within("oracle tip", [one.tip(a) for a in angle] - rows[:, 9:11], 1e-9, "mm")
    margin.within("oracle stroke", one.stroke(angle) - rows[:, 11], 1e-9, "mm")
    margin.within("oracle tension", [s.gap_tension[-1] for s in states] - rows[:, 12], 1e-9, "N")


@pytest.mark.parametrize("name", "ABC")
def test_closing_is_the_reference_table(name, margin):
    rows = choose(reference("pacheco_closing.csv"), cut=(0, 0), wrist=(1, "ABC".index(name)))
    one = WRISTS[name]
    margin.within("closing angle", one.closing_angle / np.radians(rows[:, 7]) - 1, 1e-9)
    for j, force in enumerate(rows[:, 8]):
        just_open = one.pull(force * (1 - 1e-8))[0]
        just_closed = one.pull(force * (1 + 1e-8))[0]
        assert just_open[j] < one.closing_angle[j] == just_closed[j]


def test_simpler_models_are_the_reference_table(margin):
    linear = Material(superelastic_modulus=None)
    error = []
    for row in reference("pacheco_simplified.csv"):
        one = WRISTS["ABC"[int(row[0])]]
        angle = {
            0: lambda one=one, row=row: one.pull(row[1])[0],
            1: lambda one=one, row=row: one.with_(material=linear).pull(row[1])[0],
            2: lambda one=one, row=row: one.with_(material=linear, mu=0.0).pull(row[1])[0],
            3: lambda one=one, row=row: one.equal_stroke(one.stroke(one.pull(row[1])[0])),
        }[int(row[2])]()
        error.append(np.max(np.abs(angle - np.radians(row[3 : 3 + one.n]))))
    margin.within("oracle angle", error, 1e-9, "rad")


def test_screw_motions_give_the_planar_tip(margin):
    one = wrist.C
    robot = frames.Robot(one, np.zeros(one.n), frames.Tendons(np.array([0.7]), np.zeros(1)))
    angle, tension = one.pull(1.0)
    tip = robot.bodies(angle)[-1]
    margin.within("tip of the product of exponentials", tip[[0, 2], 3] - one.tip(angle), 1e-13)
    found, gap = robot.equilibrium(np.array([1.0]))
    margin.within("root finder against brentq", found - angle, 1e-13, "rad")
    margin.within("gap tension", gap[:, 0] - tension, 1e-13, "N")


@pytest.mark.parametrize("delta_deg", [0.0, 37.0, 90.0, 180.0])
def test_arm_is_the_length_of_a_curve_on_the_wall(delta_deg, margin):
    angle, height, radius = 0.4, 0.8, 0.7
    ybar = wrist.A.centroid[0]
    delta = np.radians(delta_deg)
    start = np.array([radius * np.cos(delta), radius * np.sin(delta), 0.0, 1.0])

    def speed(s: float, step: float = 1e-5) -> float:
        here, there = (
            frames.notch(angle * t, height * t, ybar, 0.0) @ start for t in (s - step, s + step)
        )
        return float(np.linalg.norm(there - here)) / (2 * step)

    length = quad(speed, 1e-4, 1 - 1e-4)[0] / (1 - 2e-4)
    expected = height - angle * (ybar + radius * np.cos(delta))
    margin.within("tendon length in a notch", length - expected, 1e-9, "mm")
