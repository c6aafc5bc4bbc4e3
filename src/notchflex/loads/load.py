"""One load on a robot: its tendons pulled or drawn, external loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import isfinite, isnan, nan
from typing import Any

import numpy as np

from notchflex.errors import InputError
from notchflex.loads.external import ExternalLoad
from notchflex.loads.validation import check_number, short_repr

BASE_TURN = ("base_rotation", "rotation vector, rad")
"""Name and form of the rotation of the base, for messages."""

NO_TURN = (0.0, 0.0, 0.0)
"""Rotation vector of a base that is not turned."""

_PER_TENDON = "a number, or one entry per tendon with None where nothing is commanded"


@dataclass(frozen=True, repr=False)
class Load(ExternalLoad):
    """One load on a robot.

    Args:
        tension: Tension at the base of every tendon, N. A single number pulls the first tendon;
            a sequence has one entry per tendon, None where its tension is not commanded.
        stroke: Tendon drawn out at the base since the free robot, mm; in the same form.
        base_rotation: Rotation vector of the base in the world, rad.
        tip_force: Force at the tip, N; in the world, or in the tip's frame if `following`.
        tip_moment: Moment at the tip, N mm; in the same frame.
        tip_point: Where the tip force acts and the tip mass hangs, from the tip (the end of the
            last uncut length, on the tube axis), in the tip's frame, mm.
        following: Whether tip force and tip moment turn with the tip.
        body_forces: Forces and moments on single bodies, each a `BodyForce`.
        tip_mass: Mass that hangs at the tip point, g.
        gravity: Acceleration of gravity in the world, m/s^2. Given, the robot's own weight counts
            where its material has a density. Not given, a tip mass hangs along (0, 0, -9.81).

    A tendon of which neither tension nor stroke is commanded hangs slack (0 N).

    Raises:
        InputError: An invalid external load; tensions and strokes are checked when the robot is
            known.

    Example:
        >>> Load(tension=2.0, tip_force=(0.0, 0.1, 0.0))
        Load(tension=2.0, tip_force=(0.0, 0.1, 0.0))
    """

    tension: float | Sequence[float | None] | None = None
    stroke: float | Sequence[float | None] | None = None
    base_rotation: Sequence[float] = NO_TURN

    def __repr__(self) -> str:
        """Show what is given; tendons first."""
        ordered = sorted(fields(self), key=lambda one: bool(one.kw_only))
        values = {one.name: getattr(self, one.name) for one in ordered}
        unlike = {one.name for one in ordered if repr(values[one.name]) != repr(one.default)}
        given = (f"{name}={value!r}" for name, value in values.items() if name in unlike)
        return f"Load({', '.join(given)})"

    def per_tendon(self, what: str, tendons: int) -> list[float]:
        """Return tension (N) or stroke (mm) of every tendon, NaN where not commanded.

        Args:
            what: "tension" or "stroke".
            tendons: Number of tendons of the robot.

        Raises:
            InputError: Too many entries, or one that is not a finite number.
        """
        value = getattr(self, what)
        entries = [nan] * tendons
        if value is None:
            return entries
        if hasattr(value, "__array__"):
            value = np.asarray(value).tolist()
        several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
        given: list[Any] = list(value) if several else [value]
        if len(given) > tendons:
            raise InputError.WRONG_SHAPE(
                f"{what} has {len(given)} entries, but the robot has {tendons} tendons; "
                f"give at most {tendons}"
            )
        for i, entry in enumerate(given):
            if entry is not None:
                entries[i] = check_number(entry, what, _PER_TENDON)
                if not isfinite(entries[i]):
                    raise InputError.NOT_FINITE(f"{what} must be finite; got {short_repr(entry)}")
        return entries


def entries_of(values: np.ndarray) -> float | list[float | None] | None:
    """Return an entry per tendon as a `Load` takes them: a number for a single tendon."""
    entries = [None if isnan(value) else value for value in values.tolist()]
    if all(entry is None for entry in entries):
        return None
    return entries[0] if len(entries) == 1 else entries


__all__ = ["BASE_TURN", "NO_TURN", "Load"]
