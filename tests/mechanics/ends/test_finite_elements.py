"""The stiffness of notches against finite elements."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.mechanics.ends import Side, notch_stiffness, validity
from notchflex.mechanics.section import SECTION_OF_CUT
from reference_data import named_rows

CLAMPED = named_rows("fem_notch_clamped.csv")
CHAIN = named_rows("fem_notch_chain.csv")
MOMENT = named_rows("fem_notch_moment.csv")
YOUNG = 60e3


def tube_and_notch(row):
    return row["OD"] / 2, row["ID"] / 2, row["cut"], row["depth"], row["height"]


def inside(row, side):
    """Whether the small-load law claims to hold (what it says of softening is left aside)."""
    return not [
        text
        for text in validity(*tube_and_notch(row), side, side)
        if "softening" not in text and "moment" not in text
    ]


def judge(margin, what, error, rms, largest):
    error = 100.0 * np.asarray(error)
    margin.within(f"{what}, rms of {len(error)}", np.sqrt(np.mean(error**2)), rms, "%")
    margin.within(f"{what}, max of {len(error)}", error, largest, "%")


def test_small_loads(margin):
    error, outside = [], []
    for row in CLAMPED:
        side = Side("clamped", row["ring"])
        found = notch_stiffness(*tube_and_notch(row), row["nu"], side, side).weak
        outer, inner, cut, depth, height = tube_and_notch(row)
        wanted = height + row["delta_weak"]
        if row["with_tube"] == "yes":
            second = SECTION_OF_CUT[cut](outer, inner, depth).second_moment_weak
            wanted -= 2 * row["ring"] * second / (np.pi / 4 * (outer**4 - inner**4))
        (error if inside(row, side) else outside).append(wanted / found - 1)
    judge(margin, "K₀ of one notch", error, 1.0, 3.0)
    assert len(error) > 90
    margin.note(f"K₀ outside the range: max {100 * np.max(np.abs(outside)):.1f} %")


def chain_rows():
    for row in CHAIN:
        side = Side("between", row["ring"])
        section = SECTION_OF_CUT[row["cut"]](*(row["OD"] / 2, row["ID"] / 2, row["depth"]))
        yield row, section, notch_stiffness(*tube_and_notch(row), row["nu"], side, side)


def test_other_directions(margin):
    errors = {name: [] for name in ("strong", "axial", "coupling", "torsion", "shear centre")}
    for row, section, found in chain_rows():
        height, weak = row["height"], section.second_moment_weak
        errors["strong"].append(found.strong / (height + row["delta_strong"]) - 1)
        errors["axial"].append(found.axial / (height + row["delta_axial"]) - 1)
        # The compliance between stretch on the tube axis and bending, times E: ȳ_eff ℓ/I.
        cross = (section.centroid * found.weak - found.coupling) / weak
        errors["coupling"].append(cross / row["uz_rx"] - 1)
        twist = 2 * (1 + row["nu"]) * found.torsion / section.torsion_constant
        errors["torsion"].append(twist / row["rz"] - 1)
        errors["shear centre"].append(found.shear_centre / row["shear_centre"] - 1)
    for name, rms, largest in (
        ("strong", 3.0, 8.0),
        ("axial", 5.0, 5.0),
        ("coupling", 6.0, 6.0),
        ("torsion", 5.0, 12.5),
        ("shear centre", 6.0, 7.0),
    ):
        judge(margin, name, errors[name], rms, largest)


def test_weak_bending_in_chains(margin):
    error, shallow = [], []
    for row, _, found in chain_rows():
        side = Side("between", row["ring"])
        (error if inside(row, side) else shallow).append(
            (row["height"] + row["delta_weak"]) / found.weak - 1
        )
    judge(margin, "K₀ in chains", error, 1.0, 3.0)
    judge(margin, "K₀ in chains, g/OD 0.60 (warned of)", shallow, 8.0, 8.0)


@pytest.mark.parametrize(("depth", "allowed"), [(1.4, 3.4), (1.458, 3.4), (0.972, 3.4)])
def test_moment_to_closing(depth, allowed, margin):
    rows = [row for row in MOMENT if row["depth"] == depth]
    error = []
    for row in rows:
        side = Side("clamped", row["ring"])
        law = notch_stiffness(0.81, 0.7, "off-axis", depth, row["height"], 0.33, side, side)
        second = SECTION_OF_CUT["off-axis"](0.81, 0.7, depth).second_moment_weak
        tube = 2 * row["ring"] / (np.pi / 4 * (0.81**4 - 0.7**4))  # the two rings as beams
        angle = np.radians(row["theta_deg"]) - row["moment"] / YOUNG * tube
        flattening = 1.0 + law.alpha * angle / 2 + law.beta * angle**2 / 2
        found = YOUNG * second / law.weak * angle / flattening**2
        error.append(found / row["moment"] - 1)
    margin.within(
        f"moment of a notch {depth} mm deep, relative", 100 * np.array(error), allowed, "%"
    )


def test_closing():
    # Ring angles at first contact, and tangents 1 to 3° beyond, N mm/rad (fem/closing_summary).
    for cut, angle, tangents in (
        ("on-axis", 31.39018, (1551.537, 1365.655, 1205.127)),
        ("off-axis", 30.93807, (1510.823, 1351.215, 1209.446)),
    ):
        side = Side("clamped", 1.2)
        law = notch_stiffness(0.81, 0.7, cut, 1.4, 0.8, 0.33, side, side)
        section = SECTION_OF_CUT[cut](0.81, 0.7, 1.4)
        closing = np.degrees(law.closing_factor * 0.8 / (0.81 + section.centroid))
        assert closing == pytest.approx(angle, rel=3e-3)
        stiffness = law.closed_ratio * YOUNG * section.second_moment_weak / law.weak
        assert stiffness == pytest.approx(np.mean(tangents), rel=0.1)


def test_validity_names_what_is_left():
    ring = Side("between", 1.2)
    assert validity(0.81, 0.7, "on-axis", 1.4, 0.8, ring, ring) == []
    said = {
        "solid strip": (0.58, 0.43, "off-axis", 1.044, 0.5),
        "between notches": (0.81, 0.7, "on-axis", 1.05, 0.8),
        "moment": (0.81, 0.75, "on-axis", 1.4, 0.8),
        "0.159": (0.81, 0.7, "on-axis", 1.4, 0.12),
    }
    for word, notch in said.items():
        assert any(word in text for text in validity(*notch, ring, ring)), word
    far = Side("free", 3.0)
    assert validity(0.81, 0.7, "on-axis", 1.4, 0.8, ring, far) != []
