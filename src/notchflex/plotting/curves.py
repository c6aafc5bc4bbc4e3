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
    MARKERS,
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
TIP_LABELS = tuple(f"tip position {axis} [mm]" for axis in "xz")
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


def entry_lines(x: Array, table: Array, each: str = "", **style: Any) -> list[Mark]:
    """Return a curve over x for each entry of a table, (rows, entries), named by its number.

    Of many entries some are drawn; `style` are further options of `Curve`.
    """
    shown = evenly(range(table.shape[1]), MAX_NAMES)
    if len(shown) == 1:
        return [line(x, table[:, 0], BLUE, **style)]
    return [
        line(x, table[:, entry], colour, name=f"{each} {entry + 1}", **style)
        for entry, colour in zip(shown, sequence_colours(len(shown)), strict=True)
    ]


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


def branches_of(path: EquilibriumPath) -> list[tuple[slice, str]]:
    """Return the branches of a path, by the sum over the tendons that change.

    Each counts by its prescribed tension or stroke.
    """
    values, _, changing = prescribed(path)
    values = values[:, changing]
    sizes = np.nanmax(np.abs(values), axis=0, initial=1e-300)
    return list(branches((values / sizes).sum(axis=1)))


def steps_by_branch(path: EquilibriumPath) -> dict[str, list[int]]:
    """Return the converged steps of loading and of unloading, each if there are any."""
    steps = {LOADING: list[int](), UNLOADING: list[int]()}
    for part, way in branches_of(path):
        solved = part.start + np.flatnonzero(path.converged[part])
        steps[way] += [step for step in solved.tolist() if step not in steps[way]]
    return {way: some for way, some in steps.items() if some}


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
    parts = branches_of(path)
    for part, way in parts:
        usual = {"name": "" if len(parts) == 1 else way} if name is None else {"name": name}
        usual |= {"marker": "o" if part.stop - part.start == 1 else ""}
        yield line(x[part], y[part], colour or COLOUR[way], LINE[way], **(usual | style))


def entry_branches(
    path: EquilibriumPath, across: Any, table: Any, names: Any, ends: Any = None
) -> Iterator[Mark]:
    """Yield the branches of every entry, (entries, S), over its own x; several have colours.

    With the ends of a band of tolerances, (2, entries, S), the band lies behind its curve.
    """
    count = len(table)
    named = evenly(range(count), MAX_NAMES)
    for entry, colour in enumerate(sequence_colours(count) if count > 1 else [None]):
        tag = {"group": names[entry]} if colour else {}
        if ends is not None:
            for part, way in branches_of(path):
                x, style = across[entry][part], tag or {"name": "5 to 95 % of draws"}
                shade = colour or COLOUR[way]
                low, high = ends[:, entry, part]
                yield band(x, low, high, shade, 0.18, layer=1, **style)
        tag |= {"name": names[entry] * (entry in named)} if colour else {}
        yield from branch_lines(path, across[entry], table[entry], colour, **tag)


def way_entries(path: EquilibriumPath) -> list[Curve]:
    """Return legend entries of loading and unloading, if a path has both."""
    ways = dict.fromkeys(way for _, way in branches_of(path))
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
    **options: Any,
) -> Panel:
    """Return a quantity over the load, each entry in its colour, with its band of tolerances.

    Args:
        path: Solved path.
        name: A quantity with one number, or one for each notch.
        bands: Bands by name of the quantity; None for none.
        extra: Further marks.
        options: Those of `Panel`.
    """
    x, x_label = abscissa(path)
    table = scaled(path, name, getattr(path, name)).T
    ends = None
    if bands and name in bands:
        low, high = (scaled(path, name, end).T for end in (bands[name].low, bands[name].high))
        ends = np.where(path.converged, np.sort([low, high], axis=0), np.nan)
    names = [f"notch {number}" for number in range(1, len(table) + 1)]
    lines = entry_branches(path, [x] * len(table), table, names, ends)
    items: list[Mark] = [*lines, *extra, *failures(path, x)]
    options = {"y_label": QUANTITIES[name].label} | options
    return Panel(items, x_label, shared="x", **options)


def scaled(path: EquilibriumPath, name: str, values: Any) -> Array:
    """Return a quantity in the unit of pictures, (S, entries): strains unsigned, in percent."""
    values = np.asarray(values, float).reshape(len(path), -1)
    return 100.0 * np.abs(values) if name == "peak_strain" else QUANTITIES[name].scale * values


