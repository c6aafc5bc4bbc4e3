"""The robot of Gao 2017 against every link integrated by shooting with a Runge-Kutta method."""

from __future__ import annotations

import numpy as np
from differences import Differences
from matplotlib.axes import Axes
from pictures import TENSION, beside, label_all, picture

import gao2017
import notchflex as nf
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from reference_data import reference

CASES = (
    gao2017.TIP_ONLY,
    gao2017.TIP_AWAY,
    gao2017.TIP_TOWARD,
    gao2017.BODY_AWAY,
    gao2017.BODY_TOWARD,
)


def tables() -> dict[str, str]:
    """Compare the loop, its tensions and front; the friction, and weights on the robot."""
    compared, finer = loop(0), loop(1)
    for mu, pull, y, z, _, _ in reference("gao_mu_sweep.csv"):
        robot = gao2017.robot().with_value("friction.coefficient", mu)
        bent = nf.simulate(robot, nf.pull(0.0, pull, gao2017.PULLED)).raise_if_failed()
        name = "tip at 13 N, nine coefficients of friction"
        compared.add(name, gao2017.tip(bent)[-1], [y, z], "mm")
    for case in CASES:
        rows = gao2017.external_rows(case)
        tip = gao2017.tip(gao2017.under_weight(case))
        compared.add("tip under weights, five cases", tip, rows[:, 3:5], "mm")
    return {"gao2017": compared.table(), "gao2017_finer": finer.table()}


def loop(refinement: int) -> Differences:
    """Compare loading to 13 N and unloading."""
    path, rows = gao2017.pulled_and_let_go(refinement), reference("gao_free_bending.csv")
    profile, half = reference("gao_tension_profiles.csv"), gao2017.PULLED
    compared = Differences()
    compared.add("tip, loading to 13 N and unloading", gao2017.tip(path), rows[:, 2:4], "mm")
    compared.add("rotation of the tip", path.total_angle, rows[:, 4], "rad")
    compared.add("tension of every span", path.span_tension[:, 0], profile[:, 2:], "N")
    m = path.front[0][half:, 0]
    compared.add("contact at the friction front", m, rows[half:, 7], "contacts")
    return compared


@picture("gao2017.svg", 9.0, 3.4, 2)
def pictures(left: Axes, right: Axes) -> None:
    """Draw the loop and the tension along the tendon."""
    path, rows = gao2017.pulled_and_let_go(), reference("gao_free_bending.csv")
    profile = reference("gao_tension_profiles.csv")
    half = gao2017.PULLED
    for steps, colour, way in (
        (slice(0, half), BLUE, "pulling"),
        (slice(half, None), VERMILLION, "unloading"),
    ):
        left.plot(path.tension[steps, 0], np.degrees(path.total_angle[steps]), color=colour)
        beside(left, (rows[steps, 1], np.degrees(rows[steps, 4])), colour, way)
    chosen = (half - 1, half + 2, half + 4, half + 6, half + 8, half + 10)
    for step, colour in zip(chosen, sequence_colours(len(chosen)), strict=True):
        way = "loading" if step < half else "unloading"
        right.plot(path.span_tension[step, 0], color=colour)
        spans = np.arange(profile.shape[1] - 2)
        label = f"{path.tension[step, 0]:.0f} N, {way}"
        beside(right, (spans, profile[step, 2:]), colour, label, ms=3.0)
    label_all((left,), TENSION, "rotation of the tip [deg]")
    label_all((right,), "span of the tendon, 0 at the base", "tension [N]")
    left.legend()
    right.legend(fontsize=7.0)
