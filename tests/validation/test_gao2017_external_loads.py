"""Weights on Gao 2017's robot, at the tip and in its middle, while the tendon pulls.

Numbers: tests/reference/gao_external_loads.csv. The weight comes first, then the tendon by 1 N.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from gao2017 import (
    BODY_AWAY,
    BODY_TOWARD,
    EDGE,
    TIP_AWAY,
    TIP_ONLY,
    TIP_TOWARD,
    external_rows,
    robot,
    tip,
    under_weight,
)

LENGTH, ANGLE, FORCE = 1e-4, 1e-5, 1e-5  # mm, rad, N, with the usual modes
FINE_LENGTH, FINE_ANGLE, FINE_FORCE = 1e-6, 1e-7, 1e-6  # with more


def check(margin, path, rows, length, angle, force):
    """Tip, rotation and distal tension against rows of the table."""
    assert path.converged.all(), path.reason
    margin.within("tip", np.linalg.norm(tip(path) - rows[:, 3:5], axis=1), length, "mm")
    margin.within("rotation", path.total_angle - rows[:, 5], angle, "rad")
    given = ~np.isnan(rows[:, 6])  # the weights alone leave the tendon slack
    distal = np.where(given, path.span_tension[:, 0, -1] - rows[:, 6], path.span_tension[:, 0, -1])
    margin.within("distal tension", distal, force, "N")


@pytest.mark.parametrize("case", [TIP_ONLY, TIP_AWAY, TIP_TOWARD, BODY_AWAY, BODY_TOWARD])
def test_every_weight(case, margin):
    check(margin, under_weight(case), external_rows(case), LENGTH, ANGLE, FORCE)


@pytest.mark.nightly
@pytest.mark.parametrize("case", [TIP_AWAY, BODY_AWAY])
def test_more_modes(case, margin):
    """Moments, the largest |EI kappa - M| over the largest |M|, are met better, too."""
    path = under_weight(case, refinement=1)
    check(margin, path, external_rows(case), FINE_LENGTH, FINE_ANGLE, FINE_FORCE)
    usual, more = under_weight(case).moment_error, path.moment_error
    margin.note(f"moment error: {usual.max():.1e}, with more modes {more.max():.1e}")
    margin.within("usual modes", usual, 2e-3)
    margin.within("more modes", more, 2e-4)
    margin.within("more modes over usual modes", more.max() / usual.max(), 0.2)


def test_a_hung_mass_is_its_weight(margin):
    """A mass at the level tube instead of a force; the tube itself weighs nothing."""
    rows = external_rows(TIP_TOWARD)
    light = robot().with_value("material.density", None)
    loads = [
        nf.Load(tension=f, tip_mass=g, gravity=(9.81, 0.0, 0.0), tip_point=(EDGE, 0.0, 0.0))
        for _, g, f in rows[:, :3]
    ]
    path = nf.simulate(light, loads)
    check(margin, path, rows, LENGTH, ANGLE, FORCE)
    same = under_weight(TIP_TOWARD)
    margin.within("tip against the force", path.tip_position - same.tip_position, 1e-11, "mm")
    margin.within("bodies", path.body_position - same.body_position, 1e-11, "mm")
