"""Nitinol by fibres: elastic, a plateau with hardening, unloading on a plateau of its own."""

from __future__ import annotations

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.mechanics.material.fibre_law import (
    FLATTEST,
    FibreLaw,
)
from notchflex.mechanics.material.law import section_law
from notchflex.robot import Nitinol


@section_law.register
def _(material: Nitinol) -> FibreLaw:
    modulus = material.elastic_modulus
    loading, ratio = material.plateau_stress / modulus, material.compression_ratio
    # A fibre does not fall below loading in tension, nor below unloading in compression.
    tension, compression = [loading], [-ratio * loading]
    if material.unloading_stress is not None:
        unloading = material.unloading_stress / modulus
        tension, compression = [loading, unloading], [-ratio * unloading, -ratio * loading]
    low, high = xp.array(compression)[:, None], xp.array(tension)[:, None]
    change = xp.array([1.0 - xp.maximum(material.plateau_modulus / modulus, FLATTEST)])
    if material.transformation_strain is not None:
        length = material.transformation_strain - loading
        low, high = xp.hstack([low, low - length]), xp.hstack([high, high + length])
        change = xp.append(change, -change)
    return FibreLaw(
        elastic_modulus=constant(modulus),
        shear_modulus=constant(modulus / (2.0 * (1.0 + material.poisson_ratio))),
        low=constant(low),
        high=constant(high),
        change=constant(change),
    )
