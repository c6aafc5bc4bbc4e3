"""Panels along a tendon: tension from span to span, and contacts whose friction has reversed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.curves import LINE, NEUTRAL, abscissa, branch_lines, steps_by_branch
from notchflex.plotting.sheet import BESIDE, Colour, Curve, Mark, Panel
from notchflex.plotting.style import sequence_colours
from notchflex.results.quantities.registry import QUANTITIES, spans_of

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

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
