"""Along a tendon: its tension from span to span, and how far its friction has turned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from notchflex.plot.curves import COLOUR, LINE
from notchflex.plot.drive import LETTING_GO, PULLING, abscissa, branches, drive, way_of
from notchflex.plot.style import sequence_colours
from notchflex.results.quantities import QUANTITIES
from notchflex.results.spans import spans_of

if TYPE_CHECKING:
    from notchflex.statics import Path

MOST_STEPS = 6
SLACK = 1e-9
"""A tendon with less tension [N] all along a path has nothing to show."""


def pulled_tendons(path: Path) -> list[int]:
    """Return the tendons (from 0) that carry tension anywhere on a path."""
    tension = np.nan_to_num(np.where(np.asarray(path.converged)[:, None], path.tension, 0.0))
    return [int(i) for i in np.flatnonzero(tension.max(axis=0) > SLACK)]


def draw_profile(axes: Axes, path: Path, tendon: int) -> None:
    """Draw the tension of a tendon (from 0) from span to span, while pulling and letting go.

    Steps of one tension have one colour; solid lines are pulling, dashed ones letting go.
    """
    quantity = QUANTITIES["span_tension"]
    number = np.arange(spans_of(path, tendon))
    ways = {way: _spread(path, steps, tendon) for way, steps in way_of(path).items()}
    # One scale of colours for both ways, by the tension at the base.
    drawn = [step for steps in ways.values() for step in steps]
    most = float(path.tension[drawn, tendon].max())
    colours = sequence_colours(101)
    for way, steps in ways.items():
        for step in steps:
            tension = float(path.tension[step, tendon])
            axes.plot(
                number,
                path.span_tension[step, tendon, : len(number)],
                color=colours[round(100 * tension / most)],
                linestyle=LINE[way],
                marker="o",
                markersize=1.8,
                linewidth=1.1,
            )
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(bottom=0.0)
    which = f" {tendon + 1}" if path.tension.shape[1] > 1 else ""
    axes.set_xlabel(f"span of tendon{which}, 0 at the base")
    axes.set_ylabel(quantity.label)
    entries = [Line2D([], [], color="0.3", linestyle=LINE[way], label=way) for way in ways]
    axes.legend(handles=entries, loc="best")


def draw_front(axes: Axes, path: Path) -> None:
    """Draw how far the friction of every pulled tendon has turned from pulling to letting go."""
    x, label = abscissa(path)
    tendons = pulled_tendons(path)
    m, eta = (np.asarray(part, float) for part in path.front)
    # Between contacts by eta, which falls from 1 to -1 while one contact turns.
    front = m + 0.5 * (1.0 - np.where(np.isnan(eta), 1.0, eta))
    front[~np.asarray(path.converged)] = np.nan
    front[path.tension <= SLACK] = np.nan  # without tension there is no friction
    for order, tendon in enumerate(tendons):
        named: set[str] = set()
        for part, growing in branches(drive(path)):
            way = PULLING if growing else LETTING_GO
            which = f", tendon {tendon + 1}" if len(tendons) > 1 else ""
            axes.plot(
                x[part],
                front[part, tendon],
                color=COLOUR[way],
                linestyle=LINE[way],
                marker="os^D"[order % 4],
                markersize=2.2,
                label=None if way in named else f"{way}{which}",
            )
            named.add(way)
    # From where the other curves begin, although nothing rubs without tension.
    room = 0.05 * float(np.ptp(x))
    axes.set_xlim(x.min() - room, x.max() + room)
    most = max(spans_of(path, tendon) for tendon in tendons)
    axes.set_ylim(0.5, most + 0.5)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel(label)
    axes.set_ylabel(r"friction front $m + (1 - \eta)/2$, contact")
    axes.legend(loc="best")


def has_friction(path: Path) -> bool:
    """Tell whether any contact of a pulled tendon rubs at any step."""
    bound = np.nan_to_num(path.contact_bound[np.asarray(path.converged)])
    tendons = pulled_tendons(path)
    return bool(tendons) and bool((bound[:, tendons] > 0.0).any())


def _spread(path: Path, steps: list[int], tendon: int) -> list[int]:
    """Some of the steps with tension, evenly spread over it."""
    steps = [step for step in steps if path.tension[step, tendon] > SLACK]
    if len(steps) <= MOST_STEPS:
        return steps
    tension = path.tension[steps, tendon]
    wanted = np.linspace(tension.min(), tension.max(), MOST_STEPS)
    nearest = (steps[int(np.argmin(np.abs(tension - goal)))] for goal in wanted)
    return list(dict.fromkeys(nearest))
