"""Typed properties for every quantity of a path and of an equilibrium.

Their documentation and their values come from the registry (`notchflex._quantity`).
"""

from __future__ import annotations

from typing import Any, Generic, NoReturn, Self, TypeVar, overload

import numpy as np

from notchflex._quantity import REGISTERED
from notchflex.results.quantities import (
    path_formulas as path_formulas,  # registers the last quantities
)

QUANTITIES = {name: one for name, one in REGISTERED.items() if one.title}
"""Every quantity of a solved state, by the attribute that holds it."""

_Many = TypeVar("_Many")
_One = TypeVar("_One")


class _Property(property, Generic[_Many, _One]):
    """A quantity as property: values of every step of a path, or the value of one equilibrium.

    A property of Python, so that help on `path.tension` tells what it is, not what an array is.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        one = QUANTITIES[name]
        self._name, self.__doc__ = name, f"{one.summary}\n\n{one.text}"

    @overload
    def __get__(self, thing: None, owner: type) -> Self: ...
    @overload
    def __get__(self, thing: PathQuantities, owner: type) -> _Many: ...
    @overload
    def __get__(self, thing: EquilibriumQuantities, owner: type) -> _One: ...
    def __get__(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, thing: _Quantities | None, owner: type
    ) -> Any:
        return self if thing is None else thing.quantity(self._name)

    def __set__(self, thing: _Quantities, value: object) -> NoReturn:
        raise AttributeError(f"{self._name} is a result and cannot be set")


class Number(_Property[np.ndarray, float]):
    """One number a step."""


class Flag(_Property[np.ndarray, bool]):
    """True or false at every step."""


class Count(_Property[np.ndarray, int]):
    """A whole number a step."""


class Text(_Property[list[str], str]):
    """A text a step."""


class Array(_Property[np.ndarray, np.ndarray]):
    """An array a step."""


class _Quantities:
    """Axes are those of one state; those of a path have the steps before them."""

    def quantity(self, name: str) -> Any:
        """Return a quantity by its name."""
        raise NotImplementedError

    # Written by docs/make/quantity_properties.py:
    commanded_tension = Array()
    """Commanded tension, N, shape (t)."""
    commanded_stroke = Array()
    """Commanded stroke, mm, shape (t)."""
    tension = Array()
    """Tendon tension, N, shape (t)."""
    stroke = Array()
    """Tendon stroke, mm, shape (t)."""
    notch_angle = Array()
    """Notch angle, rad, shape (n)."""
    edge_angle = Array()
    """Edge angle, rad, shape (n)."""
    chord_angle = Array()
    """Chord angle, rad, shape (n)."""
    total_chord_angle = Number()
    """Total chord angle, rad."""
    total_angle = Number()
    """Total bending angle, rad."""
    tip_axis_angle = Number()
    """Angle between the axes of base and tip, rad."""
    tip_position = Array()
    """Tip position, mm, shape (3)."""
    tip_rotation = Array()
    """Tip rotation, shape (3, 3)."""
    body_position = Array()
    """Body position, mm, shape (bodies, 3)."""
    body_rotation = Array()
    """Body rotation, shape (bodies, 3, 3)."""
    span_tension = Array()
    """Span tension, N, shape (t, spans)."""
    notch_moment = Array()
    """Notch moment, N mm, shape (n)."""
    outer_strain = Array()
    """Outer strain, shape (n)."""
    peak_strain = Array()
    """Peak strain, shape (n)."""
    gap = Array()
    """Notch gap, mm, shape (n)."""
    closed = Array()
    """Closed, shape (n)."""
    contact_force = Array()
    """Contact force, N, shape (n)."""
    contact_log_ratio = Array()
    """Tension ratio over a contact, shape (t, contacts)."""
    contact_slid = Array()
    """Slid length, mm, shape (t, contacts)."""
    contact_turning = Array()
    """Turning at a contact, rad, shape (t, contacts)."""
    contact_state = Array()
    """State of a contact, shape (t, contacts)."""
    contact_bound = Array()
    """Largest tension ratio over a contact, shape (t, contacts)."""
    dissipation = Array()
    """Dissipation, N mm, shape (t, contacts)."""
    material_dissipation = Array()
    """Dissipation of the material, N mm, shape (n)."""
    front_contact = Array()
    """Friction front, shape (t)."""
    front_eta = Array()
    """Friction at the front, shape (t)."""
    base_force = Array()
    """Base force, N, shape (3)."""
    base_moment = Array()
    """Base moment, N mm, shape (3)."""
    moment_error = Number()
    """Moment error."""
    stored_energy = Number()
    """Stored energy, N mm."""
    tendon_work = Array()
    """Tendon work, N mm, shape (t)."""
    converged = Flag()
    """Converged."""
    reason = Text()
    """Reason."""
    reason_code = Text()
    """Code of the reason."""
    stable = Flag()
    """Stable."""
    smallest_eigenvalue = Number()
    """Smallest eigenvalue, N mm."""
    determinant_sign = Number()
    """Sign of the determinant."""
    snap = Array()
    """Snap, shape (n)."""
    residual = Number()
    """Residual."""
    iterations = Count()
    """Iterations."""


class PathQuantities(_Quantities):
    """Quantities of every step, as leading axis: n notches, t tendons, n + 1 bodies."""


class EquilibriumQuantities(_Quantities):
    """Quantities of one equilibrium: n notches, t tendons, n + 1 bodies."""
