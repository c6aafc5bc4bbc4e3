"""The records that all specifications share: limits, numbers of a robot, entries of quantities.

A new kind of limit is a key of `Between`, a new way to name entries a key of `Measured`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, replace
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from notchflex import InputError
from notchflex.specification.reading import OldWords, coded, known, record
from notchflex.support import QUANTITIES, Float, Int, ProblemError

SHORT_NAMES = {"strain": "peak_strain", "angle": "total_angle", "force": "contact_force"}
"""Short names of quantities that often have limits."""

LIMITED = {
    name: one
    for name, one in QUANTITIES.items()
    if one.kind is float
    and one.source != "path"
    and "row" not in one.per
    and name != "moment_error"
}
"""Quantities that may have limits: numbers that a batch returns."""

_FRACTIONS = ("peak_strain", "outer_strain", "fatigue_margin")


def as_list(given: Any) -> Any:
    """Take a single entry as a list of one."""
    several = isinstance(given, Sequence) and not isinstance(given, str | bytes)
    return given if several or given is None else (given,)


FromOne = Annotated[tuple[Annotated[Int, Field(ge=1)], ...], BeforeValidator(as_list)]
QuantityName = Annotated[str, BeforeValidator(lambda name: SHORT_NAMES.get(str(name), name))]


@record()
class Between:
    """Limits.

    Args:
        lower: The least value.
        upper: The greatest value.
    """

    lower: Float | None = None
    upper: Float | None = None

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest value, infinite where there is none."""
        low, high = self.lower, self.upper
        return -math.inf if low is None else low, math.inf if high is None else high

    def words(self, unit: str, scale: float = 1.0) -> str:
        """Return the limits in words, such as "at most 0.06".

        Args:
            unit: The unit that is written.
            scale: Takes the limits to this unit.
        """
        low, high = (f"{end * scale:g}" for end in self.ends)
        if self.lower is None or self.upper is None:
            words = f"at most {high}" if self.lower is None else f"at least {low}"
        else:
            words = f"{low} to {high}"
        return f"{words} {unit}".rstrip()

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, high = self.ends
        if not low < high:
            text = f"is {low:g}, not less than `upper`, {high:g}; exchange them."
            raise ProblemError([("lower", text)])
        return self


@record(kw_only=False)
class Varied(Between):
    """A number of the robot file or of a load, with its limits in the unit of the file.

    Args:
        value: Path of the robot file, such as `notch.depth`.
    """

    value: Annotated[str, Field(min_length=1)]


@record(kw_only=False)
class Measured(OldWords):
    """Entries of a quantity under a load; all of them where none is chosen.

    Args:
        quantity: Name of a quantity, such as "total_angle".
        load: Name of the load; not needed if there is one.
        notch: Only these notches, from 1: a number or several.
        tendon: Only these tendons, from 1.
        body: Only these bodies, 0 for the base.
        span: Only these spans of a tendon, from 1.
        contact: Only these contacts of a tendon, from 1.
        axis: Only this coordinate.
    """

    quantity: QuantityName
    _: KW_ONLY
    load: str | None = None
    notch: FromOne | None = None
    tendon: FromOne | None = None
    body: Annotated[tuple[Annotated[Int, Field(ge=0)], ...], BeforeValidator(as_list)] | None = None
    span: FromOne | None = None
    contact: FromOne | None = None
    axis: Literal["x", "y", "z"] | None = None


@record(kw_only=False, refuse=coded)
class LimitedQuantity(Between, Measured):
    """Entries of a quantity at a step of a load, and their limits; the others as of `Measured`.

    Args:
        quantity: Name of a quantity, such as "total_angle".
        step: Step of the load, from 1; the last where not given.
    """

    _: KW_ONLY
    step: Annotated[Int | None, Field(ge=1)] = None

    @property
    def text(self) -> str:
        """Quantity and limits in words, in the unit of files; from the unit inside Python."""
        quantity = QUANTITIES[self.quantity]
        return f"{quantity.title} {self.words(quantity.unit, quantity.scale)}"

    @property
    def in_python(self) -> Self:
        """The same with limits in the unit inside Python (rad), from those of files (deg)."""
        check_quantity(self)
        scale = QUANTITIES[self.quantity].scale
        low, high = (None if end is None else end / scale for end in (self.lower, self.upper))
        return replace(self, lower=low, upper=high)


def check_quantity(asked: LimitedQuantity) -> None:
    """Raise if a quantity has no limits or not these entries, or a limit is one in percent.

    Raises:
        InputError: It is so.
    """
    quantity = known(asked.quantity, LIMITED, "quantity with limits")
    check_axes(asked, quantity.per)
    check_percent(quantity.name, *asked.ends)


def check_percent(name: str, *limits: float | None) -> None:
    """Raise if a limit of a strain is beyond 1.

    Raises:
        InputError: It is so.
    """
    if name in _FRACTIONS and any(1.0 < abs(end) < math.inf for end in limits if end is not None):
        raise InputError.OUT_OF_RANGE(f"a {name} beyond 1 is more than 100 %; give 0.06 for 6 %.")


def check_axes(asked: Measured, per: Sequence[str]) -> None:
    """Raise if entries are named that a quantity does not have.

    Args:
        asked: The quantity.
        per: What its entries stand for.

    Raises:
        InputError: It is so.
    """
    for key in ("notch", "tendon", "body", "span", "contact", "axis"):
        if getattr(asked, key) is not None and key not in per:
            has = f"one number per {' and '.join(per)}" if per else "a single number"
            raise InputError.CONFLICT(f"`{key}` is given, but {asked.quantity} has {has}.")
