"""Flexures of tables: against the notches they were made from, beam formulae and linear algebra."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np
import pytest

import notchflex as nf
from notchflex.errors import Failure

PATH = [nf.Load(tension=tension) for tension in (0.3, 0.9, 1.4, 1.8, 1.1, 0.4, 0.0)]
TUBE = nf.Tube(1.62, 1.40)


def robot_of(*notches: nf.TableNotch | nf.ArcNotch, **parts: Any) -> nf.Robot:
    usual: dict[str, Any] = {
        "name": "table",
        "tube": TUBE,
        "tendon": (nf.Tendon(0.70),),
        "material": nf.Linear(60e3),
        "friction": nf.Frictionless(),
    }
    return nf.Robot(notch=notches, **(usual | parts))


def made_from(robot: nf.Robot) -> list[nf.TableNotch]:
    """A table of every notch, from its moments and angles under a tendon without friction."""
    free = robot.replace(friction=nf.Frictionless())
    tension = np.linspace(0.0, 3.0, 1201)[1:]
    path = nf.simulate(free, [nf.Load(tension=one) for one in tension])
    known = path.converged & (path.gap > 1e-9).all(axis=1)
    tension, angles = tension[known], path.notch_angle[known]
    arms = path.notch_moment[known] / tension[:, None]
    np.testing.assert_allclose(arms, np.tile(arms[:1], (len(arms), 1)), rtol=1e-9)
    np.testing.assert_allclose(path.stroke[known, 0], angles @ arms[0], rtol=1e-9)
    tables: list[nf.TableNotch] = []
    for notch, arm, angle, closing in zip(
        robot.notches, arms[0], angles.T, robot.geometry.closing_angle, strict=True
    ):
        assert isinstance(notch, nf.ArcNotch)
        moment = arm * tension
        if isinstance(robot.material, nf.Superelastic):
            angle, moment = two_branches(angle, moment)
        tables.append(
            nf.TableNotch(
                notch.height,
                angle_deg=tuple(np.degrees(angle).tolist()),
                moment=tuple(moment.tolist()),
                uncut_length=notch.uncut_length,
                axis_offset=float(arm) - 0.70,
                closing_angle_deg=float(np.degrees(closing)),
            )
        )
    return tables


def two_branches(angle: np.ndarray, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two straight branches of Pacheco 2021 (eq. 13), with near points about their meeting."""
    first, (second, start) = moment[20] / angle[20], np.polyfit(angle[-50:], moment[-50:], 1)
    kink = start / (first - second)
    at = np.array([0.5 * kink, kink - 1e-6, kink, kink + 1e-6, 0.4, 0.6])
    return at, np.minimum(first * at, start + second * at)


@pytest.mark.parametrize("ends", ["rigid", "shell"])
def test_tables_of_arc_notches_take_their_path(ends: str):
    wrist = nf.load_robot("pacheco2021-a").with_value("notch.ends", ends)
    if ends == "shell":
        wrist = wrist.replace(material=nf.Linear(20e3))
    tables = wrist.replace(notch=tuple(made_from(wrist)))
    expected, got = nf.simulate(wrist, PATH), nf.simulate(tables, PATH)
    assert expected.converged.all()
    assert got.converged.all(), got.reason
    assert np.degrees(expected.notch_angle.max()) > 15.0
    np.testing.assert_allclose(got.notch_angle, expected.notch_angle, atol=1e-6)
    np.testing.assert_allclose(got.tip_position, expected.tip_position, atol=1e-6)
    np.testing.assert_allclose(got.stroke, expected.stroke, atol=1e-6)
    np.testing.assert_allclose(got.stored_energy, expected.stored_energy, atol=1e-6)
    assert np.isnan(got.peak_strain).all()


