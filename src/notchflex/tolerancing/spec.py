"""Specification of robots within tolerances: loads, acceptance limits, and their files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from notchflex import EquilibriumPath, InputError, Robot
from notchflex.specification import (
    Criterion,
    LimitedQuantity,
    LoadTables,
    OldWords,
    as_list,
    check_quantity,
    coded,
    known_numbers,
    load_named,
    made,
    placed,
    read_load,
    record,
)
from notchflex.support import QUANTITIES, AnyPath, Float, read_specification


@record(kw_only=False, refuse=coded)
class AcceptanceLimit(LimitedQuantity):
    """Between what a quantity of a robot that is accepted must lie.

    Args:
        quantity: Name of a quantity of `EquilibriumPath`, such as "total_angle".
        lower: Smallest value, in mm, N, MPa or rad; None for no limit.
        upper: Largest value; None for no limit.
        load: Name of the load; None for the only one.
        step: Step of the load, from 1; None for the last.
        notch: Which notches, from 1: a number or several; None for every notch separately.
        tendon: Which tendons, from 1; None for every one.
        body: Which bodies, 0 for the base; None for every one.
        span: Which spans of a tendon, from 1; None for every one.
        contact: Which contacts of a tendon, from 1; None for every one.
        axis: "x", "y" or "z": needed of a vector.

    Raises:
        InputError: No such quantity, no limit, or limits or entries that cannot be.
    """

    @model_validator(mode="after")
    def _has_limits(self) -> AcceptanceLimit:
        check_quantity(self)
        if "axis" in QUANTITIES[self.quantity].per and self.axis is None:
            raise InputError.MISSING_VALUE(f'{self.quantity} needs an axis, "x", "y" or "z".')
        if self.lower is None and self.upper is None:
            raise InputError.MISSING_VALUE(
                f"the limit of {self.quantity} has neither `lower` nor `upper`; give one or both."
            )
        return self


_Limits = Annotated[
    tuple[AcceptanceLimit, ...],
    BeforeValidator(as_list),
    Field(min_length=1),
]
_Tolerances = Mapping[str, Any] | None
_Yield = Annotated[Float | None, Field(gt=0.0, lt=1.0)]


@record(kw_only=False, refuse=coded)
class ToleranceSpec:
    """Loads, acceptance limits and tolerances of a robot that is made many times.

    Args:
        limits: What a robot must meet to be accepted, all of it.
        loads: Loads by name, as for `simulate`; each is followed from rest.
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

    limits: _Limits
    loads: Annotated[Mapping[str, Any], Field(min_length=1)]
    tolerances: _Tolerances = None
    wanted_yield: _Yield = None

    @model_validator(mode="after")
    def _has_loads(self) -> ToleranceSpec:
        for limit in self.limits:
            with placed(f"the limit of {limit.quantity}"):
                load_named(limit, self.loads)
        return self


@record(refuse=coded)
class ToleranceFile(OldWords):
    """What a file of tolerances holds, in mm, N, MPa and deg.

    Args:
        load: Loads by name; the keys are the options of `notchflex simulate`.
        accept: What a robot must meet to be accepted.
        tolerance: As in a robot file; those of the robot where not given.
        wanted_yield: The part of all robots that should be accepted.
    """

    load: LoadTables
    accept: _Limits
    tolerance: _Tolerances = None
    wanted_yield: _Yield = None


def read_tolerance_spec(file: AnyPath, robot: Robot) -> ToleranceSpec:
    """Read a file of tolerances and acceptance limits.

    Args:
        file: A TOML file in mm, N, MPa and deg with `[load.NAME]`, `[[accept]]`, `wanted_yield` if
            wanted and, if the robot's own are not meant, `[tolerance]`.
        robot: The robot that it is for.

    Returns:
        What the file asks, in mm, N, MPa and rad.

    Raises:
        InputError: There is no such file, or it cannot be used; the message names the key.
    """

    def make(table: Mapping[str, Any]) -> ToleranceSpec:
        asked = made(ToleranceFile, table, coded)
        loads = {name: read_load(one, name, robot) for name, one in asked.load.items()}
        limits = tuple(limit.in_python for limit in asked.accept)
        return ToleranceSpec(limits, loads, asked.tolerance, asked.wanted_yield)

    return read_specification(file, "file of tolerances", make)


def criteria_of(spec: ToleranceSpec, paths: Mapping[str, EquilibriumPath]) -> list[Criterion]:
    """Find the numbers that limits are about.

    Args:
        spec: The limits.
        paths: The robot of the drawing under every load.

    Raises:
        InputError: A robot or a load has no such entry or step, or it is not known.
    """
    criteria: list[Criterion] = []
    for limit in spec.limits:
        with placed(f"the limit of {limit.quantity}"):
            criteria += known_numbers(limit, paths)
    return criteria
