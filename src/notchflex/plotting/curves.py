"""Curves of a path: over the load, along a tendon, one quantity over another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from notchflex import Band, EquilibriumPath, InputError
from notchflex.plotting.marks import (
    BESIDE,
    DASHED,
    DOTTED,
    INSIDE,
    SOLID,
    Array,
    Colour,
    Curve,
    Mark,
    Panel,
    Span,
    band,
    dots,
    line,
)
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.support import QUANTITIES, Quantity, entries_of, is_listed, nearest, spans_of

LOADING, UNLOADING = "loading", "unloading"
"""Names of the two branches of a loop."""

COLOUR = {LOADING: BLUE, UNLOADING: VERMILLION}
LINE = {LOADING: SOLID, UNLOADING: DASHED}
NEUTRAL = "#4c4c4c"
"""Colour of legend entries for marks of several colours."""
NOTCH_LABEL = "notch [number], 1 at the base"
STEP = "step"
"""Name of the number of the step, from 1."""
MAX_NAMES = 12
"""If a robot has more notches than this, a legend names some of them."""
SLACK = 1e-9
"""A tendon with less tension [N] all along a path is not drawn."""


def evenly(values: Any, most: int) -> list[int]:
    """Return which values are nearest to some that are evenly spread over them, smallest first.

    Example:
        >>> evenly(range(9), 3)
        [0, 4, 8]
    """
    values = np.asarray(values, float)
    goals = np.linspace(values.min(), values.max(), most) if len(values) else []
    return list(dict.fromkeys(int(np.argmin(np.abs(values - goal))) for goal in goals))


def branches(x: Array) -> Iterator[tuple[slice, str]]:
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
    sign = np.sign(change)
    moving = np.flatnonzero(sign)
    turns = moving[1:][np.diff(sign[moving]) != 0.0].tolist()
    for start, end in pairwise([0, *turns, len(x) - 1]):
        yield slice(start, end + 1), LOADING if sign[start:end].sum() >= 0.0 else UNLOADING


def steps_by_branch(path: EquilibriumPath) -> dict[str, list[int]]:
    """Return the converged steps of loading and of unloading, each if there are any."""
    steps: dict[str, dict[int, None]] = {}
    for part, way in branches(load_parameter(path)):
        solved = part.start + np.flatnonzero(path.converged[part])
        steps.setdefault(way, {}).update(dict.fromkeys(solved.tolist()))
    return {way: list(some) for way, some in steps.items() if some}


def prescribed(path: EquilibriumPath) -> tuple[Array, list[int], list[int]]:
    """Return what drives each tendon, (S, tendons), those driven by strokes, and that change.

    Where its stroke is prescribed it is the stroke, else the tension. Tendons count from 0.
    """
    tension, stroke = (
        np.isfinite(np.asarray(commanded, float)).any(axis=0)
        for commanded in (path.commanded_tension, path.commanded_stroke)
    )
    values = np.where(stroke, path.stroke, path.tension)
    solved = values[np.asarray(path.converged)]
    spread = np.ptp(solved, axis=0) if len(solved) else 0.0
    changing = np.flatnonzero((tension | stroke) & (spread > 1e-12))
    return values, np.flatnonzero(stroke).tolist(), changing.tolist()


def abscissa(path: EquilibriumPath) -> tuple[Array, str]:
    """Return what a path is drawn against, (S,), and its label.

    The stroke, where it is prescribed, or the tension of the one tendon that changes, or of the
    first of several that change in proportion; else the step.
    """
    values, by_stroke, changing = prescribed(path)
    solved = values[np.asarray(path.converged)][:, changing]
    change = solved - solved[:1]
    together = bool(changing) and np.linalg.matrix_rank(change / np.ptp(solved, axis=0), 1e-8) == 1
    if together or len(path) == 1:
        tendon = changing[0] if changing else 0
        name = "stroke" if tendon in by_stroke else "tension"
        return values[:, tendon], tendon_label(path, name, tendon)
    return np.arange(1.0, len(path) + 1.0), "step [number]"


def load_parameter(path: EquilibriumPath) -> Array:
    """Return a number for each step, (S,), that increases while the tendons are pulled.

    The sum over the tendons that change, each by its prescribed tension or stroke.
    """
    values, _, changing = prescribed(path)
    values = values[:, changing]
    return (values / np.nanmax(np.abs(values), axis=0, initial=1e-300)).sum(axis=1)


def tendon_label(path: EquilibriumPath, name: str, tendon: int) -> str:
    """Return the label of a quantity of a tendon (from 0), with its number if it has others."""
    several = path.tension.shape[1] > 1
    return entry_label(QUANTITIES[name], f"tendon {tendon + 1}" if several else "")


def entry_label(quantity: Quantity, name: str) -> str:
    """Return the label of one entry: "angle of notch 3", "tip position x".

    Args:
        quantity: The quantity.
        name: Name of the entry, such as "notch 3" or "x"; "" for a single value.
    """
    if not name:
        return quantity.label
    if quantity.per == ("axis",):
        title, symbol = f"{quantity.title} {name}", f"{quantity.symbol}_{name}"
    else:
        title = f"{quantity.title.removeprefix(f'{quantity.per[0]} ')} of {name}"
        number = name.removeprefix("notch ")
        index = number if len(number) == 1 else f"{{{number}}}"
        symbol = quantity.symbol.replace("_j", f"_{index}")
    return replace(quantity, title=title, symbol=symbol).label


def branch_lines(
    path: EquilibriumPath,
    x: Any,
    y: Any,
    colour: Colour | None = None,
    name: str | None = None,
    **style: Any,
) -> Iterator[Curve]:
    """Yield the branches of a curve: loading solid, unloading dashed; converged steps only.

    Without a colour, loading and unloading have one each; without a name, each has its own if there
    are both. `style` are further options of `Curve`.
    """
    y = np.where(path.converged, y, np.nan)
    parts = list(branches(load_parameter(path)))
    for part, way in parts:
        usual = {"name": "" if len(parts) == 1 else way} if name is None else {"name": name}
        usual |= {"marker": "o" if part.stop - part.start == 1 else ""}
        yield line(x[part], y[part], colour or COLOUR[way], LINE[way], **(usual | style))


def way_entries(path: EquilibriumPath) -> list[Curve]:
    """Return legend entries of loading and unloading, if a path has both."""
    ways = dict.fromkeys(way for _, way in branches(load_parameter(path)))
    return [Curve([], NEUTRAL, LINE[way], name=way) for way in ways if len(ways) > 1]


def failures(path: EquilibriumPath, x: Array) -> Iterator[Span]:
    """Mark the steps that did not converge by dotted vertical lines."""
    failed = x[~np.asarray(path.converged)]
    for value in failed[np.isfinite(failed)].tolist():
        yield Span("x", value, "#666666", DOTTED, name="not converged")


def load_panel(
    path: EquilibriumPath,
    name: str,
    bands: Mapping[str, Band] | None = None,
    extra: Sequence[Mark] = (),
    names: bool = True,
    **options: Any,
) -> Panel:
    """Return a quantity over the load, each entry in its colour, with its band of tolerances.

    Args:
        path: Solved path.
        name: A quantity with one number, or one for each notch.
        bands: Bands by name of the quantity; None for none.
        extra: Further marks.
        names: Whether the legend names the entries.
        options: Those of `Panel`.
    """
    x, x_label = abscissa(path)
    table = scaled(path, name, getattr(path, name))
    count, items = table.shape[1], list[Mark]()
    named = evenly(range(count), MAX_NAMES) if names else []
    for entry, colour in enumerate(sequence_colours(count) if count > 1 else [None]):
        group = f"notch {entry + 1}" if count > 1 else ""
        if bands is not None and name in bands:
            ends = [scaled(path, name, end) for end in (bands[name].low, bands[name].high)]
            low, high = np.sort([end[:, entry] for end in ends], axis=0)
            items += _bands(path, x, low, high, colour, group)
        style = {"group": group, "name": group if entry in named else ""} if group else {}
        items += branch_lines(path, x, table[:, entry], colour, **style)
    label = options.pop("y_label", QUANTITIES[name].label)
    return Panel([*items, *extra, *failures(path, x)], x_label, label, shared="x", **options)


def scaled(path: EquilibriumPath, name: str, values: Any) -> Array:
    """Return a quantity in the unit of pictures, (S, entries): strains unsigned, in percent."""
    values = np.asarray(values, float).reshape(len(path), -1)
    return 100.0 * np.abs(values) if name == "peak_strain" else QUANTITIES[name].scale * values


def _bands(
    path: EquilibriumPath, x: Array, low: Array, high: Array, colour: Colour | None, group: str
) -> Iterator[Mark]:
    low = np.where(path.converged, low, np.nan)
    name = "" if group else "5 to 95 % of draws"
    for part, way in branches(load_parameter(path)):
        shade = colour or COLOUR[way]
        yield band(x[part], low[part], high[part], shade, 0.18, name=name, group=group, layer=1)


def path_panels(path: EquilibriumPath, bands: Mapping[str, Band] | None) -> list[Panel]:
    """Return the curves that a path of several steps is worth."""
    allowed, limits = path.robot.material.allowed_strain, list[Mark]()
    if allowed is not None:
        level, name = 100.0 * allowed, f"allowed {100.0 * allowed:.3g} %"
        limits.append(Span("y", level, VERMILLION, DASHED, 1.2, name=name))
    label = f"{QUANTITIES['peak_strain'].title} of every notch [%]"
    style: dict[str, Any] = {"y_label": label, "from_zero": True, "legend": INSIDE}
    panels = [total_panel(path, bands), notches_panel(path, bands)]
    _, by_stroke, changing = prescribed(path)
    driven = [tendon for tendon in changing if tendon in by_stroke][:MAX_PROFILES]
    panels += [stroke_panel(path, tendon) for tendon in driven]
    # The curves of the notches have their names in the panel of the angles.
    panels.append(load_panel(path, "peak_strain", bands, limits, names=False, **style))
    if len(steps_by_branch(path)) > 1:
        tendons = pulled_tendons(path)
        panels += [profile_panel(path, tendon) for tendon in tendons[:MAX_PROFILES]]
        panels += [front_panel(path)] if reverses_step_by_step(path) else []
    return panels


MAX_PROFILES = 2
"""Tendons whose tension is drawn over the stroke, and from span to span."""


def total_panel(path: EquilibriumPath, bands: Mapping[str, Band] | None = None) -> Panel:
    """Return the total angle against tension or stroke."""
    return load_panel(path, "total_angle", bands, legend=INSIDE)


def notches_panel(path: EquilibriumPath, bands: Mapping[str, Band] | None = None) -> Panel:
    """Return the angle of every notch; dots mark closed notches."""
    x, angles = abscissa(path)[0], scaled(path, "notch_angle", path.notch_angle)
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    extra: list[Mark] = [dots([], NEUTRAL, name="closed")] if closed.any() else []
    for notch, colour in enumerate(sequence_colours(angles.shape[1])):
        points = np.stack([x, angles[:, notch]], axis=1)[closed[:, notch]]
        extra.append(dots(points, colour, group=f"notch {notch + 1}", layer=3))
    return load_panel(path, "notch_angle", bands, extra)


def stroke_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) over its stroke: the hysteresis of friction."""
    labels = [tendon_label(path, name, tendon) for name in ("stroke", "tension")]
    items: list[Mark] = [*branch_lines(path, path.stroke[:, tendon], path.tension[:, tendon])]
    items += failures(path, path.commanded_stroke[:, tendon])
    return Panel(items, *labels, legend=INSIDE, from_zero=True)


