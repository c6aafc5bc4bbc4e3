"""Friction laws: the bound of the log tension ratio at the two edges of a gap."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.friction import friction_law

EXIT, ENTRY = np.array([0.1, 0.0, 0.4]), np.array([0.2, 0.0, 0.4])
TURNING = np.stack([EXIT, ENTRY], axis=-1)


def test_frictionless_holds_nothing() -> None:
    np.testing.assert_array_equal(friction_law(nf.Frictionless()).bounds(TURNING), 0.0)


def test_capstan_at_its_own_edges() -> None:
    np.testing.assert_allclose(friction_law(nf.Capstan(0.25)).bounds(TURNING), 0.25 * TURNING)


def test_whole_turning_ahead_of_the_notch() -> None:
    law = friction_law(nf.Capstan(0.25, wrap="whole-before"))
    exit_bound, entry_bound = np.moveaxis(law.bounds(TURNING), -1, 0)
    np.testing.assert_allclose(exit_bound, 0.25 * (EXIT + ENTRY))
    np.testing.assert_array_equal(entry_bound, 0.0)


def test_nothing_else_is_friction() -> None:
    with pytest.raises(TypeError, match=r"friction_law\.register"):
        friction_law(nf.Linear(1000.0))
