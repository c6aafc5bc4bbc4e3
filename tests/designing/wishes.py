"""Design specifications that tests and benchmarks share."""

from __future__ import annotations

from typing import Any

import notchflex as nf

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
        "state": [{"name": "closed", "tension": 1.65}],
        "objective": [{"quantity": "notch.height", "goal": "minimise"}],
        "constraint": [
            {"quantity": "closing_tension", "order": "tip-first", "margin": 0.02},
            {"quantity": "closing_tension", "lower": 1.4, "upper": 1.6},
            {"quantity": "outer_strain", "state": "closed", "upper": 0.06},
            {"quantity": "total_angle", "state": "closed", "lower": 90.0},
        ],
        "search": {"starts": 3, "candidates": 32},
    }
