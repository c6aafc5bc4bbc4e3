"""The stiffness of notches against finite elements."""

from __future__ import annotations

import numpy as np
import pytest

from fem_notches import YOUNG, chain_bending, left_by, moments, other_directions, single_notch
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.ends import notch_stiffness
from notchflex.mechanics.ring import Side


def judge(margin, what, error, rms, largest):
    error = 100.0 * np.asarray(error)
    margin.within(f"{what}, rms of {len(error)}", np.sqrt(np.mean(error**2)), rms, "%")
    margin.within(f"{what}, max of {len(error)}", error, largest, "%")


def test_small_loads(margin):
    # None of the law's constants was fitted to notches between rigid plates.
    error, outside = single_notch()
    judge(margin, "K₀ of one notch", error, 1.4, 4.3)
    assert len(error) > 60
    margin.note(f"K₀ outside the range: max {100 * np.max(np.abs(outside)):.1f} %")


# The rows to which constants of the law were fitted, and those kept back.
LARGEST = {"strong": 8.0, "axial": 5.5, "coupling": 6.0, "torsion": 8.0, "shear centre": 5.0}
CELLS = {"fit": LARGEST | {"shear": 10.8, "sway": 8.0}, "judge": LARGEST | {"shear": 8, "sway": 8}}


@pytest.mark.parametrize("use", CELLS)
def test_other_directions(use, margin):
    for name, errors in other_directions(use).items():
        judge(margin, f"{name}, {use}", errors, 4.0, CELLS[use][name])


@pytest.mark.parametrize("use", CELLS)
def test_weak_bending_in_chains(use, margin):
    error, shallow = chain_bending(use)
    judge(margin, f"K₀ in chains, {use}", error, 1.8, 5.2)
    judge(margin, f"K₀ in chains, outside the ranges, {use}", shallow, 3.1, 6.3)


@pytest.mark.parametrize(("depth", "allowed"), [(1.4, 4.6), (1.458, 3.0), (0.972, 2.1)])
def test_moment_to_closing(depth, allowed, margin):
    error = 100 * np.array(moments(depth))
    assert error.size > 5
    margin.within(f"moment of a notch {depth} mm deep, relative", error, allowed, "%")


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
    assert left_by(0.81, 0.7, "on-axis", 1.4, 0.8, ring, ring) == []
    said = {
        "solid strip": (0.58, 0.43, "off-axis", 1.044, 0.5),
        "depth": (0.81, 0.7, "on-axis", 1.05, 0.8),
        "85 %": (0.81, 0.78, "on-axis", 1.4, 0.8),
        "height": (0.81, 0.7, "on-axis", 1.4, 0.12),
    }
    for word, notch in said.items():
        assert any(word in text for text in left_by(*notch, ring, ring)), word
    for far in (Side("free", 3.0), Side("clamped", 300.0), Side("clamped", 0.0)):
        assert left_by(0.81, 0.7, "on-axis", 1.4, 0.8, ring, far) == []
    (near,) = left_by(0.81, 0.7, "on-axis", 1.4, 0.8, ring, Side("free", 0.15))
    assert near.startswith("ring / outer diameter is 0.0926, below 0.2")
