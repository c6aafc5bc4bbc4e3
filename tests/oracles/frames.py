"""Robots with notches and tendons all round, by matrix exponentials and a general root finder.

Every notch is one screw motion about its neutral axis, written as a 4x4 matrix exponential
(scipy), so nothing of the package's rigid motions is used.  Tendons run on the wall: the one at
`r` and at the angle Delta from the bend of a notch is h - theta (ybar + r cos Delta) long there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import fsolve

from .wrist import Wrist


def about_z(angle: float) -> np.ndarray:
    """Rotation about the tube axis as a 4x4 matrix [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def shift(x: float = 0.0, z: float = 0.0) -> np.ndarray:
    """Translation as a 4x4 matrix [mm]."""
    return np.array([[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, z], [0, 0, 0, 1.0]])


def notch(angle: float, height: float, centroid: float, direction: float) -> np.ndarray:
    """Motion across a notch bent by `angle` toward `direction` [rad, mm]."""
    twist = np.zeros((4, 4))
    twist[0, 2], twist[2, 0] = angle, -angle  # bends z toward x
    twist[2, 3] = height  # the neutral axis keeps its length
    bent = shift(-centroid) @ expm(twist) @ shift(centroid)
    return about_z(direction) @ bent @ about_z(-direction)


@dataclass(frozen=True)
class Tendons:
    """Tendons to the tip: radius [mm] and direction [rad] of each."""

    radius: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True)
class Robot:
    """A wrist whose notches point anywhere, with any number of tendons."""

    wrist: Wrist
    direction: np.ndarray
    tendons: Tendons

    @property
    def arm(self) -> np.ndarray:
        """Shortening of a tendon per angle of a notch [mm], notches x tendons."""
        delta = self.tendons.direction[None, :] - self.direction[:, None]
        return self.wrist.centroid[:, None] + self.tendons.radius * np.cos(delta)

    def bodies(self, angle: np.ndarray) -> np.ndarray:
        """Frames of body 0 ... n at their proximal faces, and of the tip: (n + 2, 4, 4)."""
        pose = np.eye(4)
        poses = [pose]
        w = self.wrist
        for a, h, c, ybar, way in zip(
            angle, w.height, w.uncut, w.centroid, self.direction, strict=True
        ):
            pose = pose @ notch(a, h, ybar, way)
            poses.append(pose)
            pose = pose @ shift(z=c)
        return np.array([*poses, pose])

    def slide(self, angle: np.ndarray) -> np.ndarray:
        """Tendon drawn over both edges of every notch [mm], (n, 2, tendons)."""
        short = (np.asarray(angle) - self.wrist.start)[:, None] * self.arm
        ahead = np.cumsum(short[::-1], axis=0)[::-1]
        return np.stack([ahead, ahead - short], axis=1)

    def gap_tension(self, tension: np.ndarray, angle: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """Tension in every gap [N] where each contact slides the way of `sign`, (n, tendons)."""
        share = 1.0 if self.wrist.wrap == "whole-before" else 0.5
        turn = self.wrist.mu * np.abs(angle)
        loss = np.stack([share * turn, (1.0 - share) * turn], axis=1)[:, :, None] * sign
        before_gap = np.cumsum(loss.reshape(-1, loss.shape[2]), axis=0)[0::2]
        return tension * np.exp(-before_gap)

    def equilibrium(self, tension: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles [rad] and gap tensions [N] pulled from rest, no notch closed.

        Every contact slides from the start, so its friction points against what has slid; the
        signs are guessed without friction and must come out the same in the end.
        """
        tension = np.asarray(tension, dtype=float)
        w = self.wrist
        sign = np.zeros((w.n, 2, len(tension)))
        angle = w.start.copy()
        for _ in range(5):

            def unbalance(angle: np.ndarray, sign: np.ndarray = sign) -> np.ndarray:
                carried = np.array([w.elastic_moment(j, a) for j, a in enumerate(angle)])
                return carried - (self.gap_tension(tension, angle, sign) * self.arm).sum(axis=1)

            angle, _, flag, message = fsolve(unbalance, angle, xtol=1e-15, full_output=True)
            assert np.max(np.abs(unbalance(angle))) < 1e-13, (flag, message)
            slid = self.slide(angle)
            if np.array_equal(np.sign(slid), sign):
                break
            sign = np.sign(slid)
        else:
            raise AssertionError("the contacts do not slide one way: choose other tensions")
        assert np.all(angle < w.closing_angle), "a notch closes: choose smaller tensions"
        return angle, self.gap_tension(tension, angle, sign)
