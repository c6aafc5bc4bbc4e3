"""Wrists as solids of finite elements, and the same wrists for the package.

Numbers: tests/reference/fem_wrist_*.csv, wrists A and B with off-axis cuts and a straight tendon on
the inner wall. Levels with less than 0.05 mm of gap are left out, as the solid has no contact.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import notchflex as nf
from notchflex.mechanics.chain import sites_of
from notchflex.mechanics.flexure.arc import place_of
from notchflex.mechanics.law_errors import Place
from reference_data import named_rows

LEAST_GAP = 0.05  # mm
HEIGHT, UNCUT = {"A": 0.8, "B": 0.5}, {"A": 1.2, "B": 1.5}
BASE = 1.2  # mm
NOTCHES = 5
LINEAR = nf.Linear(60_000.0)
BILINEAR = nf.Nitinol(elastic_modulus=10_000.0, plateau_stress=280.0, plateau_modulus=3_000.0)


class Solid(NamedTuple):
    """What the solid of one case does at each level of tension.

    Attributes:
        robot: The wrist of the case, with elastic ends.
        loads: Its loads; x points to the bend.
        angles: Angles between the rings of every notch, deg, shape (levels, notches).
        faces: Angles between the faces of every notch, deg.
        tip: Places of the tip, mm, shape (levels, 3).
    """

    robot: nf.Robot
    loads: list[nf.Load]
    angles: np.ndarray
    faces: np.ndarray
    tip: np.ndarray

    def tip_errors(self, path: nf.EquilibriumPath) -> np.ndarray:
        """Return the distance from the tip of a path to that of the solid, as part of its way."""
        notch = self.robot.notch[0]
        straight = BASE + NOTCHES * (notch.height + notch.uncut_length)
        moved = np.linalg.norm(self.tip - [0.0, 0.0, straight], axis=1)
        return np.linalg.norm(path.tip_position - self.tip, axis=1) / moved


def wrist(wrist: str = "A", friction: float = 0.0, **keys: Any) -> nf.Robot:
    """Build wrist A or B: linear elastic, with elastic ends; keys of the notch replace others."""
    notch = {
        "depth": 1.40,
        "height": HEIGHT[wrist],
        "uncut_length": UNCUT[wrist],
        "repeat": NOTCHES,
        "ends": "shell",
    }
    return nf.Robot(
        name=f"wrist {wrist}",
        tube=nf.Tube(1.62, 1.40, base_length=BASE),
        notch=(nf.ArcNotch("off-axis", **(notch | keys)),),
        tendon=(nf.Tendon(0.70, path="straight"),),
        material=LINEAR,
        friction=nf.Capstan(friction) if friction else nf.Frictionless(),
    )


def drawn(row: dict[str, Any]) -> nf.Robot:
    """Build a wrist of fem_wrists_drawn.csv, with elastic ends."""
    young, *plateau = map(float, str(row["material"]).split())
    notch = nf.ArcNotch(
        row["cut"],
        depth=row["depth"],
        height=row["height"],
        uncut_length=row["uncut"],
        repeat=int(row["notches"]) - 1,
        ends="shell",
    )
    return nf.Robot(
        name="wrist",
        tube=nf.Tube(row["outer"], row["inner"], base_length=row["base"]),
        notch=(notch, replace(notch, uncut_length=row["last"], repeat=1)),
        tendon=(nf.Tendon(row["inner"] / 2, path="straight"),),
        material=nf.Nitinol(
            elastic_modulus=young, plateau_stress=plateau[0], plateau_modulus=plateau[1]
        )
        if plateau
        else nf.Linear(young),
        friction=nf.Frictionless(),
    )


def drawn_wrists() -> list[list[dict[str, Any]]]:
    """Read the wrists of fem_wrists_drawn.csv: the rows of each, one for a level of tension."""
    rows = named_rows("fem_wrists_drawn.csv")
    return [list(same) for _, same in itertools.groupby(rows, lambda row: list(row.values())[:11])]


def stiffness_errors(rows: list[dict[str, Any]]) -> np.ndarray:
    """Return the factor on the stiffness that gives the angles of a drawn wrist, less 1.

    Shape (levels, notches), or one column where the total is given; NaN where the law has snapped.
    """
    robot = drawn(rows[0])
    loads = [nf.Load(tension=tension) for tension in (0.0, *(row["tension_N"] for row in rows))]
    wanted = np.array([str(row["angles_deg"]).split() for row in rows], float)

    def logarithms(factor: float) -> np.ndarray:
        path = nf.simulate(robot.with_value("notch.stiffness_factor", factor), loads)
        bent = np.degrees(path.notch_angle)[1:]
        bent = bent if wanted.shape[1] > 1 else bent.sum(axis=1, keepdims=True)
        return np.where(path.converged[1:, None], np.log(bent), np.nan)

    softer, stiffer = logarithms(0.98), logarithms(1.02)
    return 0.04 * (logarithms(1.0) - np.log(wanted)) / (softer - stiffer)


def errors_by_place(rows: list[dict[str, Any]]) -> list[tuple[Place, float, float]]:
    """Return places of the first, the middle and the last notch; rms and largest of residuals."""
    found, robot = stiffness_errors(rows), drawn(rows[0])
    parts = {1: found}
    if found.shape[1] > 1:
        parts = dict(zip((0, 1, -1), np.split(found, [1, -1], axis=1), strict=True))
    sites = sites_of(robot)
    return [
        (
            place_of(robot.notches[i], robot.tube, sites[i], robot.material.by_fibres),
            float(np.sqrt(np.nanmean(part**2))),
            float(np.nanmax(np.abs(part))),
        )
        for i, part in parts.items()
    ]


def rigid(robot: nf.Robot) -> nf.Robot:
    """Return the wrist with the ends of the papers."""
    return robot.with_value("notch.ends", "rigid")


def solid(case: str) -> Solid:
    """Read a case: "A_lin_mu0_medium" is wrist A, linear, without friction, medium mesh."""
    tips = [
        row
        for row in named_rows("fem_wrist_tips.csv")
        if row["case"] == case and row["min_gap_mm"] > LEAST_GAP
    ]
    rows = [row for row in named_rows("fem_wrist_angles.csv") if row["case"] == case]
    levels = [[row for row in rows if row["F_N"] == tip["F_N"]] for tip in tips]
    material = BILINEAR if "_se_" in case else LINEAR
    robot = replace(wrist(case[0], tips[0]["mu"]), material=material)
    # Their y points to the bend, as x does here.
    return Solid(
        robot,
        [nf.Load(tension=tip["F_N"], tip_force=(tip["tipload_y"], 0.0, 0.0)) for tip in tips],
        np.array([[row["theta_fem_deg"] for row in level] for level in levels]),
        np.array([[row["theta_edge_deg"] for row in level] for level in levels]),
        np.array([[tip["tip_y"], 0.0, tip["tip_z"]] for tip in tips]),
    )


def sideways(robot: nf.Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Push the tip of wrist A sideways by 0.02 N, without tension.

    Args:
        robot: The wrist.

    Returns:
        Twist and sideways bend of every ring, rad; the same of the solid.
    """
    state = nf.solve(robot, nf.Load(tension=0.0, tip_force=(0.0, 0.02, 0.0)))
    turns, rows = state.body_rotation[1:], named_rows("fem_wrist_sideways.csv")
    twist = 0.5 * (turns[:, 1, 0] - turns[:, 0, 1])
    bend = 0.5 * (turns[:, 1, 2] - turns[:, 2, 1])
    solid = np.array([(row["twist"], row["bend"]) for row in rows])
    return twist, bend, solid[:, 0], solid[:, 1]
