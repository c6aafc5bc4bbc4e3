"""The robot of Liu 2022 against elliptic integrals with a fixed point for every notch."""

from __future__ import annotations

import numpy as np
from differences import Differences
from matplotlib.axes import Axes
from pictures import beside, label_all, picture

import notchflex as nf
from liu2022 import liu, pulled
from notchflex.plotting.style import sequence_colours
from reference_data import choose, reference

READINGS = ("pull along the gap", "small deflection", "dead pull", "follower")
COEFFICIENTS = (0.0, 0.1, 0.15, 0.2, 0.3)


def run(model: int, mu: float, turning: str = "chord") -> tuple[nf.EquilibriumPath, np.ndarray]:
    """Pull the robot in one reading of the paper, and read the rows of the table beside it.

    The rows begin with friction and pull, and, where friction turns with chords, with the reading.
    """
    if turning == "slope":
        rows = choose(reference("liu_robot_slope.csv"), mu=(0, mu))
        pull = rows[:, 1]
    else:
        rows = choose(reference("liu_robot.csv"), model=(0, model), mu=(1, mu))
        pull = rows[:, 2]
    return pulled(liu(model, mu, turning), pull).raise_if_failed(), rows


def tables() -> dict[str, str]:
    """Compare chord angles in every reading, slopes where bodies turn with them, tensions."""
    compared = Differences()
    for model, reading in enumerate(READINGS):
        for mu in COEFFICIENTS:
            path, wanted = run(model, mu)
            chords = np.radians(wanted[:, 3:10])
            compared.add(f"chord angles, {reading}", path.chord_angle, chords, "rad")
            spans = path.span_tension[:, 0, [1, 13]]
            compared.add("tension in the first and last gap", spans, wanted[:, 13:15])
    for mu in (0.0, 0.1, 0.2, 0.3):
        path, wanted = run(0, mu, "slope")
        slopes = np.radians(wanted[:, 2:9])
        compared.add("slopes, friction turning with them", path.notch_angle, slopes, "rad")
    return {"liu2022": compared.table()}


@picture("liu2022.svg", 8.0, 3.4, 2)
def pictures(left: Axes, right: Axes) -> None:
    """Draw the sum of the chord angles for every coefficient, and the tension that is left."""
    for mu, colour in zip(COEFFICIENTS, sequence_colours(len(COEFFICIENTS)), strict=True):
        path, rows = run(0, mu)
        pull, dots = path.tension[:, 0], rows[::2]
        left.plot(pull, np.degrees(path.total_chord_angle), color=colour)
        beside(left, (dots[:, 2], dots[:, 10]), colour, f"μ {mu:g}")
        right.plot(pull, path.span_tension[:, 0, 13] / pull, color=colour)
        beside(right, (dots[:, 2], dots[:, 14] / dots[:, 2]), colour)
    heads = "sum of chord angles [deg]", "tension in the last gap, of the pull"
    label_all((left, right), "pull of the cable [N]", *heads)
    left.legend()
