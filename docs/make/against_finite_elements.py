"""The fall of tension along wrist A against a solid of three-dimensional finite elements."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from page import percent, table
from pictures import label_all, picture

import notchflex as nf
from notchflex.mechanics.friction import friction_law
from notchflex.plotting.style import BLUE, VERMILLION
from reference_data import named_rows

COEFFICIENT = 0.13
LEVELS = (25.0, 51.0, 113.0)  # deg in total
WRAPS = {"geometric": BLUE, "whole-before": VERMILLION}


def levels(total_deg: float) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Return pull (N), angles of the rings (rad) and gap tensions (N) within 2 deg of a total."""
    cases: dict[tuple[str, float], list[tuple[float, float]]] = {}
    for row in named_rows("fem_friction_wrist.csv"):
        cases.setdefault((row["case"], row["F_N"]), []).append((row["theta_fem_deg"], row["T_fem"]))
    columns = [(force, *np.transpose(rows)) for (_, force), rows in cases.items()]
    return [
        (force, np.radians(degrees), tension)
        for force, degrees, tension in columns
        if abs(degrees.sum() - total_deg) < 2.0
    ]


def falls(wrap: str, angle: np.ndarray) -> np.ndarray:
    """Return gap tension over pull: each notch turns the tendon by half its angle at each edge."""
    law = friction_law(nf.Capstan(COEFFICIENT, wrap=wrap))
    leaving, entering = np.moveaxis(law.bounds(np.stack([angle / 2, angle / 2], -1)), -1, 0)
    return np.exp(-(np.cumsum(leaving + entering) - entering))


def worst(wrap: str, total_deg: float) -> float:
    """Return the largest error of a gap tension, relative, over all levels near a total."""
    return max(
        float(np.abs(force * falls(wrap, angle) / tension - 1.0).max())
        for force, angle, tension in levels(total_deg)
    )


def tables() -> dict[str, str]:
    """Return what stands on the page."""
    rows = [
        (f"{total:.0f}", *(percent(worst(wrap, total), 2) for wrap in WRAPS)) for total in LEVELS
    ]
    head = ("bent in total, deg", *(f'`wrap = "{wrap}"`' for wrap in WRAPS))
    return {"finite_elements": table(head, rows)}


@picture("finite_elements.svg", 4.6, 3.2)
def pictures(axes: Axes) -> None:
    """Draw the tension in every gap where the wrist is bent most."""
    gaps = np.arange(1, 6)
    force, angle, tension = levels(LEVELS[-1])[0]
    for wrap, colour in WRAPS.items():
        axes.plot(gaps, falls(wrap, angle), color=colour, label=wrap)
    axes.plot(gaps, tension / force, "ko", ms=4, mfc="none", label="finite elements")
    axes.set_xticks(gaps)
    total = f"gap, from the base; {np.degrees(angle.sum()):.0f} deg in total"
    label_all((axes,), total, "tension over the pull")
    axes.legend()