def test_table_closes_at_its_angle():
    table = nf.TableNotch(1.0, (10.0,), (1.0,), uncut_length=1.0, closing_angle_deg=8.0)
    closing = nf.closing(robot_of(table))
    # M = 1 N mm at 10 deg, straight; the tendon's arm is its radius.
    assert closing.angle[0] == pytest.approx(np.radians(8.0), rel=1e-12)
    assert closing.tension[0] == pytest.approx(0.8 / 0.70, rel=1e-9)
    held = nf.solve(robot_of(table), nf.Load(tension=5.0))
    assert np.degrees(held.notch_angle[0]) == pytest.approx(8.0, abs=1e-9)


def test_curve_passes_its_points_and_its_moment_is_the_slope_of_its_energy():
    points = (4.0, 9.0, 15.0, 22.0), (1.0, 2.6, 2.7, 5.0)
    table = nf.TableNotch(1.5, *points, uncut_length=1.0)
    robot = robot_of(table)
    at = nf.simulate(robot, [nf.Load(tension=moment / 0.70) for moment in points[1]])
    np.testing.assert_allclose(np.degrees(at.notch_angle[:, 0]), points[0], atol=1e-9)
    stroke = 0.70 * np.radians(np.linspace(0.0, 22.0, 1_001))
    path = nf.simulate(robot, [nf.Load(stroke=one) for one in stroke])
    angle, energy, moment = path.notch_angle[:, 0], path.stored_energy, path.notch_moment[:, 0]
    np.testing.assert_allclose(angle, stroke / 0.70, atol=1e-12)
    assert (np.diff(moment) >= 0.0).all()
    work = 0.5 * (moment[1:] + moment[:-1]) * np.diff(angle)
    np.testing.assert_allclose(np.cumsum(work), energy[1:] - energy[0], rtol=1e-5, atol=1e-7)
    # Odd: bent the other way with the opposite moment.
    other = robot_of(table, tendon=(nf.Tendon(0.70, direction_deg=180.0),))
    back = nf.solve(other, nf.Load(tension=3.0)).notch_angle[0]
    assert back == pytest.approx(-nf.solve(robot, nf.Load(tension=3.0)).notch_angle[0], rel=1e-12)


def test_state_beyond_the_ends_is_told():
    path = nf.simulate(
        robot_of(nf.TableNotch(1.0, (5.0, 20.0), (1.0, 3.0), uncut_length=1.0)),
        [nf.Load(tension=3.0 / 0.70 * part) for part in (0.999, 1.001)],
    )
    assert path.converged.tolist() == [True, False]
    assert path.reason_code[1] == Failure.BENT_TOO_FAR.name
    assert "beyond the ends of its table" in path.reason[1]


# A straight round rod, of the length 12 mm and the radius 0.5 mm.
LENGTH, MODULUS, SHEAR = 12.0, 50e3, 18e3
SECOND, AREA = np.pi * 0.5**4 / 4.0, np.pi * 0.5**2
BEND, SWAY = MODULUS * SECOND / LENGTH, 12.0 * MODULUS * SECOND / LENGTH**3
STIFFNESS = (BEND, BEND, 2.0 * SHEAR * SECOND / LENGTH, SWAY, SWAY, MODULUS * AREA / LENGTH)


