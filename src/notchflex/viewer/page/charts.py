"""The two live charts: the loop of the whole robot, and the tension along one tendon."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from notchflex.plotting.curves import COLOUR
from notchflex.plotting.branches import LOADING, UNLOADING, branches
from notchflex.plotting.style import GREY
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.viewer.page.chart import Line, chart
from notchflex.viewer.scene.colours import TENDON, css, of_contacts
from notchflex.viewer.session import Session

BEFORE = "#b5b5b5"


def axis(name: str) -> str:
    """Return the label of an axis of a quantity, without the symbol that is set as mathematics."""
    quantity = QUANTITIES[name]
    return f"{quantity.title} [{quantity.unit}]"


class Loop(NamedTuple):
    """A chart of the total angle.

    Attributes:
        lines: What is drawn.
        x_label: Text of the horizontal axis.
        y_label: Text of the vertical axis.
        name: What it shows.
    """

    lines: list[Line]
    x_label: str
    y_label: str
    name: str


def loop(session: Session, tendon: int) -> Loop:
    """Return the total angle against tension or stroke of a tendon (from 0), since it was at rest.

    It is against what commands the tendon now. Loading and unloading have their colours; a loop of
    the robot before its last change is grey.
    """
    scale = QUANTITIES["total_angle"].scale
    by = session.controls.by[tendon]
    lines: list[Line] = []
    if session.before is not None:
        drawn, angle = session.before.loop(tendon, by)
        lines.append(Line(drawn, scale * angle, BEFORE, name="before the change"))
    drawn, angle = session.history.loop(tendon, by)
    for part, growing in branches(drawn) if len(drawn) > 1 else ():
        way = LOADING if growing else UNLOADING
        lines.append(Line(drawn[part], scale * angle[part], COLOUR[way], name=way))
    lines.append(Line(drawn[-1:], scale * angle[-1:], "", 0.0, ("#111111",), 4.5, "now"))
    x_label = axis(by)
    if session.robot.number_of_tendons > 1:
        x_label = x_label.replace(f"tendon {by}", f"{by} of tendon {tendon + 1}")
    return Loop(lines, x_label, axis("total_angle"), f"total angle against {by}")


def loop_chart(session: Session, tendon: int) -> str:
    """Draw `loop` as an SVG element."""
    found = loop(session, tendon)
    return chart(found.lines, found.x_label, found.y_label, found.name)


def tendon_chart(session: Session, tendon: int) -> str:
    """Draw the tension along a tendon (from 0), a dot for each contact by what it does."""
    spans = np.asarray(session.state.span_tension, float)[tendon]
    spans = spans[np.isfinite(spans)]
    contacts = len(spans) - 1
    # A span keeps its tension; the contact at its end changes it.
    edges = np.arange(len(spans) + 1.0)
    x, y = np.repeat(edges, 2)[1:-1], np.repeat(spans, 2)
    dots = of_contacts(session.state, tendon)
    lines = [Line(x, y, css(TENDON), 2.0, name="tension")]
    if contacts > 0:
        lines.append(Line(edges[1:-1], spans[1:], GREY, 0.0, dots, 3.2, "contacts"))
    of = f" {tendon + 1}" if session.robot.number_of_tendons > 1 else ""
    return chart(
        lines,
        f"contact of tendon{of}, from 1 at the base",
        axis("span_tension"),
        "tension along the tendon",
    )


__all__ = ["Loop", "axis", "loop", "loop_chart", "tendon_chart"]
