"""The seven-notch robot of Liu 2022 against independent numbers, in every reading of the paper.

Numbers: tests/reference/liu_robot.csv and liu_robot_slope.csv (elliptic integrals and a fixed
point for every notch, to 1e-13). The modes are the default ones.

@article{liu2022curvature,
  title   = {Curvature Correction of a Notched Continuum Robot Based on a Static Model Considering
             Large Deformation and Friction Effect},
  journal = {Machines}, volume = {10}, pages = {778}, year = {2022}
}
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from liu2022 import STEPS, force_for_chord, liu, pulled
from reference_data import choose, reference

ANGLE, FORCE = 1e-7, 2e-8  # rad; tension relative to the pull
COEFFICIENTS = (0.0, 0.1, 0.15, 0.2, 0.3)
FIRST_GAP, LAST_GAP, LAST_EXIT = 1, 13, 12  # spans and contacts of a cable over seven notches


def corner(turning: np.ndarray, mu: float) -> np.ndarray:
    """Tension beyond a corner over tension before it (Liu 2022, eq. 7)."""
    half = 0.5 * turning
    return (np.cos(half) - mu * np.sin(half)) / (np.cos(half) + mu * np.sin(half))


def check(path: nf.EquilibriumPath, mu: float, rows: dict[str, np.ndarray], margin) -> None:
    """Hold a path to the columns of a table that both tables have."""
    assert path.converged.all(), path.reason
    turning, spans = path.contact_turning[:, 0], path.span_tension[:, 0]
    notch, total = (
        (path.chord_angle, path.total_chord_angle)
        if "chord" in rows
        else (path.notch_angle, path.total_angle)
    )
    each = np.degrees(ANGLE)
    margin.within("each notch", np.degrees(notch) - rows.get("chord", rows.get("slope")), each)
    margin.within("sum of chords", np.degrees(path.total_chord_angle) - rows["chords"], each)
    margin.within("sum of slopes", np.degrees(path.total_angle) - rows["slopes"], each, "deg")
    np.testing.assert_allclose(notch.sum(axis=1), total, rtol=1e-12)
    margin.within("turning at the first edge", turning[:, 0] - rows["gamma"], ANGLE, "rad")
    for name, span in (("first", FIRST_GAP), ("last", LAST_GAP)):
        error = (spans[:, span] - rows[f"{name} gap"]) / rows["force"]
        margin.within(f"tension in the {name} gap, of the pull", error, FORCE)
    if "beyond" in rows:
        # The cable ends at the last edge; what the table has beyond it is the friction there.
        last = turning[:, LAST_EXIT] + path.chord_angle[:, -1]
        error = (spans[:, LAST_GAP] * corner(last, mu) - rows["beyond"]) / rows["force"]
        margin.within("tension beyond the last edge, of the pull", error, FORCE)


@pytest.mark.parametrize("mu", COEFFICIENTS)
@pytest.mark.parametrize(
    "model", [*(pytest.param(one, marks=pytest.mark.nightly) for one in (0, 1, 3)), 2]
)
def test_paper_reading(model, mu, margin):
    table = choose(reference("liu_robot.csv"), model=(0, model), mu=(1, mu))
    assert len(table) == STEPS
    names = ("chords", "slopes", "gamma", "first gap", "last gap", "beyond")
    rows = dict(zip(names, table[:, 10:16].T, strict=True))
    rows |= {"force": table[:, 2], "chord": table[:, 3:10]}
    check(pulled(liu(model, mu), table[:, 2]), mu, rows, margin)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.2, 0.3])
def test_bodies_that_turn_with_the_slope(mu, margin):
    table = choose(reference("liu_robot_slope.csv"), mu=(0, mu))
    assert len(table) == STEPS
    names = ("slopes", "chords", "gamma", "first gap", "last gap")
    rows = dict(zip(names, table[:, 9:14].T, strict=True))
    rows |= {"force": table[:, 1], "slope": table[:, 2:9]}
    check(pulled(liu(0, mu, "slope"), table[:, 1]), mu, rows, margin)


@pytest.mark.parametrize(("mu", "force"), [(0.0, "7.8174"), (0.2, "9.1462")])
def test_force_for_58_degrees(mu, force, margin):
    found = force_for_chord(liu(0, mu), np.radians(58.0))
    margin.note(f"58 deg at mu {mu}: {found:.6f} N")
    assert f"{found:.4f}" == force


def test_error_without_friction_at_the_mu_that_fits_the_printed_one(margin):
    # The same forces as in the table of the paper's test; with the steps above 20 left out.
    forces = 9.396 / 20 * np.arange(1, STEPS + 1)
    total = [np.degrees(pulled(liu(0, mu), forces).total_chord_angle[:20]) for mu in (0.0, 0.2315)]
    found = np.sqrt(np.mean((total[0] - total[1]) ** 2))
    margin.note(f"frictionless against mu 0.2315: {found:.4f} deg; {total[1][-1]:.4f} deg in full")
    assert f"{found:.2f}" == "5.10"


def test_small_deflection_meets_the_moments_of_its_own_model(margin):
    path = pulled(liu(1, 0.2), np.linspace(0.5, 12.0, STEPS))
    margin.within("moment", path.moment_error, 1e-12)
