"""Robots of strips (Liu 2022) by shooting: cables on both sides, friction that slides, closed lips.

Notch by notch from the base, each as the boundary-value problem of the elastica under the cable
forces on its distal body (Liu 2022, eq. 1-9), integrated as an initial-value problem. Points are
(x, z): x toward the first cable, z along the proximal body's axis from its face on that side; the
angle counts from z toward x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root


@dataclass(frozen=True)
class Strip:
    """Liu's robot (Table 2): lengths mm, stiffness N mm²."""

    length: float = 8.0
    height: float = 3.5
    lip: float = 5.0  # outer radius of the tube
    stiffness: float = 1000.406 * 4.0 * 1.5**3 / 12.0
    mu: float = 0.0
    dead: bool = False  # cables pull along the proximal body's axis

    @property
    def leaves(self) -> np.ndarray:
        """Where the two cables leave the proximal body."""
        return np.array([[0.5 * self.length, 0.0], [-0.5 * self.length, self.height]])


@dataclass(frozen=True)
class Notch:
    """One solved notch: angle, tension of both cables in the gap and beyond, force of the lips."""

    angle: float
    gap_tension: np.ndarray
    beyond: np.ndarray
    lip_gap: float
    contact_force: float


def turned(point: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return point @ np.array([[c, -s], [s, c]])


def moment(arm: np.ndarray, force: np.ndarray) -> float:
    """About +y, which turns z toward x."""
    return arm[1] * force[0] - arm[0] * force[1]


def solve_notch(strip: Strip, tension: np.ndarray, slides: np.ndarray, closed: bool) -> Notch:
    """One notch under the tensions that arrive.

    Args:
        strip: The strip.
        tension: Tension of both cables where they reach this notch, N.
        slides: +1 for a cable that slides toward the base, -1 toward the tip.
        closed: Whether the lips response on the side of the first cable; else they carry no force.
    """

    def loads(
        end: np.ndarray, contact_force: float, part: float
    ) -> tuple[np.ndarray, float, Notch]:
        """Force and moment about the strip's free end, which lies at x, z and has turned."""
        origin = end[:2] - turned(np.array([0.5 * strip.length, 0.0]), end[2])
        enters = origin + turned(strip.leaves, end[2])
        span = strip.leaves - enters
        along = span / np.linalg.norm(span, axis=1)[:, None]
        exit_turn = np.arctan2(np.abs(along[:, 0]), -along[:, 1])
        entry_turn = np.arccos(np.clip(-along @ turned(np.array([0.0, 1.0]), end[2]), -1.0, 1.0))
        ratio = [
            np.exp(-2.0 * slides * np.arctanh(strip.mu * np.tan(0.5 * turn)))
            for turn in (exit_turn, entry_turn)
        ]
        pull = part * tension * ratio[0]
        direction = np.tile([0.0, -1.0], (2, 1)) if strip.dead else along
        edge = origin + turned(np.array([strip.lip, 0.0]), end[2])
        forces = np.array([*(pull[:, None] * direction), [0.0, contact_force]])
        couple = sum(
            moment(point - end[:2], force)
            for point, force in zip([*enters, edge], forces, strict=True)
        )
        found = Notch(float(end[2]), pull, pull * ratio[1], float(edge[1]), float(contact_force))
        return forces.sum(axis=0), couple, found

    def misses(unknown: np.ndarray, part: float) -> np.ndarray:
        end = unknown[:3]
        force, couple, found = loads(end, unknown[3], part)

        def slope(s: float, at: np.ndarray) -> list[float]:
            bending = couple + moment(end[:2] - at[:2], force)
            return [np.cos(at[2]), -np.sin(at[2]), bending / strip.stiffness]

        clamp = [-0.5 * strip.length, strip.height, 0.0]
        way = solve_ivp(slope, (0.0, strip.length), clamp, method="DOP853", rtol=1e-11, atol=1e-12)
        return np.array([*(way.y[:, -1] - end), found.lip_gap if closed else found.contact_force])

    guess = np.array([0.5 * strip.length, strip.height, 0.0, 0.0])
    for part in np.linspace(0.2, 1.0, 5):
        guess = root(misses, guess, args=(part,), tol=1e-12).x
    missed = float(np.max(np.abs(misses(guess, 1.0))))
    if missed > 1e-9:
        raise AssertionError(f"no equilibrium of a strip, misses by {missed:.1e}")
    return loads(guess[:3], guess[3], 1.0)[2]


def march(strip: Strip, tension: np.ndarray, slides: np.ndarray, notches: int = 7) -> list[Notch]:
    """All notches from the base, their lips open."""
    found = []
    for _ in range(notches):
        found.append(solve_notch(strip, np.asarray(tension, float), slides, closed=False))
        tension = found[-1].beyond
    return found
