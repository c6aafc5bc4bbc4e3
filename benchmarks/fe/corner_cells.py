"""Strain at the rounded corner of an on-axis cut by finite elements.

    python corner_cells.py ../../tests/reference/fem_corner_cells.csv cells.csv

Needs gmsh, scikit-fem, meshio and pypardiso. A cell is the half of a notch and of the ring behind
it, of a long row, and by symmetry half of these; lengths are over the outer diameter. It is meshed
as a flat sheet, 4 hexahedra of 27 nodes through the wall and 8 along a corner, and rolled up. Its
ends stay plane and turn against each other, without axial force. The factor is the largest
principal strain at the nodes of the corner over M e/(E I) of the section.
"""

import csv
import sys
from pathlib import Path
from typing import Any

import gmsh
import meshio
import numpy as np
import pypardiso
from skfem import Basis, ElementHex2, ElementVector, MeshHex2, asm
from skfem.io.meshio import from_meshio
from skfem.models.elasticity import lame_parameters, linear_elasticity

POISSON_RATIO, LAYERS, ALONG_CORNER = 0.33, 4, 8
OUTER = 0.5


def sheet(width: float, around: float, half: float, top: float, radius: float) -> tuple[Any, Any]:
    """Mesh the flat sheet: half the wall that is left, and half a ring above it."""
    fine, coarse = 0.5 * np.pi * radius / ALONG_CORNER, min(half, top - half, width) / 2.5
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    geometry = gmsh.model.geo
    corners = [
        (0.0, 0.0, coarse), (width, 0.0, coarse), (width, half - radius, fine),
        (width + radius, half, fine), (around, half, 3.0 * coarse), (around, top, 3.0 * coarse),
        (0.0, top, coarse),
    ]  # fmt: skip
    points = [geometry.addPoint(x, z, 0.0, size) for x, z, size in corners]
    centre = geometry.addPoint(width + radius, half - radius, 0.0, fine)
    pairs = list(zip(points, points[1:] + points[:1], strict=True))
    lines = [
        geometry.addCircleArc(first, centre, last) if number == 2 else geometry.addLine(first, last)
        for number, (first, last) in enumerate(pairs)
    ]
    surface = geometry.addPlaneSurface([geometry.addCurveLoop(lines)])
    geometry.synchronize()
    for name, value in (
        ("Algorithm", 8),
        ("RecombinationAlgorithm", 1),
        ("SubdivisionAlgorithm", 1),
    ):
        gmsh.option.setNumber(f"Mesh.{name}", value)
    gmsh.model.mesh.setRecombine(2, surface)
    gmsh.model.mesh.generate(2)
    tags, places, _ = gmsh.model.mesh.getNodes()
    (_,), _, (quads,) = gmsh.model.mesh.getElements(2)
    gmsh.finalize()
    used, numbers = np.unique(quads, return_inverse=True)
    order = np.argsort(tags)
    rows = order[np.searchsorted(tags[order], used)]
    return places.reshape(-1, 3)[rows, :2], numbers.reshape(-1, 4)


def rolled(cell: dict[str, float]) -> tuple[MeshHex2, np.ndarray, float]:
    """Mesh a cell; return also the nodes of its corner, and the half angle of the wall left."""
    inner, half = OUTER - cell["wall"], 0.5 * cell["height"]
    middle, radius = 0.5 * (OUTER + inner), cell["radius"]
    angle = float(np.arccos((cell["depth"] - OUTER) / OUTER))
    width, top = angle * middle, half + 0.5 * cell["ring"]
    flat, quads = sheet(width, np.pi * middle, half, top, radius)
    levels = np.linspace(-0.5, 0.5, LAYERS + 1) * cell["wall"]
    nodes = np.vstack([np.column_stack([flat, np.full(len(flat), level)]) for level in levels])
    shifts = len(flat) * np.arange(LAYERS)[:, None, None]
    hexes = np.concatenate([quads + shifts, quads + shifts + len(flat)], axis=-1).reshape(-1, 8)
    mesh = MeshHex2.from_mesh(from_meshio(meshio.Mesh(nodes, {"hexahedron": hexes})))
    along, height, out = mesh.doflocs.copy()
    # Nodes between two of the corner move onto its circle.
    x, z = along - (width + radius), height - (half - radius)
    size = np.hypot(x, z)
    near = (x < 1e-9) & (z > -1e-9) & (np.abs(size / radius - 1.0) < 0.02)
    along[near] = width + radius + x[near] * radius / size[near]
    height[near] = half - radius + z[near] * radius / size[near]
    turned, far = along / middle, middle + out
    places = np.vstack([-far * np.cos(turned), far * np.sin(turned), height])
    return MeshHex2(places, mesh.t), np.flatnonzero(near), angle


