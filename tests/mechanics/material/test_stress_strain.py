"""A curve of stress over strain against fine quadratures, Nitinol by formulas, and its files."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from fibre_sections import ENDS, PLAIN, bending, energy, fine_fibres, moment, respond, section
from notchflex._jax import jax
from notchflex.mechanics.material import Fibres, section_law
from notchflex.mechanics.section import FIBRES, two_walls_fibres
from notchflex.robot import robot_from_text, robot_text
from refusals import refused

BILINEAR = nf.Nitinol(42000.0, 350.0, 6000.0, compression_ratio=1.3)
CURVE = nf.StressStrain(
    strain=(0.008, 0.02, 0.05, 0.07),
    stress=(336.0, 400.0, 480.0, 900.0),
    compression_strain=(0.01, 0.03),
    compression_stress=(450.0, 800.0),
)
WRIST = nf.load_robot("pacheco2021-a")
TEXT = robot_text(WRIST.replace(material=CURVE))


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
def test_moment_is_that_of_a_fine_quadrature(cut: str) -> None:
    law, own, (arm, area) = section_law(CURVE), section(cut), fine_fibres(cut)
    tension, compression = (
        np.array(one)
        for one in (
            (CURVE.strain, CURVE.stress),
            (CURVE.compression_strain, CURVE.compression_stress),
        )
    )

    def stress(strain: np.ndarray) -> np.ndarray:
        """The curve, and beyond its end as between its last two points."""
        at = [*-compression[0, ::-1], 0.0, *tension[0]]
        values = [*-compression[1, ::-1], 0.0, *tension[1]]
        beyond = (values[-1] - values[-2]) / (at[-1] - at[-2])
        before = (values[1] - values[0]) / (at[1] - at[0])
        ends = beyond * np.maximum(strain - at[-1], 0.0), before * np.minimum(strain - at[0], 0.0)
        return np.interp(strain, at, values) + sum(ends)

    for curvature in (-0.9, 0.1, 0.4, 1.3):
        found = brentq(lambda x, k=curvature: area @ stress(x + k * arm), -0.3, 0.3, xtol=1e-15)
        expected = float(area @ (stress(found + curvature * arm) * arm))
        assert moment(law, curvature, own) == pytest.approx(expected, rel=6e-3)


def test_the_curve_of_a_bilinear_law_is_that_law() -> None:
    begin = 350.0 / 42_000.0
    by_points = nf.StressStrain(
        strain=(begin, begin + 0.05),
        stress=(350.0, 650.0),
        compression_strain=(1.3 * begin, 1.3 * begin + 0.01),
        compression_stress=(455.0, 515.0),
    )
    own, laws = section(ends=ENDS), (section_law(by_points), section_law(BILINEAR))
    for curvature in (-0.8, 0.2, 1.1):
        one, other = (respond(law, bending(curvature), own, ()) for law in laws)
        np.testing.assert_allclose(one.resultants, other.resultants, rtol=1e-12, atol=1e-13)
        assert float(one.slope) == pytest.approx(float(other.slope), rel=1e-12)
        held = [float(energy(law, bending(curvature), own, ())) for law in laws]
        assert held[0] == pytest.approx(held[1], rel=1e-12)


def smooth(count: int) -> nf.StressStrain:
    """A smooth curve through many points, with a flat plateau and a stiff end, from zero on."""
    strain = np.linspace(0.0, 0.08, count)
    plateau = 450.0 * np.tanh(strain / 0.01)
    stress = np.maximum.accumulate(plateau + 2e6 * np.maximum(strain - 0.06, 0.0) ** 2)
    return nf.StressStrain(strain=tuple(strain), stress=tuple(stress))


def test_few_kinks_keep_a_curve_of_many_points() -> None:
    curve = smooth(10_000)
    law = section_law(curve)
    strain = np.linspace(-0.08, 0.08, 9_999)
    fibre = Fibres(np.ones((9_999, 5)), np.full((9_999, 5), 0.2))
    sums = law.sum_fibres(fibre, (), strain, np.zeros(9_999))
    exact = np.interp(np.abs(strain), curve.strain, curve.stress) * np.sign(strain)
    np.testing.assert_allclose(sums.force, exact, atol=1.001e-6 * curve.stress[-1])
    assert len(law.change) <= 1024
    # so that curves of one length of the table share a program
    assert law.change.shape == section_law(smooth(9_000)).change.shape


def test_a_curve_may_begin_at_zero() -> None:
    begun = nf.StressStrain((0.0, *CURVE.strain), (0.0, *CURVE.stress))
    plain = nf.StressStrain(CURVE.strain, CURVE.stress)
    assert begun.elastic_modulus == plain.elastic_modulus
    for one, other in zip(
        jax.tree.leaves(section_law(begun)), jax.tree.leaves(section_law(plain)), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    assert robot_from_text(robot_text(WRIST.replace(material=begun))).material == begun


@pytest.mark.parametrize("slope", [0.0, 1.0, 400.0])
def test_a_rectangle_on_a_flat_plateau_follows_the_closed_form(slope: float) -> None:
    """Half height c, onset at curvature y: M = E I (r k + (1 - r) (1.5 y - 0.5 y^3 / k^2))."""
    modulus, onset, half = 45_000.0, 0.01, 0.06
    (arm,), area = two_walls_fibres(half, half, FIBRES)
    own = dataclasses.replace(
        PLAIN,
        area=2.0 * half,
        second_moment_weak=2.0 * half**3 / 3.0,
        edge_spine=half,
        edge_near=half,
        fibres=Fibres(arm, half * area),
    )
    law = section_law(nf.Nitinol(modulus, onset * modulus, slope))
    yielded, rigidity, ratio = onset / half, modulus * own.second_moment_weak, slope / modulus
    last = 0.0
    for curvature in yielded * np.array([1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0]):
        plateau = 1.5 * yielded - 0.5 * yielded**3 / curvature**2
        expected = rigidity * (ratio * curvature + (1.0 - ratio) * plateau)
        found = moment(law, curvature, own)
        assert found == pytest.approx(expected, rel=4e-3)  # 20 fibres
        assert found > last
        last = found


@pytest.mark.parametrize("unloading", [None, 150.0])
def test_a_wrist_passes_a_flat_plateau_up_and_down(unloading: float | None) -> None:
    flat = nf.Nitinol(42_000.0, 350.0, 0.0, unloading_stress=unloading)
    wrist = WRIST.replace(material=flat, friction=nf.Capstan(0.3))
    path = nf.simulate(wrist, nf.stroke_path(0.0, 3.0, 11).release())
    assert path.converged.all()
    assert np.degrees(path.total_angle.max()) > 120.0


def test_energy_is_the_area_under_the_moment() -> None:
    law, own, step = section_law(CURVE), section(), 1e-6
    for curvature in (-0.6123, 0.2042, 1.2):
        ahead, behind = (
            float(energy(law, bending(curvature + by), own, ())) for by in (step, -step)
        )
        slope = (ahead - behind) / (2.0 * step)
        assert slope == pytest.approx(moment(law, curvature, own), rel=1e-8)


def test_its_file_is_read_written_and_changed(tmp_path: Path) -> None:
    robot = WRIST.replace(material=CURVE)
    assert "strain = [0.008, 0.02, 0.05, 0.07]" in TEXT
    assert robot_from_text(TEXT) == robot
    nf.save_robot(robot, tmp_path / "own.toml")
    read = nf.load_robot(tmp_path / "own.toml")
    assert read == robot
    assert hash(read) == hash(robot)
    text = (tmp_path / "own.toml").read_text()
    nf.save_robot(read, tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_text() == text
    changed = read.with_value("material.stress", [336.0, 420.0, 500.0, 900.0])
    assert changed.material.stress == (336.0, 420.0, 500.0, 900.0)
    nf.save_robot(changed, tmp_path / "changed.toml")
    assert nf.load_robot(tmp_path / "changed.toml") == changed
    assert "strain 0.008 to 0.07 (4 values)" in repr(robot)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"strain": (0.01,)}, "`strain` is a list; give at least 2 values"),
        ({"strain": 0.01}, "`strain` is 0.01; it must be a list of numbers"),
        ({"strain": (0.01, "a")}, '`strain[2]` is "a" (text); it must be a number'),
        ({"strain": (0.0, 0.02)}, "`stress` is 400 MPa at the strain 0 (number 1)"),
        ({"stress": (0.0, 450.0)}, "`stress` is 0 MPa at the strain 0.01 (number 1)"),
        ({"strain": (-0.01, 0.02)}, "`strain[1]` is -0.01; it must be at least 0"),
        ({"strain": (0.02, 0.01)}, "`strain` has 0.01 behind 0.02 (number 2); strains must rise"),
        ({"strain": (0.01, 0.02, 0.03)}, "`stress` has 2 values and `strain` 3; give one stress"),
        ({"stress": (400.0, 390.0)}, "`stress` falls from 400 to 390 MPa (number 2)"),
        ({"compression_strain": (0.01, 0.02)}, "`compression_stress` is missing"),
        ({"strain": tuple(1e-5 * k for k in range(10_001))}, "give at most 10000 values"),
    ],
)
def test_bad_values_name_what_is_allowed(keys: dict, message: str) -> None:
    with pytest.raises(nf.InputError) as caught:
        dataclasses.replace(nf.StressStrain(strain=(0.01, 0.02), stress=(400.0, 450.0)), **keys)
    assert message in str(caught.value)
    assert "None" not in str(caught.value)


def test_files_name_the_value_that_is_wrong() -> None:
    for old, new, message in (
        ("0.02, 0.05", '"x", 0.05', '`material.strain[2]` is "x" (text); it must be a number'),
        ("[336.0, 400.0", "[336.0, 300.0", "`material.stress` falls from 336 to 300 MPa"),
    ):
        with pytest.raises(nf.InputError) as caught:
            robot_from_text(TEXT.replace(old, new))
        assert message in str(caught.value)
    robot = robot_from_text(TEXT)
    with refused("UNSUPPORTED", "`material.strain`"):
        nf.differentiable(robot, [nf.Load(tension=1.0)], ["material.strain"])
