"""Design specifications that tests and benchmarks share."""

from __future__ import annotations

from math import cos, sin
from typing import Any

import notchflex as nf
from notchflex.robot import from_table, to_table

# A wider tube than that of wrist A: at 6 % of strain its notches close beyond 1.4 N.
WIDE = {"tube.outer_diameter": 2.4, "tube.inner_diameter": 2.2, "notch.depth": 2.13}


def wide_wrist() -> nf.Robot:
    """Wrist A cut from a wider tube."""
    return nf.load_robot("pacheco2021-a").with_values(WIDE | {"tendon.radius": 1.0})


def tip_first(along: str = "polynomial") -> dict[str, Any]:
    """The tip closes first, all between 1.4 and 1.6 N, at most 6 % of strain, least height."""
    return {
        "name": "tip first",
        "robot": "pacheco2021-a",
        "variable": [
            {"value": "notch.depth", "lower": 2.05, "upper": 2.2, "along": along},
            {"value": "notch.height", "lower": 0.4, "upper": 1.5},
            {"value": "tendon.radius", "lower": 0.7, "upper": 1.1},
        ],
        "load": {"closed": {"tension": 1.65}},
        "objective": [{"quantity": "notch.height", "goal": "minimise"}],
        "constraint": [
            {"quantity": "closing_tension", "order": "tip-first", "margin": 0.02},
            {"quantity": "closing_tension", "lower": 1.4, "upper": 1.6},
            {"quantity": "outer_strain", "load": "closed", "upper": 0.06},
            {"quantity": "total_angle", "load": "closed", "lower": 90.0},
        ],
        "search": {"starts": 3, "candidates": 32},
    }


def bend() -> dict[str, Any]:
    """Twenty points of an arc of 8 mm that turns by 63 degrees, followed by wrist A."""
    curvature = 1.1 / 8.0
    lengths = [8.0 * number / 20 for number in range(1, 21)]
    points = [
        [(1.0 - cos(curvature * s)) / curvature, 0.0, sin(curvature * s) / curvature]
        for s in lengths
    ]
    return {
        "name": "bend",
        "robot": "pacheco2021-a",
        "variable": [
            {"value": "notch.depth", "lower": 1.2, "upper": 1.45, "along": "each"},
            {"value": "notch.uncut_length", "lower": 0.3, "upper": 2.5},
            {"value": "notch.height", "lower": 0.3, "upper": 1.2},
            {"value": "load.bent.tension", "lower": 0.3, "upper": 2.5},
        ],
        "load": {"bent": {"tension": 1.2}},
        "curve": [{"name": "bend", "load": "bent", "points": points}],
        "search": {"starts": 2, "candidates": 16},
    }


def s_wrist() -> nf.Robot:
    """Four notches to one side and four to the other, a tendon for either."""
    table = to_table(nf.load_robot("pacheco2021-a"))
    near = table["notch"][0] | {"repeat": 4, "depth": 1.35}
    first = table["tendon"][0] | {"end_body": 4}
    second = first | {"direction_deg": 180.0, "end_body": 8}
    table |= {"notch": [near, near | {"direction_deg": 180.0}], "tendon": [first, second]}
    return from_table(table)


def s_curve() -> dict[str, Any]:
    """An S of 14 mm, twenty points, by two tendons."""
    spec = bend()
    spec["name"] = "S"
    spec["variable"] = [
        {"value": "notch.depth", "lower": 1.2, "upper": 1.45, "along": "each"},
        {"value": "notch.uncut_length", "lower": 0.3, "upper": 2.5},
        {"value": "load.bent.tension[1]", "lower": 0.0, "upper": 2.5},
        {"value": "load.bent.tension[2]", "lower": 0.0, "upper": 2.5},
    ]
    spec["load"] = {"bent": {"tension": [1.0, 0.6]}}
    curvature = [[0.0, 0.12], [6.0, 0.12], [7.5, -0.12], [14.0, -0.12]]
    spec["curve"] = [{"name": "S", "load": "bent", "curvature": curvature}]
    return spec
