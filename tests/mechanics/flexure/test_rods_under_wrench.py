"""One rod alone under a force and a moment at its end, against beams solved by other means.

The balance of the modes (internal forces = those of the wrench on the distal body) is solved by a
Newton iteration of NumPy, for all rows of a table at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.mechanics.flexure import Rod, flexure_state, relative_pose, rod, with_level
from notchflex.mechanics.flexure.strip import strip_rod
from notchflex.mechanics.flexure.u_link import CurvedEnd, u_link_rod
from notchflex.mechanics.material import SectionLaw, section_law
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from reference_data import choose, reference

LIU, STRIP = nf.Tube(10.0, 6.0), nf.StripNotch(height=3.5, strip_thickness=1.5, depth=6.9)
NYLON, LENGTH = section_law(nf.Linear(1000.406)), 8.0
BENDING_STIFFNESS = 1000.406 * 4.0 * 1.5**3 / 12.0
GAO, NITINOL = nf.Tube(5.99, 4.0), section_law(nf.Linear(22000.0, poisson_ratio=0.33))
LINK_START, LINK_HEADING = np.array([-1.537941127075, -0.4875]), 0.4946425904173


def balanced(
    shape: Rod,
    law: SectionLaw,
    point: np.ndarray,
    force: np.ndarray,
    moment: np.ndarray,
    following: np.ndarray | None = None,
    steps: int = 1,
) -> np.ndarray:
    """Modes under forces at a point of the distal body (in its frame), one row per load."""

    def out_of_balance(modes: Any, force: Any, moment: Any, follows: Any) -> Any:
        state = flexure_state(shape, law, (), modes, with_pose=True)
        turned = state.pose.rotation.T
        inside = jnp.where(follows, force, turned @ force)
        wrench = jnp.concatenate([turned @ moment + jnp.cross(point, inside), inside])
        return state.internal - state.twist.T @ wrench

    rows, count = len(force), shape.modes
    follows = np.zeros(rows, bool) if following is None else following
    once = jax.jit(jax.vmap(out_of_balance))
    # Differences in every mode beside the residual, in one batch.
    shifts = 1e-6 * np.concatenate([np.zeros((1, count)), np.eye(count), -np.eye(count)])

    def residual_and_slope(modes: np.ndarray, part: float) -> tuple[np.ndarray, np.ndarray]:
        loads = (part * force, part * moment, follows)
        every = [np.repeat(load, len(shifts), axis=0) for load in loads]
        tried = (modes[:, None] + shifts).reshape(-1, count)
        out = np.asarray(once(tried, *every)).reshape(rows, len(shifts), count)
        slope = (out[:, 1 : count + 1] - out[:, count + 1 :]) / 2e-6
        return out[:, 0], np.swapaxes(slope, 1, 2)

    modes = np.zeros((rows, count))
    for part in np.arange(1, steps + 1) / steps:
        for _ in range(20):
            out, slope = residual_and_slope(modes, part)
            change = np.linalg.solve(slope, out[..., None])[..., 0]
            modes = modes - change
            if np.max(np.abs(change)) < 1e-12:
                break
        else:
            raise AssertionError(f"no balance, last change {np.max(np.abs(change)):.1e}")
    return modes


def poses(shape: Rod, modes: np.ndarray) -> Motion:
    return jax.tree.map(np.asarray, jax.jit(jax.vmap(lambda row: relative_pose(shape, row)))(modes))


# ------------------------------------------------------------------------------------- strips


def strip_errors(table: np.ndarray, shape: Rod, steps: int) -> np.ndarray:
    """Errors of slope, X, Y (over the length) and chord for every row of the beam table."""
    shape, free_end = with_level(shape, "plane"), np.array([0.5 * LENGTH, 0.0, 0.0])
    angle = np.radians(table[:, 1])
    size = table[:, 2] * BENDING_STIFFNESS / LENGTH**2
    # The angle counts from the direction opposite to the force to the strip, which lies along x
    # and bends toward -z.
    force = -size[:, None] * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=-1)
    modes = balanced(shape, NYLON, free_end, force, np.zeros_like(force), table[:, 0] == 1.0, steps)
    found = poses(shape, modes)
    end = found.rotation @ free_end + found.translation
    x, y = (end[:, 0] + 0.5 * LENGTH) / LENGTH, (STRIP.height - end[:, 2]) / LENGTH
    slope = np.arctan2(found.rotation[:, 0, 2], found.rotation[:, 2, 2])
    return np.abs(np.stack([slope, x, y, np.arctan2(y, x)], axis=-1) - table[:, 3:])


@pytest.mark.nightly
def test_strip_converges_with_its_modes(margin):
    table = reference("liu_single_beam.csv")
    worst = []
    for modes, nodes in ((2, 6), (4, 10), (6, 16), (8, 20), (10, 24)):
        errors = strip_errors(table, strip_rod(STRIP, LIU, modes, nodes), steps=6)
        told = [
            f"up to F l²/EI = {most:g}: {errors[table[:, 2] <= most].max():.1e}"
            for most in (0.5, 1.0, 2.0, 5.0, 10.0)
        ]
        margin.note(f"{modes} modes, {nodes} nodes, {', '.join(told)}")
        worst.append(errors.max())
    assert np.all(np.diff(worst) < 0.0)
    margin.within("10 modes, every load", worst[-1], 1e-8)


def test_strip_by_default(margin):
    # The first strip of Liu's robot has F l²/EI = 0.57 at 10 N.
    table = reference("liu_single_beam.csv")
    table = table[table[:, 2] <= 0.5]
    margin.within("default modes", strip_errors(table, rod(STRIP, LIU), steps=1), 2e-8)


def test_small_deflection_is_the_linear_beam(margin):
    table = choose(reference("liu_single_beam.csv"), mode=(0, 0), angle=(1, 90))
    table = table[table[:, 2] <= 5.0]
    load = table[:, 2]
    linear = [0.5 * load, np.ones_like(load), load / 3.0, np.arctan2(load / 3.0, 1.0)]
    table[:, 3:] = np.stack(linear, axis=-1)
    small = nf.StripNotch(3.5, 1.5, 6.9, deflection="small")
    margin.within("all", strip_errors(table, rod(small, LIU), steps=1), 1e-11)


@pytest.mark.parametrize("direction", [0.0, 90.0, 217.0])
def test_free_strip_holds_the_next_body_straight(direction):
    notch = nf.StripNotch(3.5, 1.5, 6.9, direction_deg=direction)
    free = rod(notch, LIU)
    pose = relative_pose(free, np.zeros(free.modes))
    np.testing.assert_allclose(pose.rotation, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(pose.translation, [0.0, 0.0, 3.5], atol=1e-14)


def test_strip_out_of_the_plane(margin):
    # By statics: torque along the strip over G J, moment about the tube over E I strong.
    size = 1e-3
    found = poses(
        rod(STRIP, LIU),
        balanced(rod(STRIP, LIU), NYLON, np.zeros(3), np.zeros((2, 3)), size * np.eye(3)[[0, 2]]),
    )
    modulus, ratio = 1000.406, 2.0 * 1.33
    torsion = float(rod(STRIP, LIU).section.torsion_constant[0])
    wanted = [size * LENGTH * ratio / (modulus * torsion), size * LENGTH / (modulus * 98.0)]
    turns = [found.rotation[0, 2, 1], found.rotation[1, 1, 0]]
    margin.within("turns, relative", np.divide(turns, wanted) - 1.0, 1e-10)


# ------------------------------------------------------------------------------------ U-links


def link_errors(side: str, build: Callable[[nf.ULink], Rod]) -> tuple[np.ndarray, np.ndarray]:
    """Errors of (y, z, heading) and of the base moment, as a part of the greatest, in each row."""
    table = reference("gao_single_link.csv")
    hand = 1.0 if side == "away" else -1.0  # Gao's y is our -x; the other slot's link is mirrored
    shape = with_level(build(nf.ULink(0.275, 0.70, 2.0, side)), "plane")
    upper_edge = 2.0 * 0.275 + 0.70
    start = np.array([-hand * LINK_START[0], 0.0, LINK_START[1] + upper_edge])
    np.testing.assert_allclose(shape.start_offset, start, atol=1e-12)
    # The loads act at the end of the link, which half a turn about its middle takes to its start.
    point = np.array([-start[0], 0.0, start[2] + 0.275 - 2.0 * 0.275])
    n_y, n_z, base = table[:, :3].T
    none = 0.0 * n_y
    force = np.stack([-hand * n_y, none, n_z], axis=-1)
    moment = np.stack([none, hand * table[:, 6], none], axis=-1)
    found = poses(shape, balanced(shape, NITINOL, point, force, moment))
    end = found.rotation @ point + found.translation
    turn = hand * np.arctan2(found.rotation[:, 0, 2], found.rotation[:, 2, 2])
    at = np.stack([-hand * end[:, 0], end[:, 2] - upper_edge, turn + LINK_HEADING], axis=-1)
    lever = at[:, :2] - LINK_START
    moment_at_base = table[:, 6] + lever[:, 0] * n_z - lever[:, 1] * n_y
    return at - table[:, 3:6], (moment_at_base - base) / np.abs(table[:, 6]).max()


@pytest.mark.parametrize("side", ["away", "toward"])
def test_link_by_default(side, margin):
    pose, moment = link_errors(side, lambda notch: rod(notch, GAO))
    margin.within(f"{side}, pose", pose, 3e-6, "mm, rad")
    margin.within(f"{side}, moment, relative", moment, 3e-6)


@pytest.mark.nightly
def test_link_converges_with_its_modes(margin):
    pose, moment = link_errors("away", lambda notch: u_link_rod(notch, GAO, 4, 2, (6, 4)))
    margin.note(f"4 moment modes and 2 pairs of force modes: {np.abs(pose).max():.1e} mm, rad")
    pose, moment = link_errors("away", lambda notch: u_link_rod(notch, GAO, 6, 3, (12, 8)))
    margin.within("6 + 6 modes, pose", pose, 2e-8, "mm, rad")
    margin.within("6 + 6 modes, moment, relative", moment, 2e-8)


def test_shape_of_force_modes_hardly_needs_the_poisson_ratio(margin):
    pose, _ = link_errors("away", lambda notch: u_link_rod(notch, GAO, poisson_ratio=0.45))
    margin.within("modes for 0.45 instead of 0.33", pose, 3e-6, "mm, rad")


@pytest.mark.parametrize("side", ["away", "toward"])
@pytest.mark.parametrize("direction", [0.0, 217.0])
def test_free_link_holds_the_next_body_straight(direction, side):
    shape = rod(nf.ULink(0.275, 0.70, 2.0, side, direction_deg=direction), GAO)
    pose = relative_pose(shape, np.zeros(9))
    np.testing.assert_allclose(pose.rotation, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(pose.translation, [0.0, 0.0, 0.55], atol=1e-14)


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
