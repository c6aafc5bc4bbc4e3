"""Wrists from the drawing against three-dimensional solid finite elements, with nothing fitted.

Numbers: tests/reference/fem_wrist_angles.csv and fem_wrist_tips.csv, wrists A and B with off-axis
cuts and a straight tendon on the inner wall. Levels with less than 0.05 mm of gap are left out, as
the model has no contact.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from reference_data import FOLDER

LEAST_GAP = 0.05  # mm
HEIGHT, UNCUT = {"A": 0.8, "B": 0.5}, {"A": 1.2, "B": 1.5}
BASE = 1.2  # mm
# Largest error of an angle of any notch at any level; of the tip, as part of its path.
ANGLES = {
    "A_lin_mu0_medium": 0.065,
    "A_lin_mu013_medium": 0.065,
    "B_lin_mu0_medium": 0.03,
    "A_lin_mu0_tipFy+_medium": 0.065,
    "A_lin_mu0_tipFy-_medium": 0.065,
}
TIP = 0.02


def rows(name: str) -> dict[tuple[str, float], list[dict[str, str]]]:
    """Rows of a table by case and tension."""
    found = defaultdict(list)
    with (FOLDER / name).open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found[row["case"], float(row["F_N"])].append(row)
    return found


def wrist(case: str, friction: float, material: nf.robot.Material) -> nf.Robot:
    """The wrist of a case."""
    notch = nf.ArcNotch(
        "off-axis",
        depth=1.40,
        height=HEIGHT[case[0]],
        uncut_length=UNCUT[case[0]],
        repeat=5,
        ends="shell",
    )
    return nf.Robot(
        name=case,
        tube=nf.Tube(1.62, 1.40, base_length=BASE),
        notch=(notch,),
        tendon=(nf.Tendon(0.70, path="straight"),),
        material=material,
        friction=nf.Capstan(friction),
    )


def solved(case: str, material: nf.robot.Material):
    """Steps of a case, and the finite-element numbers of each: tip row and angles."""
    tips = {
        force: one[0]
        for (name, force), one in rows("fem_wrist_tips.csv").items()
        if name == case and float(one[0]["min_gap_mm"]) > LEAST_GAP
    }
    angles = rows("fem_wrist_angles.csv")
    friction = float(next(iter(tips.values()))["mu"])
    # Their y points to the bend, as x does here.
    loads = [
        nf.Load(tension=force, tip_force=(float(tip["tipload_y"]), 0.0, 0.0))
        for force, tip in tips.items()
    ]
    path = nf.simulate(wrist(case, friction, material), loads)
    assert path.converged.all()
    assert len(path) >= 4
    theta = [[float(row["theta_fem_deg"]) for row in angles[case, force]] for force in tips]
    return path, list(tips.values()), np.array(theta)


@pytest.mark.parametrize(("case", "allowed"), ANGLES.items())
def test_angles_and_tips(case, allowed, margin):
    path, tips, theta = solved(case, nf.Linear(60_000.0))
    if "tipF" not in case:
        margin.within("notch angle, relative", np.degrees(path.notch_angle) / theta - 1, allowed)
    total = np.degrees(path.total_angle)
    margin.within("total angle, relative", total / theta.sum(1) - 1, 0.02)
    place = np.array([[float(tip["tip_y"]), 0.0, float(tip["tip_z"])] for tip in tips])
    straight = BASE + 5 * (HEIGHT[case[0]] + UNCUT[case[0]])
    moved = np.linalg.norm(place - [0.0, 0.0, straight], axis=1)
    error = np.linalg.norm(path.tip_position - place, axis=1)
    margin.within("tip, part of its path", error / moved, TIP)


@pytest.mark.parametrize("case", ["A_se_mu0_medium", "A_se_mu013_coarse"])
def test_yielding_fibres(case, margin):
    bilinear = nf.Nitinol(elastic_modulus=10_000.0, plateau_stress=280.0, plateau_modulus=3_000.0)
    path, _, theta = solved(case, bilinear)
    error = np.degrees(path.notch_angle) / theta - 1.0
    margin.within("middle notches, relative", error[:, :4], 0.03)
    margin.within("last notch, relative", error[:, 4], 0.06)


def test_the_papers_law_is_far_off():
    """The test can fail: rigid ends miss the same numbers by a third."""
    path, _, theta = solved("A_lin_mu0_medium", nf.Linear(60_000.0))
    rigid = replace(path.robot, notch=(replace(path.robot.notch[0], ends="rigid"),))
    found = nf.simulate(rigid, path.load)
    assert (np.degrees(found.total_angle) < 0.7 * theta.sum(1)).all()


@pytest.mark.parametrize("case", ["A_lin_mu0_medium", "B_lin_mu0_medium"])
def test_faces_turn_less_than_rings(case, margin):
    path, tips, theta = solved(case, nf.Linear(60_000.0))
    angles = rows("fem_wrist_angles.csv")
    faces = np.array(
        [[float(row["theta_edge_deg"]) for row in angles[case, float(tip["F_N"])]] for tip in tips]
    )
    ratio = path.edge_angle / path.notch_angle
    error = ratio / (faces / theta) - 1
    margin.within("face over ring angle, middle notches", error[:, :4], 3e-3)
    margin.within("face over ring angle, last notch", error[:, 4], 1.5e-2)
