"""The arc notch: Pacheco's kinematics follow from the rod, and are no formulas of their own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import legvander
from scipy.integrate import cumulative_simpson

import notchflex as nf
from notchflex._jax import jax
from notchflex.mechanics.contact import SpineContact
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.flexure import Rod, fibre_stretch, relative_pose, rod, with_level
from notchflex.mechanics.flexure import flexure_state as plain_flexure_state
from notchflex.mechanics.material import section_law
from notchflex.mechanics.motion import Motion
from twists import exponential

flexure_state = jax.jit(plain_flexure_state, static_argnames="with_pose")

GAUSS = np.polynomial.legendre.leggauss(7)[0]
TUBE = nf.Tube(1.62, 1.40)
LAW = section_law(nf.Linear(10000.0))


def notch(direction: float = 0.0, precurvature: float = 0.0) -> nf.ArcNotch:
    return nf.ArcNotch(
        "on-axis",
        1.40,
        0.8,
        uncut_length=1.2,
        direction_deg=direction,
        precurvature_deg=precurvature,
    )


def under_tendons(direction: float = 0.0, precurvature: float = 0.0) -> Rod:
    """The rod with the one mode that a tendon asks for."""
    return with_level(rod(notch(direction, precurvature), TUBE), "tendons")


def pose_and_twist(shape: Rod, modes: np.ndarray) -> tuple[Motion, np.ndarray]:
    state = flexure_state(shape, LAW, (), modes, with_pose=True)
    return state.pose, np.asarray(state.twist)


def lip_gap(shape: Rod, theta: float) -> float:
    state = flexure_state(shape, LAW, (), np.array([theta]), with_pose=False)
    ones, across = np.ones(1), np.asarray(shape.closure)[None]
    natural = fibre_stretch(across) @ (shape.length @ shape.reference_strain)
    return float(SpineContact(ones, ones, natural, across).cross(shape, state, None).gap[0])


def pacheco_notch(theta: float, centroid: float, height: float = 0.8) -> np.ndarray:
    """Transform of a notch at the tube axis, Pacheco 2021 eq. 1 with s = h - ybar theta."""
    along = height - centroid * theta
    turned = np.eye(4)
    c, s = np.cos(theta), np.sin(theta)
    turned[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    bow = 2 * np.sin(theta / 2) ** 2 / theta if theta else 0.0
    reach = s / theta if theta else 1.0
    turned[:3, 3] = [along * bow, 0.0, along * reach]
    return turned


@pytest.mark.parametrize("theta", [0.0, 1e-7, 0.1, 0.5, -0.3])
@pytest.mark.parametrize("direction", [0.0, 90.0, 217.0])
def test_pose_is_eq_1(theta: float, direction: float) -> None:
    shape = under_tendons(direction)
    pose = relative_pose(shape, np.array([theta]))
    expected = pacheco_notch(theta, float(shape.end_offset[0]))
    angle = np.radians(direction)
    about = np.eye(4)
    about[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    expected = about @ expected @ about.T
    np.testing.assert_allclose(pose.rotation, expected[:3, :3], atol=1e-15)
    np.testing.assert_allclose(pose.translation, expected[:3, 3], atol=1e-15)


def test_lips_meet_at_the_closing_angle() -> None:
    shape = under_tendons()
    closing = 0.8 / (0.81 + float(shape.end_offset[0]))
    assert lip_gap(shape, closing) == pytest.approx(0.0, abs=1e-15)
    # The gap is the distance of the lips, found again from the pose of the distal body.
    theta = 0.2
    pose = relative_pose(shape, np.array([theta]))
    lip = np.array([0.81, 0.0, 0.0])
    chord = float(np.linalg.norm(pose.point(lip) - lip))
    arc = chord * (theta / 2) / np.sin(theta / 2)
    assert lip_gap(shape, theta) == pytest.approx(arc, rel=1e-12)


def test_precurvature_is_there_without_moment() -> None:
    shape = under_tendons(precurvature=5.0)
    state = flexure_state(shape, LAW, (), np.zeros(1), with_pose=False)
    assert float(state.bend[1]) == pytest.approx(np.radians(5.0))
    np.testing.assert_array_equal(state.internal, 0.0)


def test_moment_is_stiffness_times_elastic_angle() -> None:
    shape = under_tendons(precurvature=5.0)
    state = flexure_state(shape, LAW, (), np.array([0.1]), with_pose=False)
    expected = 10000.0 * 5.816412685e-4 / 0.8 * 0.1
    assert float(state.internal[0]) == pytest.approx(expected, rel=1e-9)


def test_twist_is_the_finite_difference_of_the_pose() -> None:
    shape = under_tendons(40.0)
    modes, step = np.array([0.3]), 1e-6
    pose, twist = pose_and_twist(shape, modes)
    ahead, behind = (relative_pose(shape, modes + sign * step) for sign in (1, -1))
    turning = np.asarray(pose.rotation).T @ (ahead.rotation - behind.rotation) / (2 * step)
    moving = np.asarray(pose.rotation).T @ (ahead.translation - behind.translation) / (2 * step)
    np.testing.assert_allclose(
        twist[:, 0], [turning[2, 1], turning[0, 2], turning[1, 0], *moving], atol=1e-9
    )


def test_twist_of_all_modes_is_the_finite_difference_of_the_pose() -> None:
    shape = rod(notch(40.0, 3.0), TUBE, refinement=1)
    modes, step = 0.2 * np.cos(np.arange(shape.modes)), 1e-6
    pose, twist = pose_and_twist(shape, modes)
    for mode in range(shape.modes):
        by = step * np.eye(shape.modes)[mode]
        ahead, behind = (relative_pose(shape, modes + sign * by) for sign in (1, -1))
        turning = np.asarray(pose.rotation).T @ (ahead.rotation - behind.rotation) / (2 * step)
        moving = np.asarray(pose.rotation).T @ (ahead.translation - behind.translation) / (2 * step)
        np.testing.assert_allclose(
            twist[:, mode], [turning[2, 1], turning[0, 2], turning[1, 0], *moving], atol=1e-9
        )


def test_pose_of_changing_strain_is_that_of_many_short_pieces() -> None:
    # Magnus's series against a product of exponentials of the strain in the middle of 2,000 pieces.
    shape = rod(notch(0.0, 4.0), TUBE)
    modes = np.array([0.35, 0.12, 0.1, -0.07, 0.15])
    height, pieces = 0.8, 2000
    pose = Motion(shape.start_rotation, shape.start_offset)
    middle = (np.arange(pieces) + 0.5) / pieces * 2.0 - 1.0
    nodes = legvander(GAUSS, 1)
    even, linear = np.einsum("pn,ncm->pcm", np.linalg.pinv(nodes), shape.basis)
    for place in middle:
        basis = even + linear * place
        strain = shape.reference_strain[0] + basis @ modes
        pose = pose.then(exponential(height / pieces * strain))
    pose = pose.then(Motion(shape.end_rotation, shape.end_offset))
    found = relative_pose(shape, modes)
    np.testing.assert_allclose(found.rotation, pose.rotation, atol=3e-8)
    np.testing.assert_allclose(found.translation, pose.translation, atol=3e-8)


def test_fibre_stretch_is_pachecos_wall_arc() -> None:
    shape = under_tendons()
    arm, theta = 0.70 + float(shape.end_offset[0]), 0.25
    strain = shape.reference_strain + shape.basis @ np.array([theta])
    length = shape.length @ strain @ np.asarray(fibre_stretch(np.array([arm, 0.0])))
    assert float(length) == pytest.approx(0.8 - theta * arm, rel=1e-14)


def pulled_by_a_straight_tendon(tension: float, arm: float, height: float = 0.8) -> float:
    """Angle of one notch whose tendon spans the gap straight: its arm changes along the notch.

    Curvature is moment over stiffness at 2,001 points of the neutral axis, found by repetition.
    """
    cut = SECTION_OF_CUT["on-axis"](0.81, 0.70, 1.40)
    ybar, stiffness = float(cut.centroid), 10000.0 * float(cut.second_moment_weak)
    along = np.linspace(0.0, height, 2001)
    curvature = np.zeros_like(along)
    for _ in range(200):
        angle = cumulative_simpson(curvature, x=along, initial=0)
        x = cumulative_simpson(np.sin(angle), x=along, initial=0) - ybar
        z = cumulative_simpson(np.cos(angle), x=along, initial=0)
        end = angle[-1]
        edge = np.array([x[-1], z[-1]]) + (arm + ybar) * np.array([np.cos(end), -np.sin(end)])
        pull = np.array([arm, 0.0]) - edge
        pull *= tension / np.hypot(*pull)
        moment = np.abs((edge[0] - x) * pull[1] - (edge[1] - z) * pull[0])
        curvature = 0.5 * (curvature + moment / stiffness)
    return float(angle[-1])


@pytest.mark.parametrize(("refinement", "within"), [(0, 2e-5), (1, 1e-10)])
def test_refinement_adds_modes_under_a_straight_tendon(refinement: int, within: float) -> None:
    # One mode is exact for a constant arm only: it misses by 8.2e-6 rad at 1.4 N, three by 1.7e-11.
    robot = nf.Robot(
        name="one notch",
        tube=TUBE,
        notch=(notch(),),
        tendon=(nf.Tendon(radius=0.60, end_body=1, path="straight"),),
        material=nf.Linear(10000.0),
        friction=nf.Frictionless(),
    )
    state = nf.solve(robot, nf.Load(tension=1.4), refinement=refinement)
    assert abs(state.total_angle - pulled_by_a_straight_tendon(1.4, 0.60)) < within


def test_nothing_else_is_a_notch() -> None:
    with pytest.raises(TypeError, match=r"rod\.register"):
        rod(nf.Frictionless(), TUBE)
