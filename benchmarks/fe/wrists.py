"""Whole wrists pulled to closing by finite elements: rows of tests/reference/fem_wrists_drawn.csv.

    python wrists.py OUT.csv [linear|nitinol] [COUNT]

`linear` draws COUNT (35) wrists of four notches from a Sobol sequence, without those that were
chosen by hand; `nitinol` has twelve. The deck is that of `notchflex export --inp` with two elements
through the wall and without contact. A wrist of linear material takes half a minute to two minutes
on one core, of nitinol two to seven; a table that is there is gone on with.
"""

from __future__ import annotations

import csv
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import calculix
import numpy as np
from scipy.stats import qmc

import notchflex as nf
from notchflex.export.formats import DeckOptions
from notchflex.export.mesh import mesh_of

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from fem_rings import read_rings
from fem_wrists import drawn

MESH = DeckOptions(2, 5, 6, 6, 8, contact=False)
STEPS, LEVELS = 6, 5
FINER = 1.003
"""Angles of finer meshes over those of this one."""
MOST_STRAIN, MOST_CLOSED = 0.13, 0.93  # of the law, at the largest tension
YOUNG = 60_000.0
NAMES = "outer inner cut depth height uncut base last notches material use tension_N angles_deg"
# Young's modulus, stress and slope of the plateau, MPa.
NITINOL = (
    (42000.0, 350.0, 6000.0),
    (55000.0, 450.0, 3000.0),
    (30600.0, 259.0, 8500.0),
    (60000.0, 480.0, 4000.0),
)
# Cut, outer and inner diameter, depth, height, uncut length; numbers of the materials.
TUBES = (
    ("off-axis", 1.62, 1.4, 1.4, 0.8, 1.2, (0, 3)),
    ("on-axis", 1.62, 1.4, 1.4, 0.8, 1.2, (0, 1)),
    ("off-axis", 2.0, 1.6, 1.6, 0.8, 1.0, (1, 0)),
    ("on-axis", 2.0, 1.7, 1.6, 0.7, 1.5, (1, 3)),
    ("off-axis", 1.8, 1.5, 1.55, 0.4, 0.8, (2, 1)),
    ("on-axis", 1.2, 0.9, 1.0, 0.5, 0.6, (0, 1)),
)


def linear(count: int) -> Iterator[dict[str, Any]]:
    """Draw wrists over the dimensions: diameters of 2 mm, ratios to it of a Sobol sequence."""

    def between(part: float, low: float, high: float) -> float:
        return round(2.0 * low * (high / low) ** part, 4)

    for number, part in enumerate(qmc.Sobol(7, seed=7).random(64)[:count]):
        cut = ("off-axis", "on-axis")[number % 2]
        bore = 0.64 + 0.29 * part[0]
        deepest = 0.92 if cut == "on-axis" else min(0.92, 0.5 * (1.0 + bore) - 0.03)
        yield {
            "outer": 2.0,
            "inner": round(2.0 * bore, 4),
            "cut": cut,
            "depth": round(2.0 * (0.68 + (deepest - 0.68) * part[1]), 4),
            "height": between(part[2], 0.15, 0.8),
            "uncut": between(part[3], 0.2, 2.0),
            "base": between(part[4], 0.12, 2.5),
            "last": between(part[5], 0.22, 2.5),
            "material": YOUNG,
        }


def nitinol() -> Iterator[dict[str, Any]]:
    """List wrists of usual proportions and materials that yield."""
    for cut, outer, inner, depth, height, uncut, materials in TUBES:
        for number in materials:
            yield {
                "outer": outer,
                "inner": inner,
                "cut": cut,
                "depth": depth,
                "height": height,
                **dict.fromkeys(("uncut", "base", "last"), uncut),
                "material": " ".join(f"{one:g}" for one in NITINOL[number]),
            }


def largest_tension(robot: nf.Robot) -> float:
    """Return the tension up to which the law neither closes nor overstrains a notch, N."""
    closing = np.asarray(robot.geometry.closing_angle)
    slope = nf.solve(robot, nf.Load(tension=1e-3)).notch_angle / 1e-3
    low, high = 0.0, float(np.min(closing / slope))
    for _ in range(14):
        middle = 0.5 * (low + high)
        path = nf.simulate(robot, nf.pull(0.0, middle, 9))
        inside = path.converged.all() and path.peak_strain[-1].max() < MOST_STRAIN
        inside = inside and np.all(path.notch_angle[-1] < MOST_CLOSED * closing)
        low, high = (middle, high) if inside else (low, middle)
    return low


def solved(robot: nf.Robot, tension: float) -> list[tuple[float, np.ndarray]]:
    """Return the tensions that the solid reached, N, and its angles between rings, deg."""
    # The deck is written at a ten-thousandth of the tension, far from any limit point of the law.
    path = nf.simulate(robot, nf.pull(0.0, 1e-4 * tension, 2))

    def larger(force: re.Match[str]) -> str:
        return f"{1e4 * float(force[0]):#.10g}"

    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder, "deck.inp")
        nf.export_robot(path, deck, MESH)
        text = re.sub(r"(?m)^[-\d.e]+(?=,-?100,1\.$)", larger, deck.read_text())
        steps = f"{1 / STEPS},1.,0.02,{1 / STEPS}"
        deck.write_text(text.replace("0.1,1.,1e-6,0.25", steps), encoding="utf-8")
        printed = calculix.run(Path(folder), "deck", to_the_end=False)  # a wrist may snap
    parts = re.split(r" displacements .*? time\s+(\S+)", printed)
    mesh = mesh_of(robot, MESH)
    return [
        (
            tension * float(time),
            np.degrees(read_rings(mesh, f" displacements x\n{body}").notch_angle),
        )
        for time, body in zip(parts[1::2], parts[2::2], strict=True)
    ]


def main() -> None:
    """Solve the wrists that the table lacks."""
    file, kind, count = (*sys.argv[1:], *("linear", "35")[len(sys.argv) - 2 :])
    names = NAMES.split()
    done: set[str] = set()
    if Path(file).exists():
        with Path(file).open(encoding="utf-8") as lines:
            done = {",".join(list(row.values())[:8]) for row in csv.DictReader(lines)}
    else:
        Path(file).write_text(",".join(names) + "\n", encoding="utf-8")
    for part in linear(int(count)) if kind == "linear" else nitinol():
        row = part | {"notches": 4, "use": "judge"}
        if ",".join(str(row[name]) for name in names[:8]) in done:
            continue
        robot = drawn(row)
        found = [one for one in solved(robot, largest_tension(robot)) if one[1].min() > 0.0]
        chosen = np.unique(np.linspace(0, len(found) - 1, min(LEVELS, len(found))).round())
        with Path(file).open("a", encoding="utf-8") as table:
            for tension, angles in (found[int(one)] for one in chosen):
                row["tension_N"] = f"{tension:.5g}"
                row["angles_deg"] = " ".join(f"{FINER * one:.5g}" for one in angles)
                table.write(",".join(str(row[name]) for name in names) + "\n")
        print(*part.values(), flush=True)


if __name__ == "__main__":
    main()
