"""Finite elements of chains of equal arc notches: the cell of the middle notch, with CalculiX.

    python notch_cells.py CELLS.csv OUT.csv

computes the cells of tests/reference/fem_notch_chain.csv, or of another table with its first seven
columns and `use`, anew; a table that is there is gone on with.

A quarter of a chain of five notches is meshed (the mesh of `export --inp`), from the middle of the
third notch to a rigid plate. Symmetry or antisymmetry in the plane of bending and in the middle of
the notch sort the six loads into four decks. The energy of the cell, which reaches to the middle of
the ring, is its compliance in the middle of the notch on the tube axis; of that the ring's own, as
a beam, is taken off.
"""

from __future__ import annotations

import csv
import sys
import tempfile
import warnings
from pathlib import Path

import calculix
import numpy as np

import notchflex as nf
from notchflex.export.formats import DeckOptions
from notchflex.export.mesh import TubeMesh, mesh_of
from notchflex.mechanics.cuts import SECTION_OF_CUT

MESH = DeckOptions(2, 8, 9, 12, 16)
NOTCHES = 5
# What is held in the plane of bending, in the middle of the notch and of the plate, and what is
# loaded in turn: x toward the notch, y across, z along, and the turns about them as 4, 5, 6.
DECKS = (
    ((2,), (3,), (1, 2, 4, 6), ((3,), (5,), (3, 5))),
    ((2,), (1, 2), (2, 3, 4, 5, 6), ((1,),)),
    ((1, 3), (3,), (1, 2, 3, 5, 6), ((4,),)),
    ((1, 3), (1, 2), (1, 3, 4, 5), ((2,), (6,), (2, 6))),
)
GIVEN = ("OD", "ID", "cut", "depth", "height", "ring", "nu", "use")
FOUND = (
    *("delta_weak", "delta_strong", "delta_axial", "uz_rx", "rz"),
    *("shear_centre", "shear_x", "shear_y"),
)


def mesh(row: dict[str, str]) -> TubeMesh:
    """Mesh half of the tube of a chain."""
    outer, inner, depth, height, ring = (
        float(row[name]) for name in ("OD", "ID", "depth", "height", "ring")
    )
    cut = "on-axis" if row["cut"] == "on-axis" else "off-axis"
    with warnings.catch_warnings(action="ignore"):  # a modulus of 1
        robot = nf.Robot(
            name="chain",
            tube=nf.Tube(outer, inner, base_length=ring),
            notch=(nf.ArcNotch(cut, depth, height, uncut_length=ring),) * NOTCHES,
            tendon=(nf.Tendon(0.5 * inner, path="straight"),),
            material=nf.Linear(1.0),
            friction=nf.Frictionless(),
        )
    return mesh_of(robot, MESH)


