"""Newton's condensed step against the dense step of JAX's derivative of the whole balance."""

from __future__ import annotations

import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.analysis.solve import prepare_for
from notchflex.loads.command import make_commands
from notchflex.loads.load_path import load_path
from notchflex.solver.linear_step import linear_step
from notchflex.solver.residual import (
    AUGMENTATION,
    Iterate,
    command_residual,
    evaluate,
    trial_log_ratio,
)

TIP = {"tip_force": (0.02, 0.0, -0.01), "tip_moment": (0.0, 0.05, 0.0)}
SIDE = {"tip_force": (0.02, 0.01, -0.01), "following": True, "gravity": (1.0, 2.0, 3.0)}
CASES = {
    "wrist by stroke": ("pacheco2021-a", nf.Load(stroke=1.0), 0.05),
    "wrist in space": ("pacheco2021-a", nf.Load(tension=1.0, **SIDE), 0.05),
    "strips": ("liu2022", nf.Load(tension=5.0), 0.02),
    "links, following": ("gao2017", nf.Load(tension=6.0, following=True, **TIP), 0.01),
    "two axes": ("two-axis-wrist", nf.Load(tension=[0.5, None, 0.2], stroke=[None, 0.1]), 0.05),
}


@pytest.mark.parametrize(
    "case",
    # The others take long to compile.
    [pytest.param(one, marks=[pytest.mark.nightly] * (one != "wrist by stroke")) for one in CASES],
)
def test_it_is_the_dense_step(case: str, margin) -> None:
    name, load, size = CASES[case]
    robot = nf.load_robot(name)
    if case.startswith("wrist in space"):
        robot = robot.with_value("material.density", 6450.0)
    path = load_path(load, robot.number_of_tendons)
    ready = prepare_for(robot, path)
    wanted = jax.tree.map(lambda leaf: leaf[0], make_commands(path, robot, ready.chain))
    # Any state will do, also one far from balance, as long as all forces are there.
    numbers, rest = np.random.default_rng(3), ready.rest
    flat, point_of = ravel_pytree(rest.point)
    at = point_of(flat + size * numbers.normal(size=flat.shape))
    at = at._replace(base_tension=1.0 + numbers.random(ready.chain.tendons))
    where, _ = ravel_pytree(at)

    def imbalance(varied: jax.Array) -> tuple[jax.Array, jax.Array]:
        """The imbalance, twice: `jacfwd` differentiates one and hands on the other."""
        point: Iterate = point_of(varied)
        found = evaluate(ready.chain, point, rest.memory, wanted.applied)
        demand = command_residual(ready.chain, wanted, None, found.base)
        left = ravel_pytree((found.residual, demand))[0]
        return left, left

    def yielding(point: Iterate) -> jax.Array:
        """What contacts that stick yield by in the step: the square of their imbalance."""
        found = evaluate(ready.chain, point, rest.memory, wanted.applied)
        largest = jnp.max(jnp.abs(ravel_pytree(found.residual.log_ratio)[0]))
        ratios = point.unknowns.log_ratio
        sticks = tuple(
            jnp.abs(trial_log_ratio(ready.chain, ratios[k], span, rest.memory, k)) < span.bound
            for k, span in enumerate(found.spans)
        )
        nothing = jax.tree.map(jnp.zeros_like, point)
        unknowns = nothing.unknowns._replace(log_ratio=sticks)
        return AUGMENTATION * largest**2 * ravel_pytree(nothing._replace(unknowns=unknowns))[0]

    def condensed(point: Iterate) -> jax.Array:
        found = evaluate(ready.chain, point, rest.memory, wanted.applied)
        return ravel_pytree(linear_step(ready.chain, wanted, point, rest.memory, found))[0]

    matrix, left = jax.jit(jax.jacfwd(imbalance, has_aux=True))(where)
    dense = np.linalg.solve(matrix + np.diag(jax.jit(yielding)(at)), -left)
    step = jax.jit(condensed)(at)
    margin.within("relative", (step - dense) / np.abs(dense).max(), 1e-8)


def stuck_step(size: float) -> Iterate:
    """Return the step from a bent shape where contacts stick, in forces of a robot of size 1."""
    robot = nf.Robot(
        name="of a size",
        tube=nf.Tube(1.6 * size, 1.4 * size),
        notch=(nf.ArcNotch("on-axis", 1.4 * size, 0.8 * size, uncut_length=1.2 * size, repeat=3),),
        tendon=(nf.Tendon(0.7 * size),),
        material=nf.Linear(50_000.0),
        friction=nf.Corner(0.3),
    )
    path = load_path(nf.Load(stroke=size), 1)
    ready = prepare_for(robot, path)
    wanted = jax.tree.map(lambda leaf: leaf[0], make_commands(path, robot, ready.chain))
    unknowns = ready.rest.point.unknowns
    unknowns = unknowns._replace(modes=unknowns.modes + 0.1)
    at = Iterate(unknowns, 0.0 * ready.rest.point.base_tension + size**2)
    found = evaluate(ready.chain, at, ready.rest.memory, wanted.applied)
    memory = ready.rest.memory._replace(slid=tuple(span.slid for span in found.spans))
    found = evaluate(ready.chain, at, memory, wanted.applied)
    assert np.all(found.spans[0].bound[:-1] > 0.0), "none sticks"
    step = linear_step(ready.chain, wanted, at, memory, found)
    return step._replace(base_tension=step.base_tension / size**2)


@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # 160 mm wide
def test_of_a_robot_of_another_size_it_is_as_large(margin) -> None:
    """Where every contact sticks a stroke does not tell the tension: a pivot does."""
    one, other = (stuck_step(size) for size in (1.0, 100.0))
    margin.within("tension", other.base_tension / one.base_tension - 1.0, 1e-6)
    margin.within("bending", other.unknowns.modes - one.unknowns.modes, 1e-6, "rad")
