"""Small loads on a single notch, against the textbook: cantilevers in bending and torsion.

python benchmarks/robustness.py compliance
"""

from __future__ import annotations

import numpy as np

import notchflex as nf

from .sections import section_of


def arc_error(random: np.random.Generator) -> float:
    """Return the largest relative error of an arc notch's answers to small loads in space."""
    outer = np.exp(random.uniform(-1, 2))
    inner, depth = outer * random.uniform(0.5, 0.95), outer * random.uniform(0.9, 1.85)
    height, uncut = outer * random.uniform(0.3, 2), outer * random.uniform(0.0, 3)
    modulus, poisson = float(np.exp(random.uniform(5, 12))), random.uniform(0, 0.45)
    cut = "on-axis" if random.random() < 0.5 else "off-axis"
    left = section_of(cut, outer, inner, depth)
    weak, strong, torsion = left.weak, left.strong, left.torsion
    neutral, shear = left.centroid, left.shear_centre
    robot = nf.Robot(
        name="one notch",
        tube=nf.Tube(2 * outer, 2 * inner),
        notch=(nf.ArcNotch(cut, depth=depth, height=height, uncut_length=uncut),),
        tendon=(nf.Tendon(0.95 * outer),),
        material=nf.Linear(modulus, poisson_ratio=poisson),
        friction=nf.Frictionless(),
    )
    length, rigid = height + uncut, modulus / 2 / (1 + poisson) * torsion
    force = 1e-5 * modulus * min(weak, strong, torsion) / length**2
    pushes = [nf.Load(tip_force=row) for row in (force * np.eye(3))]
    path = nf.solve_each(robot, [*pushes, nf.Load(tip_moment=(0.0, 0.0, force * length))])
    moved = (path.tip_position - [0.0, 0.0, length]) / force
    bending = (length**3 - uncut**3) / 3 / modulus
    # a pull along z acts off the neutral axis, on the side of the cut: it bends away from it
    coupled = -neutral * (length**2 - uncut**2) / 2 / modulus / weak
    rows = [
        (moved[0, 0], bending / weak),
        (moved[1, 1], bending / strong + shear**2 * height / rigid),
        (moved[2, 0], coupled),
        (moved[0, 2], coupled),
        (moved[2, 2], neutral**2 * height / modulus / weak),
        (moved[3, 1], shear * height / rigid * length),
    ]
    return max(abs(found / due - 1) for found, due in rows)


def strip_error(random: np.random.Generator) -> float:
    """Return the largest relative error of a strip's answers to moments, small and large."""
    outer = np.exp(random.uniform(-1, 2))
    length, width = outer * random.uniform(0.9, 1.8), outer * random.uniform(0.1, 1)
    thickness, modulus = outer * random.uniform(0.05, 0.3), float(np.exp(random.uniform(5, 12)))
    robot = nf.Robot(
        name="one strip",
        tube=nf.Tube(2 * outer, 1.4 * outer),
        notch=(
            nf.StripNotch(
                height=outer,
                strip_thickness=thickness,
                depth=1.3 * outer,
                strip_length=length,
                wall_width=width,
            ),
        ),
        tendon=(nf.Tendon(0.85 * outer, path="straight"),),
        material=nf.Linear(modulus),
        friction=nf.Frictionless(),
    )
    stiffness = modulus * width * thickness**3 / 12 / length
    angles = np.array([1e-4, 0.1, 0.3])
    path = nf.solve_each(robot, [nf.Load(tip_moment=(0, stiffness * x, 0)) for x in angles])
    return float(np.abs(path.notch_angle[:, 0] / angles - 1).max())


def failed(seed: int, count: int) -> bool:
    """Compare, tell, and return whether an error is too large."""
    random = np.random.default_rng([seed, 4])
    arcs = max(arc_error(random) for _ in range(count))
    strips = max(strip_error(random) for _ in range(count))
    print(f"largest relative error: arc notches {arcs:.1e}, strips {strips:.1e}")
    return not (arcs < 2e-5 and strips < 1e-8)
