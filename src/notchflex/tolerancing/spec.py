"""Specification of robots within tolerances: loads, acceptance limits, and their files."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from typing import Any, Literal, Protocol, cast

import numpy as np
from jaxtyping import Float

from notchflex import BodyForce, EquilibriumPath, InputError, Load, LoadPath, Robot
from notchflex.analysis.outputs import OUTPUTS
from notchflex.robot.part import unknown_key
from notchflex.support import (
    REGISTERED,
    Quantity,
    TendonCommand,
    check_integer,
    check_number,
    holds,
    load_columns,
    nearest,
    parse_toml,
    parse_vector,
    read_body_force,
    read_command,
    read_text,
    short_repr,
)

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


_TABLES = ("load", "accept", "tolerance", "yield")
_VECTORS = ("tip_force", "tip_moment", "tip_point", "gravity")
LOAD_KEYS = (
    *("tension", "stroke", "base_rotation"),
    *_VECTORS,
    *("tip_mass", "body_force", "following"),
)
"""Keys of a load in a file."""


def read_tolerance_spec(file: str | os.PathLike[str], robot: Robot) -> ToleranceSpec:
    """Read a file of tolerances and acceptance limits.

    Args:
        file: A TOML file in mm, N, MPa and deg with `[load.NAME]`, `[[accept]]` and, if the robot's
            own are not meant, `[tolerance]`; and `wanted` in `[yield]`.
        robot: The robot that it is for.

    Returns:
        What the file asks, in mm, N, MPa and rad.

    Raises:
        InputError: There is no such file, or it cannot be used; the message names the key.
    """
    name = os.fspath(file)
    table = parse_toml(read_text(file, "TOML file"), name)
    try:
        return spec_of(table, robot)
    except InputError as problem:
        raise type(problem)(f"{name}: {problem}", problem.code) from None


def spec_of(table: Mapping[str, Any], robot: Robot) -> ToleranceSpec:
    """Make a specification from the table of a file.

    Args:
        table: As read from TOML.
        robot: The robot that it is for.
    """
    for key in table:
        if key not in _TABLES:
            raise InputError.UNKNOWN_NAME(unknown_key(key, key, _TABLES))
    loads = _table(table, "load")
    if not loads:
        raise InputError.MISSING_VALUE(
            'there is no load; write, for example, [load.pulled] and below it tension = "0:2:5".'
        )
    yields = _table(table, "yield")
    _known(yields, ("wanted",), "yield")
    target = yields.get("wanted")
    return ToleranceSpec(
        list(_limits(table)),
        {name: read_load(_table(loads, name, "load."), name, robot) for name in loads},
        cast("Mapping[str, Any] | None", table.get("tolerance")),
        None if target is None else check_number(target, "yield.wanted"),
    )


def _table(table: Mapping[str, Any], key: str, before: str = "") -> dict[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InputError.WRONG_TYPE(f"`{before}{key}` is not a table; write [{before}{key}].")
    return cast("dict[str, Any]", value)


def _known(table: Mapping[str, Any], allowed: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in allowed:
            raise InputError.UNKNOWN_NAME(unknown_key(f"{where}.{key}", key, allowed))


def _limits(table: Mapping[str, Any]) -> Iterator[AcceptanceLimit]:
    given = table.get("accept", [])
    if not isinstance(given, list) or not given:
        raise InputError.MISSING_VALUE(
            "there is no acceptance limit; write, for example, [[accept]] and below it quantity = "
            '"total_angle" and lower = 80.0.'
        )
    for number, one in enumerate(cast("list[Any]", given), start=1):
        where = f"accept[{number}]"
        if not isinstance(one, dict):
            raise InputError.WRONG_TYPE(f"`{where}` is not a table; write [[accept]].")
        keys = cast("dict[str, Any]", one)
        _known(keys, LIMIT_KEYS, where)
        if "quantity" not in keys:
            raise InputError.MISSING_VALUE(f"`{where}.quantity` is missing.")
        try:
            limit = AcceptanceLimit(**keys)
        except InputError as problem:
            raise type(problem)(f"`{where}`: {problem}", problem.code) from None
        scale = REGISTERED[limit.quantity].scale
        ends = {
            key: None if (end := getattr(limit, key)) is None else end / scale
            for key in ("lower", "upper")
        }
        yield replace(limit, **ends)


def read_load(table: Mapping[str, Any], name: str, robot: Robot) -> LoadPath:
    """Make a load of the table of a file, whose keys are the options of `notchflex simulate`.

    Args:
        table: As read from TOML.
        name: Name of the load, for messages.
        robot: The robot that it is for.
    """
    where = f"load.{name}"
    _known(table, LOAD_KEYS, where)
    commands = {
        key: [_command(key, where, one) for one in _several(table.get(key))]
        for key in ("tension", "stroke")
    }
    if not table:
        raise InputError.MISSING_VALUE(
            f'`{where}` is empty; write, for example, tension = "0:2:5".'
        )
    if not any(commands.values()):
        commands["tension"] = [TendonCommand("tension", 1, [float("nan")])]  # all hang slack
    try:
        tensions, strokes = load_columns(
            commands["tension"], commands["stroke"], robot.number_of_tendons
        )
        turn = np.radians(_vector(table.get("base_rotation", (0.0, 0.0, 0.0)), "angles in deg"))
        return _loaded(LoadPath(tensions, strokes, turn), table)
    except InputError as problem:
        raise type(problem)(f"`{where}`: {problem}", problem.code) from None


def _several(given: Any) -> list[Any]:
    if given is None:
        return []
    return cast("list[Any]", given) if isinstance(given, list) else [given]


def _command(key: str, where: str, given: Any) -> TendonCommand:
    """Read a number or a text such as `0:2:5` or `1=0:2:5`."""
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise InputError.WRONG_TYPE(
            f'`{where}.{key}` is {short_repr(given)}; give a number, or text such as "0:2:5".'
        )
    text = given if isinstance(given, str) else repr(given)
    try:
        return read_command(f"{where}.{key}", key == "stroke", text)
    except InputError as problem:
        raise type(problem)(f"`{where}.{key}`: {problem}", problem.code) from None


def _vector(given: Any, what: str) -> tuple[float, float, float]:
    """Read three numbers, or the text `X,Y,Z`."""
    if isinstance(given, list | tuple):
        given = ",".join(repr(one) for one in cast("list[Any]", given))
    return parse_vector(what)(str(given))


def _loaded(path: LoadPath, table: Mapping[str, Any]) -> LoadPath:
    """Put external loads on all steps."""
    vectors = {key: _vector(table[key], f"numbers of {key}") for key in _VECTORS if key in table}
    following = table.get("following", False)
    forces = [
        BodyForce(body, force, point=point or (0.0, 0.0, 0.0), following=following)
        for body, force, point in (
            read_body_force(str(one)) for one in _several(table.get("body_force"))
        )
    ]
    turns = {"following": following} if following and {"tip_force", "tip_moment"} & {*table} else {}
    mass = {"tip_mass": table["tip_mass"]} if "tip_mass" in table else {}
    bodies = {"body_forces": forces} if forces else {}
    external: dict[str, Any] = {**vectors, **mass, **bodies, **turns}
    return path.loaded(**external) if external else path


# Quantities that are pure numbers of at most 1; a limit beyond is one in percent.
_PARTS = ("peak_strain", "outer_strain")
FIRST = {"body": 0}
"""The number of the first entry along an axis, where it is not 1."""


class Limited(Protocol):
    """What names entries of a quantity, such as an `AcceptanceLimit`; None for all of them."""

    @property
    def quantity(self) -> str:
        """Name of the quantity."""
        ...

    @property
    def step(self) -> int | None:
        """Step of the load, from 1; None for the last."""
        ...

    @property
    def lower(self) -> float | None:
        """Smallest value that is accepted."""
        ...

    @property
    def upper(self) -> float | None:
        """Largest value that is accepted."""
        ...


@dataclass(frozen=True)
class Criterion:
    """One number of a result with its limits, in mm, N, MPa and rad.

    Attributes:
        name: What it is called, such as `notch_angle[3] at pulled`.
        quantity: Its quantity.
        load: Name of the load.
        step: Step of the load, from 0.
        index: Place within the quantity of one step.
        lower: Smallest value that is accepted; -inf where there is none.
        upper: Largest value that is accepted; inf where there is none.
    """

    name: str
    quantity: Quantity
    load: str
    step: int
    index: tuple[int, ...]
    lower: float
    upper: float

    def of(self, values: np.ndarray) -> Float[np.ndarray, " rows"]:
        """Return the number of every row of what a batch returns, steps as second axis."""
        return values[(slice(None), self.step, *self.index)]


def criteria_of(spec: ToleranceSpec, paths: Mapping[str, EquilibriumPath]) -> list[Criterion]:
    """Find the numbers that limits are about.

    Args:
        spec: The limits.
        paths: The robot of the drawing under every load.

    Raises:
        InputError: A robot or a load has no such entry or step.
    """
    criteria: list[Criterion] = []
    for limit in spec.limits:
        load = spec.load_of(limit)
        criteria += entries_of(limit, load, paths[load], len(paths) > 1)
    return criteria


def entries_of(
    limit: Limited, load: str, path: EquilibriumPath, named: bool, what: str = "the limit"
) -> Iterator[Criterion]:
    """Yield the numbers of a result that a limit is about.

    Args:
        limit: The limit.
        load: Name of the load.
        path: The robot of the drawing under it.
        named: Whether their names say which load it is.
        what: What messages call it.
    """
    quantity, steps = REGISTERED[limit.quantity], len(path)
    check_percent(limit.quantity, (limit.lower, limit.upper))
    step = steps if limit.step is None else limit.step
    if step > steps:
        raise InputError.OUT_OF_RANGE(
            f"{what} of {limit.quantity} has step {step}, but the load {load} has {steps}."
        )
    if not holds(path, quantity):
        raise InputError.UNSUPPORTED(
            f"this robot has no {limit.quantity}; choose another quantity."
        )
    values = np.asarray(path.quantity(limit.quantity))[step - 1]
    choices = [
        _places(limit, axis, size, what)
        for axis, size in zip(quantity.per, values.shape, strict=True)
    ]
    at = [f"at {load}"] if named else []
    at += [f"step {step}"] if limit.step is not None else []
    lower, upper = (
        default if end is None else float(end)
        for end, default in ((limit.lower, -np.inf), (limit.upper, np.inf))
    )
    for position in np.ndindex(*map(len, choices)):
        index = tuple(choice[one] for choice, one in zip(choices, position, strict=True))
        if not np.isfinite(values[index]):  # beyond the end of a tendon
            continue
        words = " ".join([_entry(limit.quantity, quantity.per, index), ", ".join(at)]).strip()
        yield Criterion(words, quantity, load, step - 1, index, lower, upper)


def check_percent(name: str, limits: Iterable[float | None]) -> None:
    """Raise if a limit of a strain is one in percent.

    Raises:
        InputError: It is beyond 1.
    """
    if name in _PARTS and any(1.0 < abs(one) < np.inf for one in limits if one is not None):
        raise InputError.OUT_OF_RANGE(f"a {name} beyond 1 is more than 100 %; give 0.06 for 6 %.")


def _places(limit: Limited, axis: str, size: int, what: str) -> Sequence[int]:
    """Return the places along an axis that a limit is about."""
    number = getattr(limit, axis) if axis in INDICES else None
    if number is None:
        return range(size)
    if axis == "axis":
        return [AXES.index(number)]
    first = FIRST.get(axis, 1)
    if not first <= number < first + size:
        raise InputError.OUT_OF_RANGE(
            f"{what} of {limit.quantity} names {axis} {number}; "
            f"give a number from {first} to {first + size - 1}."
        )
    return [number - first]


def _entry(name: str, per: tuple[str, ...], index: tuple[int, ...]) -> str:
    words = [
        AXES[number] if axis == "axis" else str(number + FIRST.get(axis, 1))
        for axis, number in zip(per, index, strict=True)
    ]
    return f"{name}[{','.join(words)}]" if words else name
