"""The robot of Liu 2022 against elliptic integrals with a fixed point for every notch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from differences import Difference, difference, joined, table_of

import notchflex as nf
from liu2022 import liu, pulled
from notchflex.plotting.style import house_style, new_figure, save, sequence_colours
from reference_data import choose, reference

READINGS = ("pull along the gap", "small deflection", "dead pull", "follower")
COEFFICIENTS = (0.0, 0.1, 0.15, 0.2, 0.3)


def run(model: int, mu: float, turning: str = "chord") -> tuple[nf.EquilibriumPath, np.ndarray]:
    """Pull the robot in one reading of the paper, and read the rows of the table beside it."""
    if turning == "slope":
        rows = choose(reference("liu_robot_slope.csv"), mu=(0, mu))
        return pulled(liu(model, mu, turning), rows[:, 1]).raise_if_failed(), rows
    rows = choose(reference("liu_robot.csv"), model=(0, model), mu=(1, mu))
    return pulled(liu(model, mu, turning), rows[:, 2]).raise_if_failed(), rows


def differences() -> list[Difference]:
    """Compare chord angles in every reading, slopes where bodies turn with them, tensions."""
    rows = []
    for model, reading in enumerate(READINGS):
        for mu in COEFFICIENTS:
            path, wanted = run(model, mu)
            chords = np.radians(wanted[:, 3:10])
            rows.append(difference(f"chord angles, {reading}", path.chord_angle, chords, "rad"))
            spans = path.span_tension[:, 0, [1, 13]]
            rows.append(
                difference("tension in the first and last gap", spans, wanted[:, 13:15], "")
            )
    for mu in (0.0, 0.1, 0.2, 0.3):
        path, wanted = run(0, mu, "slope")
        slopes = np.radians(wanted[:, 2:9])
        rows.append(
            difference("slopes, friction turning with them", path.notch_angle, slopes, "rad")
        )
    return joined(rows)


def tables() -> dict[str, str]:
    """Return what stands on the page."""
    return {"liu2022": table_of(differences())}


def pictures(folder: Path) -> None:
    """Draw the sum of the chord angles for every coefficient, and the tension that is left."""
    with house_style():
        figure = new_figure(8.0, 3.4)
        left, right = figure.subplots(1, 2)
        for mu, colour in zip(COEFFICIENTS, sequence_colours(len(COEFFICIENTS)), strict=True):
            path, rows = run(0, mu)
            pull = path.tension[:, 0]
            left.plot(pull, np.degrees(path.total_chord_angle), color=colour)
            left.plot(rows[::2, 2], rows[::2, 10], "o", ms=3.5, mfc="none", color=colour)
            right.plot(pull, path.span_tension[:, 0, 13] / pull, color=colour)
            right.plot(
                rows[::2, 2], rows[::2, 14] / rows[::2, 2], "o", ms=3.5, mfc="none", color=colour
            )
            left.plot([], [], "o-", ms=3.5, mfc="none", color=colour, label=f"μ {mu:g}")
        for axes in (left, right):
            axes.set_xlabel("pull of the cable [N]")
        left.set_ylabel("sum of chord angles [deg]")
        right.set_ylabel("tension in the last gap, of the pull")
        left.legend()
    save(figure, folder / "liu2022.svg")
