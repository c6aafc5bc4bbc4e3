"""A curve of stress over strain as a law of fibres: each of its points is a kink."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from notchflex._jax import constant
from notchflex.mechanics.material.fibre_law import FibreLaw
from notchflex.mechanics.material.law import section_law
from notchflex.robot import StressStrain

# A strain that no fibre reaches.
_NEVER = 1e6


@section_law.register
def _(material: StressStrain) -> FibreLaw:
    modulus = material.elastic_modulus
    high, change = _kinks(material.strain, material.stress, modulus)
    low = -high
    if material.compression_strain is not None and material.compression_stress is not None:
        at, by = _kinks(material.compression_strain, material.compression_stress, modulus)
        low = np.append(np.full(len(high), -_NEVER), -at)
        high = np.append(high, np.full(len(at), _NEVER))
        change = np.append(change, by)
    return FibreLaw(
        elastic_modulus=constant(modulus),
        shear_modulus=constant(modulus / (2.0 * (1.0 + material.poisson_ratio))),
        low=constant(low[None]),
        high=constant(high[None]),
        change=constant(change),
    )


def _kinks(
    strain: Sequence[float], stress: Sequence[float], modulus: float
) -> tuple[np.ndarray, np.ndarray]:
    """List the kinks of a curve, and the fall of slope there over Young's modulus."""
    slope = np.diff(stress, prepend=0.0) / np.diff(strain, prepend=0.0) / modulus
    at, change = np.append(0.0, strain[:-1]), -np.diff(slope, prepend=1.0)
    turns = np.abs(change) > 1e-12  # at zero only where compression begins with another slope
    return at[turns], change[turns]
