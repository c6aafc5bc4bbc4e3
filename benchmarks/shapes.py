"""The shapes of robot that robustness.py draws numbers for.

What is listed here (how many notches of which kinds, which tendons run how, which laws, loads in
the plane or in space) decides which program is compiled; it is the same for all robots of a shape.
Everything else is drawn in draw.py. `SHAPES` have the laws of the papers, `DRAWN` what a drawing
of the tube gives: elastic ends, elastic closing, fibres with and without hysteresis.
"""

from __future__ import annotations

from typing import NamedTuple


class Rope(NamedTuple):
    """How a tendon runs.

    Attributes:
        side: Direction, deg.
        path: "wall-arc", "straight" and so on.
        end: Body in which it ends; 0 is the last one, None any that has wall on its side.
    """

    side: float
    path: str = "wall-arc"
    end: int | None = None


class Shape(NamedTuple):
    """What robots that share a program have in common.

    Attributes:
        name: What it is called in tables.
        notches: Kinds, base to tip: o and s are arcs (on-axis cut by a laser, saw cut), p is a
            pair of triangular notches, u a U-link.
        directions: Sides to which the arcs bend: "one", "both" (0 and 180 deg), "four", "any".
        tendons: The tendons; the first ends in the last body that has wall on its side.
        friction: "frictionless", "geometric", "whole-before", "slope" or "chord".
        material: "linear", "superelastic", "nitinol", "hysteresis" (nitinol that unloads on a
            plateau of its own) or "table" (stress over strain).
        loads: "tendons" alone, other loads in the "plane", or in "space".
        ends: "rigid", or "elastic": the notches as the tube makes them.
        closing: Of arcs, "rigid" or "elastic".
    """

    name: str
    notches: str
    directions: str
    tendons: tuple[Rope, ...]
    friction: str
    material: str
    loads: str
    ends: str = "rigid"
    closing: str = "rigid"


def _straight(*sides: float, path: str = "straight") -> tuple[Rope, ...]:
    return tuple(Rope(side, path, None if i else 0) for i, side in enumerate(sides))


def _wall(*sides: float) -> tuple[Rope, ...]:
    return _straight(*sides, path="wall-arc")


SHAPES = (
    Shape("wrist", "ooooo", "one", _wall(0), "whole-before", "superelastic", "tendons"),
    Shape("saw-cut wrist", "ssss", "one", _wall(0), "geometric", "linear", "plane"),
    Shape("wrist in space", "ooo", "one", _wall(0, 180), "geometric", "superelastic", "space"),
    Shape("both sides", "oooooo", "both", _wall(0, 180), "frictionless", "linear", "plane"),
    Shape("two axes", "ooooo", "four", _wall(0, 90, 180, 270), "geometric", "linear", "space"),
    Shape("any side", "sososo", "any", _wall(0, 120, 240), "whole-before", "linear", "tendons"),
    Shape(
        "straight tendons",
        "ssssss",
        "four",
        _straight(0, 120, 240),
        "frictionless",
        "linear",
        "space",
    ),
    Shape("straight tendon", "oooo", "one", _straight(0), "slope", "superelastic", "plane"),
    Shape("strips", "pppp", "one", _straight(0), "slope", "linear", "tendons"),
    Shape("strips, two cables", "ppppp", "one", _straight(0, 180), "chord", "linear", "plane"),
    Shape(
        "strips in space",
        "ppp",
        "one",
        _straight(0, 180, path="straight-follower"),
        "geometric",
        "superelastic",
        "space",
    ),
    Shape("links", "uuuuuu", "one", _straight(0, 180), "slope", "linear", "tendons"),
    Shape("more links", "uuuuuuuu", "one", _straight(0, 180), "geometric", "linear", "plane"),
    Shape("links in space", "uuuuu", "one", _straight(0), "frictionless", "superelastic", "space"),
    Shape("all kinds", "oospuuu", "one", _straight(0, 180), "slope", "linear", "plane"),
    Shape(
        "links on a wrist",
        "ooouuu",
        "one",
        (Rope(0, "straight", 0), Rope(180, "straight"), Rope(0, "wall-arc", 3)),
        "geometric",
        "superelastic",
        "space",
    ),
)

DRAWN = (
    Shape(
        "drawn wrist", "ooooo", "one", _straight(0), "geometric", "nitinol", "tendons", "elastic"
    ),
    Shape(
        "with hysteresis",
        "ooooo",
        "one",
        _straight(0),
        "geometric",
        "hysteresis",
        "tendons",
        "elastic",
        "elastic",
    ),
    Shape("drawn saw cuts", "ssss", "one", _wall(0), "geometric", "linear", "plane", "elastic"),
    Shape(
        "drawn in space", "ooo", "one", _straight(0, 180), "slope", "nitinol", "space", "elastic"
    ),
    Shape(
        "both sides, loops",
        "oooo",
        "both",
        _wall(0, 180),
        "frictionless",
        "hysteresis",
        "plane",
        "elastic",
    ),
    Shape(
        "drawn, of a table",
        "soos",
        "one",
        _straight(0),
        "whole-before",
        "table",
        "tendons",
        "elastic",
        "elastic",
    ),
    Shape(
        "rigid, loops",
        "osos",
        "any",
        _wall(0, 120, 240),
        "geometric",
        "hysteresis",
        "tendons",
        "rigid",
        "elastic",
    ),
    Shape(
        "loops in space",
        "oooo",
        "four",
        _straight(0, 90, 180, 270),
        "geometric",
        "hysteresis",
        "space",
        "elastic",
        "elastic",
    ),
    Shape(
        "drawn, superelastic",
        "oooo",
        "one",
        _straight(0),
        "chord",
        "superelastic",
        "plane",
        "elastic",
        "elastic",
    ),
    Shape("drawn strips", "pppp", "one", _straight(0, 180), "slope", "linear", "plane", "elastic"),
    Shape(
        "drawn strips in space",
        "ppp",
        "one",
        _straight(0, 180),
        "geometric",
        "nitinol",
        "space",
        "elastic",
    ),
    Shape("drawn links", "uuuuuu", "one", _straight(0, 180), "slope", "linear", "plane", "elastic"),
    Shape(
        "drawn links in space", "uuuuu", "one", _straight(0), "chord", "table", "space", "elastic"
    ),
    Shape(
        "all kinds, drawn",
        "oospuu",
        "one",
        _straight(0, 180),
        "slope",
        "hysteresis",
        "plane",
        "elastic",
        "elastic",
    ),
)
