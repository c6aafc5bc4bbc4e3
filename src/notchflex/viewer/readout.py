"""The numbers of the state as a small table for the page, and what the colours mean."""

from __future__ import annotations

from html import escape

import numpy as np

from notchflex.plotting.style import BLUE, VERMILLION
from notchflex.results.quantities import CONTACT_STATES, QUANTITIES
from notchflex.robot import Robot
from notchflex.viewer.charts import axis
from notchflex.viewer.colours import CLOSED, CONTACT, METAL, UNKNOWN, css, of_strain
from notchflex.viewer.session import Session

_CELL = 'style="padding:1px 4px;text-align:right;font-variant-numeric:tabular-nums"'


def readout(session: Session) -> str:
    """Return the numbers of a session's state as an HTML table; `data-name` names each."""
    state, robot = session.state, session.robot
    rows: list[tuple[str, str, str]] = []
    for name in ("tension", "stroke"):
        values = np.asarray(getattr(state, name))
        for tendon, value in enumerate(values):
            of = f" {tendon + 1}" if len(values) > 1 else ""
            label = axis(name).replace("tendon ", f"tendon{of} ")
            rows.append((f"{name}_{tendon + 1}", label, f"{value:.3f}"))
    angle = QUANTITIES["total_angle"].scale * float(state.total_angle)
    rows.append(("total_angle", axis("total_angle"), f"{angle + 0.0:.2f}"))
    place = ", ".join(f"{value + 0.0:.2f}" for value in state.tip_position)
    rows.append(("tip_position", axis("tip_position"), place))
    rows.append(("peak_strain", "largest strain", _strain(session)))
    closed = [str(number) for number in np.flatnonzero(state.closed) + 1]
    told = ", ".join(closed) if len(closed) <= 8 else f"{len(closed)}"
    rows.append(("closed", f"closed notches of {robot.number_of_notches}", told or "none"))
    cells = "".join(
        f'<tr><td style="padding:1px 4px">{escape(label)}</td>'
        f'<td {_CELL} data-name="{name}">{escape(value)}</td></tr>'
        for name, label, value in rows
    )
    return f'<table style="width:96%;font-size:13px;border-collapse:collapse">{cells}</table>'


def _strain(session: Session) -> str:
    largest = float(np.max(np.abs(session.state.peak_strain)))
    allowed = session.robot.material.allowed_strain
    told = f"{100.0 * largest:.2f} %"
    return told if allowed is None else f"{told} of {100.0 * allowed:g} % allowed"


def notice(text: str, waiting: bool = False) -> str:
    """Return a sentence as a framed note; nothing where there is none to tell."""
    if not text:
        return '<div role="status"></div>'
    colour, role = (BLUE, "status") if waiting else (VERMILLION, "alert")
    return (
        f'<div role="{role}" style="border-left:4px solid {colour};padding:4px 8px;margin:4px;'
        f'font-size:13px;white-space:pre-wrap;overflow-wrap:anywhere">{escape(text)}</div>'
    )


def legend(robot: Robot, cell: float) -> str:
    """Return what colours and marks mean, as HTML.

    Args:
        robot: The robot.
        cell: Width of a cell of the grid, mm.
    """
    allowed = robot.material.allowed_strain
    if allowed is None:
        strain = _entry(css(METAL), "notches; the robot file allows no particular strain")
    else:
        scale = ",".join(css(of_strain(part)) for part in np.linspace(0.0, 1.0, 9))
        strain = (
            f'<div>strain of notches: 0 <span style="display:inline-block;width:90px;height:10px;'
            f'background:linear-gradient(to right,{scale})"></span> {100.0 * allowed:g} % allowed'
            "</div>"
        )
    contacts = "".join(
        _entry(colour, f"contact: {CONTACT_STATES[number]}") for number, colour in CONTACT.items()
    )
    contacts += _entry(UNKNOWN, "contact without friction, or a slack tendon's")
    return (
        f'<div style="font-size:12px;padding:0 6px">{strain}'
        f"{_entry(css(CLOSED), 'ball: closed notch')}{contacts}"
        f"<div>axes x red, y green, z blue; grid {cell:g} mm</div></div>"
    )


def _entry(colour: str, text: str) -> str:
    return (
        f'<div><span style="display:inline-block;width:10px;height:10px;border-radius:5px;'
        f'background:{colour};margin-right:5px"></span>{escape(text)}</div>'
    )


__all__ = ["legend", "notice", "readout"]
