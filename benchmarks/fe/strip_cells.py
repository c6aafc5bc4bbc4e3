"""Finite elements of a strip between two opposite slots: its compliance, with gmsh and CalculiX.

    python strip_cells.py strip|link PARTS.csv OUT.csv

computes the parts of one table (those in tests/reference: fem_strip_cells.csv and
fem_u_link_cells.csv) anew, and writes them to another. Parts to "fit" differ from the first in one
number; those to "judge" were not fitted.

Half of the tube (x > 0) is meshed with quadratic tetrahedra. One face is held, the other is moved
as a rigid plate in the six ways, three of them symmetric about x = 0 and three antisymmetric. The
energies of these fields within the cell of one strip give its compliance, in the six directions
(ux, uy, uz, rx, ry, rz), at the middle of the strip: y along the strip, z along the tube.

A cell of sharp notches (`Strip`) reaches an eighth of the diameter beyond them; a cell of slots
with round ends (`Link`) lies between the middles of neighbouring slots of a row of six.
"""

from __future__ import annotations

import csv
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np
from calculix import ORDER, PRINTED, displacements, solid_lines

BODY = 0.5  # uncut length beyond the last cut, over the outer diameter
NAMES = ("ux", "uy", "uz", "rx", "ry", "rz")


@dataclass(frozen=True)
class Strip:
    """A pair of opposite right-triangular notches whose straight edges bound the strip."""

    outer: float
    inner: float
    thickness: float
    depth: float
    height: float
    nu: float = 0.4
    pairs: int = 1

    @property
    def middles(self) -> list[float]:
        """Heights of the middles of the strips, pairs adjoining, mm."""
        pitch = self.height + self.thickness
        return [(k - 0.5 * (self.pairs - 1)) * pitch for k in range(self.pairs)]

    @property
    def top(self) -> float:
        """Half the length of the model, mm."""
        return self.middles[-1] + 0.5 * self.thickness + self.height + BODY * 2.0 * self.outer

    @property
    def cell(self) -> float:
        """Half the length of the cell, mm: to an eighth of the diameter beyond the notches."""
        return self.middles[-1] + 0.5 * self.thickness + self.height + 0.25 * self.outer

    @property
    def tips(self) -> list[tuple[float, float]]:
        """Ends (y, z) of the cuts, where the mesh is fine."""
        y, z = self.depth - self.outer, 0.5 * self.thickness
        return [(side * y, at + side * z) for at in self.middles for side in (-1.0, 1.0)]

    def cuts(self) -> list[int]:
        """Make the solids to cut away."""
        made = []
        tip, z, far = self.outer - self.depth, -0.5 * self.thickness, 1.2 * self.outer
        low = z - self.height * (far - tip) / self.depth
        for at in self.middles:
            for sign in (1.0, -1.0):
                cut = _prism([(tip, z), (far, z), (far, low)], sign, 2.0 * self.outer)
                gmsh.model.occ.translate([(3, cut)], 0.0, 0.0, at)
                made.append(cut)
        return made


