"""The slopes of a rod's pose (mechanics/flexure/rod_kinematics.py) against JAX's derivatives."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import assemble
from notchflex.mechanics.flexure import Rod, geometric_stiffness, relative_pose
from notchflex.mechanics.flexure.rod_kinematics import integrate_rod, twist_slope
from notchflex.mechanics.motion import unskew

SMALL = nf.StripNotch(3.5, 1.5, 6.9, deflection="small", repeat=7)


def twist(shape: Rod, modes: jax.Array) -> jax.Array:
    pose = relative_pose(shape, modes)
    slope = jax.jacfwd(lambda varied: relative_pose(shape, varied))(modes)
    turned = jnp.einsum("ji,jkm->ikm", pose.rotation, slope.rotation)
    turn = jax.vmap(unskew, -1, -1)(turned)
    return jnp.concatenate([turn, pose.rotation.T @ slope.translation])


def robot(name: str) -> nf.Robot:
    if name != "small strips":
        return nf.load_robot(name)
    return nf.load_robot("liu2022").replace(notch=(SMALL,))


@pytest.mark.parametrize(
    ("name", "flat"),
    [
        ("pacheco2021-a", False),
        ("gao2017", True),
        ("liu2022", True),
        # Longest to compile.
        *(
            pytest.param(*case, marks=pytest.mark.nightly)
            for case in [
                ("gao2017", False),
                ("small strips", False),
            ]
        ),
    ],
)
def test_slopes_are_the_derivatives_of_the_pose(name: str, flat: bool, margin) -> None:
    chain = assemble(robot(name), "plane" if flat else "space", loaded=True, flat=flat)
    numbers = np.random.default_rng(5)

    @jax.jit
    def errors(shape: Rod, modes: jax.Array, wrench: jax.Array) -> tuple[jax.Array, jax.Array]:
        own = integrate_rod(shape, modes)
        wanted = jax.jacfwd(lambda varied: twist(shape, varied).T @ wrench)(modes)
        change = geometric_stiffness(shape, modes, own, wrench) - wanted
        return twist_slope(shape, modes, own) - twist(shape, modes), change / abs(wanted).max()

    for number in (0, 1):  # the first of either kind
        shape = jax.tree.map(lambda leaf, j=number: leaf[j], chain.rods)
        modes = jnp.array(0.15 * numbers.normal(size=shape.modes))
        wrench = jnp.array(numbers.normal(size=shape.basis.shape[-2]))
        turns_and_moves, change = errors(shape, modes, wrench)
        margin.within("twist", turns_and_moves, 1e-13)
        margin.within("change of the pull, relative", change, 1e-13)
