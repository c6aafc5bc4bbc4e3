"""Closed formulas of sections and laws, written again from the papers for the checks alone.

Nothing here calls the library: a check that asked it for its own centroid would agree with any
error of that centroid.  Lengths in mm, moduli in MPa, angles in rad.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def arc_section(tube: dict[str, Any], notch: dict[str, Any]) -> tuple[float, float]:
    """Return centroid (toward the spine) and second moment of what an arc notch leaves."""
    outer, inner = tube["outer_diameter"] / 2, tube["inner_diameter"] / 2
    cut = notch["depth"] - outer
    if notch["cut"] == "on-axis":
        half = math.acos(cut / outer)
        area = half * (outer**2 - inner**2)
        centroid = 2 * math.sin(half) / (3 * half) * (outer**3 - inner**3) / (outer**2 - inner**2)
        second = (outer**4 - inner**4) / 4 * (half + math.sin(half) * math.cos(half))
        return centroid, second - area * centroid**2
    area = first = second = 0.0
    for radius, sign in ((outer, 1.0), (inner, -1.0)):
        if cut >= radius:
            continue
        half = math.acos(max(cut / radius, -1.0))
        sine, cosine = math.sin(half), math.cos(half)
        area += sign * radius**2 * (half - sine * cosine)
        first += sign * 2 / 3 * radius**3 * sine**3
        second += sign * radius**4 / 4 * (half - sine * cosine + 2 * sine**3 * cosine)
    return first / area, second - first**2 / area


def stress(material: dict[str, Any], strain: np.ndarray | float) -> np.ndarray:
    """Return the stress of a strain (Pacheco 2021, eq. 13), odd in the strain."""
    modulus = material["elastic_modulus"]
    strain = np.asarray(strain, dtype=float)
    if material["kind"] == "linear":
        return modulus * strain
    size = np.abs(strain)
    first, second = material["transition_strain"], material.get("plastic_strain", 0.1)
    slope = material["superelastic_modulus"]
    low = modulus * first
    high = low + (second - first) * slope
    beyond = np.where(size > second, size - second, 1.0)
    exponent = np.exp(material.get("plastic_exponent", -0.01) / beyond)
    plastic = high + material.get("plastic_modulus", 1000.0) * exponent
    middle = low + (size - first) * slope
    value = np.where(size <= first, modulus * size, np.where(size <= second, middle, plastic))
    return np.sign(strain) * value


def arc_moment(
    tube: dict[str, Any], notch: dict[str, Any], material: dict[str, Any], curvature: Any
) -> np.ndarray:
    """Return the moment of an arc notch at a change of curvature of its neutral line."""
    centroid, second = arc_section(tube, notch)
    edge = tube["outer_diameter"] / 2 - centroid
    return second / edge * stress(material, np.asarray(curvature) * edge)


def friction_bound(friction: dict[str, Any], turning: np.ndarray) -> np.ndarray:
    """Return the largest |ln(tension ratio)| over a contact where the tendon turns so far."""
    if friction["kind"] == "frictionless":
        return np.zeros_like(turning)
    coefficient = friction["coefficient"]
    if friction["kind"] == "capstan":
        return coefficient * turning
    with np.errstate(invalid="ignore"):
        return 2 * np.arctanh(np.minimum(coefficient * np.tan(turning / 2), 1.0))


def reference(robot: dict[str, Any], notch: dict[str, Any]) -> tuple[float, float, float]:
    """Return stiffness (N mm), a large angle and the lever (mm) of a notch, roughly."""
    tube, modulus = robot["tube"], robot["material"]["elastic_modulus"]
    outer, inner = tube["outer_diameter"] / 2, tube["inner_diameter"] / 2
    if notch["kind"] == "arc":
        centroid, second = arc_section(tube, notch)
        angle = min(notch["height"] / (outer + centroid), 0.8)
        return modulus * second / notch["height"], angle, outer * 0.9 + centroid
    width = notch.get("wall_width") or 2 * (outer - inner)
    thickness = notch["strip_thickness"]
    second = width * thickness**3 / 12
    if notch["kind"] == "strip":
        length = notch.get("strip_length") or outer + inner
        return modulus * second / length, min(notch["height"] / (2 * outer), 0.5), 0.5 * length
    length = notch["strip_length"] + 2 * notch["slot_radius"]
    return modulus * second / length, min(notch["slot_radius"] / outer, 0.3), 0.8 * outer
