"""Nitinol by fibres against independent fine quadratures, closed forms and its own loops."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from fibre_sections import ENDS, bending, energy, fine_fibres, moment, respond, section
from notchflex.mechanics.material import FibreSection, NotchEnds, SectionLaw, section_law
from refusals import refused

STRAIGHT = dataclasses.replace(ENDS, odd=0.0, even=0.0, warped=0.0)
BILINEAR = nf.Nitinol(42000.0, 350.0, 6000.0, compression_ratio=1.3)
HYSTERETIC = dataclasses.replace(BILINEAR, unloading_stress=150.0)


def stress(strain: np.ndarray) -> np.ndarray:
    tension, compression = 350.0 / 42000.0, 1.3 * 350.0 / 42000.0
    plateau = np.maximum(strain - tension, 0.0) - np.maximum(-strain - compression, 0.0)
    return 42000.0 * (strain - plateau) + 6000.0 * plateau


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
def test_moment_is_that_of_a_fine_quadrature(cut: str) -> None:
    law, own = section_law(BILINEAR), section(cut)
    arm, area = fine_fibres(cut)
    for curvature in (-0.8, 0.1, 0.4, 1.0):
        found = brentq(lambda x, k=curvature: area @ stress(x + k * arm), -0.2, 0.2, xtol=1e-15)
        expected = float(area @ (stress(found + curvature * arm) * arm))
        assert moment(law, curvature, own) == pytest.approx(expected, rel=4e-3)


def test_between_ends_the_law_of_the_notch_is_solved() -> None:
    law, own = section_law(BILINEAR), section(ends=ENDS)
    plain = dataclasses.replace(own, ends=None)
    rigidity = 42000.0 * float(own.second_moment_weak)
    for curvature in (-1.0, 0.2, 0.9):
        elastic = 1.0 + 0.2 * curvature + 0.1 * curvature**2

        def parts(k: float, elastic: float = elastic) -> tuple[float, float]:
            """Bend of section and ends, and flattening by the angle and by the moment."""
            part = moment(law, k, plain) / rigidity
            bent = 1.15 * k + 0.45 * part
            return bent, elastic / (1.0 + 0.15 * (bent - 1.6 * part))

        def missing(k: float, at: float = curvature) -> float:
            bent, q = parts(k)
            return bent - at / q

        own_curvature = brentq(missing, -2.0, 2.0, xtol=1e-15)
        expected = moment(law, own_curvature, plain) / parts(own_curvature)[1]
        assert moment(law, curvature, own) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("ends", [None, ENDS], ids=["plain", "ends"])
@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
def test_far_below_the_plateau_it_is_linear(cut: str, ends: NotchEnds | None) -> None:
    own = section(cut, ends)
    laws = section_law(nf.Nitinol(42000.0, 1e7)), section_law(nf.Linear(42000.0))
    for curvature in (-0.7, 0.3):
        strain = np.array([0.1, curvature, 0.2, 0.01, 0.02, 0.03])
        fibres, linear = (np.asarray(respond(law, strain, own, ()).resultants) for law in laws)
        np.testing.assert_allclose(fibres, linear, rtol=1e-12)
        held = [float(energy(law, strain, own, ())) for law in laws]
        assert held[0] == pytest.approx(held[1], rel=1e-12)


@pytest.mark.parametrize("ends", [None, ENDS], ids=["plain", "ends"])
def test_its_slope_is_that_of_the_moment(ends: NotchEnds | None) -> None:
    law, own, step = section_law(BILINEAR), section(ends=ends), 1e-7
    for curvature in (-0.6123, 0.2042, 0.7071):
        ahead, behind = (moment(law, curvature + by, own) for by in (step, -step))
        slope = respond(law, bending(curvature), own, ()).slope
        assert float(slope) == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-6)


@pytest.mark.parametrize("end", [None, 0.03])
@pytest.mark.parametrize("ends", [None, STRAIGHT], ids=["plain", "ends"])
def test_energy_is_the_area_under_the_moment(ends: NotchEnds | None, end: float | None) -> None:
    law = section_law(dataclasses.replace(BILINEAR, transformation_strain=end))
    own, step = section(ends=ends), 1e-6
    for curvature in (-0.6123, 0.2042, 0.9):
        ahead, behind = (
            float(energy(law, bending(curvature + by), own, ())) for by in (step, -step)
        )
        slope = (ahead - behind) / (2.0 * step)
        assert slope == pytest.approx(moment(law, curvature, own), rel=1e-8)


def follow(law: SectionLaw, own: FibreSection, curvatures: np.ndarray) -> list[np.ndarray]:
    """Moments, energies, dissipated energy and memories along a history."""
    memory, loss, rows, memories = law.rest(own), 0.0, [], []
    for curvature in curvatures:
        response = respond(law, bending(curvature), own, memory)
        after = np.asarray(response.memory)
        loss += float(law.dissipated(own, np.asarray(memory), after))
        memory = after
        held = float(energy(law, bending(curvature), own, memory))
        rows.append((float(response.resultants[1]), held, loss))
        memories.append(memory)
    return [*np.array(rows).T, np.array(memories)]


def history(corners: list[float], steps: int = 60) -> np.ndarray:
    pairs = itertools.pairwise(corners)
    return np.concatenate([np.linspace(*pair, steps + 1)[1:] for pair in pairs])


def test_a_closed_inner_loop_returns_to_its_point() -> None:
    law, own = section_law(HYSTERETIC), section(ends=ENDS)
    moments, _, _, memory = follow(law, own, np.array([0.8, 0.4, 0.6, 0.4, 0.8, 1.0, 0.0]))
    direct = follow(law, own, np.array([0.8, 1.0]))
    np.testing.assert_allclose(moments[[4, 5]], direct[0], rtol=1e-12)
    np.testing.assert_allclose(memory[[4, 5]], direct[3], atol=1e-14)
    assert moments[3] == pytest.approx(moments[1], rel=1e-12)
    np.testing.assert_array_equal(memory[-1], 0.0)


def test_unloading_is_elastic_first_and_below_loading() -> None:
    law, own = section_law(HYSTERETIC), section()
    up, down = follow(law, own, np.array([0.4, 0.8, 0.79]))[0], section_law(BILINEAR)
    rigidity = 42000.0 * float(own.second_moment_weak)
    assert (up[1] - up[2]) / 0.01 == pytest.approx(rigidity, rel=1e-9)
    assert up[1] == pytest.approx(moment(down, 0.8, own), rel=1e-12)
    assert follow(law, own, np.array([0.8, 0.4]))[0][1] < up[0]


def test_work_is_stored_or_dissipated() -> None:
    law, own = section_law(HYSTERETIC), section(ends=STRAIGHT)
    path = history([0.0, 0.9, 0.3, 0.6, -0.8, 0.2, 0.0], 400)
    moments, held, loss, _ = follow(law, own, path)
    places, forces = np.append(0.0, path), np.append(0.0, moments)
    work = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * np.diff(places))
    assert np.abs(work - held - loss).max() < 2e-4 * work.max()
    assert (np.diff(loss) >= -1e-14).all()
    assert held[-1] == pytest.approx(0.0, abs=1e-12)


def test_no_closed_loop_gains_work() -> None:
    law, own = section_law(HYSTERETIC), section(ends=ENDS)
    turns = np.random.default_rng(3).uniform(-0.9, 0.9, 12)
    path = history([0.0, *turns, 0.0], 40)
    moments = follow(law, own, path)[0]
    places, forces = np.append(0.0, path), np.append(0.0, moments)
    for first in range(0, len(places), 7):
        for last in np.flatnonzero(places[first + 1 :] == places[first]) + first + 1:
            part = slice(first, last + 1)
            work = np.trapezoid(forces[part], places[part])
            assert work > -1e-9
    assert np.trapezoid(forces, places) > 0.0


def test_bad_values_name_what_is_allowed() -> None:
    for keys, key in (
        ({"plateau_modulus": 50_000.0}, "plateau_modulus"),
        ({"plateau_modulus": -1.0}, "plateau_modulus"),
        ({"unloading_stress": 400.0}, "unloading_stress"),
        ({"transformation_strain": 0.001}, "transformation_strain"),
    ):
        with refused("INVALID_ROBOT", f"`{key}`"):
            nf.Nitinol(**keys)
