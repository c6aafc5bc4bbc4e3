"""Steps of the drives to a target, by least squares."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.solver.linear_step import gauss_jordan

MIN_DRIVES = 1e-10
"""Regularisation weight of the drives: selects the smallest redundant drives. It is too small to
act against the target."""
GROWTH, FIRST_PART = 1.0, 0.05
"""Largest change of a drive in a step, relative to the largest drive; and in the first step,
relative to the closing value of a notch."""

SLACK = 1e-10
"""Drives within this part of what about closes a notch of their limit are at it."""

NO_SLOPE = 1e-12
"""Slopes whose square is this part of others move nothing."""

# What a step weighs beside the error of the target, as a part of the slopes, for a target as far as
# the drives reach.
_DAMPING = 0.01


def drive_step(
    miss: Float[Array, " n"],
    slopes: Float[Array, "n t"],
    drive: Float[Array, " t"],
    low: Float[Array, " t"],
    high: Float[Array, " t"],
    driven: Float[Array, " t"],
    scale: Float[Array, ""],
) -> Float[Array, " t"]:
    """Return the step of least squares to a target within limits, that of the smallest drives.

    Drives that the step would carry beyond a limit are set to it, and the others found again.

    Args:
        miss: Weighted differences from the target.
        slopes: Their slopes by the drives.
        drive: The drives, of which the smallest are sought.
        low: Lowest step.
        high: Highest step.
        driven: 1 where a drive may change.
        scale: Size of the drives.
    """
    count = len(drive)
    slopes = slopes * driven[None]
    normal = slopes.T @ slopes
    size = jnp.trace(normal) / jnp.maximum(jnp.sum(driven), 1.0)
    has_slope = size > 0.0
    size = jnp.where(has_slope, size, 1.0)
    small = MIN_DRIVES * size
    eye = jnp.eye(count)
    gradient = slopes.T @ miss + small * drive * driven
    # Far from the target slopes hold roughly: directions that move little are left for later.
    part = jnp.linalg.norm(miss) / (jnp.sqrt(size) * scale)
    several = jnp.sum(driven) > 1.0
    damping = jnp.where(several, _DAMPING * jnp.minimum(part, 1.0), 0.0) * size
    hessian = normal + (small + damping) * eye
    # Drives without effect do not change.
    column = jnp.sum(slopes**2, axis=0)
    driven = driven * (column > NO_SLOPE * jnp.max(column))
    free, step = driven, jnp.zeros(count)
    for _ in range(count):
        both = free[:, None] * free[None, :]
        matrix = both * hessian + (1.0 - free)[None] * size * eye
        right = -free * (gradient + hessian @ ((1.0 - free) * step))
        step = jnp.where(free > 0.0, gauss_jordan(matrix, right[:, None])[:, 0], step)
        inside = jnp.clip(step, low, high)
        free = free * (inside == step)
        step = inside
    return jnp.where(has_slope, step * driven, 0.0)
