"""The law of the tube on the measured wrists, written again: what moves eq. 17, and by how much.

    python benchmarks/measured_wrists.py FOLDER [--only NAME] [--left-out] [--profile]

Notch after notch from the base, without the solver: a table of the moment over the angle, the
capstan law, and the smallest angle that holds the tension. FOLDER has the measured angles of
Pacheco 2021. Five constants are fitted (material, friction, a factor of the force of wrist A) by
a search without derivatives, once for every variant of the law. `--left-out` also predicts each
wrist from a fit to the two others; `--profile` fits a factor for every wrist and prints the errors
of the total by load and pull.
Lengths of the ends and flattening are the library's; tests compare them with a reference. All
flattening goes with the angle here, and sections stay plane beside the rings.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from notchflex.mechanics.ends import NotchStiffness, notch_stiffness
from notchflex.mechanics.ring import Side

OUTER, INNER = 0.81, 0.70  # mm
# Depths, height and uncut length, mm.
WRISTS = {
    "A": ((1.40,) * 5, 0.8, 1.2),
    "B": ((1.40,) * 5, 0.5, 1.5),
    "C": ((1.36, 1.39, 1.42, 1.45), 1.0, 1.0),
}
SCALE = np.array([1e4, 100.0, 1e3, 0.1])
START = np.array([3.06, 2.6, 8.5, 1.7])
FACTORS = {"A": 1.05, "B": 1.0, "C": 0.97}
PRIOR = 0.05
FACES = 0.086  # of the angle of the ends; the library's rule


@dataclass(frozen=True)
class Variant:
    """A reading of the law.

    Attributes:
        faces: Angle between the faces over that between the rings; None for the library's rule.
        closing: Angle of a rigid stop over h/(r_o + centroid); None for the elastic stop.
        share: Part of the end compliance that follows the material.
        coupling: Whether the neutral axis moves by b_c.
        whole: Whether the whole turning of a notch lies before its own gap.
        sides: Whether first and last notch have rings of their own kind.
        tendon: Diameter of the tendon, mm.
        rest: Precurvature over the height, rad/mm.
    """

    faces: float | None = None
    closing: float | None = None
    share: float = 0.25
    coupling: bool = True
    whole: bool = False
    sides: bool = True
    tendon: float = 0.0
    rest: float = 0.050


VARIANTS = {
    "the library's law": Variant(),
    "faces turn by 0.97 of the rings": Variant(faces=0.97),
    "faces 0.97, b_c left out": Variant(faces=0.97, coupling=False),
    "faces 0.97, rigid stop at 1.0225": Variant(faces=0.97, closing=1.0225),
    "faces 0.97, rigid stop at 1, ends alike": Variant(faces=0.97, closing=1.0, sides=False),
    "faces as the rings": Variant(faces=1.0),
    "ends all elastic": Variant(share=0.0),
    "ends all of the material": Variant(share=1.0),
    "all notches between notches": Variant(sides=False),
    "precurvature 0.045": Variant(rest=0.045),
    "precurvature 0.055": Variant(rest=0.055),
    "tendon of 0.1 mm, faces 0.97": Variant(faces=0.97, tendon=0.1),
    "whole turning before the gap, faces 0.97": Variant(faces=0.97, whole=True),
}


@dataclass(frozen=True)
class Notch:
    """One notch: its height (mm), the law of its ends, its section by fibres."""

    height: float
    ends: NotchStiffness
    arms: np.ndarray
    areas: np.ndarray
    centroid: float

    @property
    def second_moment(self) -> float:
        """Second moment about the weak axis, mm^4."""
        return float(self.areas @ self.arms**2)


def notches(wrist: str, variant: Variant) -> list[Notch]:
    """Sections of depths read at mid-wall, by fibres; their ends."""
    depths, height, uncut = WRISTS[wrist]
    middle, last = 0.5 * (OUTER + INNER), len(depths) - 1
    (through, of_wall), (points, weights) = (np.polynomial.legendre.leggauss(n) for n in (6, 24))
    found: list[Notch] = []
    for number, depth in enumerate(depths):
        half = np.arccos((depth - OUTER) / middle)
        radius = middle + 0.5 * (OUTER - INNER) * through
        angle = 0.5 * half * (1.0 + points)
        width = np.outer(0.5 * (OUTER - INNER) * of_wall * radius, half * weights)
        height_of = np.outer(radius, np.cos(angle)).ravel()
        areas = width.ravel()
        centroid = float(areas @ height_of / areas.sum())
        at_outer = OUTER + (depth - OUTER) * OUTER / middle
        kinds = [
            "clamped" if number == 0 and variant.sides else "between",
            "free" if number == last and variant.sides else "between",
        ]
        sides = [Side(kind, uncut) for kind in kinds]  # pyright: ignore[reportArgumentType]
        ends = notch_stiffness(OUTER, INNER, "on-axis", at_outer, height, 0.33, *sides)
        found.append(Notch(height, ends, height_of - centroid, areas, centroid))
    return found


def section_moment(notch: Notch, curvature: np.ndarray, material: np.ndarray) -> np.ndarray:
    """Moment of the fibres without axial force, N mm, at curvatures, 1/mm."""
    modulus, plateau, slope = material
    stretch, stress = np.zeros((len(curvature), 1)), np.zeros((len(curvature), 1))
    for _ in range(60):
        strain = stretch + curvature[:, None] * notch.arms
        beyond = np.abs(strain) > plateau / modulus
        onward = np.sign(strain) * (plateau + slope * (np.abs(strain) - plateau / modulus))
        stress = np.where(beyond, onward, modulus * strain)
        step = (stress @ notch.areas) / (np.where(beyond, slope, modulus) @ notch.areas)
        stretch = stretch - step[:, None]
        if np.max(np.abs(step)) < 1e-12:
            break
    return (stress * notch.arms) @ notch.areas


def angles(
    every: list[Notch], variant: Variant, force: np.ndarray, constants: np.ndarray, factor: float
) -> np.ndarray:
    """Angles between the faces of every notch, and their sum, deg, (rows, notches + 1)."""
    material, friction = constants[:3], constants[3]
    pull = factor * np.maximum(force, 0.0)
    found: list[np.ndarray] = []
    for notch in every:
        height, ends = notch.height, notch.ends
        length, rest = ends.weak, variant.rest * height
        added = length - height
        curvature = np.linspace(0.0, 1.6 / height, 240)
        moment = section_moment(notch, curvature, material)
        elastic = moment / (material[0] * notch.second_moment)
        reduced = (height + variant.share * added) * curvature
        reduced += (1.0 - variant.share) * added * elastic
        factor_of_stop = ends.closing_factor if variant.closing is None else variant.closing
        stop = factor_of_stop * height / (OUTER + notch.centroid) - rest
        theta = np.linspace(0.0, stop, 500)
        if variant.closing is None:
            theta = np.append(theta, stop + np.linspace(0.001, 0.15, 20))
        q = 1.0 + ends.alpha * theta / 2.0 + ends.beta * theta**2 / 2.0
        carried = np.interp(np.interp(theta / q, reduced, curvature), curvature, moment) / q
        open_stiffness = material[0] * notch.second_moment / length
        carried += ends.closed_ratio * open_stiffness * np.maximum(theta - stop, 0.0)
        turned = theta + rest
        arm = (INNER - variant.tendon / 2.0 + notch.centroid) * np.cos(turned / 2.0)
        arm += height * turned / 12.0 - variant.coupling * ends.coupling / length
        own = turned if variant.whole else 0.5 * turned
        needed = np.maximum.accumulate(carried / (arm * np.exp(-friction * own)))
        angle = np.interp(pull, needed + 1e-12 * np.arange(len(needed)), theta)
        seen = 1.0 - FACES * added / length if variant.faces is None else variant.faces
        found.append(seen * angle + rest)
        pull = pull * np.exp(-friction * (angle + rest))
    each = np.degrees(np.array(found)).T
    return np.column_stack([each, each.sum(axis=1)])


Data = dict[str, tuple[np.ndarray, np.ndarray]]


def read(folder: Path) -> Data:
    """Force (N), and angles of all notches and their sum (deg), by wrist."""
    found: Data = {}
    for wrist, (depths, *_) in WRISTS.items():
        with (folder / f"pacheco2021_wrist_{wrist}_measured.csv").open(encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
        names = [f"notch_{number}_deg" for number in range(1, len(depths) + 1)]
        seen = np.array([[float(row[name]) for name in (*names, "total_deg")] for row in rows])
        found[wrist] = np.array([float(row["tendon_force_N"]) for row in rows]), seen
    return found


def search(
    variant: Variant, data: Data, factors: str
) -> tuple[float, np.ndarray, dict[str, np.ndarray]]:
    """Fit material, friction and the factors of some wrists: eq. 17, constants, errors (deg)."""
    every = {wrist: notches(wrist, variant) for wrist in data}

    def errors(values: np.ndarray) -> dict[str, np.ndarray]:
        own = dict(zip(factors, values[4:], strict=True))
        return {
            wrist: np.sqrt(
                np.mean(
                    (angles(every[wrist], variant, force, values[:4], own.get(wrist, 1.0)) - seen)
                    ** 2,
                    axis=0,
                )
            )
            for wrist, (force, seen) in data.items()
        }

    scale = np.append(SCALE, np.ones(len(factors)))

    def cost(scaled: np.ndarray) -> float:
        values = scaled * scale
        if np.any(values[:3] < 20.0) or values[3] < 0.0:
            return 1e3
        sizes = sum(float(np.linalg.norm(one)) for one in errors(values).values())
        if len(factors) > 1:  # as SumOfRobotErrors weighs a prior, about
            sizes += 0.01 * 0.5 * float(np.sum(((values[4:] - 1.0) / PRIOR) ** 2))
        return sizes

    best = np.append(START, [FACTORS[wrist] for wrist in factors])
    for tries, fine in ((700, 1e-3), (500, 1e-4)):
        options = {"maxfev": tries, "xatol": fine, "fatol": 0.1 * fine, "adaptive": True}
        best = minimize(cost, best, method="Nelder-Mead", options=options).x
    found = errors(best * scale)
    return sum(float(np.linalg.norm(one)) for one in found.values()), best * scale, found


def profile(folder: Path, data: Data) -> None:
    """Print errors of the total angle by load, and their means by pull, with seven constants."""
    variant = Variant()
    value, constants, _ = search(variant, data, "ABC")
    print(f"a factor for each wrist: eq. 17 {value:.3f} at {np.round(constants, 4)}")
    for (wrist, (force, seen)), factor in zip(data.items(), constants[4:], strict=True):
        with (folder / f"pacheco2021_wrist_{wrist}_measured.csv").open(encoding="utf-8") as lines:
            pull = np.array([row["trial"] for row in csv.DictReader(lines)])
        found = angles(notches(wrist, variant), variant, force, constants[:4], float(factor))
        off, part = (found - seen)[:, -1], np.clip(force / force.max(), 0.0, 1.0)
        for low in (0.0, 0.25, 0.5, 0.75):
            here = (part >= low) & ((part < low + 0.25) | (low == 0.75))
            means = [f"{np.mean(off[here & (pull == one)]):+.1f}" for one in np.unique(pull[here])]
            rms = np.sqrt(np.mean(off[here] ** 2))
            print(f"  {wrist}, from {low}: rms {rms:.1f} deg, pulls {', '.join(means)}", flush=True)


def main() -> None:
    """Print eq. 17 and the wrists left out of every variant."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", choices=VARIANTS)
    parser.add_argument("--left-out", action="store_true")
    parser.add_argument("--profile", action="store_true")
    given = parser.parse_args()
    data = read(given.folder)
    if given.profile:
        profile(given.folder, data)
        return
    for name, variant in VARIANTS.items():
        if given.only not in (None, name):
            continue
        value, constants, errors = search(variant, data, "A")
        norms = ", ".join(f"{np.linalg.norm(one):.2f}" for one in errors.values())
        print(f"{name}: eq. 17 {value:.3f} (A, B, C {norms})")
        shown = ", ".join(f"{one:.5g}" for one in constants)
        print(f"  E, plateau stress, plateau modulus, friction, factor of A: {shown}", flush=True)
        for out in data if given.left_out else ():
            kept = {wrist: rows for wrist, rows in data.items() if wrist != out}
            _, fitted, _ = search(variant, kept, "".join(kept))
            force, seen = data[out]
            off = angles(notches(out, variant), variant, force, fitted[:4], 1.0) - seen
            print(f"  {out} left out: {np.sqrt(np.mean(off[:, -1] ** 2)):.2f} deg", flush=True)


if __name__ == "__main__":
    main()
