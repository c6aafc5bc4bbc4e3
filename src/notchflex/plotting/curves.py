"""Curves over the load, by loading and unloading: total angle, notches, strains, tension."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.sheet import (
    BESIDE,
    DASHED,
    DOTTED,
    INSIDE,
    SOLID,
    Colour,
    Curve,
    Mark,
    Panel,
    Span,
    dots,
)
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
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
    # Rounding errors of a constant value are not a reversal.
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
    converged = np.asarray(path.converged)
    steps: dict[str, dict[int, None]] = {}
    for part, way in branches(load_parameter(path)):
        own_steps = (step for step in range(part.start, part.stop) if converged[step])
        steps.setdefault(way, {}).update(dict.fromkeys(own_steps))
    return {way: list(some) for way, some in steps.items() if some}


def _prescribed(path: EquilibriumPath, tendon: int) -> NDArray[np.float64]:
    return (path.stroke if by_stroke(path, tendon) else path.tension)[:, tendon]


def _changing(path: EquilibriumPath) -> list[int]:
    """Return the tendons whose prescribed tension or stroke changes."""
    converged = np.asarray(path.converged)
    commanded = np.isfinite([path.commanded_tension, path.commanded_stroke]).any(axis=(0, 1))
    tendons = range(path.tension.shape[1])
    spread = [
        np.ptp(_prescribed(path, one)[converged]) if converged.any() else 0.0 for one in tendons
    ]
    return np.flatnonzero(np.where(commanded, spread, 0.0) > 1e-12).tolist()


def _in_proportion(path: EquilibriumPath, first: int, other: int) -> bool:
    """Return whether what drives two tendons changes in proportion."""
    converged = np.asarray(path.converged)
    pair = [_prescribed(path, one)[converged] for one in (first, other)]
    change = [values - values[0] for values in pair]
    largest = int(np.argmax(np.abs(change[0])))
    ratio = change[1][largest] / change[0][largest]
    return bool(np.allclose(change[1], ratio * change[0], atol=1e-9 * np.ptp(pair[1])))


COLOUR = {LOADING: BLUE, UNLOADING: VERMILLION}
LINE = {LOADING: SOLID, UNLOADING: DASHED}
NEUTRAL = "#4c4c4c"
"""Colour of legend entries for marks of several colours."""
NOTCH_LABEL = "notch [number], 1 at the base"
TIP_LABELS = tuple(
    f"{QUANTITIES['tip_position'].title} {axis} [{QUANTITIES['tip_position'].unit}]"
    for axis in "xz"
)
MAX_NAMES = 12
"""If a robot has more notches than this, a legend names some of them."""


def branch_lines(
    path: EquilibriumPath,
    points: NDArray[np.float64],
    colour: Colour | None = None,
    name: str | None = None,
    **style: Any,
) -> Iterator[Curve]:
    """Yield the branches of a curve (S, 2): loading solid, unloading dashed; converged steps only.

    Without a colour, loading and unloading have one each; without a name, each has its own. `look`
    are further options of `Curve`; `group` is the name if not given.
    """
    points = converged_only(path, points)
    named: set[str] = set()
    for part, way in branches(load_parameter(path)):
        label = way if name is None else name
        options: dict[str, Any] = {"group": label, "hover": True}
        options["marker"] = "o" if part.stop - part.start == 1 else ""
        shown = "" if label in named else label
        shade = COLOUR[way] if colour is None else colour
        yield Curve(points[part], shade, LINE[way], name=shown, **(options | style))
        named.add(label)


def total_panel(path: EquilibriumPath) -> Panel:
    """Return the total angle against tension or stroke."""
    quantity = QUANTITIES["total_angle"]
    x, label = abscissa(path)
    items: list[Mark] = [
        *branch_lines(path, np.stack([x, path.total_angle * quantity.scale], axis=1)),
        *failures(path, x),
    ]
    named = len(items) > 1 or not np.all(path.converged)
    return Panel(items, label, quantity.label, legend=INSIDE if named else "")


def notches_panel(path: EquilibriumPath) -> Panel:
    """Return the angle of every notch; dots mark closed notches."""
    quantity = QUANTITIES["notch_angle"]
    x, label = abscissa(path)
    angles = path.notch_angle * quantity.scale
    items = list(_notch_lines(path, x, angles))
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    for notch, colour in enumerate(sequence_colours(angles.shape[1])):
        is_closed = closed[:, notch]
        if is_closed.any():
            points = np.stack([x[is_closed], angles[is_closed, notch]], axis=1)
            items.append(dots(points, colour, group=f"notch {notch + 1}", layer=3))
    if closed.any():
        items.append(dots([], NEUTRAL, name="closed"))
    return Panel([*items, *failures(path, x)], label, quantity.label, legend=BESIDE)


def strain_panel(path: EquilibriumPath) -> Panel:
    """Return the peak strain of every notch, with the allowed strain of the material."""
    x, label = abscissa(path)
    items = list(_notch_lines(path, x, 100.0 * np.abs(path.peak_strain), named=False))
    allowed = path.robot.material.allowed_strain
    if allowed is not None:
        name = f"allowed {100.0 * allowed:.3g} %"
        at = 100.0 * allowed
        items.append(Span("y", at, at, VERMILLION, DASHED, 1.2, name=name))
    return Panel(
        [*items, *failures(path, x)],
        label,
        f"{QUANTITIES['peak_strain'].title} of every notch [%]",
        legend="" if allowed is None else INSIDE,
        y_range=(0.0, None),
    )


def stroke_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) over its stroke: the hysteresis of friction."""
    points = np.stack([path.stroke[:, tendon], path.tension[:, tendon]], axis=1)
    labels: list[str] = []
    for name in ("stroke", "tension"):
        quantity = QUANTITIES[name]
        title = f"{name} of tendon {tendon + 1}" if path.tension.shape[1] > 1 else quantity.title
        labels.append(quantity.label.replace(quantity.title, title, 1))
    items = [*branch_lines(path, points), *failures(path, path.commanded_stroke[:, tendon])]
    return Panel(items, labels[0], labels[1], legend=INSIDE, y_range=(0.0, None))


def _notch_lines(
    path: EquilibriumPath,
    x: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    named: bool = True,
) -> Iterator[Mark]:
    """Yield a curve for every notch, in its colour."""
    count = values.shape[1]
    chosen: Any = range(count)
    if count > MAX_NAMES:  # some, with the first and the last
        chosen = np.unique(np.linspace(0, count - 1, MAX_NAMES // 2).round().astype(int))
    for notch, colour in enumerate(sequence_colours(count)):
        group = f"notch {notch + 1}"
        name = group if named and notch in chosen else ""
        points = np.stack([x, values[:, notch]], axis=1)
        yield from branch_lines(path, points, colour, name, group=group)


def failures(path: EquilibriumPath, x: NDArray[np.float64]) -> Iterator[Span]:
    """Mark the steps that did not converge by dotted vertical lines."""
    failed = x[~np.asarray(path.converged)]
    for order, at in enumerate(failed[np.isfinite(failed)].tolist()):
        yield Span("x", at, at, "#666666", DOTTED, name="" if order else "not converged")


def converged_only(path: EquilibriumPath, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with NaN in the steps that did not converge."""
    values = np.array(values, dtype=float)
    values[~np.asarray(path.converged)] = np.nan
    return values
