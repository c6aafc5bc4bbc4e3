"""Finite elements of wrist A under a force across its plane of bending, with gmsh and CalculiX.

    python wrist_sideways.py [ELEMENT_SIZE] > fem_wrist_sideways.csv

The base is clamped, 0.02 N act along x, spread over the end face. The rotation of every ring is a
least-squares fit of a rigid motion to its middle slice. Off-axis cuts from +y; it bends in y, z.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import gmsh
import numpy as np
from calculix import ORDER, PRINTED, displacements, solid_lines

OUTER, INNER, DEPTH, HEIGHT, UNCUT, NOTCHES = 0.81, 0.70, 1.40, 0.8, 1.2, 5
LENGTH = UNCUT + NOTCHES * (HEIGHT + UNCUT)
YOUNG, POISSON, FORCE = 60_000.0, 0.33, 0.02


def mesh(size: float) -> tuple[dict[int, np.ndarray], np.ndarray, np.ndarray]:
    """Mesh the wrist with quadratic tetrahedra: nodes, elements, triangles of the end face."""
    gmsh.initialize(["", "-v", "1"])
    shape = gmsh.model.occ
    tube = [(3, shape.addCylinder(0, 0, 0, 0, 0, LENGTH, OUTER))]
    bore = [(3, shape.addCylinder(0, 0, -1, 0, 0, LENGTH + 2, INNER))]
    faces = UNCUT + np.arange(NOTCHES) * (HEIGHT + UNCUT)
    cuts = [(3, shape.addBox(-2, OUTER - DEPTH, z, 4, 3, HEIGHT)) for z in faces]
    shape.cut(tube, [*bore, *cuts])
    shape.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.model.mesh.generate(3)
    numbers, places, _ = gmsh.model.mesh.getNodes()
    nodes = dict(zip(numbers.astype(int).tolist(), places.reshape(-1, 3), strict=True))
    cells = gmsh.model.mesh.getElements(3)[2][0].reshape(-1, 10).astype(int)
    every = gmsh.model.mesh.getElements(2)[2][0].reshape(-1, 6).astype(int)
    at_end = [all(abs(nodes[n][2] - LENGTH) < 1e-6 for n in row) for row in every.tolist()]
    used = set(cells.ravel().tolist())
    return {n: nodes[n] for n in used}, cells[:, ORDER], every[at_end]


def solve(
    nodes: dict[int, np.ndarray], cells: np.ndarray, end: np.ndarray
) -> dict[int, np.ndarray]:
    """Write the deck, run CalculiX, read the displacements."""
    force: dict[int, float] = dict.fromkeys(end[:, 3:].ravel().tolist(), 0.0)
    areas = [
        0.5 * np.linalg.norm(np.cross(nodes[b] - nodes[a], nodes[c] - nodes[a]))
        for a, b, c in end[:, :3].tolist()
    ]
    for row, area in zip(end[:, 3:].tolist(), areas, strict=True):
        for node in row:  # a constant traction loads the middle nodes alone
            force[node] += FORCE * area / sum(areas) / 3.0
    base = [n for n, place in nodes.items() if abs(place[2]) < 1e-6]
    lines = solid_lines(nodes.items(), cells, YOUNG, POISSON)
    lines += ["*NSET, NSET=BASE", *(f"{n}," for n in base), "*STEP", "*STATIC"]
    lines += ["*BOUNDARY", "BASE,1,3", "*CLOAD", *(f"{n},1,{f:.10g}" for n, f in force.items())]
    with tempfile.TemporaryDirectory() as folder:
        numbers, moved = displacements(Path(folder), "wrist", lines + PRINTED)
    return dict(zip(numbers.tolist(), moved, strict=True))


def rotation(nodes: dict[int, np.ndarray], moved: dict[int, np.ndarray], z: float) -> np.ndarray:
    """Fit a rigid motion to a slice of 0.12 mm; return its rotation."""
    slice_ = [n for n, at in nodes.items() if abs(at[2] - z) < 0.06]
    at = np.array([nodes[n] for n in slice_])
    x, y, w = (at - at.mean(axis=0)).T
    none = 0.0 * x
    turns = np.array([[none, w, -y], [-w, none, x], [y, -x, none]]).transpose(2, 0, 1)
    matrix = np.concatenate([np.tile(np.eye(3), (len(x), 1, 1)), turns], axis=2)
    right = np.array([moved[n] for n in slice_]).ravel()
    return np.linalg.lstsq(matrix.reshape(-1, 6), right, rcond=None)[0][3:]


if __name__ == "__main__":
    nodes, cells, end = mesh(float(sys.argv[1]) if len(sys.argv) > 1 else 0.10)
    moved = solve(nodes, cells, end)
    print("ring,twist,bend")
    for ring in range(1, NOTCHES + 1):
        _, about_y, about_z = rotation(nodes, moved, ring * (HEIGHT + UNCUT) + 0.5 * UNCUT)
        print(f"{ring},{-about_z:.8e},{about_y:.8e}")
