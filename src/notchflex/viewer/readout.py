"""What the page tells of a state: charts, numbers, the legend of the colours, and notices."""

from __future__ import annotations

from html import escape

import numpy as np
from matplotlib.colors import to_hex

from notchflex import Robot
from notchflex.plotting import BLUE, COLOUR, VERMILLION, Curve, Mark, Panel, branches, dots
from notchflex.support import QUANTITIES
from notchflex.viewer.colours import BEYOND, STRAIN, TENDON, contact_colours, legend
from notchflex.viewer.session import Session, hysteresis

_BEFORE, _NOW = "#b5b5b5", "#111111"
_MAX_CLOSED = 8  # numbers of closed notches in one line


def axis(name: str, tendon: int = 0, count: int = 1) -> str:
    """Return the label of a quantity, of a tendon (from 0) if there are several."""
    quantity = QUANTITIES[name]
    title = quantity.title
    if count > 1:
        title = title.replace("tendon", f"tendon {tendon + 1}")
    return f"{title} [{quantity.unit}]"


def loop(session: Session, tendon: int) -> Panel:
    """Return the total angle against tension or stroke of a tendon (from 0), since rest.

    It is against what is prescribed now. Loading and unloading have their colours; the loop of the
    robot before its last change is grey.
    """
    by = session.controls.by[tendon]
    units = [1.0, QUANTITIES["total_angle"].scale]
    items: list[Mark] = []
    if session.before:
        points = hysteresis(session.before, tendon, by) * units
        items.append(Curve(points, _BEFORE, name="before the change"))
    points = hysteresis(session.history, tendon, by) * units
    for part, way in branches(points[:, 0]) if len(points) > 1 else ():
        items.append(Curve(points[part], COLOUR[way], name=way))
    items.append(dots(points[-1:], _NOW, 6.0, name="now"))
    label = axis(by, tendon, session.robot.number_of_tendons)
    return Panel(items, label, axis("total_angle"), legend="")


def along_tendon(session: Session, tendon: int) -> Panel:
    """Return the tension along a tendon (from 0), with a dot for each contact by its state."""
    spans = session.state.span_tension[tendon]
    spans = spans[np.isfinite(spans)]
    # The tension is constant in a span; the contact at its end changes it.
    edges = np.arange(len(spans) + 1.0)
    steps = np.stack([np.repeat(edges, 2)[1:-1], np.repeat(spans, 2)], axis=1)
    contacts = np.stack([edges[1:-1], spans[1:]], axis=1)
    colours = np.array(contact_colours(session.state, tendon))
    dotted = [dots(contacts[colours == code], code, 4.5) for code in np.unique(colours).tolist()]
    number = f" {tendon + 1}" if session.robot.number_of_tendons > 1 else ""
    label = f"contact of tendon{number}, from 1 at the base"
    return Panel([Curve(steps, TENDON), *dotted], label, axis("span_tension"), legend="")


def rows(session: Session) -> list[tuple[str, str, str]]:
    """Return the numbers of a session's state: name in the HTML, label with unit, value."""
    state, robot = session.state, session.robot
    count = robot.number_of_tendons
    table = [
        (f"{name}_{tendon + 1}", axis(name, tendon, count), f"{value:z.3f}")
        for name in ("tension", "stroke")
        for tendon, value in enumerate(getattr(state, name).tolist())
    ]
    angle = QUANTITIES["total_angle"].scale * float(state.total_angle)
    position = ", ".join(f"{value:z.2f}" for value in np.asarray(state.tip_position).tolist())
    closed = [str(number) for number in np.flatnonzero(state.closed) + 1]
    text = ", ".join(closed) if len(closed) <= _MAX_CLOSED else str(len(closed))
    largest, allowed = _strain(session)
    limit = ", no limit set"
    if allowed is not None:
        limit = f" {'>' if largest > allowed else 'of'} {100.0 * allowed:g} % allowed"
    return [
        *table,
        ("total_angle", axis("total_angle"), f"{angle:z.2f}"),
        ("tip_position", axis("tip_position"), position),
        ("peak_strain", "largest strain", f"{100.0 * largest:.2f} %{limit}"),
        ("closed", f"closed notches of {robot.number_of_notches}", text or "none"),
    ]


def _strain(session: Session) -> tuple[float, float | None]:
    """Return the largest strain and the allowed one, if any is set."""
    largest = float(np.fmax.reduce(np.abs(session.state.peak_strain)))
    return largest, session.robot.material.allowed_strain


def readout(session: Session) -> str:
    """Return the numbers of a session's state as an HTML table; `data-name` names each."""
    largest, allowed = _strain(session)
    warning = allowed is not None and largest > allowed
    style = f' data-warning="true" style="background:{BEYOND};color:white"'
    # Labels may take two lines: in a wide font the numbers would lie beyond the panel.
    cells = "".join(
        f"<tr{style if warning and name == 'peak_strain' else ''}>"
        f'<td style="padding:1px 4px">{escape(label)}</td>'
        '<td style="padding:1px 4px;text-align:right;white-space:nowrap;'
        f'font-variant-numeric:tabular-nums" data-name="{name}">{escape(value)}</td></tr>'
        for name, label, value in rows(session)
    )
    return f'<table style="width:98%;font-size:12px;border-collapse:collapse">{cells}</table>'


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


def legend_html(robot: Robot, cell: float) -> str:
    """Return the legend as HTML; `cell` is the width of a cell of the grid [mm]."""
    allowed, scale = robot.material.allowed_strain, ""
    if allowed is not None:
        colours = ",".join(to_hex(STRAIN(part)) for part in np.linspace(0.0, 1.0, 9))
        scale = (
            f'<div>notch strain 0 <span style="display:inline-block;width:70px;height:9px;'
            f'background:linear-gradient(to right,{colours})"></span> '
            f"{100.0 * allowed:g} % allowed</div>"
        )
    marks = "".join(
        f'<div><span style="display:inline-block;width:10px;height:{10 if mark.marker else 3}px;'
        f"border-radius:{5 if mark.marker else 0}px;vertical-align:middle;"
        f'background:{mark.colour};margin-right:5px"></span>{escape(mark.name)}</div>'
        for mark in legend(robot)
        if not mark.name.endswith("at the tip")
    )
    return (
        f'<div data-name="legend" style="font-size:12px;line-height:1.3;padding:0 6px">{scale}'
        f"{marks}<div>axes x red, y green, z blue; grid {cell:g} mm</div></div>"
    )
