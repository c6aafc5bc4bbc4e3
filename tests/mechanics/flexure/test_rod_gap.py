"""Backbones with disks against closed forms, own integration of rods, and continuous tendons."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, least_squares
from scipy.spatial.transform import Rotation
from scipy.special import ellipkinc

import notchflex as nf

YOUNG, RATIO = 54_000.0, 0.3
Z = np.array([0.0, 0.0, 1.0])


def backbone(
    gaps: int,
    length: float,
    diameter: float = 1.4,
    *tendons: nf.Tendon,
    **gap: Any,
) -> nf.Robot:
    """A backbone that is free over its whole length; its disks have no thickness."""
    options = {"uncut_length": 0.0, "repeat": gaps} | gap
    return nf.Robot(
        "backbone",
        nf.Tube(30.0, 2.0),
        (nf.RodGap(length / gaps, diameter, **options),),
        tendons or (nf.Tendon(10.0, path="straight"),),
        nf.Linear(YOUNG, poisson_ratio=RATIO),
        nf.Frictionless(),
    )


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


@pytest.mark.parametrize("load", [1.0, 5.0])
def test_elastica_under_a_dead_force(load: float) -> None:
    """A thin cantilever under F L^2/EI across it, by elliptic integrals."""
    length, diameter = 2000.0, 0.05  # so thin that it neither stretches nor shears

    def beyond(k: float) -> float:  # sqrt(load) = K(k) - F(k, phi), sin phi = 1/(k sqrt 2)
        low = np.arcsin(min(1.0, 1.0 / (k * np.sqrt(2.0))))
        return ellipkinc(np.pi / 2, k**2) - ellipkinc(low, k**2) - np.sqrt(load)

    k = brentq(beyond, np.sqrt(0.5) * (1 + 1e-15), 1 - 1e-12, xtol=1e-16)
    # The height along the tube is sqrt(2 EI/F sin(theta)) at the slope theta of the tip.
    height = length * np.sqrt(2.0 * (2 * k**2 - 1.0) / load)
    force = load * stiffness(diameter)[0][0] / length**2
    robot = backbone(4, length, diameter)
    state = nf.solve(robot, nf.Load(tip_force=(force, 0.0, 0.0)), refinement=2).raise_if_failed()
    assert state.tip_position[2] == pytest.approx(height, abs=1e-8 * length)


@pytest.mark.parametrize("following", [False, True])
def test_thick_rod_in_the_plane(following: bool) -> None:
    """Stretch and shear of a rod as thick as a fifth of its length, precurved."""
    force, moment = np.array([180.0, 0.0, -60.0]), np.array([0.0, 900.0, 0.0])
    turn = 20.0
    expected = shot(force, moment, 2.0, 10.0, following, np.radians(4 * turn) / 10.0)
    robot = backbone(4, 10.0, 2.0, precurvature_deg=turn)
    load = nf.Load(tip_force=tuple(force), tip_moment=tuple(moment), following=following)
    state = nf.solve(robot, load, refinement=3).raise_if_failed()
    np.testing.assert_allclose(state.tip_position, expected, atol=1e-8 * 10.0)


def test_helix_under_a_moment() -> None:
    """A dead moment oblique to a straight rod: its tangent turns about it at a constant rate."""
    diameter, length = 1.4, 100.0
    bending, _ = stiffness(diameter)
    moment = np.array([60.0, 90.0, 110.0])
    rate, axis = np.linalg.norm(moment) / bending[0], moment / np.linalg.norm(moment)
    along, across = (axis @ Z) * axis, Z - (axis @ Z) * axis
    angle = rate * length
    tip = (
        along * length
        + (across * np.sin(angle) + np.cross(axis, across) * (1 - np.cos(angle))) / rate
    )
    load = nf.Load(tip_moment=tuple(moment))
    errors = [
        np.linalg.norm(
            nf.solve(backbone(7, length, diameter), load, refinement=r).tip_position - tip
        )
        for r in (0, 1)
    ]
    assert errors[0] < 1e-5 * length
    assert errors[1] < 1e-8 * length


@pytest.mark.parametrize("following", [False, True])
def test_rod_in_space(following: bool) -> None:
    """Force and moment in space, dead and following."""
    force, moment = np.array([0.25, -0.2, 0.15]), np.array([-25.0, 30.0, 40.0])
    expected = shot(force, moment, 1.4, 140.0, following)
    load = nf.Load(tip_force=tuple(force), tip_moment=tuple(moment), following=following)
    state = nf.solve(backbone(7, 140.0), load, refinement=1).raise_if_failed()
    np.testing.assert_allclose(state.tip_position, expected, atol=1e-8 * 140.0)


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


@pytest.mark.parametrize("kind", ["converging", "helical"])
def test_tendon_of_many_disks_becomes_continuous(kind: str) -> None:
    length, turn, shrink = 400.0, 1.5 * np.pi, 0.6

    def path(at: float) -> tuple[np.ndarray, np.ndarray]:
        part = at / length
        radius, rate = (10.0 * (1 - shrink * part), -10.0 * shrink / length)
        angle, twist = 0.0, 0.0
        if kind == "helical":
            radius, rate, angle, twist = 10.0, 0.0, turn * part, turn / length
        outward, around = (
            np.array([np.cos(angle + by), np.sin(angle + by), 0.0]) for by in (0.0, np.pi / 2)
        )
        return radius * outward, rate * outward + radius * twist * around

    expected = continuous(path, 3.0, length)
    errors = list[float]()
    for gaps in (7, 14):
        part = np.arange(1, gaps + 1) / gaps
        holes: dict[str, Any] = {"disk_radius": tuple(10.0 * (1 - shrink * part))}
        if kind == "helical":
            holes = {"disk_direction_deg": tuple(np.degrees(turn * part))}
        robot = backbone(gaps, length, 1.4, nf.Tendon(10.0, path="straight", **holes))
        tip = nf.solve(robot, nf.Load(tension=3.0)).raise_if_failed().tip_position
        errors.append(float(np.linalg.norm(tip - expected)))
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < 0.02 * length
