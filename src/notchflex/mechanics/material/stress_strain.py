"""A curve of stress over strain as a law of fibres: each of its points is a kink."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.mechanics.material.fibre_law import (
    FLATTEST,
    FibreLaw,
)
from notchflex.mechanics.material.law import section_law
from notchflex.robot import StressStrain

# A strain that no fibre reaches.
_NEVER = 1e6
# How far a curve through fewer points may lie off, of its largest stress.
_OFF = 1e-6


@section_law.register
def _(material: StressStrain) -> FibreLaw:
    modulus = material.elastic_modulus
    high, change = _kinks(*material.in_tension, modulus)
    low = -high
    if material.in_compression is not None:
        at, by = _kinks(*material.in_compression, modulus)
        low = xp.append(xp.full(len(high), -_NEVER), -at)
        high = xp.append(high, xp.full(len(at), _NEVER))
        change = xp.append(change, by)
    # Numbers of kinks are powers of two, so that curves share programs.
    spare = (0, (1 << (len(change) - 1).bit_length()) - len(change))
    return FibreLaw(
        elastic_modulus=constant(modulus),
        shear_modulus=constant(modulus / (2.0 * (1.0 + material.poisson_ratio))),
        low=constant(xp.pad(low, spare, constant_values=-_NEVER)[None]),
        high=constant(xp.pad(high, spare, constant_values=_NEVER)[None]),
        change=constant(xp.pad(change, spare)),
    )


@lru_cache(maxsize=64)
def _kinks(
    strain: tuple[float, ...], stress: tuple[float, ...], modulus: float
) -> tuple[np.ndarray, np.ndarray]:
    """List the kinks of a curve, and the fall of slope there over Young's modulus."""
    at, value = _few_points(xp.append(0.0, strain), xp.append(0.0, stress))
    slope = xp.maximum(xp.diff(value) / xp.diff(at) / modulus, FLATTEST)
    change = -xp.diff(slope, prepend=1.0)
    turns = xp.abs(change) > 1e-12  # at zero only where compression begins with another slope
    return (at[:-1][turns], change[turns]) if turns.any() else (at[:1], change[:1])


def _few_points(strain: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Keep the first point, the last and few between them; chords pass the others closely."""
    off = _OFF * stress[-1]
    kept, last = [0], len(strain) - 1
    while kept[-1] < last:
        begin = kept[-1]
        least, most, reached = -np.inf, np.inf, begin + 1
        for point in range(begin + 1, last + 1):
            run, rise = strain[point] - strain[begin], stress[point] - stress[begin]
            if least <= rise / run <= most:
                reached = point
            least, most = max(least, (rise - off) / run), min(most, (rise + off) / run)
            if least > most:
                break
        kept.append(reached)
    return strain[kept], stress[kept]