def compliances(row: dict[str, str]) -> dict[tuple[int, ...], float]:
    """Compute the compliance of the cell to loads and to sums of two, E = 1."""
    whole = mesh(row)
    middle = float(whole.heights[whole.faces[NOTCHES // 2].sum() // 2])
    end = middle + 0.5 * (float(row["height"]) + float(row["ring"]))
    height = whole.place[whole.elements - 1, 2]
    upper = height.min(axis=1) > middle - 1e-9
    elements, in_cell = whole.elements[upper], height[upper].max(axis=1) < end + 1e-9
    numbers = np.unique(elements)
    place = whole.place[numbers - 1]
    plate = numbers[place[:, 2] == whole.heights[-1]]
    sets = {
        "PLATE": plate,
        "PLANE": np.setdiff1d(numbers[np.abs(place[:, 1]) < 1e-9], plate),
        "MIDDLE": numbers[place[:, 2] == middle],
    }
    node = len(whole.place) + 1
    lines = ["*NODE, NSET=ALL"]
    lines += [
        f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in zip(numbers, place, strict=True)
    ]
    lines += [f"{n},0.,0.,{middle:.12g}" for n in (node, node + 1)]
    lines += ["*ELEMENT, TYPE=C3D20R, ELSET=SOLID"]
    for number, cell in enumerate(elements.tolist(), 1):
        lines += [",".join(map(str, [number, *cell[:10]])) + ",", ",".join(map(str, cell[10:]))]
    lines += ["*ELSET, ELSET=CELL", *(f"{n}," for n in 1 + np.flatnonzero(in_cell))]
    for name, nodes in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{n}," for n in nodes)]
    lines += ["*MATERIAL, NAME=TUBE", "*ELASTIC", f"1.,{row['nu']}"]
    lines += ["*SOLID SECTION, ELSET=SOLID, MATERIAL=TUBE"]
    lines += [f"*RIGID BODY, NSET=PLATE, REF NODE={node}, ROT NODE={node + 1}", "*BOUNDARY"]
    plate_at = {axis: f"{node + (axis > 3)},{(axis - 1) % 3 + 1}" for axis in range(1, 7)}
    found = {}
    for plane, at_middle, held, loads in DECKS:
        deck = [*lines, *(f"PLANE,{axis},{axis}" for axis in plane)]
        deck += [f"MIDDLE,{axis},{axis}" for axis in at_middle]
        deck += [plate_at[axis] for axis in held]
        for load in loads:
            deck += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", *(f"{plate_at[i]},0.5" for i in load)]
            deck += ["*EL PRINT, ELSET=CELL, TOTALS=ONLY", "ELSE", "*END STEP"]
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "cell.inp").write_text("\n".join(deck) + "\n", encoding="utf-8")
            printed = [line.split() for line in calculix.run(Path(folder), "cell").splitlines()]
        energies = [float(words[0]) for words in printed if len(words) == 1]
        # Half of the work, of a quarter of the cell.
        found |= {load: 8.0 * energy for load, energy in zip(loads, energies, strict=True)}
    return found


def results(row: dict[str, str]) -> list[float]:
    """Compute the columns `FOUND` of a row."""
    found = compliances(row)
    stretch, rotation = ((found[i, j] - found[i,] - found[j,]) / 2 for i, j in ((3, 5), (2, 6)))
    outer, inner = 0.5 * float(row["OD"]), 0.5 * float(row["ID"])
    height, ring, nu = (float(row[name]) for name in ("height", "ring", "nu"))
    section = SECTION_OF_CUT[row["cut"]](outer, inner, float(row["depth"]))
    area, second = np.pi * (outer**2 - inner**2), np.pi / 4 * (outer**4 - inner**4)
    # The tube as a beam, with Cowper's coefficient of shear.
    hollow = (1 + (inner / outer) ** 2) ** 2
    cowper = 6 * (1 + nu) * hollow
    cowper /= (7 + 6 * nu) * hollow + (20 + 12 * nu) * (inner / outer) ** 2
    across = ((height + ring) ** 3 - height**3) / (12 * second) + 2 * (
        1 + nu
    ) * ring / cowper / area
    weak, strong = found[5,] - ring / second, found[4,] - ring / second
    along, twist = found[3,] - ring / area, found[6,] - (1 + nu) * ring / second
    return [
        weak * float(section.second_moment_weak) - height,
        strong * float(section.second_moment_strong) - height,
        (along - stretch**2 / weak) * float(section.area) - height,
        abs(stretch),
        twist,
        abs(rotation) / twist,
        found[2,] - across - rotation**2 / twist,
        found[1,] - across,
    ]


def main(cells: Path, out: Path) -> None:
    """Write each cell that the table `out` has not yet."""
    with cells.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not out.exists():
        out.write_text(",".join(GIVEN[:-1] + FOUND + GIVEN[-1:]) + "\n", encoding="utf-8")
    for row in rows[len(out.read_text(encoding="utf-8").splitlines()) - 1 :]:
        numbers = [f"{number:.7g}" for number in results(row)]
        with out.open("a", encoding="utf-8") as file:
            words = [*(row[name] for name in GIVEN[:-1]), *numbers, row["use"]]
            file.write(",".join(words) + "\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
