"""The stiffness put together flexure by flexure against dense differentiation of the balance."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import notchflex as nf
from notchflex.loads.command import make_commands
from notchflex.results.path import path_warnings
from notchflex.solver.held_stiffness import held_stiffness
from oracles.held_stiffness import held_stiffness as dense

WRIST = nf.load_robot("pacheco2021-a")


def pushed(
    robot: nf.Robot, *forces: tuple[float, float, float], tension: float = 0.0
) -> nf.EquilibriumPath:
    pull = (tension,) + (0.0,) * (robot.number_of_tendons - 1)
    return nf.simulate(robot, [nf.Load(tension=pull, tip_force=one) for one in forces])


def two_by_stroke() -> nf.EquilibriumPath:
    load = nf.Load(tension=(1.0, None, 0.2, None), stroke=(None, 0.3, None, 0.0))
    return nf.simulate(nf.load_robot("two-axis-wrist"), load)


CASES = {
    "wrist in space": lambda: pushed(WRIST, (0.02, 0.0, 0.0), (0.02, 0.03, 0.0), tension=0.8),
    "strips": lambda: nf.simulate(nf.load_robot("liu2022"), nf.pull(2.0, 6.0, steps=2).release()),
    "U-links, buckled": lambda: pushed(
        nf.load_robot("gao2017"), *((0.0, 0.0, -push) for push in (0.5, 1.0, 2.0, 3.0))
    ),
    "four tendons by tension": lambda: pushed(
        nf.load_robot("two-axis-wrist"), (0.02, 0.03, 0.0), tension=1.0
    ),
    "four tendons, two by stroke": two_by_stroke,
}


def by_the_oracle(path: nf.EquilibriumPath) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and sign of the determinant of every state."""
    loads = make_commands(path.load, path.robot, path.chain)
    own = np.flatnonzero(np.asarray(path.chain.rods.padding_mask).ravel() == 0.0)
    compiled = jax.jit(dense)
    found, signs = [], []
    for step in range(len(path)):
        one = jax.tree.map(
            lambda leaf, step=step: jnp.asarray(leaf)[step], (loads, path.run.solved)
        )
        stiffness, sign = compiled(path.chain, *one)
        found.append(np.asarray(stiffness)[own[:, None], own])
        signs.append(float(sign))
    return np.array(found), np.array(signs)


def held(path: nf.EquilibriumPath) -> np.ndarray:
    loads = make_commands(path.load, path.robot, path.chain)
    pieces = held_stiffness(path.prepared, loads, path.run.solved)
    return np.concatenate([stiffness for stiffness, _ in pieces])


@pytest.mark.nightly
@pytest.mark.parametrize("name", CASES)
def test_as_by_dense_differentiation(name, margin):
    path = CASES[name]()
    assert path.converged.all(), path.reason
    expected, sign = by_the_oracle(path)
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    margin.within("stiffness", (held(path) - expected) / scale, 1e-10)
    smallest = np.linalg.eigvals(expected).real.min(axis=-1)
    # Sliding along alike notches makes eigenvectors nearly parallel: the eigenvalues of such a
    # state are known to the root of the rounding error.
    normal = np.abs(expected - expected.swapaxes(1, 2)).max(axis=(1, 2)) < 1e4
    allowed = np.where(normal, 1e-9, 2e-3)
    margin.within("eigenvalue", (path.smallest_eigenvalue / smallest - 1.0) / allowed, 1.0)
    assert path.determinant_sign.tolist() == sign.tolist()
    assert path.stable.tolist() == ((smallest > 0.0) & (sign > 0.0)).tolist()


def test_a_tendon_without_tension_leaves_stability_as_it_is(margin):
    with_another = WRIST.replace(tendon=(*WRIST.tendon, WRIST.tendon[0]))
    alone, other = (
        pushed(robot, (0.02, 0.0, 0.0), tension=0.8)[0] for robot in (WRIST, with_another)
    )
    margin.within("eigenvalue", other.smallest_eigenvalue / alone.smallest_eigenvalue - 1.0, 1e-9)
    assert other.stable == alone.stable


