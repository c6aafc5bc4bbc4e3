"""The shapes of robot that robustness.py draws numbers for.

What is listed here (how many notches of which kinds, which tendons run how, which laws, loads in
the plane or in space) decides which program is compiled; it is the same for all robots of a shape.
Everything else is drawn in draw.py.
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
        material: "linear" or "superelastic".
        loads: "tendons" alone, other loads in the "plane", or in "space".
    """

    name: str
    notches: str
    directions: str
    tendons: tuple[Rope, ...]
    friction: str
    material: str
    loads: str


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
