"""Table 4 of Pacheco et al. 2021: the model against the measured angle of every notch.

@article{pacheco2021beyond,
  author  = {Pacheco, Nicholas E. and Gafford, Joshua B. and Atalla, Mostafa A. and
             Webster, Robert J. III and Fichera, Loris},
  title   = {Beyond Constant Curvature: A New Mechanics Model for Unidirectional Notched-Tube
             Continuum Wrists},
  journal = {Journal of Medical Robotics Research},
  volume  = {6}, number = {1-2}, pages = {2140004}, year = {2021},
  doi     = {10.1142/s2424905x21400043}
}

Measured angles are read from ../shared/data. The paper's model is the specimen's: unrounded
constants (the authors' set 196) and notches that are bent when free. Its "experimental" tip is
the forward kinematics of the measured angles. The simpler models are in
test_pacheco2021_compare.py, through the command line.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from loads import tensions
from robots import specimen
from shared_data import measured, notch_columns, numbers

# Table 4, RMSE of every notch [deg]; totals: 2.5, 1.8, 2.6 % of 150, 90, 150 deg.
TABLE_4 = {
    "A": (1.80, 1.32, 1.01, 0.84, 0.89),
    "B": (0.43, 0.41, 0.39, 0.57, 0.57),
    "C": (2.47, 1.49, 1.15, 0.79),
}
TOTAL = {"A": 3.73, "B": 1.61, "C": 3.95}
PERCENT = {"A": (150.0, 2.5), "B": (90.0, 1.8), "C": (150.0, 2.6)}
POINTS = {"A": 68, "B": 75, "C": 83}
TIP = 0.33  # fig. 12, tip RMSE over all wrists [mm]


def errors(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors [deg] of every notch and the total, and of the tip [mm], a row a photograph."""
    rows = measured(f"pacheco2021_wrist_{name}_measured.csv")
    assert len(rows) == POINTS[name]
    robot = specimen(name)
    measured_angle = np.array(notch_columns(rows))
    force = np.clip(numbers(rows, "tendon_force_N"), 0.0, None)
    # Every row is a pull from rest, so any rising order is one pull through all of them.
    order = np.argsort(force, kind="stable")
    path = nf.simulate(robot, tensions(force[order]))
    assert path.converged.all(), path.reason
    back = np.argsort(order)
    angle, tip = np.degrees(path.notch_angle[back]), path.tip_position[back]
    total = angle.sum(axis=1) - numbers(rows, "total_deg")
    measured_tip, _ = nf.tip_from_angles(robot, np.radians(measured_angle))
    return np.column_stack([angle - measured_angle, total]), tip - measured_tip


def rmse(error: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(error**2, axis=0))


@pytest.mark.parametrize("name", "ABC")
def test_table_4(name, margin):
    found = rmse(errors(name)[0])
    margin.note(f"RMSE of the notches and the total: {np.round(found, 4).tolist()} deg")
    assert tuple(np.round(found[:-1], 2)) == TABLE_4[name]
    assert np.round(found[-1], 2) == TOTAL[name]
    full_scale, percent = PERCENT[name]
    assert np.round(100 * found[-1] / full_scale, 1) == percent


def test_tip_of_all_wrists_together(margin):
    square = np.concatenate([np.sum(errors(name)[1] ** 2, axis=1) for name in "ABC"])
    assert len(square) == 226
    found = np.sqrt(square.mean())
    margin.note(f"pooled tip RMSE: {found:.4f} mm")
    assert np.round(found, 2) == TIP