def pulled_tendons(path: EquilibriumPath) -> list[int]:
    """Return the tendons (from 0) that carry tension anywhere on a path."""
    pulled = (path.tension > SLACK) & np.asarray(path.converged)[:, None]
    return np.flatnonzero(pulled.any(axis=0)).tolist()


def span_line(path: EquilibriumPath, step: int, tendon: int, colour: Colour, **style: Any) -> Curve:
    """Return the tension of a tendon (from 0) from span to span at one step."""
    tension = path.span_tension[step, tendon, : spans_of(path, tendon)]
    style = {"marker": "o", "size": 1.8} | style
    return line(np.arange(len(tension)), tension, colour, **style)


def span_panel(items: Sequence[Mark], which: str = "") -> Panel:
    """Return a panel of the tension from span to span."""
    label = f"span of tendon{which} [number], 0 at the base"
    return Panel(items, label, QUANTITIES["span_tension"].label, from_zero=True, whole="x")


def profile_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) from span to span, during loading and unloading.

    Steps of the same tension have the same colour; solid lines are loading, dashed ones unloading.
    """
    tension, items = path.tension[:, tendon], list[Mark]()
    most, colours = float(np.nanmax(tension[np.asarray(path.converged)])), sequence_colours(101)
    for way, steps in steps_by_branch(path).items():
        taut = [step for step in steps if tension[step] > SLACK]
        for step in (taut[index] for index in evenly(tension[taut], 6)):
            colour = colours[round(100 * float(tension[step]) / most)]
            items.append(
                span_line(path, step, tendon, colour, dash=LINE[way], width=1.1, group=way)
            )
    which = f" {tendon + 1}" if path.tension.shape[1] > 1 else ""
    return span_panel([*items, *way_entries(path)], which)


def front_panel(path: EquilibriumPath) -> Panel:
    """Return the number of contacts of every pulled tendon at which the friction has reversed.

    After a reversal of the load, friction reverses contact by contact from the base; fractions
    follow from the state of the contact in between (`EquilibriumPath.front`).
    """
    x, x_label = abscissa(path)
    tendons, counts = pulled_tendons(path), reversed_contacts(path)
    items: list[Mark] = []
    for order, tendon in enumerate(tendons):
        which = f", tendon {tendon + 1}" if len(tendons) > 1 else ""
        marker = "os^D"[order % 4]
        for curve in branch_lines(path, x, counts[:, tendon], marker=marker, size=2.2):
            items.append(replace(curve, name=curve.name and curve.name + which))
    most = max(spans_of(path, tendon) - 1 for tendon in tendons)
    return Panel(
        items,
        x_label,
        "reversed contacts [number]",
        title=f"contacts with reversed friction, of {most}",
        shared="x",
        whole="y",
        y_range=(-0.03 * most, 1.03 * most),
    )


def reversed_contacts(path: EquilibriumPath) -> Array:
    """Return the number of contacts with reversed friction, (S, tendons); NaN without tension."""
    contact, eta = (np.asarray(part, float) for part in path.front)
    # eta decreases from 1 to -1 while the friction of one contact reverses.
    counts = contact - 1.0 + 0.5 * (1.0 - np.where(np.isnan(eta), 1.0, eta))
    return np.where(path.tension > SLACK, counts, np.nan)


def reverses_step_by_step(path: EquilibriumPath) -> bool:
    """Return whether friction reverses over three steps or more, so that it is worth a panel."""
    solved = np.asarray(path.converged)
    for tendon in pulled_tendons(path):
        count = reversed_contacts(path)[solved, tendon]
        partial = count[(count > 0.0) & (count < spans_of(path, tendon) - 1)]
        rubs = np.any(path.contact_bound[solved, tendon] > 0.0)
        if rubs and len(np.unique(partial.round(6))) > 2:
            return True
    return False


def quantities_panel(path: EquilibriumPath, x: str, y: str) -> Panel:
    """Return one quantity of a path over another; loading and unloading have their own lines."""
    (x_label, across, of), (y_label, upward, entries_per) = (_series(path, name) for name in (x, y))
    if len(across) > 1 and of == ("tendon",) != entries_per:  # only tendons that are pulled
        across = [entry for entry in across if np.ptp(entry.values) > 0.0] or across
    if len(across) == 1:
        across = across * len(upward)
    elif of != entries_per:
        columns = ", ".join(entry.header for entry in across if entry.header) or "tension, stroke"
        raise InputError.WRONG_SHAPE(
            f"{x} has {len(across)} entries; take one of them for the horizontal axis: {columns}"
        )
    items: list[Mark] = []
    for right, up, shade in zip(across, upward, sequence_colours(len(upward)), strict=True):
        style: list[Any] = [shade, up.name] if len(upward) > 1 else []
        items += branch_lines(path, right.values, up.values, *style)
    if len(upward) > 1:
        items += way_entries(path)
    if len({entry.header for entry in across}) == 1:
        items += failures(path, across[0].values)
    legend = BESIDE if len(upward) > 1 else INSIDE
    return Panel(items, x_label, y_label, legend=legend, whole="x" * (x == STEP))


def _series(path: EquilibriumPath, name: str) -> tuple[str, list[Any], tuple[str, ...]]:
    """Return the label, the entries and their kind of a quantity of a path.

    It has the name of the quantity, or the CSV column of one of its entries.
    """
    if name == STEP:
        number = np.arange(1.0, len(path) + 1.0)
        return STEP, [SimpleNamespace(header="", name="", values=number)], ()
    listed = [row for row in QUANTITIES.values() if is_listed(row) and row.kind is not str]
    choice = [quantity.name for quantity in listed]
    for quantity in listed:
        entries = list(entries_of(path, quantity))
        if quantity.name == name:
            return quantity.label, entries, quantity.per
        for entry in entries:
            if entry.header and entry.header == name:
                return entry_label(quantity, entry.name), [entry], ()
        choice += [entry.header for entry in entries if entry.header]
    if name in QUANTITIES:
        raise InputError.UNSUPPORTED(
            f"{name} can't be drawn as lines; draw a quantity such as total_angle"
        )
    choice.append(STEP)
    meant = nearest(str(name), choice, 3) or f"; there are {', '.join(choice)}"
    raise InputError.UNKNOWN_NAME(f"there is no quantity {name!r} to draw{meant}")
