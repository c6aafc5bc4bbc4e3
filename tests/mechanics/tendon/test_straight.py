"""Straight tendons: one notch against an energy balance, long chains against virtual work."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import notchflex as nf

TUBE = nf.Tube(1.62, 1.40)
STIFFNESS = 10000.0 * 5.816412685e-4 / 0.8
CENTROID = 0.6865332868


def wrist(notches: int, friction: nf.Frictionless | nf.Capstan, *directions: float) -> nf.Robot:
    return nf.Robot(
        name="straight",
        tube=TUBE,
        notch=(nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2, repeat=notches),),
        tendon=tuple(nf.Tendon(0.70, at, path="straight") for at in directions or (0.0,)),
        material=nf.Linear(10000.0),
        friction=friction,
    )


def span(theta: float) -> float:
    """Straight distance of the tendon's two edges at the inner wall, one notch bent."""
    if theta == 0.0:
        return 0.8
    radius = 0.8 / theta
    end = np.array([-CENTROID + radius * (1 - np.cos(theta)), radius * np.sin(theta)])
    end += (0.70 + CENTROID) * np.array([np.cos(theta), -np.sin(theta)])
    return float(np.linalg.norm(end - np.array([0.70, 0.0])))


@pytest.mark.parametrize("tension", [0.1, 1.0, 2.5])
def test_one_notch_takes_the_least_energy(tension: float) -> None:
    found = nf.solve(wrist(1, nf.Frictionless()), nf.Load(tension=tension)).raise_if_failed()

    def energy(theta: float) -> float:
        return 0.5 * STIFFNESS * theta**2 + tension * span(theta)

    least = minimize_scalar(energy, bounds=(1e-6, 0.53), options={"xatol": 1e-12}).x
    assert found.notch_angle[0] == pytest.approx(least, abs=1e-7)
    step = 1e-5

    def slope(theta: float) -> float:
        change = span(theta + step) - span(theta - step)
        return STIFFNESS * theta + tension * change / (2 * step)

    assert found.notch_angle[0] == pytest.approx(brentq(slope, 1e-4, 0.53), abs=1e-9)
    assert found.stroke[0] == pytest.approx(0.8 - span(found.notch_angle[0]), abs=1e-10)


def test_friction_turns_with_the_tendon() -> None:
    """One notch: the exit edge turns the tendon by the span's tilt, in every state it slides."""
    state = nf.solve(wrist(1, nf.Capstan(0.3)), nf.Load(tension=1.0))
    theta = state.notch_angle[0]
    half = theta / 2  # the span is a chord of the notch: it turns half at each edge
    assert state.contact_bound[0, 0] == pytest.approx(0.3 * half, rel=1e-10)
    assert state.span_tension[0, 1] == pytest.approx(np.exp(-0.3 * half), rel=1e-10)


@pytest.mark.nightly
def test_work_is_stored_without_friction_in_space() -> None:
    robot = wrist(3, nf.Frictionless(), 0.0, 100.0, 250.0)
    rising = np.linspace(0.0, 1.0, 201)
    load = nf.LoadPath(
        np.stack([0.8 * rising, 0.5 * rising**2, 0.2 * rising], axis=1), np.full((201, 3), np.nan)
    )
    path = nf.simulate(robot, load).raise_if_failed()
    work = path.tendon_work[-1].sum()
    assert path.stored_energy[-1] == pytest.approx(work, rel=1e-5)


def test_release_comes_back_with_friction() -> None:
    path = nf.simulate(wrist(4, nf.Capstan(0.2)), nf.pull(0.0, 1.5, steps=31).release())
    path.raise_if_failed()
    loading, unloading = path.total_angle[:31], path.total_angle[:30:-1]
    assert (unloading[1:-1] > loading[1:-1]).all()
    np.testing.assert_allclose(path.total_angle[-1], 0.0, atol=1e-9)
    heat = np.nansum(path.dissipation[-1])
    assert heat == pytest.approx(path.tendon_work[-1, 0], rel=1e-3)
    assert (path.dissipation[-1, 0] > -1e-9).all()
