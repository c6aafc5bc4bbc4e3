"""Errors of the law of a notch against finite elements of one notch and of chains of notches.

Numbers: tests/reference/fem_notch_*.csv. An error is relative: law over finite elements less 1 for
compliances and lengths, and for moments; finite elements over law less 1 for the stiffness K₀.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import notchflex as nf
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.ends import notch_stiffness
from notchflex.mechanics.flexure import Site, validity_warnings
from notchflex.mechanics.ring import Side
from reference_data import named_rows

YOUNG = 60e3
Row = dict[str, Any]


def tube_and_notch(row: Row) -> tuple[float, float, str, float, float]:
    """Return what the law takes of a row: radii, cut, depth and height."""
    return row["OD"] / 2, row["ID"] / 2, row["cut"], row["depth"], row["height"]


def left_by(
    outer: float, inner: float, cut: Any, depth: float, height: float, *sides: Side
) -> list[str]:
    """List the checked ranges that a notch between two sides leaves."""
    notch = nf.ArcNotch(cut, depth=depth, height=height, uncut_length=1.0)
    return validity_warnings(notch, nf.Tube(2 * outer, 2 * inner), Site(*sides, 0.33))


def inside(row: Row, side: Side) -> bool:
    """Whether the small-load law claims to hold (what it says of softening is left aside)."""
    return not [
        text
        for text in left_by(*tube_and_notch(row), side, side)
        if "softening" not in text and "moment" not in text
    ]


def single_notch() -> tuple[list[float], list[float]]:
    """Return errors of K₀ of one notch between rigid plates, inside the checked ranges and not."""
    error: tuple[list[float], list[float]] = [], []
    for row in named_rows("fem_notch_clamped.csv"):
        side = Side("clamped", row["ring"])
        found = notch_stiffness(*tube_and_notch(row), row["nu"], side, side).weak
        outer, inner, cut, depth, height = tube_and_notch(row)
        wanted = height + row["delta_weak"]
        if row["with_tube"] != "yes":
            second = SECTION_OF_CUT[cut](outer, inner, depth).second_moment_weak
            wanted += 2 * row["ring"] * second / (np.pi / 4 * (outer**4 - inner**4))
        error[not inside(row, side)].append(float(wanted / found - 1))
    return error


def _chain_rows(use: str):
    for row in named_rows("fem_notch_chain.csv"):
        if row["use"] == use:
            side = Side("between", row["ring"])
            section = SECTION_OF_CUT[row["cut"]](*(row["OD"] / 2, row["ID"] / 2, row["depth"]))
            outer, inner = row["OD"] / 2, row["ID"] / 2
            # The ring as a beam, taken off the rows: compliances in bending and in tension.
            bends = row["ring"] / (np.pi / 4 * (outer**4 - inner**4))
            stretches = row["ring"] / (np.pi * (outer**2 - inner**2))
            found = notch_stiffness(*tube_and_notch(row), row["nu"], side, side)
            yield row, section, found, bends, stretches


def chain_bending(use: str) -> tuple[list[float], list[float]]:
    """Return errors of K₀ in chains of equal notches, inside the checked ranges and not."""
    error: tuple[list[float], list[float]] = [], []
    for row, section, found, bends, _ in _chain_rows(use):
        side = Side("between", row["ring"])
        length = row["height"] + row["delta_weak"]
        without = found.weak - section.second_moment_weak * bends
        error[not inside(row, side)].append(float(length / without - 1))
    return error


def other_directions(use: str) -> dict[str, list[float]]:
    """Return errors in chains of equal notches, by the direction."""
    names = ("strong", "axial", "coupling", "torsion", "shear centre", "shear", "sway")
    errors: dict[str, list[float]] = {name: [] for name in names}
    for row, section, found, bends, stretches in _chain_rows(use):
        height, weak, centroid = row["height"], section.second_moment_weak, section.centroid
        strong = found.strong - section.second_moment_strong * bends
        errors["strong"].append(float(strong / (height + row["delta_strong"]) - 1))
        axial = found.axial - section.area * (stretches + centroid**2 * bends)
        errors["axial"].append(float(axial / (height + row["delta_axial"]) - 1))
        # The compliance between stretch on the tube axis and bending, times E: ȳ_eff ℓ/I. What the
        # ring as a beam adds to ȳ ℓ and to the coupling is the same.
        cross = (centroid * found.weak - found.coupling) / weak
        errors["coupling"].append(float(cross / row["uz_rx"] - 1))
        twist = 2 * (1 + row["nu"]) * found.torsion / section.torsion_constant
        errors["torsion"].append(float(twist / row["rz"] - 1))
        errors["shear centre"].append(found.shear_centre / row["shear_centre"] - 1)
        errors["shear"].append(found.shear / row["shear_y"] - 1)
        errors["sway"].append(found.sway / row["shear_x"] - 1)
    return errors


def moments(depth: float) -> list[float]:
    """Return errors of the moment of one notch of a depth (mm) between rigid plates, to closing."""
    error = []
    for row in named_rows("fem_notch_moment.csv"):
        if row["depth"] != depth:
            continue
        side = Side("clamped", row["ring"])
        law = notch_stiffness(0.81, 0.7, "off-axis", depth, row["height"], 0.33, side, side)
        second = SECTION_OF_CUT["off-axis"](0.81, 0.7, depth).second_moment_weak
        angle = np.radians(row["theta_deg"])
        flattening = 1.0 + law.alpha * angle / 2 + law.beta * angle**2 / 2
        found = YOUNG * second / law.weak * angle / flattening**2
        error.append(float(found / row["moment"] - 1))
    return error
