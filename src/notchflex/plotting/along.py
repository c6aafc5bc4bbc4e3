"""Along a tendon: its tension from span to span, and how far its friction has reversed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.curves import COLOUR, LINE
from notchflex.plotting.drive import LOADING, UNLOADING, abscissa, branches, drive, way_of
from notchflex.plotting.sheet import BESIDE, Item, Line, Panel
from notchflex.plotting.style import sequence_colours
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.results.quantities.spans import spans_of

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

MOST_STEPS = 6
MOST_TENDONS = 8
"""Tendons of one state whose tension is drawn."""

_FEWEST = 3
"""Steps on which the friction is part reversed, for a curve of it to be worth its place."""

SLACK = 1e-9
"""A tendon with less tension [N] all along a path has nothing to show."""


def pulled_tendons(path: EquilibriumPath) -> list[int]:
    """Return the tendons (from 0) that carry tension anywhere on a path."""
    tension = np.nan_to_num(np.where(np.asarray(path.converged)[:, None], path.tension, 0.0))
    return [int(i) for i in np.flatnonzero(tension.max(axis=0) > SLACK)]


def profile_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) from span to span, while loading and unloading.

    Steps of one tension have one colour; solid lines are loading, dashed ones unloading.
    """
    quantity = QUANTITIES["span_tension"]
    number = np.arange(spans_of(path, tendon))
    ways = {way: _spread(path, steps, tendon) for way, steps in way_of(path).items()}
    # One scale of colours for both ways, by the tension at the base.
    drawn = [step for steps in ways.values() for step in steps]
    most = float(path.tension[drawn, tendon].max())
    colours = sequence_colours(101)
    items: list[Item] = []
    for way, steps in ways.items():
        for step in steps:
            tension = float(path.tension[step, tendon])
            items.append(
                Line(
                    np.stack([number, path.span_tension[step, tendon, : len(number)]], axis=1),
                    colours[round(100 * tension / most)],
                    LINE[way],
                    marker="o",
                    size=1.8,
                    width=1.1,
                    group=way,
                    told=True,
                )
            )
    items += [Line([], "#4c4c4c", LINE[way], name=way, group=way) for way in ways]
    which = f" {tendon + 1}" if path.tension.shape[1] > 1 else ""
    return Panel(
        items,
        f"span of tendon{which} [number], 0 at the base",
        quantity.label,
        legend=BESIDE,
        y_range=(0.0, None),
        whole_x=True,
    )


def front_panel(path: EquilibriumPath) -> Panel:
    """Return at how many contacts of every pulled tendon the friction has reversed.

    After a reversal of the load friction turns contact by contact, from the base on; between two
    contacts by how far the one of them has come (`EquilibriumPath.front`).
    """
    x, label = abscissa(path)
    tendons = pulled_tendons(path)
    reversed_ = reversed_contacts(path)
    items: list[Item] = []
    for order, tendon in enumerate(tendons):
        named: set[str] = set()
        for part, growing in branches(drive(path)):
            way = LOADING if growing else UNLOADING
            which = f", tendon {tendon + 1}" if len(tendons) > 1 else ""
            items.append(
                Line(
                    np.stack([x[part], reversed_[part, tendon]], axis=1),
                    COLOUR[way],
                    LINE[way],
                    marker="os^D"[order % 4],
                    size=2.2,
                    name="" if way in named else f"{way}{which}",
                    group=f"{way}{which}",
                    told=True,
                )
            )
            named.add(way)
    # From where the other curves begin, although nothing rubs without tension.
    room = 0.05 * float(np.ptp(x))
    most = max(spans_of(path, tendon) - 1 for tendon in tendons)
    return Panel(
        items,
        label,
        "reversed contacts [number]",
        title=f"contacts whose friction has reversed, of {most}",
        legend=BESIDE,
        x_range=(float(x.min()) - room, float(x.max()) + room),
        y_range=(-0.03 * most, 1.03 * most),
        whole_y=True,
    )


def reversed_contacts(path: EquilibriumPath) -> NDArray[np.float64]:
    """Return at how many contacts the friction has reversed, (S, tendons); NaN without tension."""
    m, eta = (np.asarray(part, float) for part in path.front)
    # eta falls from 1 to -1 while the friction of one contact reverses.
    reversed_ = m - 1.0 + 0.5 * (1.0 - np.where(np.isnan(eta), 1.0, eta))
    reversed_[~np.asarray(path.converged)] = np.nan
    reversed_[path.tension <= SLACK] = np.nan
    return reversed_


def reverses_step_by_step(path: EquilibriumPath) -> bool:
    """Tell whether the friction of a tendon reverses over several steps: whether to draw it."""
    if not has_friction(path):
        return False
    between = [
        {round(float(value), 6) for value in column if 0.0 < value < spans_of(path, tendon) - 1}
        for tendon in pulled_tendons(path)
        for column in [reversed_contacts(path)[:, tendon]]
    ]
    return max(map(len, between), default=0) >= _FEWEST


def has_friction(path: EquilibriumPath) -> bool:
    """Tell whether any contact of a pulled tendon rubs at any step."""
    bound = np.nan_to_num(path.contact_bound[np.asarray(path.converged)])
    tendons = pulled_tendons(path)
    return bool(tendons) and bool((bound[:, tendons] > 0.0).any())


def _spread(path: EquilibriumPath, steps: list[int], tendon: int) -> list[int]:
    """Some of the steps with tension, evenly spread over it."""
    steps = [step for step in steps if path.tension[step, tendon] > SLACK]
    if len(steps) <= MOST_STEPS:
        return steps
    tension = path.tension[steps, tendon]
    wanted = np.linspace(tension.min(), tension.max(), MOST_STEPS)
    nearest = (steps[int(np.argmin(np.abs(tension - goal)))] for goal in wanted)
    return list(dict.fromkeys(nearest))
