"""Gauss's rule of a section against eigenvalues, moments and differences; its programs."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.polynomial import legendre

from notchflex._arrays import Decisions
from notchflex.mechanics.cuts import cut_fibres, sector_fibres, segment_fibres
from notchflex.mechanics.section import FIBRES, gauss_rule, two_walls_fibres

STRIPS = {"on-axis": sector_fibres, "off-axis": segment_fibres}
COUNTS = [FIBRES, 3 * FIBRES]
TUBES = [(0.81, 0.70), (1.0, 0.25), (1.0, 0.995)]
DEPTHS = np.array([0.005, 0.3, 1.0, 1.4, 1.9])  # over the outer radius


def sections(cut, count):
    """Strips of sections of many forms."""
    for outer, inner in TUBES:
        for depth in DEPTHS * outer:
            yield STRIPS[cut](outer, inner, depth, count)


def by_eigenvalues(points, weights, count):
    """Nodes and weights as eigenvalues and vectors; polynomials are made orthogonal twice."""
    polynomials, values = np.ones((1, len(points))) / np.sqrt(weights.sum()), points
    for _ in range(count - 1):
        values = points * polynomials[-1]
        for _ in range(2):
            values = values - (polynomials @ (weights * values)) @ polynomials
        values = values / np.sqrt(weights @ values**2)
        polynomials = np.vstack([polynomials, values])
    nodes, vectors = np.linalg.eigh((polynomials * weights * points) @ polynomials.T)
    return nodes, weights.sum() * vectors[0] ** 2


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("cut", STRIPS)
def test_nodes_are_eigenvalues(cut, count, margin):
    errors, moments = [], []
    for points, weights in sections(cut, count):
        nodes, areas = gauss_rule(points, weights, count)
        wanted, height, total = by_eigenvalues(points, weights, count), np.ptp(points), sum(weights)
        errors += [(nodes - wanted[0]) / height, (areas - wanted[1]) / total]
        own, strips = (
            w @ legendre.legvander(2.0 * (x - points.min()) / height - 1.0, 2 * count - 1)
            for x, w in ((nodes, areas), (points, weights))
        )
        moments.append((own - strips) / total)
    margin.within("nodes and weights, of height and area", errors, 1e-11)
    margin.within("moments, of the area", moments, 1e-12)


@pytest.mark.parametrize("count", COUNTS)
def test_rectangles(count, margin):
    points, weights = legendre.leggauss(160)
    wanted = by_eigenvalues(0.2 + 0.5 * points, weights, count)
    (nodes,), areas = two_walls_fibres(0.3, 0.7, count)
    margin.within("nodes and weights", np.subtract((nodes, areas), wanted), 1e-13)


def both(cut, like):
    """Rule and slopes along a direction, of outer, inner, depth and the direction.

    An example decides the form of the section.
    """
    with Decisions().deciding() as example:
        cut_fibres(cut, *like[:3], FIBRES)

    def rule(numbers):
        with Decisions(tuple(example.made)).deciding():
            return jnp.stack(cut_fibres(cut, *numbers, FIBRES))

    return lambda row: jnp.stack(jax.jvp(rule, (row[:3],), (row[3:],)))


def rows(cut, count):
    """Random sections of a tube and directions; cuts of one form, as a program has one."""
    random = np.random.default_rng(5)
    outer = random.uniform(0.5, 5.0, count)
    inner = outer * random.uniform(0.3, 0.95, count)
    depth = random.uniform(0.2, 1.8, count) * outer
    if cut == "off-axis":
        depth = outer + inner * random.uniform(-0.9, 0.9, count)
    return np.column_stack([outer, inner, depth, random.uniform(-1.0, 1.0, (count, 3))])


@pytest.mark.parametrize("cut", STRIPS)
def test_slopes_are_those_of_differences(cut, margin):
    errors = []
    for row in rows(cut, 4):
        numbers, change = row[:3], row[3:]
        value, slope = np.asarray(jax.jit(both(cut, row))(row))
        step = 1e-3 * min(numbers[2], 2.0 * numbers[0] - numbers[2], numbers[0] - numbers[1])
        near, far = (
            np.subtract(
                *(cut_fibres(cut, *(numbers + s * k * step * change), FIBRES) for s in (1, -1))
            )
            for k in (1, 2)
        )
        wanted = (8.0 * near - far) / (12.0 * step)
        size = np.array([[np.ptp(value[0])], [value[1].sum()]])
        plain = np.array(cut_fibres(cut, *numbers, FIBRES))
        margin.within("numbers, of height and area", (value - plain) / size, 1e-13)
        errors.append((slope - wanted) * step / size)
    margin.within("slopes by steps, of height and area", errors, 2e-10)
