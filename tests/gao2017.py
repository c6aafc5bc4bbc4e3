"""Runs of the ready robot of Gao 2017 that several tests look at, and the tables beside them.

In the tables +y opposes the tendon; our x points toward it. Runs with the same number of modes
share one compiled program, and each is solved once per test process.
"""

from __future__ import annotations

from functools import cache

import numpy as np

import notchflex as nf
from reference_data import choose, reference

PULLED = 14  # steps of 1 N from 0 to 13 N; as many let go again
CONTACTS = 27
WEIGHT = 9.81e-3  # N per gram
EDGE = 2.995  # mm: where weights hang on the tube's outer surface, on the side of the tendon
MIDDLE_OF_PIECE = 0.975  # mm: half the height 2 (r_c + l_s) of a piece between slots of one side
TIP_TOWARD, TIP_AWAY, BODY_TOWARD, BODY_AWAY, TIP_ONLY = 11, 1, 12, 2, 0  # cases of the table


@cache
def robot() -> nf.Robot:
    """The ready robot."""
    return nf.load_robot("gao2017")


@cache
def pulled_and_let_go(refinement: int = 0) -> nf.EquilibriumPath:
    """0 to 13 N by 1 N and back."""
    return nf.simulate(robot(), nf.pull(0.0, 13.0, PULLED).release(), refinement=refinement)


@cache
def squeezed() -> nf.EquilibriumPath:
    """0 to 25 N by 1 N: slots close."""
    return nf.simulate(robot(), nf.pull(0.0, 25.0, 26))


@cache
def under_weight(case: int, refinement: int = 0) -> nf.EquilibriumPath:
    """A case of the table of external loads: the weight first, then the tendon by 1 N."""
    loads = [weight_load(*row[:3]) for row in external_rows(case)]
    return nf.simulate(robot(), loads, refinement=refinement)


def weight_load(case: float, grams: float, tension: float) -> nf.Load:
    """A weight (g) across the tube at the tip plane or on the seventh piece, and the tendon."""
    toward = 1.0 if case in (TIP_TOWARD, BODY_TOWARD, TIP_ONLY) else -1.0
    force = (toward * WEIGHT * grams, 0.0, 0.0)
    if case in (BODY_TOWARD, BODY_AWAY):
        # Gao's RL_i is the wall piece on the tendon's side that is body 2 i here.
        held = nf.BodyForce(14, force, point=(EDGE, 0.0, MIDDLE_OF_PIECE))
        return nf.Load(tension=tension, body_forces=[held])
    return nf.Load(tension=tension, tip_force=force, tip_point=(EDGE, 0.0, 0.0))


def external_rows(case: int) -> np.ndarray:
    """Rows of a case of the table of external loads."""
    return choose(reference("gao_external_loads.csv"), case=(0, case))


def tip(path: nf.EquilibriumPath) -> np.ndarray:
    """Tip in the coordinates of the tables: y away from the tendon, z along the tube, mm."""
    return path.tip_position[:, [0, 2]] * [-1.0, 1.0]
