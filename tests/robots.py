"""Robots of the package for the tests: the ready ones, and those described by an oracle."""

from __future__ import annotations

from functools import cache

import numpy as np

import notchflex as nf
from oracles import frames
from oracles.wrist import Material, Wrist

UNCUT = ("disks-two-segments", "measured-backbone")
"""Ready robots that are not cut from a tube."""


@cache
def ready(name: str) -> nf.Robot:
    """Ready wrist 'A', 'B' or 'C' of Pacheco 2021: Table 3 constants, straight when free."""
    return nf.load_robot(f"pacheco2021-{name.lower()}")


@cache
def specimen(name: str) -> nf.Robot:
    """Ready wrist with the authors' unrounded constants (set 196) and bent when free."""
    return nf.load_robot(f"pacheco2021-{name.lower()}-specimen")


def linear_copy(robot: nf.Robot, elastic_modulus: float | None = None) -> nf.Robot:
    """The robot with a linear material, of the same modulus [MPa] unless another is given."""
    modulus = elastic_modulus or robot.material.elastic_modulus
    return robot.replace(material=nf.Linear(modulus))


def of_wrist(wrist: Wrist) -> nf.Robot:
    """An oracle's wrist: one tendon on the inner wall, on the side of the cuts."""
    tendon = frames.Tendons(np.array([wrist.inner_diameter / 2]), np.zeros(1))
    return of_frames(frames.Robot(wrist, np.zeros(wrist.n), tendon))


def of_frames(robot: frames.Robot) -> nf.Robot:
    """An oracle's robot with notches and tendons all round the tube."""
    w = robot.wrist
    return nf.Robot(
        name="test robot",
        tube=nf.Tube(w.outer_diameter, w.inner_diameter),
        notch=tuple(
            nf.ArcNotch(
                cut=w.cut,
                depth=depth,
                height=height,
                uncut_length=uncut,
                direction_deg=float(np.degrees(direction)),
                precurvature_deg=float(np.degrees(start)),
            )
            for depth, height, uncut, direction, start in zip(
                w.depth, w.height, w.uncut, robot.direction, w.start, strict=True
            )
        ),
        tendon=tuple(
            nf.Tendon(radius=float(radius), direction_deg=float(np.degrees(direction)))
            for radius, direction in zip(robot.tendons.radius, robot.tendons.direction, strict=True)
        ),
        material=_material(w.material),
        friction=nf.Capstan(w.mu, wrap=w.wrap),
    )


def _material(law: Material) -> nf.Linear | nf.Superelastic:
    if law.superelastic_modulus is None:
        return nf.Linear(law.elastic_modulus)
    return nf.Superelastic(
        elastic_modulus=law.elastic_modulus,
        superelastic_modulus=law.superelastic_modulus,
        transition_strain=law.transition_strain,
        plastic_strain=law.plastic_strain,
        plastic_modulus=law.plastic_modulus,
        plastic_exponent=law.plastic_exponent,
    )
