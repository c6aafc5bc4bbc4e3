"""What Python tells of parts and quantities: short signatures, and documentation of properties."""

from __future__ import annotations

import inspect

import pytest

import notchflex as nf


@pytest.mark.parametrize("kind", [nf.Tube, nf.Tendon, nf.ArcNotch, nf.Capstan, nf.Robot])
def test_signatures_name_plain_types(kind):
    text = str(inspect.signature(kind))
    assert "FieldInfo" not in text
    assert "Annotated" not in text
    assert inspect.signature(nf.Tube).parameters["base_length"].default == 0.0


def test_a_quantity_is_a_property_with_its_documentation():
    """So that help on `path.tension` shows it: help on a value shows that of an array."""
    tension = inspect.getattr_static(nf.EquilibriumPath, "tension")
    assert isinstance(tension, property)
    assert "Tendon tension, N" in (tension.__doc__ or "")
