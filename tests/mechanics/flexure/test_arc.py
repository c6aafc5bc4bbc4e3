"""The arc notch: Pacheco's kinematics follow from the rod, and are no formulas of their own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import legvander
from scipy.integrate import cumulative_simpson
from scipy.linalg import expm

import notchflex as nf
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.flexure import Rod, relative_pose, rod, with_level
from notchflex.mechanics.motion import Motion

GAUSS = np.polynomial.legendre.leggauss(7)[0]
TUBE = nf.Tube(1.62, 1.40)


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


def exponential(twist: np.ndarray) -> Motion:
    """Motion by following a constant twist (angular, linear), by SciPy's matrix exponential."""
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = np.cross(twist[:3], np.eye(3)).T  # its columns are angular x e_i
    matrix[:3, 3] = twist[3:]
    moved = expm(matrix)
    return Motion(moved[:3, :3], moved[:3, 3])  # pyright: ignore[reportArgumentType]


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


@pytest.mark.parametrize("theta", [0.0, 0.5, -0.3])
@pytest.mark.parametrize("direction", [0.0, 217.0])
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
