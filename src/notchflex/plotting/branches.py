"""Splits a path into loading and unloading, and chooses the quantity it is drawn against."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

LOADING, UNLOADING = "loading", "unloading"
"""Names of the two branches of a loop."""


def abscissa(path: EquilibriumPath) -> tuple[NDArray[np.float64], str]:
    """Return what a path is drawn against, (S,), and its label.

    The stroke, where it is prescribed, or the tension of the one tendon that changes, or of the
    first of several that change in proportion; else the step.
    """
    changing = _changing(path)
    together = all(_in_proportion(path, changing[0], one) for one in changing)
    if together if changing else len(path) == 1:
        index = changing[0] if changing else 0
        quantity = QUANTITIES["stroke" if by_stroke(path, index) else "tension"]
        label = quantity.label
        if path.tension.shape[1] > 1:
            title = f"{quantity.title.removeprefix('tendon ')} of tendon {index + 1}"
            label = label.replace(quantity.title, title)
        return getattr(path, quantity.name)[:, index], label
    return np.arange(1.0, len(path) + 1.0), "step [number]"


def load_parameter(path: EquilibriumPath) -> NDArray[np.float64]:
    """Return a number for each step, (S,), that increases while the tendons are pulled.

    The sum over the tendons that change, each by its prescribed tension or stroke.
    """
    total = np.zeros(len(path))
    for tendon in _changing(path):
        values = _prescribed(path, tendon)
        total += values / (float(np.nanmax(np.abs(values), initial=0.0)) or 1.0)
    return total


def branches(x: NDArray[np.float64]) -> Iterator[tuple[slice, str]]:
    """Split steps where a load parameter x, (S,), changes its direction.

    Yield the steps of each branch with its two ends, and `LOADING` where x increases, else
    `UNLOADING`.

    Example:
        >>> [(part.start, part.stop, way) for part, way in branches(np.array([0.0, 1.0, 2.0, 1.0]))]
        [(0, 3, 'loading'), (2, 4, 'unloading')]
    """
    change = np.diff(x)
    # Rounding errors of a constant value are no reversal.
    change[np.abs(change) <= 1e-9 * np.nanmax(np.abs(x), initial=0.0)] = 0.0
    start, direction = 0, 0.0
    for index, sign in enumerate(np.sign(change)):
        if sign and direction and sign != direction:
            yield slice(start, index + 1), LOADING if direction > 0 else UNLOADING
            start = index
        direction = sign or direction
    yield slice(start, len(x)), LOADING if direction >= 0 else UNLOADING


def by_stroke(path: EquilibriumPath, tendon: int) -> bool:
    """Return whether the stroke of a tendon (from 0) is prescribed, and not its tension."""
    return bool(np.isfinite(np.asarray(path.commanded_stroke, float)[:, tendon]).any())


def driven_by_stroke(path: EquilibriumPath) -> list[int]:
    """Return the tendons (from 0) whose prescribed strokes change."""
    return [tendon for tendon in _changing(path) if by_stroke(path, tendon)]


def steps_by_branch(path: EquilibriumPath) -> dict[str, list[int]]:
    """Return the converged steps of loading and of unloading, each if there are any."""
    good = np.asarray(path.converged)
    steps: dict[str, dict[int, None]] = {}
    for part, way in branches(load_parameter(path)):
        here = (step for step in range(part.start, part.stop) if good[step])
        steps.setdefault(way, {}).update(dict.fromkeys(here))
    return {way: list(some) for way, some in steps.items() if some}


def _prescribed(path: EquilibriumPath, tendon: int) -> NDArray[np.float64]:
    return (path.stroke if by_stroke(path, tendon) else path.tension)[:, tendon]


def _changing(path: EquilibriumPath) -> list[int]:
    """Return the tendons whose prescribed tension or stroke changes."""
    good = np.asarray(path.converged)
    commanded = np.isfinite([path.commanded_tension, path.commanded_stroke]).any(axis=(0, 1))
    tendons = range(path.tension.shape[1])
    spread = [np.ptp(_prescribed(path, one)[good]) if good.any() else 0.0 for one in tendons]
    return np.flatnonzero(np.where(commanded, spread, 0.0) > 1e-12).tolist()


def _in_proportion(path: EquilibriumPath, first: int, other: int) -> bool:
    """Return whether what drives two tendons changes in proportion."""
    good = np.asarray(path.converged)
    pair = [_prescribed(path, one)[good] for one in (first, other)]
    change = [values - values[0] for values in pair]
    largest = int(np.argmax(np.abs(change[0])))
    ratio = change[1][largest] / change[0][largest]
    return bool(np.allclose(change[1], ratio * change[0], atol=1e-9 * np.ptp(pair[1])))
