"""Which numbers of a result a specification means: steps of paths, entries along axes, names."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex import EquilibriumPath, InputError
from notchflex.specification.reading import known
from notchflex.specification.records import (
    LimitedQuantity,
    Measured,
    check_axes,
    check_quantity,
)
from notchflex.support import AXES, QUANTITIES, Quantity, entries_there


def _first(axis: str) -> int:
    """Return the number of the first entry along an axis."""
    return 0 if axis == "body" else 1


def chosen_entries(
    asked: Measured, per: Sequence[str], sizes: Sequence[int]
) -> list[tuple[int, ...]]:
    """Return the entries that are meant, each as its places along the axes, from 0.

    Args:
        asked: The quantity and its entries.
        per: What its axes stand for.
        sizes: Their lengths.

    Raises:
        InputError: There is no such entry.
    """
    check_axes(asked, per)
    along: list[Sequence[int]] = []
    for axis, size in zip(per, sizes, strict=True):
        numbers, first = getattr(asked, axis, None), _first(axis)
        if numbers is None:
            along.append(range(size))
        elif axis == "axis":
            along.append([AXES.index(numbers)])
        else:
            for number in numbers:
                if not first <= number < first + size:
                    raise InputError.OUT_OF_RANGE(
                        f"there is no {axis} {number}; give a number from {first} to "
                        f"{first + size - 1}."
                    )
            along.append([number - first for number in dict.fromkeys(numbers)])
    return list(itertools.product(*along))


def entry_names(per: Sequence[str], entry: Sequence[int]) -> list[str]:
    """Return the names of an entry along the axes: x, y or z, or a number."""
    return [
        AXES[place] if axis == "axis" else str(place + _first(axis))
        for axis, place in zip(per, entry, strict=True)
    ]


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


def load_named(asked: LimitedQuantity, loads: Mapping[str, object]) -> str:
    """Return the name of the load that is meant: the only one where none is named.

    Raises:
        InputError: There is no such load, or several and none is named.
    """
    if asked.load is None and len(loads) > 1:
        raise InputError.MISSING_VALUE(f"`load` is missing; name one of {', '.join(loads)}.")
    name = next(iter(loads)) if asked.load is None else asked.load
    known(name, loads, "load")
    return name


def limited_numbers(
    asked: LimitedQuantity, paths: Mapping[str, EquilibriumPath]
) -> Iterator[Criterion]:
    """Yield the numbers of a result that limits are about.

    Args:
        asked: The quantity, its entries and limits.
        paths: The robot of the drawing under every load.

    Raises:
        InputError: Robot or loads have no such entry or step.
    """
    check_quantity(asked)
    load = load_named(asked, paths)
    path, quantity = paths[load], QUANTITIES[asked.quantity]
    step = len(path) if asked.step is None else asked.step
    if step > len(path):
        raise InputError.OUT_OF_RANGE(f"there is no step {step}; the load {load} has {len(path)}.")
    there = entries_there(path, quantity)
    entries = [entry for entry in chosen_entries(asked, quantity.per, there.shape) if there[entry]]
    if not entries:
        raise InputError.UNSUPPORTED("this robot has none; choose another quantity.")
    where = [f"at {load}"] if len(paths) > 1 else []
    where += [f"step {step}"] if asked.step is not None else []
    for entry in entries:
        names = ",".join(entry_names(quantity.per, entry))
        name = f"{quantity.name}[{names}]" if names else quantity.name
        name = " ".join([name, ", ".join(where)]).strip()
        yield Criterion(name, quantity, load, step - 1, entry, *asked.ends)


def known_numbers(
    asked: LimitedQuantity, paths: Mapping[str, EquilibriumPath]
) -> Iterator[Criterion]:
    """Yield the same as `limited_numbers`, but refuse what is not known of these paths.

    Raises:
        InputError: A number is not known, or as there.
    """
    for one in limited_numbers(asked, paths):
        if np.isnan(one.of(np.asarray(paths[one.load].quantity(one.quantity.name))[None])).any():
            raise InputError.NOT_FINITE(
                f"{one.name} of this robot is not known, so that it is within no limits; name "
                "entries that are known."
            )
        yield one
