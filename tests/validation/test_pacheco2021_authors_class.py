"""The output of the authors' own class `Wrist`, run in GNU Octave (read from ../shared/data).

All 1,530 rows of its force model, five variants with two sets of constants. Its secant-modulus
loop stops at a relative change of 1e-4, so the tolerances are those of that loop, except for the
`linear` variant, where the loop has nothing to do.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest

import notchflex as nf
from loads import tensions
from robots import linear_copy, ready, specimen
from shared_data import measured, notch_columns, numbers

NAME = "pacheco2021_reference_wrist_class_force.csv"
VARIANTS = ("full", "full_noprecurve", "frictionless", "linear", "offaxis_noprecurve")


def variant_of(robot: nf.Robot, variant: str) -> nf.Robot:
    """The specimen as the authors' class was set up for a variant."""
    if variant.endswith("noprecurve"):
        robot = robot.with_value("notch[*].precurvature_deg", 0.0)
    if variant.startswith("offaxis"):
        robot = robot.with_value("notch[*].cut", "off-axis")
    if variant == "frictionless":
        robot = robot.replace(friction=nf.Frictionless())
    if variant == "linear":
        robot = linear_copy(robot)
    return robot


def rows_of(name: str, constants: str, variant: str) -> list[dict[str, str]]:
    wanted = {"wrist": name, "param_set": constants, "variant": variant}
    return [row for row in measured(NAME) if all(row[key] == wanted[key] for key in wanted)]


def test_all_rows_are_used():
    key = lambda row: (row["wrist"], row["param_set"], row["variant"])  # noqa: E731
    sizes = {k: len(list(rows)) for k, rows in groupby(measured(NAME), key)}
    assert set(sizes) == {(w, s, v) for w in "ABC" for s in ("ID196", "table3") for v in VARIANTS}
    assert sum(sizes.values()) == 1530


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("constants", ["ID196", "table3"])
@pytest.mark.parametrize("name", "ABC")
def test_force_model(name, constants, variant, margin):
    robot = specimen(name)
    if constants == "table3":
        rounded = ready(name)
        robot = robot.replace(material=rounded.material, friction=rounded.friction)
    robot = variant_of(robot, variant)
    rows = rows_of(name, constants, variant)

    force = np.array(numbers(rows, "tendon_force_N"))
    path = nf.simulate(robot, tensions(force))
    assert path.converged.all(), path.reason
    exact = variant == "linear"
    notch, total, tip = (1e-7, 1e-7, 1e-7) if exact else (0.01, 0.03, 0.003)
    angle = np.degrees(path.notch_angle)
    axis = path.tip_rotation[:, :, 2]
    heading = np.degrees(np.unwrap(np.arctan2(axis[:, 0], axis[:, 2])))
    margin.within("notch angles", angle - notch_columns(rows), notch, "deg")
    margin.within("total", angle.sum(axis=1) - numbers(rows, "total_deg"), total, "deg")
    margin.within("tip angle", heading - numbers(rows, "tip_angle_deg"), total, "deg")
    place = np.column_stack([numbers(rows, "tip_x_mm"), numbers(rows, "tip_z_mm")])
    margin.within("tip", path.tip_position[:, [0, 2]] - place, tip, "mm")


@pytest.mark.parametrize("name", "ABC")
def test_kinematic_model(name, margin):
    rows = measured("pacheco2021_reference_wrist_class_displacement.csv")
    rows = [row for row in rows if row["wrist"] == name]
    assert len(rows) == 21
    robot = ready(name)
    angle = nf.equal_stroke(robot, np.array(numbers(rows, "tendon_displacement_mm"))).notch_angle
    margin.within("notch angles", angle - np.radians(notch_columns(rows)), 1e-8, "rad")
    tip, _ = nf.tip_from_angles(robot, angle)
    place = np.column_stack([numbers(rows, "tip_x_mm"), numbers(rows, "tip_z_mm")])
    margin.within("tip", tip[:, [0, 2]] - place, 1e-7, "mm")
