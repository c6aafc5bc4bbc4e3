"""The two live charts: the loop of the whole robot, and the tension along one tendon."""

from __future__ import annotations

import numpy as np

from notchflex.plotting.branches import branches
from notchflex.plotting.curves import COLOUR
from notchflex.plotting.sheet import Line, Mark, Panel, dots
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.viewer.page.chart import chart
from notchflex.viewer.scene.colours import TENDON, contact_colours, css
from notchflex.viewer.session import Session

BEFORE = "#b5b5b5"


def axis(name: str) -> str:
    """Return the label of a quantity without its symbol."""
    quantity = QUANTITIES[name]
    return f"{quantity.title} [{quantity.unit}]"


def loop(session: Session, tendon: int) -> Panel:
    """Return the total angle against tension or stroke of a tendon (from 0), since rest.

    It is against what is prescribed now. Loading and unloading have their colours; the loop of the
    robot before its last change is grey.
    """
    scale = QUANTITIES["total_angle"].scale
    by = session.controls.by[tendon]
    items: list[Mark] = []
    if session.before is not None:
        points = session.before.loop(tendon, by) * [1.0, scale]
        items.append(Line(points, BEFORE, width=2.0, name="before the change"))
    points = session.history.loop(tendon, by) * [1.0, scale]
    for part, way in branches(points[:, 0]) if len(points) > 1 else ():
        items.append(Line(points[part], COLOUR[way], width=2.0, name=way))
    items.append(dots(points[-1:], "#111111", 9.0, name="now"))
    x_label = axis(by)
    if session.robot.number_of_tendons > 1:
        x_label = x_label.replace(f"tendon {by}", f"{by} of tendon {tendon + 1}")
    return Panel(items, x_label, axis("total_angle"))


def loop_chart(session: Session, tendon: int) -> str:
    """Draw `loop` as an SVG element."""
    by = session.controls.by[tendon]
    return chart(loop(session, tendon), f"total angle against {by}")


def tendon_chart(session: Session, tendon: int) -> str:
    """Draw the tension along a tendon (from 0), with a dot for each contact by its state."""
    spans = np.asarray(session.state.span_tension, float)[tendon]
    spans = spans[np.isfinite(spans)]
    # The tension is constant in a span; the contact at its end changes it.
    edges = np.arange(len(spans) + 1.0)
    steps = np.stack([np.repeat(edges, 2)[1:-1], np.repeat(spans, 2)], axis=1)
    items: list[Mark] = [Line(steps, css(TENDON), width=2.0, name="tension")]
    colours = np.array(contact_colours(session.state, tendon))
    contacts = np.stack([edges[1:-1], spans[1:]], axis=1)
    for colour in dict.fromkeys(colours.tolist()):
        items.append(dots(contacts[colours == colour], colour, 6.4))
    of = f" {tendon + 1}" if session.robot.number_of_tendons > 1 else ""
    label = f"contact of tendon{of}, from 1 at the base"
    return chart(Panel(items, label, axis("span_tension")), "tension along the tendon")
