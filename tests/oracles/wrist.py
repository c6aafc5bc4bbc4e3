"""Pacheco's wrist as one scalar equation per notch, marched from the base to the tip.

Source: Pacheco et al. 2021, eq. 10-16, with the secant-modulus iteration of eq. 14 replaced by
its exact fixed point: kappa / (1 + ybar kappa) = theta / h makes M = I sigma(eps) / (ro - ybar)
with eps = theta (ro - ybar) / h.  Friction carries its memory by the play operator.

notation: h notch height, c uncut length, g depth, arm = ri + ybar, P tension arriving.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from . import section


@dataclass(frozen=True)
class Material:
    """Piecewise law, MPa; `superelastic_modulus` None is a linear material."""

    elastic_modulus: float = 10_000.0
    superelastic_modulus: float | None = 3_000.0
    transition_strain: float = 0.028
    plastic_strain: float = 0.10
    plastic_modulus: float = 1_000.0
    plastic_exponent: float = -0.01

    def stress(self, strain: float) -> float:
        """Stress [MPa] (Pacheco 2021, eq. 13), odd in the strain."""
        if self.superelastic_modulus is None:
            return self.elastic_modulus * strain
        e, low = abs(strain), self.transition_strain
        if e <= low:
            s = self.elastic_modulus * e
        else:
            s = self.elastic_modulus * low
            s += (min(e, self.plastic_strain) - low) * self.superelastic_modulus
            if e > self.plastic_strain:
                s += self.plastic_modulus * np.exp(
                    self.plastic_exponent / (e - self.plastic_strain)
                )
        return float(np.copysign(s, strain))


@dataclass(frozen=True)
class Wrist:
    """Geometry [mm], precurvature [rad], material and friction of a one-tendon wrist."""

    height: tuple[float, ...]
    uncut: tuple[float, ...]
    depth: tuple[float, ...]
    precurvature: tuple[float, ...] = ()
    material: Material = field(default_factory=Material)
    mu: float = 0.13
    wrap: str = "whole-before"
    cut: str = "on-axis"
    outer_diameter: float = 1.62
    inner_diameter: float = 1.40

    @property
    def n(self) -> int:
        return len(self.height)

    @cached_property
    def start(self) -> np.ndarray:
        """Angle of every free notch [rad]."""
        return np.array(self.precurvature or (0.0,) * self.n)

    @cached_property
    def sections(self) -> list[section.PlaneSection]:
        shape = section.sector if self.cut == "on-axis" else section.segment
        return [shape(self.outer_diameter, self.inner_diameter, g) for g in self.depth]

    @cached_property
    def centroid(self) -> np.ndarray:
        return np.array([s.centroid for s in self.sections])

    @cached_property
    def arm(self) -> np.ndarray:
        """Moment arm of the tendon on the inner wall [mm] (eq. 5)."""
        return self.inner_diameter / 2 + self.centroid

    @cached_property
    def closing_angle(self) -> np.ndarray:
        """Angle at which the lips of a notch response [rad]."""
        return np.array(self.height) / (self.outer_diameter / 2 + self.centroid)

    def with_(self, **changes: object) -> Wrist:
        return replace(self, **changes)  # type: ignore[arg-type]

    def elastic_moment(self, j: int, angle: float) -> float:
        """Moment [N mm] that notch `j` (from 0) carries at a total `angle` [rad]."""
        s = self.sections[j]
        fibre = self.outer_diameter / 2 - s.centroid
        strain = (angle - self.start[j]) * fibre / self.height[j]
        return s.second_moment * self.material.stress(strain) / fibre

    def pull(self, tension: float) -> tuple[np.ndarray, np.ndarray]:
        """Angles [rad] and gap tensions [N] under one pull from rest."""
        state = self.march([tension])[-1]
        return state.angle, state.gap_tension

    def march(self, tensions: Sequence[float]) -> list[State]:
        """States along any history of base tensions [N], starting unloaded."""
        zero = np.zeros(self.n)
        previous = State(0.0, self.start, zero, zero)
        states = []
        for tension in tensions:
            previous = self._step(float(tension), previous)
            states.append(previous)
        return states

    def _step(self, tension: float, previous: State) -> State:
        share = 1.0 if self.wrap == "whole-before" else 0.5
        angle, gap, body = (np.zeros(self.n) for _ in range(3))
        arriving = tension
        for j in range(self.n):
            arm, limit, held = self.arm[j], self.closing_angle[j], previous.gap_tension[j]

            def gap_tension(theta: float, held: float = held, arriving: float = arriving) -> float:
                bound = np.exp(self.mu * share * abs(theta))
                return float(np.clip(held, arriving / bound, arriving * bound))

            def unbalance(theta: float, j: int = j, arm: float = arm, tension_of=gap_tension):
                return self.elastic_moment(j, theta) - arm * tension_of(theta)

            low = self.start[j]
            if unbalance(low) >= 0.0:
                angle[j] = low
            elif unbalance(limit) <= 0.0:
                angle[j] = limit
            else:
                angle[j] = brentq(unbalance, low, limit, xtol=1e-16, rtol=8.9e-16, maxiter=500)
            gap[j] = gap_tension(angle[j])
            bound = np.exp(self.mu * (1.0 - share) * abs(angle[j]))
            body[j] = np.clip(previous.body_tension[j], gap[j] / bound, gap[j] * bound)
            arriving = body[j]
        return State(tension, angle, gap, body)

    def stroke(self, angle: np.ndarray) -> np.ndarray:
        """Tendon drawn out at the base since the free shape [mm] (eq. 3)."""
        return ((np.asarray(angle) - self.start) * self.arm).sum(axis=-1)

    def tip(self, angle: np.ndarray) -> np.ndarray:
        """Tip (x, z) [mm] of the planar chain (eq. 1-2), after the last uncut section."""
        x = z = heading = 0.0
        for theta, h, c, ybar in zip(angle, self.height, self.uncut, self.centroid, strict=True):
            s = h - ybar * theta  # arc at the tube axis
            half = theta / 2
            chord = s * np.sinc(half / np.pi)
            x += chord * np.sin(heading + half)
            z += chord * np.cos(heading + half)
            heading += theta
            x += c * np.sin(heading)
            z += c * np.cos(heading)
        return np.array([x, z])

    def equal_stroke(self, stroke: float) -> np.ndarray:
        """Angles [rad] when every notch takes the same share of the stroke (eq. 1-3)."""
        return np.minimum(stroke / self.n / self.arm, self.closing_angle)


@dataclass(frozen=True)
class State:
    """One state: base tension, angles, tension in every gap and in every uncut body beyond it."""

    tension: float
    angle: np.ndarray
    gap_tension: np.ndarray
    body_tension: np.ndarray


def _pacheco(n: int, h: float, c: float, depth: Sequence[float]) -> Wrist:
    return Wrist(height=(h,) * n, uncut=(c,) * n, depth=tuple(depth))


# Pacheco 2021, Table 2 (geometry) and Table 3 (rounded constants).
A = _pacheco(5, 0.8, 1.2, [1.40] * 5)
B = _pacheco(5, 0.5, 1.5, [1.40] * 5)
C = _pacheco(4, 1.0, 1.0, [1.36, 1.39, 1.42, 1.45])
WRISTS = {"A": A, "B": B, "C": C}

# The authors' unrounded fit (set 196) and the start angles of their specimens.
SET_196 = Material(9993.685186, 2994.787499, 0.027869593)
MU_196 = 0.127548461
PRECURVATURE_DEG = {
    "A": (2.39580099, 2.268315378, 2.433246067, 1.724263869, 2.334074353),
    "B": (1.521853776, 1.320520452, 1.255100512, 1.149834263, 1.336681514),
    "C": (2.191, 2.264, 2.534, 3.062),
}
SPECIMENS = {
    name: wrist.with_(
        material=SET_196,
        mu=MU_196,
        precurvature=tuple(np.radians(PRECURVATURE_DEG[name])),
    )
    for name, wrist in WRISTS.items()
}