def path_panels(path: EquilibriumPath, bands: Mapping[str, Band] | None) -> list[Panel]:
    """Return the curves that a path of several steps is worth."""
    panels = [total_panel(path, bands), notches_panel(path, bands)]
    _, by_stroke, changing = prescribed(path)
    for tendon in [tendon for tendon in changing if tendon in by_stroke][:MAX_PROFILES]:
        # The tension of a tendon over its stroke: the hysteresis of friction.
        labels = [tendon_label(path, name, tendon) for name in ("stroke", "tension")]
        items: list[Mark] = [*failures(path, path.commanded_stroke[:, tendon])]
        items[:0] = branch_lines(path, path.stroke[:, tendon], path.tension[:, tendon])
        panels.append(Panel(items, *labels, legend=INSIDE, from_zero=True))
    allowed, limits = path.robot.material.allowed_strain, list[Mark]()
    if allowed is not None:
        level, name = 100.0 * allowed, f"allowed {100.0 * allowed:.3g} %"
        limits.append(Span("y", level, VERMILLION, DASHED, 1.2, name=name))
    label = f"{QUANTITIES['peak_strain'].title} of every notch [%]"
    strain = load_panel(
        path, "peak_strain", bands, limits, y_label=label, from_zero=True, legend=INSIDE
    )
    # The curves of the notches have their names in the panel of the angles.
    items = [replace(item, name="") if item.group else item for item in strain.items]
    panels.append(replace(strain, items=items))
    if len(steps_by_branch(path)) > 1:
        panels += [profile_panel(path, tendon) for tendon in pulled_tendons(path)[:MAX_PROFILES]]
        panels += front_panels(path)
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


def front_panels(path: EquilibriumPath) -> list[Panel]:
    """Return the number of contacts of every pulled tendon at which the friction has reversed.

    After a reversal of the load, friction reverses contact by contact from the base; fractions
    follow from the state of the contact in between (`EquilibriumPath.front`). Where it reverses in
    fewer than three steps there is nothing to see, and no panel.
    """
    x, x_label = abscissa(path)
    contact, eta = (np.asarray(part, float) for part in path.front)
    # eta decreases from 1 to -1 while the friction of one contact reverses.
    counts = contact - 1.0 + 0.5 * (1.0 - np.where(np.isnan(eta), 1.0, eta))
    counts[path.tension <= SLACK] = np.nan
    tendons, solved = pulled_tendons(path), np.asarray(path.converged)
    most, is_seen, items = 0, False, list[Mark]()
    for order, tendon in enumerate(tendons):
        contacts, count = spans_of(path, tendon) - 1, counts[solved, tendon]
        partial = count[(count > 0.0) & (count < contacts)].round(6)
        rubs = np.any(path.contact_bound[solved, tendon] > 0.0)
        is_seen |= bool(rubs and len(np.unique(partial)) > 2)
        most = max(most, contacts)
        which = f", tendon {tendon + 1}" if len(tendons) > 1 else ""
        style: dict[str, Any] = {"marker": MARKERS[order % len(MARKERS)], "size": 2.2}
        for curve in branch_lines(path, x, counts[:, tendon], **style):
            items.append(replace(curve, name=curve.name and curve.name + which))
    title, label = f"contacts with reversed friction, of {most}", "reversed contacts [number]"
    limits = -0.03 * most, 1.03 * most
    panel = Panel(items, x_label, label, title=title, shared="x", whole="y", y_range=limits)
    return [panel] if is_seen else []


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
    names, table = [entry.name for entry in upward], [entry.values for entry in upward]
    lines = entry_branches(path, [entry.values for entry in across], table, names)
    items: list[Mark] = [*lines, *(way_entries(path) if len(upward) > 1 else ())]
    if len({entry.header for entry in across}) == 1:
        items += failures(path, across[0].values)
    legend = BESIDE if len(upward) > 1 else INSIDE
    return Panel(items, x_label, y_label, legend=legend, whole="x" * (x == STEP))


def _series(path: EquilibriumPath, name: str) -> tuple[str, list[Any], tuple[str, ...]]:
    """Return the label, the entries and their kind of a quantity of a path.

    It has the name of the quantity, or the CSV column of one of its entries.
    """
    names: list[str] = []
    for choice, label, entries, per in _choices(path):
        if choice == name:
            return label, entries, per
        names.append(choice)
    if name in QUANTITIES:
        raise InputError.UNSUPPORTED(
            f"{name} can't be drawn as lines; draw a quantity such as total_angle"
        )
    meant = nearest(str(name), names, 3) or f"; there are {', '.join(names)}"
    raise InputError.UNKNOWN_NAME(f"there is no quantity {name!r} to draw{meant}")


def _choices(path: EquilibriumPath) -> Iterator[tuple[str, str, list[Any], tuple[str, ...]]]:
    """Yield all that can be drawn as lines: its name, its label, its entries and their kind."""
    number = np.arange(1.0, len(path) + 1.0)
    yield STEP, STEP, [SimpleNamespace(header="", name="", values=number)], ()
    for quantity in QUANTITIES.values():
        if is_listed(quantity) and quantity.kind is not str:
            entries = list(entries_of(path, quantity))
            yield quantity.name, quantity.label, entries, quantity.per
            for entry in entries:
                if entry.header:
                    yield entry.header, entry_label(quantity, entry.name), [entry], ()
