"""Specification of robots within tolerances: loads, acceptance limits, yield."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields
from typing import Any, Literal

from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import OUTPUTS
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.validation import check_integer, check_number, short_repr
from notchflex.robot.error_messages import nearest

INDICES = ("tendon", "notch", "body", "axis", "span", "contact")
"""Keys of a limit that say which entry of a quantity is meant."""

AXES = ("x", "y", "z")

LIMITED = tuple(
    name
    for name in OUTPUTS
    if REGISTERED[name].kind is float
    and "row" not in REGISTERED[name].per
    and name not in ("moment_error", "residual")
)
"""Quantities that may have limits: numbers that a batch returns."""


@dataclass(frozen=True)
class AcceptanceLimit:
    """Between what a quantity of a robot that is accepted must lie.

    Attributes:
        quantity: Name of a quantity of `EquilibriumPath`, such as "total_angle".
        lower: Smallest value, in mm, N, MPa or rad; None for no limit.
        upper: Largest value; None for no limit.
        load: Name of the load; None for the only one.
        step: Step of the load, from 1; None for the last.
        notch: Which notch, from 1; None for every notch separately.
        tendon: Which tendon, from 1; None for every one.
        body: Which body, 0 for the base; None for every one.
        span: Which span of a tendon, from 1; None for every one.
        contact: Which contact of a tendon, from 1; None for every one.
        axis: "x", "y" or "z": needed of a vector.
    """

    quantity: str
    _: KW_ONLY
    lower: float | None = None
    upper: float | None = None
    load: str | None = None
    step: int | None = None
    notch: int | None = None
    tendon: int | None = None
    body: int | None = None
    span: int | None = None
    contact: int | None = None
    axis: Literal["x", "y", "z"] | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a robot."""
        if self.quantity not in LIMITED:
            near = nearest(str(self.quantity), LIMITED)
            raise InputError.UNKNOWN_NAME(
                f"a limit needs the name of a quantity; got {short_repr(self.quantity)}{near}. "
                f"Allowed: {', '.join(LIMITED)}."
            )
        per, what = REGISTERED[self.quantity].per, f"the limit of {self.quantity}"
        for key in INDICES:
            if getattr(self, key) is not None and key not in per:
                has = f"one value per {' and '.join(per)}" if per else "a single value"
                raise InputError.CONFLICT(f"{what} names a {key}, but there is {has}.")
        if "axis" in per and self.axis not in AXES:
            got = "" if self.axis is None else f"; got {short_repr(self.axis)}"
            raise InputError.MISSING_VALUE(f'{what} needs an axis, "x", "y" or "z"{got}.')
        ends = [
            None if end is None else check_number(end, what) for end in (self.lower, self.upper)
        ]
        if any(end is not None and not math.isfinite(end) for end in ends):
            raise InputError.NOT_FINITE(f"{what} is not finite; leave out a side without a limit.")
        lower, upper = ends
        if lower is None and upper is None:
            raise InputError.MISSING_VALUE(f"{what} has neither lower nor upper; give one or both.")
        if lower is not None and upper is not None and lower >= upper:
            raise InputError.OUT_OF_RANGE(
                f"{what} has lower {lower:g} and upper {upper:g}; lower must be smaller."
            )
        if self.load is not None and not isinstance(self.load, str):  # pyright: ignore
            raise InputError.WRONG_TYPE(f"{what} needs the name of a load; got {self.load!r}.")
        for key in ("step", "notch", "tendon", "body", "span", "contact"):
            number, least = getattr(self, key), int(key != "body")
            if number is not None and check_integer(number, f"{key} of {what}") < least:
                raise InputError.OUT_OF_RANGE(
                    f"{what} has {key} {number}; give a whole number, {least} or more."
                )


LIMIT_KEYS = tuple(one.name for one in fields(AcceptanceLimit) if not one.kw_only) + tuple(
    one.name for one in fields(AcceptanceLimit) if one.kw_only
)


@dataclass(frozen=True)
class ToleranceSpec:
    """Loads, acceptance limits and tolerances of a robot that is made many times.

    Attributes:
        limits: What a robot must meet to be accepted, all of it.
        loads: By name, as for `simulate`; each is followed from rest.
        tolerances: As in the `[tolerance]` table of a robot file, and nothing else. None takes the
            table of the robot, and assumes the rest, as `uncertain` does.
        wanted_yield: The part of all robots that should be accepted, between 0 and 1; None where
            no tolerance shall be changed for it.

    Example:
        >>> from notchflex import pull
        >>> limit = AcceptanceLimit("total_angle", lower=0.8, upper=1.0)
        >>> ToleranceSpec([limit], {"pulled": pull(0.0, 1.0, steps=3)}).limits[0].upper
        1.0
    """

    limits: Sequence[AcceptanceLimit]
    loads: Mapping[str, LoadPath | Load | Sequence[Load]]
    tolerances: Mapping[str, Any] | None = field(default=None)
    wanted_yield: float | None = None

    def __post_init__(self) -> None:
        """Check names of loads and the wanted yield."""
        if not isinstance(self.loads, Mapping) or not self.loads:  # pyright: ignore
            raise InputError.NO_DATA(
                'a tolerance analysis needs loads by name, such as {"pulled": pull(0.0, 2.0)}'
            )
        limits = [self.limits] if isinstance(self.limits, AcceptanceLimit) else list(self.limits)
        object.__setattr__(self, "limits", tuple(limits))
        if not self.limits:
            raise InputError.NO_DATA("a tolerance analysis needs at least one acceptance limit.")
        for limit in self.limits:
            if not isinstance(limit, AcceptanceLimit):  # pyright: ignore
                raise InputError.WRONG_TYPE(
                    f"limits must be notchflex.AcceptanceLimit; got {short_repr(limit)}"
                )
            self.load_of(limit)
        target = self.wanted_yield
        if target is not None and not 0.0 < check_number(target, "wanted_yield") < 1.0:
            raise InputError.OUT_OF_RANGE(
                f"the wanted yield must lie between 0 and 1, such as 0.95; got {target:g}."
            )

    def load_of(self, limit: AcceptanceLimit) -> str:
        """Return the name of the load that a limit belongs to."""
        names = list(self.loads)
        if limit.load is None and len(names) == 1:
            return names[0]
        allowed = f"allowed: {', '.join(names)}"
        if limit.load is None:
            raise InputError.MISSING_VALUE(
                f"the limit of {limit.quantity} must name one of the loads; {allowed}."
            )
        if limit.load not in names:
            near = nearest(limit.load, names)
            raise InputError.UNKNOWN_NAME(
                f'the limit of {limit.quantity} names the load "{limit.load}"{near}; {allowed}.'
            )
        return limit.load
