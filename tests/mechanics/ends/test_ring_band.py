"""The band of a ring against a dense solution of the same polynomials; its derivatives."""

from __future__ import annotations

import itertools

import jax
import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import null_space

from notchflex._arrays import Decisions, xp
from notchflex.mechanics import ring
from notchflex.mechanics import ring as edge_loads
from notchflex.mechanics.cuts import annular_sector
from notchflex.mechanics.flattening import distortion
from notchflex.mechanics.ring import Side

BOUNDARIES = ("between", "clamped", "free")
DEGREE = 18
POINTS, WEIGHTS = legendre.leggauss(DEGREE + 1)


def conditions(boundary, n, value, slope, passing):
    """What is nil at the far edge, as rows over the polynomials of u, v and w."""
    u, v, w = np.kron(np.eye(3), value)
    turned = np.r_[0 * value, 0 * value, slope]
    rows = {
        "clamped": [u, v, w, turned],
        "between": [v, w, *([u] if n < 2 else [])]
        if passing
        else [u, turned, *([v] if n == 1 else [])],
        "free": [[u], [u, w]][n] if n < 2 else [],
    }[boundary]
    torsion = np.kron([0, 1, 0], np.eye(len(value)).reshape(-1, 1, len(value))).reshape(-1, 57)
    return np.array([*rows, *(torsion if n == 0 else [])]).reshape(-1, 57)


def dense(radius, wall, side, nu, passing=False):
    """Compute `ring.edge_compliance` with Legendre's polynomials and the null space of what holds.

    All is for radius 1; units follow from those of displacement, slope and load.
    """
    boundary, length, *_ = side
    t, c = wall / radius, length / radius
    at = np.r_[POINTS, -1.0, 1.0]
    polynomials = np.eye(DEGREE + 1)
    value, slope, bend = (
        np.stack([legendre.legval(at, legendre.legder(p, d, 2.0 / c)) for p in polynomials], -1)
        for d in range(3)
    )
    none = 0.0 * value
    plane = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
    plane = plane / (1.0 - nu**2)
    stiffnesses = np.kron(np.diag([t, t**3 / 12.0]), plane)
    edge = np.zeros((57, 4))
    edge[19:38, 0], edge[38:, 1], edge[:19, 2], edge[38:, 3] = (
        value[-2], value[-2], -value[-2], -slope[-2],
    )  # fmt: skip
    result = []
    for n in range(ring.HARMONICS):
        strains = np.array(
            [
                np.hstack([slope, none, none]),
                np.hstack([none, n * value, value]),
                np.hstack([-n * value, slope, none]),
                np.hstack([none, none, -bend]),
                np.hstack([none, n * value, n**2 * value]),
                np.hstack([0.5 * n * value, 1.5 * slope, 2.0 * n * slope]),
            ]
        )[:, :-2]
        stresses = np.tensordot(stiffnesses, 0.5 * c * WEIGHTS[:, None] * strains, 1)
        energy = np.tensordot(strains, stresses, ((0, 1), (0, 1)))
        allowed = np.eye(57)
        if len(rows := conditions(boundary, n, value[-1], slope[-1], passing)):
            allowed = null_space(rows)
        loads = allowed.T @ edge
        result.append(loads.T @ np.linalg.solve(allowed.T @ energy @ allowed, loads))
    units = np.array([1.0, 1.0, 1.0, 1.0 / radius])
    return np.array(result) * np.outer(units, units)


def rings(count):
    """Random rings: radius, wall, length, Poisson's ratio."""
    random = np.random.default_rng(7)
    for _ in range(count):
        radius, nu = random.uniform(0.5, 5.0), random.uniform(0.0, 0.5)
        wall = np.exp(random.uniform(np.log(0.02), np.log(1.2)))
        longest = 3.33 / np.sqrt(wall)
        length = np.exp(random.uniform(np.log(0.02), np.log(longest)))
        yield radius, wall * radius, length * radius, nu


def drawings(count):
    """Random rings and half angles of the arc: radius, wall, length, Poisson's ratio, angle."""
    random = np.random.default_rng(8)
    return np.array([(*numbers, random.uniform(0.2, 3.0)) for numbers in rings(count)])


def added(values, boundary):
    """Compute the added lengths over the radius and the coupling over its square."""
    radius, wall, length, nu, angle = values
    outer, inner = radius + 0.5 * wall, radius - 0.5 * wall
    sector = annular_sector(outer, inner, outer * (1.0 + xp.cos(angle)))
    side = Side(boundary, length * (2.0 if boundary == "between" else 1.0))
    with Decisions((False,) * 9).deciding():  # the ring is there
        arc = edge_loads.arc_of(outer, inner, sector)
        ends = edge_loads.end_compliance(arc, side, nu, distortion(arc, nu).loads, 0.8)
    return xp.stack(ends[:4]) / xp.stack([radius, radius, radius, radius**2])


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_the_band_solves_the_dense_system(boundary, monkeypatch, margin):
    """Lengths are compared with what is added and the height of a notch, a third of the radius."""
    every, compliances, lengths = drawings(12), [], []
    band = [added(values, boundary) for values in every]
    for (radius, wall, length, nu, _), passing in itertools.product(every, (False, True)):
        values = radius, wall, Side(boundary, length), nu, passing
        wanted = dense(*values)
        # Loads around the tube have no harmonic 0.
        scale = np.sqrt(np.einsum("nii->ni", wanted)) + (wanted == 0.0).all(axis=2)
        error = ring.edge_compliance(*values) - wanted
        error[0, 0], error[0, :, 0] = 0.0, 0.0
        # Loads that pass have no harmonic 0.
        compliances.append((error / scale[:, :, None] / scale[:, None])[int(passing) :])
    monkeypatch.setattr(edge_loads, "edge_compliance", dense)
    for values, computed in zip(every, band, strict=True):
        wanted = added(values, boundary)
        lengths.append((computed - wanted) / (1.0 / 3.0 + np.abs(wanted)))
    margin.within("compliance, relative", np.concatenate(compliances), 5e-7)
    margin.within("lengths, relative", lengths, 1e-8)


@pytest.mark.parametrize(
    "boundary", ["free", *(pytest.param(one, marks=pytest.mark.nightly) for one in BOUNDARIES[:2])]
)
def test_traced_slopes_are_those_of_differences(boundary, margin):
    slopes, errors = jax.jit(jax.jacfwd(lambda values: added(values, boundary))), []
    for values in drawings(12):
        exact, size = np.asarray(slopes(values)), 1.0 / 3.0 + np.abs(added(values, boundary))
        for k, number in enumerate(values):
            step = 1e-3 * number * np.eye(len(values))[k]
            near, far = (
                added(values + s * step, boundary) - added(values - s * step, boundary)
                for s in (1, 2)
            )
            difference = (8.0 * near - far) / (12.0 * step[k])
            errors.append((exact[:, k] - difference) * number / size)
    margin.within("slopes, relative", errors, 1e-6)


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_a_ring_that_is_no_part_has_finite_lengths(boundary):
    for length in (1e-12, 1e-6, 1e-3):
        for passing in (False, True):
            values = 0.755, 0.11, Side(boundary, length), 0.3, passing
            assert np.isfinite(ring.edge_compliance(*values)).all()
