"""Rods integrated by themselves, and robots of disks to compare them with.

A Cosserat rod with stretch and shear is integrated from its base; the backbone of a continuous
tendon carries at every section what the tendon pulls back with (Rucker and Webster 2011). Written
for the tests, after the equations, without the package's mechanics.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

YOUNG, RATIO = 54_000.0, 0.3
Z = np.array([0.0, 0.0, 1.0])


def stiffness(diameter: float, inner: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Of bending and twist, and of shear and stretch."""
    outer, shear = diameter / 2, YOUNG / (2 * (1 + RATIO))
    area, second = np.pi * (outer**2 - inner**2 / 4), np.pi / 4 * (outer**4 - inner**4 / 16)
    return second * np.array([YOUNG, YOUNG, 2 * shear]), area * np.array([shear, shear, YOUNG])


def integrated(
    base: np.ndarray, diameter: float, length: float, curvature: float = 0.0
) -> tuple[np.ndarray, Rotation, np.ndarray]:
    """Tip of a Cosserat rod from the force and moment at its base, both in the world's axes."""
    bending, stretching = stiffness(diameter)

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        turn, moment = state[3:12].reshape(3, 3), state[12:]
        along = turn @ (Z + turn.T @ base[:3] / stretching)
        bend = turn.T @ moment / bending + [0.0, curvature, 0.0]
        x, y, z = bend
        rate = turn @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.concatenate([along, rate.ravel(), -np.cross(along, base[:3])])

    start = np.concatenate([np.zeros(3), np.eye(3).ravel(), base[3:]])
    end = solve_ivp(slope, (0.0, length), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return end[:3], Rotation.from_matrix(end[3:12].reshape(3, 3)), end[12:]


def shot(
    force: np.ndarray,
    moment: np.ndarray,
    diameter: float,
    length: float,
    following: bool = False,
    curvature: float = 0.0,
) -> np.ndarray:
    """Tip of a clamped Cosserat rod under a force and a moment on it, by shooting."""

    def beyond(base: np.ndarray) -> np.ndarray:
        _, turn, last = integrated(base, diameter, length, curvature)
        wanted = (turn.apply(force), turn.apply(moment)) if following else (force, moment)
        return np.concatenate([base[:3] - wanted[0], (last - wanted[1]) / length])

    base = np.zeros(6)
    for part in np.linspace(0.125, 1.0, 8):  # from the free rod on

        def at_part(base: np.ndarray, part: float = part) -> np.ndarray:
            _, turn, last = integrated(base, diameter, length, curvature)
            ends = (turn.apply(force), turn.apply(moment)) if following else (force, moment)
            return np.concatenate([base[:3] - part * ends[0], (last - part * ends[1]) / length])

        base = least_squares(at_part, base, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    assert np.abs(beyond(base)).max() < 1e-11
    return integrated(base, diameter, length, curvature)[0]


def continuous(path: Any, tension: float, length: float) -> np.ndarray:
    """Tip of a backbone with a frictionless tendon that is led everywhere (Rucker, Webster 2011).

    The backbone carries at every section what the tendon there pulls back with; `path` gives the
    tendon's place in a section and its slope, at a length of arc.
    """
    bending, stretching = stiffness(1.4)

    def strains(at: float) -> tuple[np.ndarray, np.ndarray]:
        place, rise = path(at)
        bend, along = np.zeros(3), Z.copy()
        for _ in range(100):
            way = along + np.cross(bend, place) + rise
            pull = tension * way / np.linalg.norm(way)
            new = -np.cross(place, pull) / bending, Z - pull / stretching
            if max(np.abs(new[0] - bend).max(), np.abs(new[1] - along).max()) < 1e-15:
                return new
            bend, along = new
        raise AssertionError("strains do not settle")

    def slope(at: float, state: np.ndarray) -> np.ndarray:
        turn = state[3:].reshape(3, 3)
        (x, y, z), along = strains(at)
        rate = turn @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.concatenate([turn @ along, rate.ravel()])

    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    return solve_ivp(slope, (0.0, length), start, "DOP853", rtol=1e-12, atol=1e-12).y[:3, -1]
