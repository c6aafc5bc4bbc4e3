"""One rod alone under a force and a moment at its end, against beams solved by other means.

The balance of the modes (internal forces = those of the wrench on the distal body) is solved by a
Newton iteration of NumPy, for all rows of a table at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.mechanics.flexure import Rod, flexure_state, relative_pose, rod, with_level
from notchflex.mechanics.flexure.u_link import CurvedEnd, u_link_rod
from notchflex.mechanics.material import section_law
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from reference_data import reference

GAO, NITINOL = nf.Tube(5.99, 4.0), section_law(nf.Linear(22000.0, poisson_ratio=0.33))
LINK_START, LINK_HEADING = np.array([-1.537941127075, -0.4875]), 0.4946425904173


def balanced(shape: Rod, point: np.ndarray, force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Modes under forces at a point of the distal body (in its frame), one row per load."""

    def out_of_balance(modes: Any, force: Any, moment: Any) -> Any:
        state = flexure_state(shape, NITINOL, (), modes, with_pose=True)
        turned = state.pose.rotation.T
        inside = turned @ force
        wrench = jnp.concatenate([turned @ moment + jnp.cross(point, inside), inside])
        return state.internal - state.twist.T @ wrench

    residual, count = jax.jit(jax.vmap(out_of_balance)), shape.modes
    # Differences in every mode beside the residual, in one batch: quicker to compile than slopes.
    shifts = 1e-6 * np.concatenate([np.zeros((1, count)), np.eye(count), -np.eye(count)])
    loads = [np.repeat(load, len(shifts), axis=0) for load in (force, moment)]
    modes = np.zeros((len(force), count))
    for _ in range(20):
        tried = (modes[:, None] + shifts).reshape(-1, count)
        out = np.asarray(residual(tried, *loads)).reshape(len(force), len(shifts), count)
        slope = np.swapaxes(out[:, 1 : count + 1] - out[:, count + 1 :], 1, 2) / 2e-6
        change = np.linalg.solve(slope, out[:, 0, :, None])[..., 0]
        modes = modes - change
        if np.max(np.abs(change)) < 1e-12:
            return modes
    raise AssertionError(f"no balance, last change {np.max(np.abs(change)):.1e}")


def poses(shape: Rod, modes: np.ndarray) -> Motion:
    return jax.tree.map(np.asarray, jax.jit(jax.vmap(lambda row: relative_pose(shape, row)))(modes))


def link_errors(side: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors of (y, z, heading) and of the base moment, as a part of the greatest, in each row."""
    table = reference("gao_single_link.csv")
    hand = 1.0 if side == "away" else -1.0  # Gao's y is our -x; the other slot's link is mirrored
    shape = with_level(rod(nf.ULink(0.275, 0.70, 2.0, side), GAO), "plane")
    upper_edge = 2.0 * 0.275 + 0.70
    start = np.array([-hand * LINK_START[0], 0.0, LINK_START[1] + upper_edge])
    np.testing.assert_allclose(shape.start_offset, start, atol=1e-12)
    # The loads act at the end of the link, which half a turn about its middle takes to its start.
    point = np.array([-start[0], 0.0, start[2] + 0.275 - 2.0 * 0.275])
    n_y, n_z, base = table[:, :3].T
    none = 0.0 * n_y
    force = np.stack([-hand * n_y, none, n_z], axis=-1)
    moment = np.stack([none, hand * table[:, 6], none], axis=-1)
    found = poses(shape, balanced(shape, point, force, moment))
    end = found.rotation @ point + found.translation
    turn = hand * np.arctan2(found.rotation[:, 0, 2], found.rotation[:, 2, 2])
    at = np.stack([-hand * end[:, 0], end[:, 2] - upper_edge, turn + LINK_HEADING], axis=-1)
    lever = at[:, :2] - LINK_START
    moment_at_base = table[:, 6] + lever[:, 0] * n_z - lever[:, 1] * n_y
    return at - table[:, 3:6], (moment_at_base - base) / np.abs(table[:, 6]).max()


@pytest.mark.parametrize("side", ["away", "toward"])
def test_link_by_default(side, margin):
    pose, moment = link_errors(side)
    margin.within(f"{side}, pose", pose, 3e-6, "mm, rad")
    margin.within(f"{side}, moment, relative", moment, 3e-6)


def flexibility(side: str, nodes: int = 60) -> np.ndarray:
    """Twist of the distal body per wrench on it for small loads, by Castigliano's theorem.

    From the points and thicknesses of the curved end and of the straight part themselves, over
    the curve's own parameters.
    """
    end = CurvedEnd(0.275, 0.70)
    points, weights = np.polynomial.legendre.leggauss(nodes)
    t = 0.5 * (1.0 + points)
    speed = np.linalg.norm(end._first_derivative(t), axis=-1)
    corner = end.middle(t) - np.array([1.0, 0.275 + 0.35])
    straight = np.stack([points, 0.0 * points], axis=-1)
    y_z = np.concatenate([corner, straight, -corner])
    heading = np.concatenate([end.heading(t), 0.0 * t, end.heading(t)])
    thick = np.concatenate([end.thickness(t), np.full(nodes, 0.70), end.thickness(t)])
    length = np.concatenate([0.5 * weights * speed, weights, 0.5 * weights * speed])
    hand = 1.0 if side == "away" else -1.0
    total = np.zeros((6, 6))
    whole = length.sum()
    for (y, z), psi, h, ds in zip(y_z, heading, thick, length, strict=True):
        outer, inner = np.sqrt(2.995**2 - y**2), np.sqrt(4.0 - y**2)
        b, c = outer - inner, 0.5 * (outer + inner)
        torsion = clamped_torsion_constant(two_walls(b, h, c), c, whole, 0.33)
        shear = 22000.0 / 2.66
        stiffness = [
            22000.0 * 2.0 * (h * b**3 / 12.0 + b * h * c**2),
            22000.0 * 2.0 * b * h**3 / 12.0,
            shear * torsion,
            shear * 2.0 * b * h,
            shear * 2.0 * b * h,
            22000.0 * 2.0 * b * h,
        ]
        along = np.array([-hand * np.cos(psi), 0.0, np.sin(psi)])
        across = np.cross([0.0, 1.0, 0.0], along)
        axes = np.stack([across, [0.0, 1.0, 0.0], along])  # rows
        # From the middle of the strip, which lies half its thickness above the body's frame.
        away = -np.array([-hand * y, 0.0, z + 0.35])
        lever = np.array([[0, -away[2], away[1]], [away[2], 0, -away[0]], [-away[1], away[0], 0]])
        resultants = np.block([[axes, axes @ lever], [np.zeros((3, 3)), axes]])
        total += ds * resultants.T @ np.diag(1.0 / np.asarray(stiffness, float)) @ resultants
    return total


@pytest.mark.parametrize("side", ["away", "toward"])
def test_link_is_flexible_in_all_directions_as_castigliano_has_it(side, margin):
    # Nodes enough for the modes to show that they are exact; the default ones give 4e-6.
    shape = u_link_rod(nf.ULink(0.275, 0.70, 2.0, side), GAO, nodes=(12, 8))

    def internal(modes: jax.Array) -> tuple[jax.Array, jax.Array]:
        state = flexure_state(shape, NITINOL, (), modes, with_pose=True)
        return state.internal, state.twist

    stiffness, twist = jax.jit(jax.jacfwd(internal, has_aux=True))(np.zeros(9))
    found, wanted = twist @ np.linalg.solve(stiffness, twist.T), flexibility(side)
    scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    margin.within("relative", (found - wanted) / scale, 1e-7)