def factor(cell: dict[str, float]) -> float:
    """Return the strain at the corner over that of the section; Young's modulus is 1."""
    mesh, corner, angle = rolled(cell)
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=4)
    stiffness = asm(linear_elasticity(*lame_parameters(1.0, POISSON_RATIO)), basis)
    x, y, z = basis.doflocs
    component = np.zeros(len(x), int)
    for axis in range(3):
        component[basis.get_dofs(elements=True).all([f"u^{axis + 1}"])] = axis
    ends, end = (np.abs(z) < 1e-9, np.abs(z - z.max()) < 1e-9), component == 2
    held = ((ends[0] | ends[1]) & end) | ((np.abs(y) < 1e-9) & (component == 1))
    held[np.flatnonzero((component == 0) & ends[0] & (np.abs(y) < 1e-9))[0]] = True
    free, moved = np.flatnonzero(~held), np.flatnonzero(ends[1] & end)
    shapes = np.zeros((len(x), 2))  # a stretch, and a turn about y
    shapes[moved] = np.column_stack([np.ones(len(moved)), x[moved]])
    right = -(stiffness @ shapes)[free]
    shapes[free] = pypardiso.spsolve(stiffness[free][:, free].tocsr(), right)
    forces = (stiffness @ shapes)[moved]
    axial, turning = forces.sum(axis=0), x[moved] @ forces
    without = axial[1] / axial[0]
    moment = 2.0 * abs(turning[1] - without * turning[0])
    strain = _largest(mesh, basis, shapes[:, 1] - without * shapes[:, 0], corner)
    inner = OUTER - cell["wall"]
    area = angle * (OUTER**2 - inner**2)
    centroid = -2.0 * np.sin(angle) * (OUTER**3 - inner**3) / (3.0 * area)
    second = 0.25 * (OUTER**4 - inner**4) * (angle + np.sin(angle) * np.cos(angle))
    second -= area * centroid**2
    edge = max(-OUTER * np.cos(angle), -inner * np.cos(angle)) - centroid
    return strain * second / (moment * edge)


def _largest(mesh: MeshHex2, basis: Basis, moves: np.ndarray, nodes: np.ndarray) -> float:
    """Return the largest principal strain at nodes, mean of the elements there."""
    places = ElementHex2().doflocs.T
    near = np.flatnonzero(np.isin(mesh.t, nodes).any(axis=0))
    at_nodes = Basis(mesh, basis.elem, quadrature=(places, np.ones(len(places.T))), elements=near)
    slopes = at_nodes.interpolate(moves).grad.reshape(3, 3, -1)
    strains = 0.5 * (slopes + slopes.swapaxes(0, 1)).transpose(2, 0, 1)
    found = np.round(at_nodes.global_coordinates().value.reshape(3, -1).T / 1e-7).astype(int)
    wanted = np.round(mesh.doflocs[:, nodes].T / 1e-7).astype(int)
    index = {tuple(place): number for number, place in enumerate(wanted)}
    sums, counts = np.zeros((len(nodes), 3, 3)), np.zeros(len(nodes))
    for place, strain in zip(map(tuple, found), strains, strict=True):
        if place in index:
            sums[index[place]] += strain
            counts[index[place]] += 1
    return float(np.abs(np.linalg.eigvalsh(sums / counts[:, None, None])).max())


def main() -> None:
    """Compute all cells of a table."""
    source, target = map(Path, sys.argv[1:])
    with source.open(encoding="utf-8") as lines:
        cells = list(csv.DictReader(lines))
    with target.open("w", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, [*cells[0]])
        writer.writeheader()
        for cell in cells:
            numbers = {key: float(value) for key, value in cell.items() if key != "use"}
            writer.writerow(cell | {"factor": f"{factor(numbers):.4f}"})
            lines.flush()


if __name__ == "__main__":
    main()
