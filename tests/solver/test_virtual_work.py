"""Tendon shortening is the gradient of work: finite differences of solved equilibria.

Without friction a notched tube is an elastic structure. The work of its tendons goes into its
energy whatever the way (dU = sum T ds), and the shortening of one tendon under the pull of another
is mutual (Maxwell and Betti). Both fail if any moment arm is not the derivative of a length.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from oracles import frames
from oracles.wrist import A
from robots import of_frames

STEP = 1e-4  # N; central differences are then right to about 1e-8 of a second derivative
TENSION = np.array([0.5, 0.3, 0.4])
PATHS = ("wall-arc", "straight")


def robot(path: str) -> nf.Robot:
    wrist = A.with_(
        height=(0.8, 0.6, 1.0, 0.7),
        uncut=(1.2, 0.9, 0.5, 2.0),
        depth=(1.40, 1.30, 1.36, 1.42),
        mu=0.0,
    )
    tendons = frames.Tendons(np.array([0.7, 0.6, 0.7]), np.radians([10.0, 130.0, 250.0]))
    made = of_frames(frames.Robot(wrist, np.radians([0.0, 75.0, 190.0, 300.0]), tendons))
    return made.with_value("tendon.path", path)


def solve(made: nf.Robot, tension: np.ndarray) -> nf.Equilibrium:
    state = nf.solve(made, nf.Load(tension=tuple(tension)))
    assert state.converged, state.reason
    return state


@pytest.mark.nightly
@pytest.mark.parametrize("path", PATHS)
def test_shortening_is_mutual(path, margin):
    made = robot(path)
    compliance = np.empty((3, 3))
    for i in range(3):
        change = STEP * np.eye(3)[i]
        more, less = (solve(made, TENSION + sign * change).stroke for sign in (1, -1))
        compliance[:, i] = (more - less) / (2 * STEP)
    margin.note(f"{path}: largest compliance {compliance.max():.3f} mm/N")
    margin.within(f"{path}: asymmetry", compliance - compliance.T, 1e-7, "mm/N")
    assert (np.linalg.eigvalsh(compliance) > 0).all()
    assert np.abs(compliance - np.diag(np.diag(compliance))).max() > 0.05


@pytest.mark.parametrize("path", PATHS)
def test_work_goes_into_energy(path, margin):
    made = robot(path)
    change = STEP * np.array([1.0, -0.5, 0.7])
    more, less = (solve(made, TENSION + sign * change) for sign in (1, -1))
    energy = (more.stored_energy - less.stored_energy) / (2 * STEP)
    work = TENSION @ (more.stroke - less.stroke) / (2 * STEP)
    margin.within(f"{path}: dU - sum T ds", energy - work, 2e-10, "N mm/N")
    assert abs(work) > 0.05
