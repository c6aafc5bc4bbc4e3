"""Wrists A, B, C of Pacheco 2021 against its equations, solved in closed form."""

from __future__ import annotations

import numpy as np
from differences import Differences
from matplotlib.axes import Axes
from pictures import TENSION, TOTAL, beside, label_all, picture

import notchflex as nf
from loads import tensions
from notchflex.plotting.style import sequence_colours
from reference_data import CUTS, choose, reference
from robots import linear_copy, ready

MODELS = ("full", "linear, with friction", "linear, frictionless", "kinematic (equal strokes)")


def curves() -> dict[tuple[str, int], tuple[nf.EquilibriumPath, np.ndarray]]:
    """Pull every wrist, cut in either way, to 3 N, and read the rows of the table beside it."""
    table = reference("pacheco_force_curves.csv")
    found = {}
    for number, cut in enumerate(CUTS):
        for wrist, name in enumerate("ABC"):
            robot = ready(name).with_value("notch[*].cut", cut)
            path = nf.simulate(robot, nf.pull(0.0, 3.0, steps=61)).raise_if_failed()
            found[name, number] = path, choose(table, cut=(0, number), wrist=(1, wrist))
    return found


def tables() -> dict[str, str]:
    """Compare the curves, the closing of every notch, and the simpler models."""
    compared = Differences()
    for path, wanted in curves().values():
        n = path.robot.number_of_notches
        angles = np.radians(wanted[:, 3 : 3 + n])
        compared.add("angle of every notch, 0 to 3 N", path.notch_angle, angles, "rad")
        compared.add("tip", path.tip_position[:, [0, 2]], wanted[:, 9:11], "mm")
        compared.add("stroke", path.stroke[:, 0], wanted[:, 11], "mm")
        compared.add("tension at the tip", path.span_tension[:, 0, -1], wanted[:, 12], "N")
    table = reference("pacheco_closing.csv")
    for number, cut in enumerate(CUTS):
        for wrist, name in enumerate("ABC"):
            closing = nf.closing(ready(name).with_value("notch[*].cut", cut))
            wanted = choose(table, cut=(0, number), wrist=(1, wrist))
            compared.add("closing angle of every notch", closing.angle, np.radians(wanted[:, 7]))
            compared.add("closing tension", closing.tension, wanted[:, 8])
    for wrist, name in enumerate("ABC"):
        simpler(compared, name, choose(reference("pacheco_simplified.csv"), wrist=(0, wrist)))
    return {"pacheco2021": compared.table()}


def simpler(compared: Differences, name: str, table: np.ndarray) -> None:
    """Compare the notch angles of the paper's four models of one wrist."""
    full = ready(name)
    linear = linear_copy(full)
    robots = full, linear, linear.replace(friction=nf.Frictionless()), None
    stroke = np.zeros(0)
    for model, (text, robot) in enumerate(zip(MODELS, robots, strict=True)):
        rows = choose(table, model=(2, model))
        if robot is None:
            angle = nf.equal_stroke(full, stroke).notch_angle
        else:
            path = nf.simulate(robot, tensions(rows[:, 1])).raise_if_failed()
            stroke = stroke if model else path.stroke[:, 0]
            angle = path.notch_angle
        wanted = np.radians(rows[:, 3 : 3 + full.number_of_notches])
        compared.add(f"model: {text}", angle, wanted, "rad")


@picture("pacheco2021.svg", 8.0, 3.4, 2, sharey=True)
def pictures(*places: Axes) -> None:
    """Draw the total angles of the curves."""
    every = curves()
    for number, (axes, cut) in enumerate(zip(places, CUTS, strict=True)):
        for name, colour in zip("ABC", sequence_colours(3), strict=True):
            path, wanted = every[name, number]
            axes.plot(path.tension[:, 0], np.degrees(path.total_angle), color=colour)
            beside(axes, (wanted[::3, 2], wanted[::3, 8]), colour, f"wrist {name}")
        axes.set_title(f'cut = "{cut}"', loc="left")
    label_all(places, TENSION, TOTAL)
    places[0].legend(loc="lower right")
