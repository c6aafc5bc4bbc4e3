"""Loads of any form that a user may give, brought to one path."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain
from math import isfinite, isnan, nan
from typing import Any

import numpy as np

from notchflex.errors import InputError
from notchflex.loads.load import BASE_TURN, NO_TURN, Load
from notchflex.loads.load_path import LoadPath
from notchflex.loads.validation import number, shown, vector

_FORM = "a number, or one entry per tendon with None where nothing is commanded"


def load_path(loads: Load | LoadPath | Iterable[Any], tendons: int) -> LoadPath:
    """Bring loads of any form to one path for a robot of so many tendons.

    Args:
        loads: A path, one load, or loads in order.
        tendons: Number of tendons of the robot.

    Returns:
        The path, every tendon named.

    Raises:
        InputError: Too many entries, numbers that are no loads, a base that turns on the way.
    """
    if isinstance(loads, LoadPath):
        return loads.for_tendons(tendons)
    every = [loads] if isinstance(loads, Load) else _several(loads)
    turns = {
        NO_TURN if load.base_rotation is NO_TURN else vector(load.base_rotation, *BASE_TURN)
        for load in every
    }
    if len(turns) > 1:
        raise InputError.CONFLICT("base_rotation must be the same for all loads of a path")
    tension = [_entries(load.tension, tendons, "tension") for load in every]
    stroke = [_entries(load.stroke, tendons, "stroke") for load in every]
    given = np.array(tension), np.array(stroke), np.array(turns.pop())
    external = tuple(load.external for load in every)
    entries = zip(chain.from_iterable(tension), chain.from_iterable(stroke), strict=True)
    if any(pulled < 0.0 or not (isnan(pulled) or isnan(drawn)) for pulled, drawn in entries):
        return LoadPath(*given, external)  # which says what is wrong
    return LoadPath.checked(*given, external)


def _several(loads: Any) -> list[Load]:
    """Loads in order, one or more."""
    try:
        every = list(loads)
    except TypeError:
        raise InputError.WRONG_TYPE(
            f"loads must be a notchflex.Load, a LoadPath or Loads in order; got {shown(loads)}"
        ) from None
    if not every:
        raise InputError.NO_DATA("there are no loads; give at least one")
    for load in every:
        if not isinstance(load, Load):
            raise InputError.WRONG_TYPE(
                f"a load must be a notchflex.Load; got {type(load).__name__}"
            )
    return every


def _entries(value: Any, tendons: int, what: str) -> list[float]:
    """One number per tendon, NaN where nothing is commanded."""
    if value is None:
        return [nan] * tendons
    if hasattr(value, "__array__"):
        value = np.asarray(value).tolist()
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    given: list[Any] = list(value) if several else [value]
    if len(given) > tendons:
        raise InputError.WRONG_SHAPE(
            f"{what} has {len(given)} entries, but the robot has {tendons} tendons; "
            f"give at most {tendons}"
        )
    entries = [nan] * tendons
    for i, entry in enumerate(given):
        if entry is None:
            continue
        entries[i] = number(entry, what, _FORM)
        if not isfinite(entries[i]):
            raise InputError.NOT_FINITE(f"{what} must be finite; got {shown(entry)}")
    return entries


__all__ = ["load_path"]