@pytest.fixture(scope="module")
def held_at_thin_disks() -> nf.EquilibriumPath:
    """A tendon that does not stretch, held at both edges of disks without thickness.

    How two edges at one place share what they hold is not determined, and changes nothing else.
    """
    sides = (-20.0, -40.0, -60.0, -80.0)
    tendon = nf.Tendon(0.9, path="straight", disk_radius=(0.9,) * 4, disk_direction_deg=sides)
    gaps = (nf.RodGap(5.0, 0.6, uncut_length=0.0, repeat=4),)
    robot = nf.Robot("thin", nf.Tube(2.4, 0.6), gaps, (tendon,), nf.Linear(60e3), nf.Capstan(0.2))
    loads = [nf.Load(stroke=0.5, tip_moment=(0.0, moment, 0.0)) for moment in (0.0, 0.2, 0.1, -0.1)]
    path = nf.simulate(robot, loads)
    sticks = path.contact_state[1:, 0] == 0
    assert (sticks[:, 1:6:2] & sticks[:, 2:7:2]).any(), "no disk is held at both edges"
    return path


def test_the_stiffness_of_a_tendon_held_twice_at_one_place(held_at_thin_disks, margin):
    path = held_at_thin_disks
    assert path.stable.all()
    stretches = nf.simulate(path.robot.with_value("tendon.axial_stiffness", 1e8), path.load)
    ratio = stretches.smallest_eigenvalue / path.smallest_eigenvalue
    margin.within("eigenvalue", ratio - 1.0, 1e-6)


def test_slopes_where_a_tendon_is_held_twice_at_one_place(held_at_thin_disks, margin):
    path, name, value = held_at_thin_disks, "tendon[1].radius", 0.9
    slopes = path.jacobian([name], ["tip_position", "tension"])
    high, low = (
        nf.simulate(path.robot.with_value(name, value * (1.0 + part)), path.load)
        for part in (1e-6, -1e-6)
    )
    for quantity, slope in slopes.items():
        change = getattr(high, quantity) - getattr(low, quantity)
        margin.within(quantity, slope[..., 0] - change / (2e-6 * value), 1e-5)


@pytest.mark.nightly
@pytest.mark.parametrize("strokes", [[0.3, 0.3, 0.3, 0.3], [0.3001, 0.3, 0.3001, 0.3]])
def test_strokes_that_depend_on_each_other_fix_no_tensions(strokes):
    # The fourth stroke follows from three: 0.1 um more on two of them changes the tensions wholly.
    robot = nf.load_robot("two-axis-wrist")
    path = nf.simulate(robot, nf.Load(stroke=strokes))
    if not path.converged[0]:  # the singular system may also find none of the many answers
        allowed = {nf.Failure.STROKES_CONTRADICT.name, nf.Failure.NO_EQUILIBRIUM.name}
        assert set(path.reason_code) <= allowed
        return
    assert not path.stable.any()
    (warning,) = path_warnings(path)
    assert nf.Failure.INDETERMINATE_TENSIONS.text in warning
    assert "axial_stiffness" in warning


@pytest.mark.nightly
def test_tensions_are_determined_by_stretch_or_where_no_more_strokes_hold_than_are_independent():
    robot = nf.load_robot("two-axis-wrist")
    tendons = tuple(dataclasses.replace(one, axial_stiffness=500.0) for one in robot.tendon)
    elastic = dataclasses.replace(robot, tendon=tendons)
    loads = [nf.Load(stroke=[0.0] * 4), nf.Load(stroke=[0.3] * 4)]
    assert nf.simulate(elastic, loads).stable.all()
    loads = [nf.Load(stroke=[0.0] * 4), nf.Load(stroke=[0.4, 0.1, 0.4, 0.1])]
    assert nf.simulate(robot, loads).stable.all()
