"""What drives a path: which tendons change, where it turns, and what it is drawn against."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

LOADING, UNLOADING = "loading", "unloading"
"""What the two branches of a loop are called."""


def abscissa(path: EquilibriumPath) -> tuple[NDArray[np.float64], str]:
    """Return what a path is drawn against: the one tendon that changes, or the step.

    Where several change in step with each other, the first of them tells. It is its stroke where
    it is commanded by stroke, and its tension otherwise.

    Returns:
        Values (S,) and the label of the axis.
    """
    changing = _changing(path)
    together = len(changing) > 0 and all(_in_step(path, changing[0], one) for one in changing)
    if together or (len(path) == 1 and not len(changing)):
        index = int(changing[0]) if len(changing) else 0
        name = "stroke" if by_stroke(path, index) else "tension"
        quantity = QUANTITIES[name]
        values = getattr(path, name)
        if values.shape[1] == 1:
            return values[:, index], quantity.label
        title = quantity.title.removeprefix("tendon ")
        which = f"{title} of tendon {index + 1}"
        return values[:, index], quantity.label.replace(quantity.title, which)
    return np.arange(1.0, len(path) + 1.0), "step [number]"


def drive(path: EquilibriumPath) -> NDArray[np.float64]:
    """Return a number for each step that rises while the tendons are pulled, (S,).

    The sum over the tendons that change, each by its tension or stroke as it is commanded.
    """
    total = np.zeros(len(path))
    for index in _changing(path):
        values = (path.stroke if by_stroke(path, int(index)) else path.tension)[:, index]
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        total = total + values / (largest or 1.0)
    return total


def branches(x: NDArray[np.float64]) -> Iterator[tuple[slice, bool]]:
    """Split a path where what drives it turns.

    Args:
        x: A number for each step, (S,).

    Yields:
        The steps of each branch, first and last included, and whether x grows on it.

    Example:
        >>> [(part.start, part.stop, up) for part, up in branches(np.array([0.0, 1.0, 2.0, 1.0]))]
        [(0, 3, True), (2, 4, False)]
    """
    change = np.diff(x)
    # Rounding of a value that stays as it is is no turn.
    change = np.sign(
        np.where(np.abs(change) > 1e-9 * np.nanmax(np.abs(x), initial=0.0), change, 0.0)
    )
    start, direction = 0, 0.0
    for index, sign in enumerate(change):
        if sign and direction and sign != direction:
            yield slice(start, index + 1), bool(direction > 0)
            start = index
        direction = sign or direction
    yield slice(start, len(x)), bool(direction >= 0)


def by_stroke(path: EquilibriumPath, tendon: int) -> bool:
    """Tell whether the stroke of a tendon (from 0) is commanded, and not its tension."""
    return bool(np.isfinite(np.asarray(path.commanded_stroke, float)[:, tendon]).any())


def driven_by_stroke(path: EquilibriumPath) -> list[int]:
    """Return the tendons (from 0) that are drawn by changing strokes."""
    return [int(tendon) for tendon in _changing(path) if by_stroke(path, int(tendon))]


def way_of(path: EquilibriumPath) -> dict[str, list[int]]:
    """Return the converged steps of loading and of unloading, each where there is any."""
    good = np.asarray(path.converged)
    found: dict[str, list[int]] = {}
    for part, growing in branches(drive(path)):
        steps = [step for step in range(part.start, part.stop) if good[step]]
        known = found.setdefault(LOADING if growing else UNLOADING, [])
        known += [step for step in steps if step not in known]
    return {name: steps for name, steps in found.items() if steps}


def _changing(path: EquilibriumPath) -> NDArray[np.intp]:
    good = np.asarray(path.converged)
    spread = np.zeros(path.tension.shape[1])
    if good.any():
        spread = np.ptp(path.tension[good], axis=0)
        drawn = [by_stroke(path, index) for index in range(len(spread))]
        spread = np.where(drawn, np.ptp(path.stroke[good], axis=0), spread)
        commanded = np.isfinite([path.commanded_tension, path.commanded_stroke]).any(axis=(0, 1))
        spread = np.where(commanded, spread, 0.0)
    return np.flatnonzero(spread > 1e-12)


def _in_step(path: EquilibriumPath, first: int, other: int) -> bool:
    """Tell whether what drives two tendons changes in proportion."""
    good = np.asarray(path.converged)
    pair = [
        (path.stroke if by_stroke(path, int(one)) else path.tension)[good, one]
        for one in (first, other)
    ]
    change = [values - values[0] for values in pair]
    largest = int(np.argmax(np.abs(change[0])))
    ratio = change[1][largest] / change[0][largest]
    return bool(np.allclose(change[1], ratio * change[0], atol=1e-9 * np.ptp(pair[1])))
