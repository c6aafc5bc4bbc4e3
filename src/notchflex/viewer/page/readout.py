"""The numbers of the state and the legend of the colours as HTML, and notices."""

from __future__ import annotations

from html import escape
from typing import NamedTuple

import numpy as np

from notchflex import Robot
from notchflex.plotting import BLUE, COLOUR, VERMILLION
from notchflex.support import CONTACT_STATES, QUANTITIES
from notchflex.viewer.page.chart import axis
from notchflex.viewer.scene.marks import (
    BEYOND,
    CLOSED,
    CONTACT,
    LOAD,
    METAL,
    TENDON,
    UNKNOWN,
    css,
    is_beyond,
    strain_colour,
)
from notchflex.viewer.session import Session

BALL, LINE = "ball", "line"

_CELL = (
    'style="padding:1px 4px;text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"'
)
_WARNING = f' data-warning="true" style="background:{css(BEYOND)};color:white"'


class ReadoutRow(NamedTuple):
    """A row of the table: name in the HTML, label with unit, value, whether it is a warning."""

    name: str
    label: str
    value: str
    warns: bool = False


def rows(session: Session) -> list[ReadoutRow]:
    """Return the numbers of a session's state."""
    state, robot = session.state, session.robot
    table: list[ReadoutRow] = []
    for name in ("tension", "stroke"):
        values = np.asarray(getattr(state, name))
        for tendon, value in enumerate(values):
            of = f" {tendon + 1}" if len(values) > 1 else ""
            label = axis(name).replace("tendon ", f"tendon{of} ")
            table.append(ReadoutRow(f"{name}_{tendon + 1}", label, fixed(float(value), 3)))
    angle = QUANTITIES["total_angle"].scale * float(state.total_angle)
    position = ", ".join(fixed(float(value), 2) for value in state.tip_position)
    closed = [str(number) for number in np.flatnonzero(state.closed) + 1]
    text = ", ".join(closed) if len(closed) <= 8 else f"{len(closed)}"
    largest = float(np.max(np.abs(state.peak_strain)))
    allowed = robot.material.allowed_strain
    warns, limit = False, ", no limit set"
    if allowed is not None:
        warns = is_beyond(largest / allowed)
        limit = f" {'>' if warns else 'of'} {100.0 * allowed:g} % allowed"
    strain = f"{100.0 * largest:.2f} %{limit}"
    return [
        *table,
        ReadoutRow("total_angle", axis("total_angle"), fixed(angle, 2)),
        ReadoutRow("tip_position", axis("tip_position"), position),
        ReadoutRow("peak_strain", "largest strain", strain, warns),
        ReadoutRow("closed", f"closed notches of {robot.number_of_notches}", text or "none"),
    ]


def readout(session: Session) -> str:
    """Return the numbers of a session's state as an HTML table; `data-name` names each."""
    # Labels may take two lines: in a wide font the numbers would lie beyond the panel.
    cells = "".join(
        f"<tr{_WARNING if row.warns else ''}>"
        f'<td style="padding:1px 4px">{escape(row.label)}</td>'
        f'<td {_CELL} data-name="{row.name}">{escape(row.value)}</td></tr>'
        for row in rows(session)
    )
    return f'<table style="width:98%;font-size:12px;border-collapse:collapse">{cells}</table>'


def fixed(value: float, digits: int) -> str:
    """Return a number with some decimals, without a sign before a zero.

    Example:
        >>> fixed(-1e-9, 2), fixed(-0.126, 2)
        ('0.00', '-0.13')
    """
    return f"{round(value, digits) + 0.0:.{digits}f}"


def notice(text: str, waiting: bool = False) -> str:
    """Return a sentence as a note over the scene, where no panel scrolls; an empty one for none."""
    if not text:
        return '<div data-name="notice" role="status"></div>'
    colour, role = (BLUE, 'status" data-waiting="true') if waiting else (VERMILLION, "alert")
    return (
        f'<div data-name="notice" role="{role}" style="border-left:4px solid {colour};'
        "position:fixed;top:8px;left:50%;transform:translateX(-50%);max-width:40vw;z-index:100;"
        "pointer-events:none;background:white;box-shadow:0 1px 6px #0006;"
        'padding:4px 8px;font-size:13px;white-space:pre-wrap;overflow-wrap:anywhere">'
        f"{escape(text)}</div>"
    )


def beyond(label: str, value: float, ends: tuple[float, float], further: bool) -> str:
    """Return the notice that a value lies outside its slider, and which one is set.

    `label` is that of the slider; `further`: its end can be changed.

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


class LegendEntry(NamedTuple):
    """A colour in CSS, its mark (`BALL` or `LINE`), and what it means."""

    colour: str
    mark: str
    text: str


def entries(robot: Robot) -> list[LegendEntry]:
    """Return the meaning of each colour, except the scale of the strain."""
    allowed = robot.material.allowed_strain
    if allowed is None:
        strain = LegendEntry(css(METAL), BALL, "notch: the robot file sets no allowed strain")
    else:
        strain = LegendEntry(css(BEYOND), BALL, f"notch strained beyond {100.0 * allowed:g} %")
    return [
        strain,
        LegendEntry(css(CLOSED), BALL, "closed notch"),
        *(LegendEntry(CONTACT[one], BALL, f"contact: {CONTACT_STATES[one]}") for one in CONTACT),
        LegendEntry(UNKNOWN, BALL, "contact without friction, or slack"),
        LegendEntry(css(TENDON), LINE, "tendon"),
        *(LegendEntry(colour, LINE, f"loop: {way}") for way, colour in COLOUR.items()),
        LegendEntry(LOAD["force"], LINE, "force at the tip"),
        LegendEntry(LOAD["moment"], LINE, "moment at the tip"),
    ]


def strain_scale(count: int) -> list[str]:
    """Return colours from zero strain to the allowed one."""
    return [css(strain_colour(part)) for part in np.linspace(0.0, 1.0, count).tolist()]


def legend_html(robot: Robot, cell: float) -> str:
    """Return the legend as HTML; `cell` is the width of a cell of the grid [mm]."""
    allowed, scale = robot.material.allowed_strain, ""
    if allowed is not None:
        scale = (
            f'<div>notch strain 0 <span style="display:inline-block;width:70px;height:9px;'
            f'background:linear-gradient(to right,{",".join(strain_scale(9))})"></span> '
            f"{100.0 * allowed:g} % allowed</div>"
        )
    marks = "".join(_mark(one) for one in entries(robot) if not one.text.endswith("at the tip"))
    return (
        f'<div data-name="legend" style="font-size:12px;line-height:1.3;padding:0 6px">{scale}'
        f"{marks}<div>axes x red, y green, z blue; grid {cell:g} mm</div></div>"
    )


def _mark(one: LegendEntry) -> str:
    height, radius = (10, 5) if one.mark == BALL else (3, 0)
    return (
        f'<div><span style="display:inline-block;width:10px;height:{height}px;'
        f"border-radius:{radius}px;vertical-align:middle;background:{one.colour};"
        f'margin-right:5px"></span>{escape(one.text)}</div>'
    )
