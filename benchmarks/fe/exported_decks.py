"""Decks that `notchflex export --inp` writes, run by CalculiX, against other finite elements.

    python exported_decks.py [medium|fine]

The others are tests/reference/fem_notch_clamped.csv (one notch between rigid plates under a
moment) and fem_wrist_angles.csv (wrist A pulled to 1 N with friction): meshes and set-up of another
program. A notch takes three seconds on one core, the wrist half a minute (fine: three minutes).
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import calculix
import numpy as np

import notchflex as nf
from notchflex.export.formats import DeckOptions
from notchflex.export.mesh import mesh_of

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from fem_rings import RingMotion, read_rings
from fem_wrists import solid
from reference_data import named_rows

YOUNG, MOMENT = 60_000.0, 1e-3


def run(subject: nf.Robot | nf.EquilibriumPath, options: DeckOptions) -> RingMotion:
    """Write a deck, run it as it is, read the rings."""
    robot = subject if isinstance(subject, nf.Robot) else subject.robot
    with tempfile.TemporaryDirectory() as folder:
        nf.export_robot(subject, Path(folder, "deck.inp"), options)
        return read_rings(mesh_of(robot, options), calculix.run(Path(folder), "deck"))


def notches(mesh: str) -> None:
    """Compare the rotation of every single notch of the table."""
    options = DeckOptions.of_mesh(mesh, tip_moment=MOMENT)  # type: ignore[arg-type]
    errors: list[float] = []
    for row in named_rows("fem_notch_clamped.csv"):
        tube = (row["OD"], row["ID"])
        if tube != (1.62, 1.4) or row["cut"] != "off-axis" or row["with_tube"] != "yes":
            continue
        robot = nf.Robot(
            name="one notch",
            tube=nf.Tube(*tube, base_length=row["ring"]),
            notch=(nf.ArcNotch("off-axis", row["depth"], row["height"], uncut_length=row["ring"]),),
            tendon=(nf.Tendon(0.70, path="straight"),),
            material=nf.Linear(YOUNG, poisson_ratio=row["nu"]),
            friction=nf.Frictionless(),
        )
        second = float(nf.annular_segment(0.81, 0.70, row["depth"]).second_moment_weak)
        known = MOMENT * (row["height"] + row["delta_weak"]) / (YOUNG * second)
        # The known rotation is that of the plates: half of each ring lies outside ours.
        tube_moment = np.pi / 4 * (0.81**4 - 0.70**4)
        found = run(robot, options).notch_angle[0] + MOMENT * row["ring"] / (YOUNG * tube_moment)
        errors.append(float(found / known - 1.0))
        print(
            f"depth {row['depth']:.4f} height {row['height']:.1f} ring {row['ring']:.1f}: "
            f"{errors[-1]:+.2%}",
            flush=True,
        )
    print(f"{len(errors)} notches: largest {np.abs(errors).max():.2%}")


def wrist(mesh: str) -> None:
    """Compare every notch of wrist A at 1 N."""
    case = solid("A_lin_mu013_medium")
    level = next(i for i, one in enumerate(case.loads) if one.tension == 1.0)
    path = nf.simulate(case.robot, nf.pull(0.0, 1.0, 5))
    options = DeckOptions.of_mesh(mesh)  # type: ignore[arg-type]
    found = np.degrees(run(path, options).notch_angle)
    print("wrist A at 1 N, notches:", *(f"{one:+.2%}" for one in found / case.angles[level] - 1.0))


if __name__ == "__main__":
    chosen = sys.argv[1] if len(sys.argv) > 1 else "medium"
    wrist(chosen)
    notches(chosen)
