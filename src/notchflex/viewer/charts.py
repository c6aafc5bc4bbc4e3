"""The two live charts: the loop of the whole robot, and the tension along one tendon."""

from __future__ import annotations

import numpy as np

from notchflex.plotting.curves import COLOUR
from notchflex.plotting.drive import LETTING_GO, PULLING, branches
from notchflex.plotting.style import GREY
from notchflex.results.quantities import QUANTITIES
from notchflex.viewer.chart import Line, chart
from notchflex.viewer.colours import TENDON, css, of_contacts
from notchflex.viewer.session import Session

BEFORE = "#b5b5b5"


def axis(name: str, of: str = "") -> str:
    """Return the label of an axis of a quantity, without the symbol that is set as mathematics."""
    quantity = QUANTITIES[name]
    return f"{quantity.title}{of} [{quantity.unit}]"


def loop_chart(session: Session, tendon: int) -> str:
    """Draw the total angle against the tension of a tendon (from 0), since the robot was at rest.

    What was pulled and what was let go have their colours; a loop of the robot before its last
    change is grey.
    """
    scale = QUANTITIES["total_angle"].scale
    lines: list[Line] = []
    if session.before is not None:
        tension, angle = session.before.loop(tendon)
        lines.append(Line(tension, scale * angle, BEFORE, name="before the change"))
    tension, angle = session.history.loop(tendon)
    for part, growing in branches(tension) if len(tension) > 1 else ():
        way = PULLING if growing else LETTING_GO
        lines.append(Line(tension[part], scale * angle[part], COLOUR[way], name=way))
    lines.append(Line(tension[-1:], scale * angle[-1:], "", 0.0, ("#111111",), 4.5, "now"))
    of = f" of tendon {tendon + 1}" if session.robot.number_of_tendons > 1 else ""
    x_label = axis("tension").replace("tendon tension", f"tension{of}" if of else "tendon tension")
    return chart(lines, x_label, axis("total_angle"), "total angle against tension")


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


__all__ = ["axis", "loop_chart", "tendon_chart"]
