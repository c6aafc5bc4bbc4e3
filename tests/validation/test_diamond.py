"""A measured loop of a laser-cut diamond of Nitinol: its first branches fitted, the rest predicted.

Half a strut is one flexure: no moment in the middle, clamped at its end, pulled across. Its bending
moment falls linearly along it, so it is cut into nodes, each with a section of fibres and a memory
of its own. The drawing of the specimen is not part of the data, so two constants stand for its
size: force and strain of the strut per force and extension of the diamond. Only three others can
be told from the loop, all relative to Young's modulus and plateau stress.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from jaxtyping import Array
from scipy.optimize import least_squares

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.mechanics.material import Fibres, FibreSection, SectionLaw, section_law
from notchflex.mechanics.section import two_walls_fibres
from shared_data import measured, numbers

# Places along half a strut from the point without moment, and what each stands for.
_POINTS, _TWICE = np.polynomial.legendre.leggauss(8)
ARM, WEIGHT = 0.5 + 0.5 * _POINTS, 0.5 * _TWICE
# Height and width of 2, as the size of a strut is one of the constants.
(_ARMS,), _AREAS = two_walls_fibres(1.0, 1.0, 160)
FIBRES = Fibres(_ARMS, 2.0 * _AREAS)
ONE = np.ones(())
SECTION = FibreSection(4.0 * ONE, 4.0 / 3.0 * ONE, ONE, ONE, ONE, ONE, ONE, None, FIBRES)
MODULUS, PLATEAU = 42_000.0, 350.0
START = 0.001, 0.03, 0.15, 0.4, 1.1
LOWER, UPPER = (1e-6, 1e-3, 0.011, 0.02, 0.2), (1.0, 1.0, 0.9, 0.99, 5.0)


@jax.jit
def forces(law: SectionLaw, ends: Array) -> tuple[Array, Array]:
    """Forces that move the end of half a strut so far one after the other, and their errors."""

    def bent(curvature: Array, memory: Array):
        return jax.vmap(lambda k, m: law.bent(k, SECTION, m))(curvature, memory)

    def move(state: tuple[Array, Array], end: Array):
        curvature, memory = state

        def improve(_: int, search: tuple[Array, Array]) -> tuple[Array, Array]:
            at = bent(search[0], memory)
            held, by_force = search[0] - at.moment / at.slope, ARM / at.slope
            force = (end - (WEIGHT * ARM) @ held) / ((WEIGHT * ARM) @ by_force)
            return held + by_force * force, force

        curvature, force = jax.lax.fori_loop(0, 4, improve, (curvature, jnp.zeros(())))
        at = bent(curvature, memory)
        error = jnp.max(jnp.abs(at.moment - force * ARM)) + jnp.abs(
            (WEIGHT * ARM) @ curvature - end
        )
        return (curvature, at.memory), (force, error)

    rest = jnp.zeros(len(ARM)), jnp.zeros((len(ARM), len(FIBRES.arm)))
    return jax.lax.scan(move, rest, ends)[1]


def predicted(constants: np.ndarray, extension: np.ndarray) -> np.ndarray:
    """Forces of the diamond along a history of its extension, N."""
    force, strain, hardening, unloading, compression = constants
    material = nf.Nitinol(
        MODULUS,
        PLATEAU,
        hardening * MODULUS,
        compression_ratio=compression,
        unloading_stress=unloading * PLATEAU,
    )
    found, error = forces(section_law(material), strain * extension)
    assert np.max(error) < 1e-8 * np.max(np.abs(found))
    return force * np.asarray(found)


def turns(extension: np.ndarray) -> list[int]:
    """Where a history starts to move, turns round by 0.05 mm or more, and ends."""
    extreme = int(np.argmax(extension > 0.0)) - 1
    found, way = [extreme], 1.0
    for place in range(extreme, len(extension)):
        ahead = way * (extension[place] - extension[extreme])
        if ahead < -0.05:
            found.append(extreme)
            way = -way
        if ahead > 0.0 or ahead < -0.05:
            extreme = place
    return [*found, len(extension) - 1]


@pytest.fixture(scope="module")
def loop() -> tuple[np.ndarray, np.ndarray, int]:
    """Extension, force, and where the first unloading ends: 30 rows of each branch."""
    rows = measured("confluent_nitinol_diamond_load.csv")
    extension, force = (np.array(numbers(rows, key)) for key in ("extension_mm", "load_N"))
    branches = [np.linspace(*pair, 31).astype(int) for pair in itertools.pairwise(turns(extension))]
    kept = np.concatenate([branches[0][:1], *(branch[1:] for branch in branches)])
    return extension[kept], force[kept], 60


def test_the_loop_is_kept_whole(loop: tuple[np.ndarray, np.ndarray, int]) -> None:
    extension, force, turn = loop
    np.testing.assert_allclose(extension[[0, 30, turn, 90, 120]], [0, 0.8, 0.4, 0.8, 0], atol=1e-3)
    assert np.trapezoid(force, extension) == pytest.approx(11.48, rel=0.01)


@pytest.mark.nightly
def test_the_rest_of_the_loop_follows_from_its_first_branches(loop, margin) -> None:
    extension, force, turn = loop
    first = extension[: turn + 1]
    fit = least_squares(
        lambda constants: predicted(constants, first) - force[: turn + 1],
        START,
        bounds=(LOWER, UPPER),
        x_scale=START,
        diff_step=1e-3,
    )
    found = predicted(fit.x, extension)
    lost, own = (np.trapezoid(one, extension) for one in (force, found))
    margin.within("dissipation, relative", own / lost - 1.0, 0.15)
    for name, part in (("whole", slice(None)), ("predicted", slice(turn, None))):
        rms = np.sqrt(np.mean((found - force)[part] ** 2)) / force.max()
        margin.within(f"force, rms of the largest, {name}", rms, 0.08)
    # The test can fail: without hysteresis the same constants miss the rest.
    elastic = fit.x * [1.0, 1.0, 1.0, 0.0, 1.0] + [0.0, 0.0, 0.0, 0.99, 0.0]
    missed = predicted(elastic, extension) - force
    assert np.sqrt(np.mean(missed[turn:] ** 2)) > 0.15 * force.max()
