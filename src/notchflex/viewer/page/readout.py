"""The numbers of the state as a table for the page, and notices."""

from __future__ import annotations

from html import escape
from typing import NamedTuple

import numpy as np

from notchflex.plotting.style import BLUE, VERMILLION
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.viewer.page.charts import axis
from notchflex.viewer.scene.colours import BEYOND, css, is_beyond
from notchflex.viewer.session import Session

_CELL = (
    'style="padding:1px 4px;text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"'
)
_WARNING = f' data-warning="true" style="background:{css(BEYOND)};color:white"'


class ReadoutRow(NamedTuple):
    """A row of the table.

    Attributes:
        name: Name in the HTML.
        label: Label, with the unit.
        value: The value as text.
        warns: Whether it is marked as a warning.
    """

    name: str
    label: str
    value: str
    warns: bool = False


def rows(session: Session) -> list[ReadoutRow]:
    """Return the numbers of a session's state."""
    state, robot = session.state, session.robot
    found: list[ReadoutRow] = []
    for name in ("tension", "stroke"):
        values = np.asarray(getattr(state, name))
        for tendon, value in enumerate(values):
            of = f" {tendon + 1}" if len(values) > 1 else ""
            label = axis(name).replace("tendon ", f"tendon{of} ")
            found.append(ReadoutRow(f"{name}_{tendon + 1}", label, fixed(float(value), 3)))
    angle = QUANTITIES["total_angle"].scale * float(state.total_angle)
    found.append(ReadoutRow("total_angle", axis("total_angle"), fixed(angle, 2)))
    place = ", ".join(fixed(float(value), 2) for value in state.tip_position)
    found.append(ReadoutRow("tip_position", axis("tip_position"), place))
    found.append(ReadoutRow("peak_strain", "largest strain", *_strain(session)))
    closed = [str(number) for number in np.flatnonzero(state.closed) + 1]
    text = ", ".join(closed) if len(closed) <= 8 else f"{len(closed)}"
    found.append(
        ReadoutRow("closed", f"closed notches of {robot.number_of_notches}", text or "none")
    )
    return found


def readout(session: Session) -> str:
    """Return the numbers of a session's state as an HTML table; `data-name` names each."""
    cells = "".join(
        f"<tr{_WARNING if row.warns else ''}>"
        f'<td style="padding:1px 4px;white-space:nowrap">{escape(row.label)}</td>'
        f'<td {_CELL} data-name="{row.name}">{escape(row.value)}</td></tr>'
        for row in rows(session)
    )
    return f'<table style="width:98%;font-size:12px;border-collapse:collapse">{cells}</table>'


def _strain(session: Session) -> tuple[str, bool]:
    """Return the largest strain and the allowed one, and whether it is exceeded."""
    largest = float(np.max(np.abs(session.state.peak_strain)))
    allowed = session.robot.material.allowed_strain
    text = f"{100.0 * largest:.2f} %"
    if allowed is None:
        return f"{text}, no limit set", False
    if is_beyond(largest / allowed):
        return f"{text} > {100.0 * allowed:g} % allowed", True
    return f"{text} of {100.0 * allowed:g} % allowed", False


def notice(text: str, waiting: bool = False) -> str:
    """Return a sentence as a framed note; an empty one for no sentence."""
    if not text:
        return '<div data-name="notice" role="status"></div>'
    colour, role = (BLUE, "status") if waiting else (VERMILLION, "alert")
    return (
        f'<div data-name="notice" role="{role}" style="border-left:4px solid {colour};'
        'padding:4px 8px;margin:4px;font-size:13px;white-space:pre-wrap;overflow-wrap:anywhere">'
        f"{escape(text)}</div>"
    )


def beyond(label: str, value: float, ends: tuple[float, float], further: bool) -> str:
    """Return the notice that a value lies outside its slider, and which one is set.

    Args:
        label: Label of the slider, with its unit in brackets.
        value: The typed value.
        ends: Least and largest value of the slider.
        further: Whether the end of the slider can be changed.

    Example:
        >>> beyond("tension [N]", 30.0, (0.0, 3.0), further=False)
        'tension: 30 N is outside its slider, from 0 to 3 N. It is set to 3 N.'
    """
    name, _, unit = label.removesuffix("]").partition(" [")
    low, high = ends
    remedy = "; change the end under 'slider to'" if further and value > high else ""
    return (
        f"{name}: {value:g} {unit} is outside its slider, from {low:g} to {high:g} {unit}. "
        f"It is set to {min(max(value, low), high):g} {unit}{remedy}."
    )


def fixed(value: float, digits: int) -> str:
    """Return a number with some decimals, without a sign before a zero.

    Example:
        >>> fixed(-1e-9, 2), fixed(-0.126, 2)
        ('0.00', '-0.13')
    """
    return f"{round(value, digits) + 0.0:.{digits}f}"
