"""Torsion constant and shear centre of an annular segment: estimates, corrected by a table.

There is no closed form, so a simple estimate for each of the three shapes is multiplied by a
factor that `benchmarks/segment_table.py` computed once with `sectionproperties` (warping
analysis) and fitted with Chebyshev polynomials in two coordinates that make it smooth:
√(1 − r_i/r_o), and the angle of the chord that the cut plane makes.

The table covers 0.2 ≤ r_i/r_o ≤ 0.98 for every depth of the open arc, the solid segment down to
a height of 0.005 r_o, and the closed tube as long as 1 % of the wall is left under the flat;
beyond, the factors keep their value at its edge (right for slivers, not checked for the rest).
Measured against other meshes of `sectionproperties`: torsion constant within 0.2 %; shear centre
within 0.1 % open or solid and 1 % closed, where a barely cut tube has it nearly on the axis.
"""

from functools import cache
from importlib.resources import files

import numpy as np

from notchflex._jax import array_module, jax
from notchflex.mechanics.section.angles import half_angle
from notchflex.mechanics.section.segment_estimates import (
    closed_estimate,
    open_estimate,
    solid_estimate,
)
from notchflex.mechanics.section.terms import broadcast_terms

# Where the factors were computed; benchmarks/segment_table.py reads these.
RATIO_RANGE = (0.2, 0.98)  # r_i / r_o
LIGAMENT_LEFT = 0.01  # least thickness left under the flat of a closed tube, over the wall
CHORD_RANGE = {  # of the angle in rad, see `chord_angle`
    "closed": (2.0 * np.arcsin(np.sqrt(LIGAMENT_LEFT)), np.pi),
    "open": (0.0, np.pi),
    "solid": (0.1, np.pi / 2.0),
}


@cache
def _read_table() -> dict[tuple[str, str], np.ndarray]:
    """Read the coefficients, by shape and quantity, shape (ratio orders, angle orders)."""
    text = (files("notchflex.mechanics.section") / "segment_table.csv").read_text(encoding="utf-8")
    table: dict[tuple[str, str], list[list[float]]] = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            shape, quantity, *coefficients = line.split(",")
            table.setdefault((shape, quantity), []).append([float(c) for c in coefficients])
    return {key: np.array(rows) for key, rows in table.items()}


def _chebyshev(count: int, value: jax.Array, low: float, high: float) -> jax.Array:
    """Evaluate the first Chebyshev polynomials (count, …), constant outside low … high."""
    xp = array_module(value)
    # The ends are moved in by 1e-12, because the arccosine has no derivative there.
    x = (2.0 * value - low - high) / (high - low)
    x = xp.clip(x, -1.0 + 1e-12, 1.0 - 1e-12)
    return xp.cos(broadcast_terms(np.arange(count, dtype=float), x) * xp.arccos(x)[None])


def chord_angle(shape: str, outer: jax.Array, inner: jax.Array, depth: jax.Array) -> jax.Array:
    """Return the table's coordinate along the depth, an angle in rad.

    Args:
        shape: "closed", "open" or "solid".
        outer: Outer radius, mm.
        inner: Inner radius, mm.
        depth: Depth of the cut, mm.

    Returns:
        For the solid segment the half-angle of the outer circle beyond the cut plane, for the
        open arc that of the inner circle, for the closed tube 2 arccos √(g / wall): all of them
        make the square roots at the ends of their range smooth.
    """
    if shape == "closed":
        return half_angle(outer, outer - inner - depth, depth)
    if shape == "open":
        return half_angle(inner, inner + outer - depth, inner - outer + depth)
    return half_angle(outer, 2.0 * outer - depth, depth)


def _factors(
    shape: str, outer: jax.Array, inner: jax.Array, depth: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Interpolate the factors on the torsion constant and on the shear centre."""
    xp = array_module(outer)
    low, high = (float(np.sqrt(1.0 - ratio)) for ratio in reversed(RATIO_RANGE))
    table = _read_table()
    both = np.stack([table[shape, "torsion"], table[shape, "shear"]])
    _, rows, columns = both.shape
    across = _chebyshev(rows, xp.sqrt(1.0 - inner / outer), low, high)
    along = _chebyshev(
        columns, chord_angle(shape, outer, inner, depth), *map(float, CHORD_RANGE[shape])
    )
    torsion, shear = xp.einsum("kpq,p...,q...->k...", both, across, along)
    return torsion, shear


def segment_torsion(
    outer: jax.Array, inner: jax.Array, depth: jax.Array, area: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Compute torsion constant and shear centre of an annular segment.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm, greater than 0; of the same shape.
        depth: Depth of the cut, mm; of the same shape.
        area: Area of the section, mm²; of the same shape.

    Returns:
        Torsion constant, mm⁴, and distance of the (Trefftz) shear centre from the tube axis,
        toward the spine, mm.
    """
    xp = array_module(outer)
    wall, plane = outer - inner, depth - outer
    closed = (plane < -inner) & (depth < wall)  # both: they may differ by rounding
    solid = plane >= inner
    # All three are computed; outside its own range each one gets a depth in the middle of it,
    # so that no derivative becomes NaN.
    shallow = xp.where(closed, depth, 0.5 * wall)
    through = xp.where(closed | solid, outer, depth)
    deep = xp.where(solid, depth, outer + inner)

    estimates = {
        "closed": closed_estimate(outer, inner, shallow),
        "open": open_estimate(outer, inner, through, area),
        "solid": solid_estimate(outer, deep, area),
    }
    torsion, shear = {}, {}
    for (shape, (first, second)), at in zip(
        estimates.items(), (shallow, through, deep), strict=True
    ):
        on_torsion, on_shear = _factors(shape, outer, inner, at)
        torsion[shape], shear[shape] = first * on_torsion, second * on_shear

    def choose(of: dict[str, jax.Array]) -> jax.Array:
        return xp.where(closed, of["closed"], xp.where(solid, of["solid"], of["open"]))

    return choose(torsion), choose(shear)
