"""Curves over the load and along a tendon, with the bands of tolerances behind them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.sheet import (
    BESIDE,
    DASHED,
    DOTTED,
    INSIDE,
    SOLID,
    Area,
    Colour,
    Curve,
    Mark,
    Panel,
    Span,
    dots,
)
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.support import QUANTITIES, spans_of

if TYPE_CHECKING:
    from notchflex import Band, EquilibriumPath


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


MAX_STEPS = 6

_FEWEST = 3
"""The reversal of friction is drawn if it is partial at this many steps at least."""

SLACK = 1e-9
"""A tendon with less tension [N] all along a path is not drawn."""


def pulled_tendons(path: EquilibriumPath) -> list[int]:
    """Return the tendons (from 0) that carry tension anywhere on a path."""
    tension = np.nan_to_num(np.where(np.asarray(path.converged)[:, None], path.tension, 0.0))
    return [int(i) for i in np.flatnonzero(tension.max(axis=0) > SLACK)]


def span_line(path: EquilibriumPath, step: int, tendon: int, colour: Colour, **style: Any) -> Curve:
    """Return the tension of a tendon (from 0) from span to span at one step."""
    tension = path.span_tension[step, tendon, : spans_of(path, tendon)]
    points = np.stack([np.arange(len(tension)), tension], axis=1)
    usual: dict[str, Any] = {"marker": "o", "size": 1.8, "hover": True}
    return Curve(points, colour, **(usual | style))


def profile_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) from span to span, during loading and unloading.

    Steps of the same tension have the same colour; solid lines are loading, dashed ones unloading.
    """
    ways = {way: _spread(path, steps, tendon) for way, steps in steps_by_branch(path).items()}
    tension = path.tension[:, tendon]
    most = max(float(tension[step]) for steps in ways.values() for step in steps)
    colours = sequence_colours(101)
    items: list[Mark] = [
        span_line(path, step, tendon, colours[round(100 * float(tension[step]) / most)],
                  dash=LINE[way], width=1.1, group=way)
        for way, steps in ways.items() for step in steps
    ]  # fmt: skip
    items += [Curve([], NEUTRAL, LINE[way], name=way, group=way) for way in ways]
    which = f" {tendon + 1}" if path.tension.shape[1] > 1 else ""
    return Panel(
        items,
        f"span of tendon{which} [number], 0 at the base",
        QUANTITIES["span_tension"].label,
        legend=BESIDE,
        y_range=(0.0, None),
        whole="x",
    )


def front_panel(path: EquilibriumPath) -> Panel:
    """Return the number of contacts of every pulled tendon at which the friction has reversed.

    After a reversal of the load, friction reverses contact by contact from the base; fractions
    follow from the state of the contact in between (`EquilibriumPath.front`).
    """
    x, label = abscissa(path)
    tendons = pulled_tendons(path)
    reversed_ = reversed_contacts(path)
    items: list[Mark] = []
    for order, tendon in enumerate(tendons):
        points = np.stack([x, reversed_[:, tendon]], axis=1)
        for line in branch_lines(path, points, marker="os^D"[order % 4], size=2.2):
            which = f", tendon {tendon + 1}" if len(tendons) > 1 else ""
            name = line.name and line.name + which
            items.append(replace(line, name=name, group=line.group + which))
    # The same limits as the other curves, although without tension there is no friction.
    room = 0.05 * float(np.ptp(x))
    most = max(spans_of(path, tendon) - 1 for tendon in tendons)
    return Panel(
        items,
        label,
        "reversed contacts [number]",
        title=f"contacts with reversed friction, of {most}",
        legend=BESIDE,
        x_range=(float(x.min()) - room, float(x.max()) + room),
        y_range=(-0.03 * most, 1.03 * most),
        whole="y",
    )


def reversed_contacts(path: EquilibriumPath) -> NDArray[np.float64]:
    """Return the number of contacts with reversed friction, (S, tendons); NaN without tension."""
    m, eta = (np.asarray(part, float) for part in path.front)
    # eta decreases from 1 to -1 while the friction of one contact reverses.
    reversed_ = m - 1.0 + 0.5 * (1.0 - np.where(np.isnan(eta), 1.0, eta))
    reversed_[~np.asarray(path.converged)] = np.nan
    reversed_[path.tension <= SLACK] = np.nan
    return reversed_


def reverses_step_by_step(path: EquilibriumPath) -> bool:
    """Return whether friction reverses over several steps, so that it is worth a panel."""
    tendons = pulled_tendons(path)
    bound = np.nan_to_num(path.contact_bound[np.asarray(path.converged)])
    if not tendons or not (bound[:, tendons] > 0.0).any():
        return False
    counts = reversed_contacts(path)
    for tendon in tendons:
        count = counts[:, tendon]
        partial = count[(count > 0.0) & (count < spans_of(path, tendon) - 1)]
        if len(np.unique(partial.round(6))) >= _FEWEST:
            return True
    return False


def _spread(path: EquilibriumPath, steps: list[int], tendon: int) -> list[int]:
    """Return some of the steps with tension, evenly spread over it."""
    steps = [step for step in steps if path.tension[step, tendon] > SLACK]
    if len(steps) <= MAX_STEPS:
        return steps
    tension = path.tension[steps, tendon]
    targets = np.linspace(tension.min(), tension.max(), MAX_STEPS)
    nearest = (steps[int(np.argmin(np.abs(tension - goal)))] for goal in targets)
    return list(dict.fromkeys(nearest))


NAME = "5 to 95 % of draws"


def shaded(
    panel: Panel, path: EquilibriumPath, bands: Mapping[str, Band] | None, name: str
) -> Panel:
    """Return a panel with the band of a quantity behind its curves, entry by entry.

    Args:
        panel: Curves of one quantity over the load.
        path: The path that the panel shows.
        bands: Bands by name; None leaves the panel as it is.
        name: The quantity.
    """
    if bands is None or name not in bands:
        return panel
    # A strain is drawn without its sign, in percent.
    scale = 100.0 if name == "peak_strain" else QUANTITIES[name].scale
    ends = np.stack([bands[name].low, bands[name].high]) * scale
    ends = np.sort(np.abs(ends), axis=0) if name == "peak_strain" else ends
    ends = ends.reshape(2, len(path), -1)
    several = ends.shape[2] > 1
    shades: list[Colour | None] = [None]
    if several:
        shades = [*sequence_colours(ends.shape[2])]
    x = abscissa(path)[0]
    areas: list[Area] = []
    for entry, shade in enumerate(shades):
        group = f"notch {entry + 1}" if several else ""
        low, high = (converged_only(path, end) for end in ends[:, :, entry])
        for part, way in branches(load_parameter(path)):
            is_finite = np.isfinite(low[part]) & np.isfinite(high[part])
            along = x[part][is_finite]
            across = np.append(low[part][is_finite], high[part][is_finite][::-1])
            outline = np.stack([np.append(along, along[::-1]), across], axis=1)
            if len(along) > 1:
                colour = COLOUR[way] if shade is None else shade
                areas.append(Area([outline], colour, colour, 0.18, 0.0, group=group, layer=1))
    if areas and not several:
        areas[0] = replace(areas[0], name=NAME)
    return replace(panel, items=[*areas, *panel.items], legend=panel.legend or INSIDE)