@pytest.mark.parametrize("full", [False, True])
def test_stiffness_of_a_rod_is_that_of_the_beam(full: bool):
    numbers = np.diag(STIFFNESS).ravel() if full else np.array(STIFFNESS)
    notch = nf.TableNotch(LENGTH, stiffness=tuple(numbers.tolist()), uncut_length=0.0)
    robot, small = robot_of(notch), 1e-5

    def tip(**load: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
        scaled: dict[str, Any] = {name: small * np.array(load[name]) for name in load}
        state = nf.solve(robot, nf.Load(tension=0.0, **scaled))
        assert state.converged
        turn = state.tip_rotation
        vector = 0.5 * np.array(
            [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        )
        return (state.tip_position - [0.0, 0.0, LENGTH]) / small, vector / small

    rigidity = MODULUS * SECOND
    for axis, sign in ((0, 1.0), (1, -1.0)):
        force = np.eye(3)[axis]
        moved, turned = tip(tip_force=tuple(force))
        assert moved[axis] == pytest.approx(LENGTH**3 / (3.0 * rigidity), rel=1e-6)
        assert turned[1 - axis] == pytest.approx(sign * LENGTH**2 / (2.0 * rigidity), rel=1e-6)
        moved, turned = tip(tip_moment=tuple(np.eye(3)[1 - axis]))
        assert turned[1 - axis] == pytest.approx(LENGTH / rigidity, rel=1e-6)
        assert moved[axis] == pytest.approx(sign * LENGTH**2 / (2.0 * rigidity), rel=1e-6)
    moved, _ = tip(tip_force=(0.0, 0.0, 1.0))
    assert moved[2] == pytest.approx(LENGTH / (MODULUS * AREA), rel=1e-6)
    _, turned = tip(tip_moment=(0.0, 0.0, 1.0))
    assert turned[2] == pytest.approx(LENGTH / (2.0 * SHEAR * SECOND), rel=1e-6)


def test_coupled_stiffness_against_its_inverse():
    random = np.random.default_rng(3)
    size = np.array([40.0, 25.0, 30.0, 9.0, 12.0, 80.0])
    part = random.uniform(-1.0, 1.0, (6, 6))
    matrix = np.sqrt(np.outer(size, size)) * (np.eye(6) + 0.15 * (part + part.T))
    np.linalg.cholesky(matrix)
    offset, length, small = 0.3, 5.0, 1e-5
    notch = nf.TableNotch(
        length, stiffness=tuple(matrix.ravel()), uncut_length=0.0, axis_offset=offset
    )
    robot = robot_of(notch)
    for direction in range(6):
        wrench = small * np.eye(6)[direction]  # about the tip and along the axes of the base
        state = nf.solve(
            robot,
            nf.Load(tension=0.0, tip_moment=tuple(wrench[:3]), tip_force=tuple(wrench[3:])),
        )
        assert state.converged
        # About the middle of the neutral axis, which lies on the side away from the bend.
        middle = np.array([-offset, 0.0, 0.5 * length])
        arm = np.array([0.0, 0.0, length]) - middle
        moment = wrench[:3] + np.cross(arm, wrench[3:])
        motion = np.linalg.solve(matrix, np.concatenate([moment, wrench[3:]]))
        expected = motion[3:] + np.cross(motion[:3], arm)
        got = state.tip_position - [0.0, 0.0, length]
        np.testing.assert_allclose(got, expected, atol=2e-5 * small, rtol=1e-4)
        energy = 0.5 * wrench @ np.concatenate([motion[:3], expected])
        assert state.stored_energy == pytest.approx(energy, rel=1e-4)


def test_rigid_directions_do_not_give_way():
    notch = nf.TableNotch(2.0, (10.0,), (1.0,), uncut_length=1.0)
    state = nf.solve(robot_of(notch), nf.Load(tension=0.0, tip_force=(0.0, 0.3, -0.2)))
    np.testing.assert_allclose(state.tip_position, [0.0, 0.0, 3.0], atol=1e-12)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "`notch[1].angle_deg` is missing"),
        ({"angle_deg": (1.0, 2.0), "moment": (2.0, 1.0)}, "moments must have the signs"),
        ({"angle_deg": (-1.0, 2.0), "moment": (1.0, 1.0)}, "moments must have the signs"),
        ({"angle_deg": (1.0, 2.0), "moment": (1.0,)}, "has 1 numbers and `angle_deg` 2"),
        ({"angle_deg": (2.0, 1.0), "moment": (1.0, 2.0)}, "angles must rise"),
        ({"angle_deg": (0.0,), "moment": (0.0,)}, "one is not 0"),
        ({"stiffness": (1.0,) * 7}, "has 7 numbers"),
        ({"stiffness": (1.0,) * 36}, "is not positive"),
        ({"stiffness": (float("nan"),) * 36}, "is not positive"),
        ({"stiffness": (1.0, float("inf"), 1.0, 1.0, 1.0, 1.0)}, "is not positive"),
        ({"file": "a.csv"}, "`notch[1].file` is taken from robot files"),
        ({"stiffness": (1.0,) * 6, "closing_angle_deg": 3.0, "precurvature_deg": 4.0}, "less than"),
    ],
)
def test_bad_tables_are_refused(values: dict[str, object], words: str):
    with pytest.raises(nf.InputError) as caught:
        robot_of({"kind": "table", "length": 1.0, "uncut_length": 1.0, **values})  # pyright: ignore
    assert words in str(caught.value)


