"""Two walls side by side: against quadrature, a plain series, and beams held at both ends."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.mechanics.section import (
    clamped_torsion_constant,
    rectangle_torsion_constant,
    two_walls,
)

SHAPES = [(2.0, 1.5, 4.0), (1.0, 0.7, 2.5), (0.3, 2.0, 1.0), (1.0, 1.0, 0.5)]


@pytest.mark.parametrize("shape", SHAPES)
def test_area_and_moments_are_integrals(shape, margin):
    width, thickness, middle = shape
    points, weights = np.polynomial.legendre.leggauss(3)
    x = 0.5 * thickness * points
    y = np.concatenate([side * middle + 0.5 * width * points for side in (-1, 1)])
    dx, dy = 0.5 * thickness * weights, 0.5 * width * np.concatenate([weights, weights])
    wanted = [dx.sum() * dy.sum(), dx @ x**2 * dy.sum(), dx.sum() * (dy @ y**2)]
    found = two_walls(*shape)
    properties = [found.area, found.second_moment_weak, found.second_moment_strong]
    margin.within("relative", np.divide(properties, wanted) - 1.0, 1e-14)
    assert found.edge_near == found.edge_spine == 0.5 * thickness
    assert found.centroid == found.shear_centre == 0.0


@pytest.mark.parametrize("ratio", [1.0, 1.2, 2.0, 10.0, 0.3])
def test_rectangle_is_prandtls_series(ratio, margin):
    # The membrane over a rectangle as a double Fourier series, an oracle of another form:
    # J = 256/pi^6 b^3 h^3 sum 1/(m² n² (m² h² + n² b²)) over odd m, n.
    odd = 2.0 * np.arange(1500) + 1.0
    m, n = odd[:, None] ** 2, odd[None] ** 2
    series = 256.0 / np.pi**6 * ratio**3 * np.sum(1.0 / (m * n * (m + n * ratio**2)))
    # What the series leaves out beyond 3000 is below 1e-9 of it.
    margin.within("relative", rectangle_torsion_constant(ratio, 1.0) / series - 1.0, 1e-8)


def test_known_rectangles(margin):
    # Timoshenko and Goodier, table of §109: b h³ times these.
    table = {1.0: 0.1406, 1.5: 0.196, 2.0: 0.229, 3.0: 0.263, 10.0: 0.312}
    found = rectangle_torsion_constant(np.array(list(table)), 1.0) / np.array(list(table))
    margin.within("table", found - np.array(list(table.values())), 6e-4)
    assert rectangle_torsion_constant(1.0, 1.0) == pytest.approx(0.14057701495515551, rel=1e-14)


def torque_by_differences(torsion, warping, length, nodes=4000):
    """Torque over angle of a bar clamped at both ends: G J φ' - E I_ω φ''' is constant."""
    # Unknown twist φ' at the nodes, zero at both ends; by its symmetric second differences.
    step = length / nodes
    inner = nodes - 1
    matrix = np.zeros((3, inner))
    matrix[1] = torsion + 2.0 * warping / step**2
    matrix[0, 1:] = matrix[2, :-1] = -warping / step**2
    from scipy.linalg import solve_banded

    twist = solve_banded((1, 1), matrix, np.ones(inner))
    return 1.0 / (twist.sum() * step)


@pytest.mark.parametrize("length", [0.5, 8.0, 100.0])
def test_clamped_torsion_is_vlasovs_equation(length, margin):
    section = two_walls(2.0, 1.5, 4.0)
    modulus = 2.0 * (1.0 + 0.3)
    warping = 2.0 * (2.0 * 1.5**3 / 12.0) * 4.0**2
    wanted = torque_by_differences(float(section.torsion_constant), modulus * warping, length)
    found = clamped_torsion_constant(section, 4.0, length, 0.3)
    margin.within(f"{length} mm, relative", found / length / wanted - 1.0, 1e-4)