@dataclass(frozen=True)
class Link:
    """A strip of a row of six slots with round ends, cut from the two sides in turn."""

    outer: float
    inner: float
    thickness: float
    length: float
    slot_radius: float
    nu: float = 0.33
    slots: int = 6

    @property
    def pitch(self) -> float:
        """Length of tube for a slot and a strip, mm."""
        return 2.0 * self.slot_radius + self.thickness

    @property
    def top(self) -> float:
        """Half the length of the model, mm."""
        return 0.5 * self.slots * self.pitch + 1.5 * self.outer / 3.0

    @property
    def cell(self) -> float:
        """Half the length of the cell, mm."""
        return 0.5 * self.pitch

    @property
    def tips(self) -> list[tuple[float, float]]:
        """Ends (y, z) of the slots of the cell."""
        y = 0.5 * self.length
        return [(-y, -0.5 * self.pitch), (y, 0.5 * self.pitch)]

    def cuts(self) -> list[int]:
        """Make the solids to cut away; the slot below the middle strip is cut from y > 0."""
        made, r = [], self.slot_radius
        for number in range(self.slots):
            z = (number - 0.5 * (self.slots - 1)) * self.pitch
            side = 1.0 if (number - self.slots // 2) % 2 else -1.0
            y = -0.5 * self.length * side
            far = 1.2 * self.outer * side
            box = gmsh.model.occ.addBox(
                -1.0, min(y, far), z - r, 2.0 * self.outer + 1.0, abs(far - y), 2.0 * r
            )
            end = gmsh.model.occ.addCylinder(-1.0, y, z, 2.0 * self.outer + 1.0, 0.0, 0.0, r)
            made += [box, end]
        return made


def _prism(corners: list[tuple[float, float]], sign: float, deep: float) -> int:
    """Extrude a polygon (y, z) along x; the sign -1 turns it by half a turn about x."""
    occ = gmsh.model.occ
    points = [occ.addPoint(-1.0, sign * y, sign * z) for y, z in corners]
    lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    return next(tag for dim, tag in occ.extrude([(2, face)], deep + 1.0, 0, 0) if dim == 3)


def mesh(part: Strip | Link, fine: float, coarse: float) -> tuple[np.ndarray, np.ndarray]:
    """Mesh half of a part.

    Args:
        part: The geometry.
        fine: Size of the elements near the tips of the cuts and in the strip, mm.
        coarse: Their size far away, mm.

    Returns:
        Nodes (n, 3) and the tetrahedra's nodes (m, 10), in CalculiX's order.
    """
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    occ = gmsh.model.occ
    long = 2.0 * part.top
    tube = occ.addCylinder(0, 0, -part.top, 0, 0, long, part.outer)
    bore = occ.addCylinder(0, 0, -part.top, 0, 0, long, part.inner)
    wall, _ = occ.cut([(3, tube)], [(3, bore)])
    half = occ.addBox(0, -2 * part.outer, -part.top, 2 * part.outer, 4 * part.outer, long)
    wall, _ = occ.intersect(wall, [(3, half)])
    wall, _ = occ.cut(wall, [(3, tag) for tag in part.cuts()])
    if part.cell < part.top:
        size = 4 * part.outer
        box = occ.addBox(-1, -0.5 * size, -part.cell, size, size, 2 * part.cell)
        inside, _ = occ.intersect(wall, [(3, box)], removeObject=False)
        occ.fragment(wall, inside)
    occ.synchronize()
    curves = [
        tag
        for _, tag in gmsh.model.getEntities(1)
        if _near(gmsh.model.occ.getCenterOfMass(1, tag), part)
    ]
    field = gmsh.model.mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, "CurvesList", curves)
    field.setNumber(distance, "Sampling", 60)
    size = field.add("Threshold")
    t = part.thickness
    for name, value in (
        ("InField", distance), ("SizeMin", fine), ("SizeMax", coarse),
        ("DistMin", 0.05 * t), ("DistMax", 4.0 * t),
    ):  # fmt: skip
        field.setNumber(size, name, value)
    field.setAsBackgroundMesh(size)
    for name in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{name}", 0)
    gmsh.option.setNumber("Mesh.Algorithm3D", 1)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    tags, where, _ = gmsh.model.mesh.getNodes()
    _, cells = gmsh.model.mesh.getElementsByType(11)
    gmsh.finalize()
    used, inverse = np.unique(cells, return_inverse=True)
    place = np.full(int(tags.max()) + 1, -1)
    place[tags.astype(int)] = np.arange(len(tags))
    nodes = where.reshape(-1, 3)[place[used.astype(int)]]
    cells = inverse.reshape(-1, 10)[:, ORDER]
    _straighten(nodes, cells)
    return nodes, cells


def _straighten(nodes: np.ndarray, cells: np.ndarray) -> None:
    """Straighten the edges of elements that the curved wall has folded or nearly so."""
    for _ in range(5):
        volume = np.linalg.det(np.einsum("pnk,enx->epkx", _local_slopes(_CHECKED), nodes[cells]))
        bad = cells[volume.min(axis=1) < 0.05 * np.abs(volume).max(axis=1)]
        if len(bad) == 0:
            return
        for number, (a, b) in enumerate(_EDGES):
            nodes[bad[:, 4 + number]] = 0.5 * (nodes[bad[:, a]] + nodes[bad[:, b]])


def _near(centre: tuple[float, float, float], part: Strip | Link) -> bool:
    """Whether an edge lies at the tip of a cut, where sharp or round."""
    reach = 0.05 * part.thickness if isinstance(part, Strip) else 1.01 * part.slot_radius
    return any(
        np.hypot(centre[1] - y, centre[2] - z) < reach and abs(centre[2]) <= part.cell + 1e-9
        for y, z in part.tips
    )


def solve(part: Strip | Link, nodes: np.ndarray, cells: np.ndarray, work: Path) -> np.ndarray:
    """Move the upper face in six ways, E = 1.

    Returns:
        Displacements (6, n, 3).
    """
    eps = 1e-6 * part.top
    top = np.flatnonzero(nodes[:, 2] > part.top - eps)
    bottom = np.flatnonzero(nodes[:, 2] < -part.top + eps)
    cut = np.setdiff1d(np.flatnonzero(nodes[:, 0] < eps), np.concatenate([top, bottom]))
    motion = np.zeros((6, len(top), 3))
    for axis in range(3):
        motion[axis, :, axis] = 1.0
        motion[3 + axis] = np.cross(np.eye(3)[axis], nodes[top])
    lines = solid_lines(enumerate(nodes, 1), cells + 1, 1.0, part.nu)
    fields = np.zeros((6, len(nodes), 3))
    for name, held, cases in (("even", (0,), (1, 2, 3)), ("odd", (1, 2), (0, 4, 5))):
        deck = list(lines)
        for case in cases:
            deck += ["*STEP", "*STATIC", "*BOUNDARY, OP=NEW"]
            deck += [f"{n + 1},1,3,0." for n in bottom]
            deck += [f"{n + 1},{d + 1},{d + 1},0." for n in cut for d in held]
            deck += [
                f"{n + 1},{d + 1},{d + 1},{motion[case, k, d]:.12g}"
                for k, n in enumerate(top)
                for d in range(3)
            ]
            deck += PRINTED
        _, moved = displacements(work, name, deck)
        fields[list(cases)] = moved.reshape(len(cases), len(nodes), 3)
    return fields


