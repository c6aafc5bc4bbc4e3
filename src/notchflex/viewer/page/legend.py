"""The legend of the colours of the scene and the charts, for the page and for pictures."""

from __future__ import annotations

from html import escape
from typing import NamedTuple

import numpy as np

from notchflex.plotting.curves import COLOUR
from notchflex.results.quantities.registry import CONTACT_STATES
from notchflex.robot import Robot
from notchflex.viewer.scene.colours import (
    BEYOND,
    CLOSED,
    CONTACT,
    LOAD,
    METAL,
    TENDON,
    UNKNOWN,
    css,
    strain_colour,
)

BALL, LINE = "ball", "line"


class LegendEntry(NamedTuple):
    """A colour and what it means.

    Attributes:
        colour: Colour in CSS.
        mark: `BALL` or `LINE`.
        text: Meaning.
    """

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
    """Return the legend as HTML.

    Args:
        robot: The robot.
        cell: Width of a cell of the grid, mm.
    """
    allowed, scale = robot.material.allowed_strain, ""
    if allowed is not None:
        scale = (
            f'<div>notch strain 0 <span style="display:inline-block;width:70px;height:9px;'
            f'background:linear-gradient(to right,{",".join(strain_scale(9))})"></span> '
            f"{100.0 * allowed:g} % allowed</div>"
        )
    listed = [one for one in entries(robot) if not one.text.endswith("at the tip")]
    marks = "".join(_mark(one) for one in listed)
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
