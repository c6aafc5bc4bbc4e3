"""The fall of tension along wrist A against a solid of three-dimensional finite elements."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from page import table

import notchflex as nf
from notchflex.mechanics.friction import friction_law
from notchflex.plotting.style import BLUE, VERMILLION, house_style, new_figure, save
from reference_data import FOLDER

COEFFICIENT = 0.13
LEVELS = (25.0, 51.0, 113.0)  # deg in total
WRAPS = ("geometric", "whole-before")
Level = tuple[str, float, np.ndarray, np.ndarray]


def levels(total_deg: float) -> list[Level]:
    """Return case, pull (N), angles of the rings (rad) and gap tensions (N) within 2 deg."""
    found: dict[tuple[str, float], list[dict[str, str]]] = {}
    with (FOLDER / "fem_friction_wrist.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found.setdefault((row["case"], float(row["F_N"])), []).append(row)
    every = [
        (
            case,
            force,
            np.radians([float(row["theta_fem_deg"]) for row in rows]),
            np.array([float(row["T_fem"]) for row in rows]),
        )
        for (case, force), rows in found.items()
    ]
    return [one for one in every if abs(np.degrees(one[2].sum()) - total_deg) < 2.0]


def falls(wrap: str, angle: np.ndarray) -> np.ndarray:
    """Return gap tension over pull: each notch turns the tendon by half its angle at each edge."""
    law = friction_law(nf.Capstan(COEFFICIENT, wrap=wrap))
    leaving, entering = np.moveaxis(law.bounds(np.stack([angle / 2, angle / 2], -1)), -1, 0)
    return np.exp(-(np.cumsum(leaving + entering) - entering))


def worst(wrap: str, total_deg: float) -> float:
    """Return the largest error of a gap tension, relative, over all levels near a total."""
    return max(
        float(np.abs(force * falls(wrap, angle) / tension - 1.0).max())
        for _, force, angle, tension in levels(total_deg)
    )


def tables() -> dict[str, str]:
    """Return what stands on the page."""
    rows = [
        (f"{total:.0f}", *(f"{100.0 * worst(wrap, total):.2f} %" for wrap in WRAPS))
        for total in LEVELS
    ]
    head = ("bent in total, deg", *(f'`wrap = "{wrap}"`' for wrap in WRAPS))
    return {"finite_elements": table(head, rows)}


def pictures(folder: Path) -> None:
    """Draw the tension in every gap where the wrist is bent most."""
    with house_style():
        figure = new_figure(4.6, 3.2)
        axes = figure.subplots()
        gaps = np.arange(1, 6)
        _, force, angle, tension = levels(LEVELS[-1])[0]
        for wrap, colour in zip(WRAPS, (BLUE, VERMILLION), strict=True):
            axes.plot(gaps, falls(wrap, angle), color=colour, label=wrap)
        axes.plot(gaps, tension / force, "ko", ms=4, mfc="none", label="finite elements")
        axes.set_xticks(gaps)
        axes.set_xlabel(f"gap, from the base; {np.degrees(angle.sum()):.0f} deg in total")
        axes.set_ylabel("tension over the pull")
        axes.legend()
    save(figure, folder / "finite_elements.svg")