# Quadrature of the tetrahedron, exact to degree 2, in barycentric coordinates.
_A, _B = 0.5854101966249685, 0.1381966011250105
_POINTS = np.full((4, 4), _B) + (_A - _B) * np.eye(4)
_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))

# Where a folded element shows: its corners and the points of the quadrature.
_CHECKED = np.concatenate([_POINTS, np.eye(4)])


def _local_slopes(points: np.ndarray) -> np.ndarray:
    """Slopes of the shape functions by three barycentric coordinates, (points, 10, 3)."""
    slopes = np.zeros((len(points), 10, 4))
    for k in range(4):
        slopes[:, k, k] = 4.0 * points[:, k] - 1.0
    for number, (a, b) in enumerate(_EDGES):
        slopes[:, 4 + number, a] = 4.0 * points[:, b]
        slopes[:, 4 + number, b] = 4.0 * points[:, a]
    return slopes[..., 1:] - slopes[..., :1]


def energies(
    part: Strip | Link, nodes: np.ndarray, cells: np.ndarray, fields: np.ndarray, half: float
) -> np.ndarray:
    """Compute twice the mutual energies (6, 6) of fields within |z| < half, both halves."""
    inside = np.abs(nodes[cells[:, :4]][..., 2].mean(axis=1)) < half
    cells = cells[inside]
    local = _local_slopes(_POINTS)
    jacobian = np.einsum("pnk,enx->epkx", local, nodes[cells])
    volume = np.abs(np.linalg.det(jacobian)) / 24.0
    gradient = np.einsum("epxk,pnk->epnx", np.linalg.inv(jacobian), local)
    moved = fields[:, cells]
    slope = np.einsum("cenx,epny->cepxy", moved, gradient)
    strain = 0.5 * (slope + slope.swapaxes(-1, -2))
    shear = 1.0 / (2.0 * (1.0 + part.nu))
    lame = part.nu / ((1.0 + part.nu) * (1.0 - 2.0 * part.nu))
    trace = np.trace(strain, axis1=-2, axis2=-1)
    both = 2.0 * shear * np.einsum("cepxy,depxy,ep->cd", strain, strain, volume)
    both += lame * np.einsum("cep,dep,ep->cd", trace, trace, volume)
    even = np.array([0, 1, 1, 1, 0, 0])
    return 2.0 * both * (even[:, None] == even)


def compliance(
    part: Strip | Link, work: Path, fine: float, coarse: float
) -> tuple[np.ndarray, np.ndarray, int]:
    """Compute E times the compliance, at the origin, of the cell and of the whole.

    Returns:
        Both (6, 6), and the number of nodes.
    """
    nodes, cells = mesh(part, fine, coarse)
    fields = solve(part, nodes, cells, work)
    stiffness = energies(part, nodes, cells, fields, np.inf)
    whole = np.linalg.inv(stiffness)
    cell = whole @ energies(part, nodes, cells, fields, part.cell) @ whole
    return cell, whole, len(nodes)


ENTRIES = [(i, j) for i in range(6) for j in range(i, 6) if (i in (1, 2, 3)) == (j in (1, 2, 3))]


def sizes(part: Strip | Link) -> tuple[float, float]:
    """Sizes of the elements of a part, fine and coarse, mm."""
    if isinstance(part, Strip):
        return part.thickness / 16.0, 0.25 * part.outer
    return min(part.thickness / 7.0, part.slot_radius / 2.5), 0.12 * part.outer


def main(kind: type[Strip] | type[Link], parts: Path, out: Path) -> None:
    """Write E times the compliance of each part that the table `out` has not yet."""
    heads = [f"EC_{NAMES[i]}_{NAMES[j]}" for i, j in ENTRIES]
    with parts.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    keys = list(rows[0])[1:7]
    if not out.exists():
        out.write_text(",".join(["use", *keys, "nodes", *heads]) + "\n", encoding="utf-8")
    done = len(out.read_text(encoding="utf-8").splitlines()) - 1
    for row in rows[done:]:
        begun = time.time()
        part = kind(**{key: float(row[key]) for key in keys})
        with tempfile.TemporaryDirectory() as work:
            cell, _, nodes = compliance(part, Path(work), *sizes(part))
        words = [row["use"], *(row[key] for key in keys), nodes]
        words += [f"{cell[entry]:.6g}" for entry in ENTRIES]
        with out.open("a", encoding="utf-8") as file:
            file.write(",".join(map(str, words)) + "\n")
        print(f"{part} {nodes} nodes, {time.time() - begun:.0f} s", flush=True)


if __name__ == "__main__":
    main({"strip": Strip, "link": Link}[sys.argv[1]], *map(Path, sys.argv[2:]))
