"""Random materials that are summed up fibre by fibre."""

from __future__ import annotations

from typing import Any

import numpy as np
from drawn_loads import Numbers

import notchflex as nf


def drawn_material(numbers: Numbers, kind: str, density: float) -> nf.Nitinol | nf.StressStrain:
    """Draw nitinol with or without hysteresis, or a table of stress over strain."""
    modulus = numbers.log(2e4, 8e4)
    begin = numbers.usual(0.006, 0.012, 0.002, 0.03)
    if kind == "table":
        return _table(numbers, modulus, begin, density)
    stress = begin * modulus
    unloading = stress * numbers.usual(0.2, 0.6, 0.01, 0.98) if kind == "hysteresis" else None
    return nf.Nitinol(
        modulus,
        stress,
        modulus * numbers.usual(0.05, 0.25, 0.01, 0.9),
        float(numbers.choice((1.0, numbers.uniform(1.0, 1.6)))),
        unloading,
        float(begin + numbers.uniform(0.02, 0.06)) if numbers.chance(0.3) else None,
        density=density,
    )


def _table(numbers: Numbers, modulus: float, begin: float, density: float) -> nf.StressStrain:
    """Draw a curve of two to seven pieces that may stiffen again, at times one for each sign."""

    def curve(first: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        count = int(numbers.generator.integers(1, 7))
        strain = first + np.append(0.0, np.cumsum(numbers.generator.uniform(0.004, 0.02, count)))
        slope = modulus * np.array([numbers.log(0.012, 1.2) for _ in range(count)])
        stress = modulus * first + np.append(0.0, np.cumsum(np.diff(strain) * slope))
        return tuple(strain.tolist()), tuple(stress.tolist())

    strain, stress = curve(begin)
    other: dict[str, Any] = {}
    if numbers.chance(0.5):
        both = curve(begin * numbers.uniform(0.8, 1.6))
        other = {"compression_strain": both[0], "compression_stress": both[1]}
    return nf.StressStrain(strain=strain, stress=stress, density=density, **other)


def softened(material: Any, strain: float) -> float:
    """Stress in tension at a strain over that of Young's modulus there, about."""
    modulus = material.elastic_modulus
    if isinstance(material, nf.Nitinol):
        begin = material.plateau_stress / modulus
        beyond = material.plateau_modulus
    elif isinstance(material, nf.StressStrain):
        begin = material.strain[0]
        beyond = (material.stress[-1] - material.stress[0]) / (material.strain[-1] - begin)
    else:
        return 1.0
    if strain <= begin:
        return 1.0
    return (begin + beyond / modulus * (strain - begin)) / strain
