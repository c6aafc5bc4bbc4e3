"""What every part of a robot is: a frozen dataclass, checked by pydantic when it is made."""

import dataclasses
import functools
import inspect
import operator
import warnings
from collections.abc import Callable, Iterable
from typing import Annotated, Any, TypeVar, cast, dataclass_transform, get_type_hints, overload

import pydantic.dataclasses
from pydantic import BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError

from notchflex.errors import InputError
from notchflex.robot.error_messages import sentences

T = TypeVar("T")


class ProblemError(ValueError):
    """What a check across several keys found: pairs of a key (a path below the part) and a text.

    The text goes on after the name of the key: "is 1.7 mm; it must be ...".
    """

    def __init__(self, problems: Iterable[tuple[str, str]]):
        self.found = list(problems)
        super().__init__("\n".join(f"`{key}` {text}" for key, text in self.found))


@overload
def part(cls: type[T]) -> type[T]: ...
@overload
def part(
    *, kw_only: bool, refuse: Callable[[str], InputError] = InputError.INVALID_ROBOT
) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(Field,))
def part(
    cls: type[T] | None = None,
    *,
    kw_only: bool = False,
    refuse: Callable[[str], InputError] = InputError.INVALID_ROBOT,
) -> Any:
    """Make a class a frozen pydantic dataclass that says clearly what is wrong with its values.

    Wrong values raise `InputError`; unknown keys are refused by name. What the attribute `warnings`
    of an object holds is given as Python warnings when it is made by its class.

    Args:
        cls: The class with its annotated fields.
        kw_only: Whether its fields are keyword arguments only, here and in what derives from it.
        refuse: Makes the error of a message, with its code.
    """
    if cls is None:
        return functools.partial(_part, kw_only=kw_only, refuse=refuse)
    return _part(cls, kw_only=kw_only, refuse=refuse)


def _part(cls: type[T], *, kw_only: bool, refuse: Callable[[str], InputError]) -> type[T]:
    dataclass = pydantic.dataclasses.dataclass(
        frozen=True, kw_only=kw_only, config=ConfigDict(extra="forbid")
    )
    decorated: Any = dataclass(cls)
    checked_init = decorated.__init__

    @functools.wraps(checked_init)
    def checked(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            checked_init(self, *args, **kwargs)
        except ValidationError as error:
            problems = sentences(error, decorated)
            raise refuse("\n".join(f"{decorated.__name__}: {one}" for one in problems)) from None
        for warning in getattr(self, "warnings", ()):
            warnings.warn(warning, stacklevel=2)

    decorated.__init__ = checked
    decorated.__signature__ = _plain_signature(decorated)
    return decorated


def _plain_signature(cls: Any) -> inspect.Signature:
    """Return the signature of a class without the checks of its annotations, for help."""
    signature = inspect.signature(cls)
    names = {name: one.annotation for name, one in signature.parameters.items()}
    namespace = {"__annotations__": names, "__module__": cls.__module__}
    plain = get_type_hints(type(cls.__name__, (), namespace))
    return signature.replace(
        parameters=[one.replace(annotation=plain[n]) for n, one in signature.parameters.items()]
    )


def unchecked(part: T, **values: Any) -> T:
    """Return a part with other values that nothing checks, such as numbers that are traced."""
    other = object.__new__(type(part))
    names = {field.name for field in dataclasses.fields(cast("Any", part))}
    vars(other).update({name: one for name, one in vars(part).items() if name in names} | values)
    return other


def _as_float(value: object) -> float:
    """Take any real number (of numpy too), but no truth value and no text."""
    if isinstance(value, (bool, str, bytes)) or not hasattr(value, "__float__"):
        raise PydanticCustomError("number_wanted", "a number is wanted")
    try:
        return float(value)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError, OverflowError):
        raise PydanticCustomError("number_wanted", "a number is wanted") from None


def _as_int(value: object) -> int:
    """Take any whole number type (of numpy too), but no truth value, no text and no float."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise PydanticCustomError("whole_number_wanted", "a whole number is wanted")
    try:
        return operator.index(value)  # pyright: ignore[reportArgumentType]
    except TypeError:  # an array of several numbers, or of floats
        raise PydanticCustomError("whole_number_wanted", "a whole number is wanted") from None


Float = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_as_float)]
"""A finite float64."""
FloatOrInf = Annotated[float, BeforeValidator(_as_float)]
"""A float64 that may be infinite; a bound of `quantity` keeps NaN out."""
Int = Annotated[int, BeforeValidator(_as_int)]
"""A whole number."""


# What a number of a unit may be at most, and at least where it must be greater than 0: far beyond
# every robot, and near enough that nothing computed from it overflows.
_MIN_MAGNITUDE = {"mm": 1e-6, "MPa": 1e-6, "N": 1e-6, "kg/m3": 1e-6, "deg": 1e-6, "": 1e-9}
_MAX_MAGNITUDE = {"mm": 1e6, "MPa": 1e9, "kg/m3": 1e6, "deg": 3600.0, "": 1e3}

MOST_STRAIN = 0.5
"""Beyond every material of a robot; a strain above it was meant in percent."""


def quantity(
    unit: str,
    text: str,
    *,
    above: float | None = None,
    below: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    usual: tuple[float, float] | None = None,
) -> Any:
    """Describe a number for use in `Annotated`: its unit, what it is, and what is allowed.

    Args:
        unit: Unit as in the robot file ("mm", "N", "MPa", "deg"); "" for a pure number.
        text: What the number is; goes into the JSON Schema, into messages and written files.
        above: Exclusive lower bound.
        below: Exclusive upper bound.
        at_least: Inclusive lower bound.
        at_most: Inclusive upper bound.
        usual: Lowest and highest usual value; beyond them `Robot.warnings` asks what was meant.

    Where a bound is not given, the limits of the unit apply: 1e-6 to 1e6 mm, 1e-6 to 1e9 MPa, 3600
    deg and so on.
    """
    if above == 0.0 and at_least is None:
        at_least = _MIN_MAGNITUDE.get(unit)
    if at_most is None and below is None:
        at_most = _MAX_MAGNITUDE.get(unit)
    if above is None and at_least is None and unit in _MAX_MAGNITUDE:
        at_least = -_MAX_MAGNITUDE[unit]
    extra: dict[str, Any] = {"unit": unit} if unit else {}
    if usual:
        extra["usual"] = list(usual)
    return Field(
        gt=above,
        lt=below,
        ge=at_least,
        le=at_most,
        description=text,
        json_schema_extra=extra or None,
    )