def test_numbers_of_a_table_vary_and_differentiate():
    table = nf.TableNotch(
        1.2, (5.0, 12.0, 30.0), (1.0, 1.7, 3.5), uncut_length=1.0, axis_offset=0.2, repeat=3
    )
    robot = robot_of(table, friction=nf.Capstan(0.1))
    load = nf.Load(tension=1.5, tip_force=(0.02, 0.0, 0.0))
    names = ["notch[2].length", "notch.axis_offset", "notch[3].stiffness_factor"]
    slopes = nf.solve(robot, load).path.jacobian(names, "total_angle")["total_angle"][0]
    for name, slope in zip(names, slopes, strict=True):
        value = {"notch[2].length": 1.2, "notch.axis_offset": 0.2}.get(name, 1.0)
        ends = [
            nf.solve(robot.with_value(name, value * part), load).total_angle
            for part in (0.9999, 1.0001)
        ]
        assert (ends[1] - ends[0]) / (2e-4 * value) == pytest.approx(slope, rel=1e-5, abs=1e-9)
    factors = np.linspace(0.9, 1.1, 7)
    many = nf.batch(robot, {"notch[3].stiffness_factor": factors}, load)["total_angle"]
    each = [
        nf.solve(robot.with_value("notch[3].stiffness_factor", factor), load).total_angle
        for factor in factors.tolist()
    ]
    np.testing.assert_allclose(many, each, rtol=0.0, atol=1e-13)


def test_unknown_strains_do_not_enter_slopes_of_other_quantities():
    arc = nf.ArcNotch("on-axis", depth=1.38, height=0.8, uncut_length=1.2)
    table = nf.TableNotch(0.8, angle_deg=(40.0,), moment=(2.0,), uncut_length=1.2)
    fatigue = nf.Fatigue(line="pelton2003", corner_radius=0.05)
    robot, load = robot_of(table, arc, arc, fatigue=fatigue), [nf.Load(0.5), nf.Load(2.5)]
    path = nf.simulate(robot, load)
    # The table has no strains, and the line ends before the arcs at the second load.
    assert np.isnan(path.fatigue_margin[:, 0]).all()
    assert np.isnan(path.peak_strain).tolist() == [[True, False, False]] * 2
    assert np.isfinite(path.fatigue_margin[0, 1:]).all()
    assert np.isnan(path.fatigue_margin[1, 1:]).all()
    unknown = "peak_strain", "outer_strain", "fatigue_margin", "base_stroke", "base_tension"
    depth = "notch[2].depth"
    slope = path.jacobian(depth, "total_angle")["total_angle"][:, 0]
    assert np.abs(slope).min() > 0.05
    weights = {"total_angle": [0.0, 1.0]} | dict.fromkeys(unknown, 0.0)
    assert path.gradient(weights)[depth] == pytest.approx(slope[1], rel=1e-10)
    function = nf.differentiable(robot, load, [depth], outputs=("total_angle", *unknown))

    def last(value: Any) -> Any:
        return function({depth: value})["total_angle"][-1]

    values = jax.numpy.array([1.38, 1.38])
    np.testing.assert_allclose(jax.vmap(jax.grad(last))(values), slope[1], rtol=1e-10)
