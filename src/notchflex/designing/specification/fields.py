"""Kinds of values in the tables of a design file."""

from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from notchflex.errors import InputError
from notchflex.robot.part import Float, FloatOrInf, Int, ProblemError

REFUSE = InputError.INVALID_SPECIFICATION

_LARGE = 1e9


def number(text: str, **limits: float) -> Any:
    """Describe a number whose unit is that of a quantity."""
    return Field(description=text, **({"ge": -_LARGE, "le": _LARGE} | limits))  # pyright: ignore


def check_order(lower: float, upper: float, otherwise: str) -> None:
    """Raise if a least value is not less than the greatest; `otherwise` says what else to do."""
    if not lower < upper:
        text = f"is {lower:g}, not less than `upper`, {upper:g}; exchange them, or {otherwise}."
        raise ProblemError([("lower", text)])


def _one_or_several(value: Any) -> Any:
    """Take a single entry as a list of one."""
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    return value if several or value is None else (value,)


Numbers = Annotated[tuple[Int, ...], BeforeValidator(_one_or_several)]
Commanded = Annotated[tuple[FloatOrInf, ...], BeforeValidator(_one_or_several)]
Vector = Annotated[tuple[Float, ...], Field(min_length=3, max_length=3)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=40)]
WANTED = Field(
    ge=0.5, le=0.9999, description="part of the robots made within tolerances that must meet limits"
)
