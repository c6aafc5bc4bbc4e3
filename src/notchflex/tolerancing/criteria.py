"""Acceptance limits of one robot under its loads: which number of which result must lie where."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from notchflex._quantity import REGISTERED, Quantity
from notchflex.errors import InputError
from notchflex.results.path import EquilibriumPath
from notchflex.results.quantities.registry import holds
from notchflex.tolerancing.spec import AXES, INDICES, ToleranceSpec

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
