"""Limits on quantities of a state: which states count as part of a workspace."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Bool

from notchflex import InputError
from notchflex.specification import LimitedQuantity, check_quantity, coded, made, placed
from notchflex.support import short_repr


def limits_of(given: Mapping[str, object] | None) -> tuple[LimitedQuantity, ...]:
    """Check limits.

    Args:
        given: By name of a quantity its largest value, or its smallest and largest as a pair with
            None for none.

    Raises:
        InputError: No such quantity, a bound that is not a number, or bounds that are reversed.
    """
    if given is not None and not isinstance(given, Mapping):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            'limits are given by quantity, such as {"peak_strain": 0.08, "gap": (0.0, None)}; '
            f"got {short_repr(given)}"
        )
    return tuple(itertools.starmap(_limit, (given or {}).items()))


def _limit(name: str, bounds: Any) -> LimitedQuantity:
    with placed(f"the limit of {name}"):
        pair = bounds if isinstance(bounds, tuple | list) else (None, bounds)
        low, high, *more = (None if end in (math.inf, -math.inf) else end for end in (*pair, None))
        if len(more) != 1 or low is high is None:
            got = short_repr(bounds)
            text = f"give its largest value, or the smallest and the largest; got {got}"
            raise InputError.WRONG_SHAPE(text)
        limit = made(LimitedQuantity, {"quantity": name, "lower": low, "upper": high}, coded)
        check_quantity(limit)
    return limit


def all_hold(
    limits: Iterable[LimitedQuantity], outputs: Mapping[str, np.ndarray]
) -> Bool[np.ndarray, "rows steps"]:
    """Return which states of paths converged and keep all limits; NaN marks a missing entry."""
    hold = np.asarray(outputs["converged"], bool)
    for limit in limits:
        values, (low, high) = outputs[limit.quantity], limit.ends
        outside = (values < low) | (values > high)
        hold = hold & ~outside.reshape(*hold.shape, -1).any(axis=-1)
    return hold


def in_python(given: Mapping[str, object]) -> dict[str, tuple[float | None, float | None]]:
    """Return limits in the units of files (deg) in those inside Python (rad)."""
    limits = (limit.in_python for limit in limits_of(given))
    return {limit.quantity: (limit.lower, limit.upper) for limit in limits}
