"""The solid of a robot as a binary STL file: triangles in mm, in the frame of the base."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import __version__
from notchflex.export.cuts import cuts_of
from notchflex.export.document import Subject
from notchflex.export.options import SolidOptions
from notchflex.export.solids.checks import check_one_piece
from notchflex.export.tube_ends import tube_end
from notchflex.results.same_robot import robot_digest

if TYPE_CHECKING:
    from manifold3d import Manifold

STRETCHED = (
    "the model's strips overlap with the walls that they turn into; in the bent solid the material "
    "between them is stretched, by about 1 % of the volume."
)

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])


@dataclass(frozen=True)
class StlSolid:
    """A closed surface of triangles."""

    robot_digest: str
    solid: Manifold
    warnings: tuple[str, ...]

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers about the surface."""
        low, high = np.array(self.solid.bounding_box()).reshape(2, 3)
        return {
            "robot_hash": self.robot_digest,
            "triangles": self.solid.num_tri(),
            "volume_mm3": self.solid.volume(),
            "surface_mm2": self.solid.surface_area(),
            "holes": self.solid.genus(),
            "box_mm": [low.tolist(), high.tolist()],
        }

    def save(self, file: Path) -> None:
        """Write it."""
        mesh = self.solid.to_mesh64()
        points = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts, int)]
        normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        table = np.zeros(len(points), _TRIANGLE)
        table["normal"] = normal / np.where(length > 0.0, length, 1.0)
        table["corners"] = points
        head = f"notchflex {__version__}, robot {self.robot_digest}, mm".encode("ascii")
        count = np.array([len(points)], "<u4")
        file.write_bytes(head.ljust(80) + count.tobytes() + table.tobytes())


def stl_solid(subject: Subject, options: SolidOptions) -> StlSolid:
    """Make the solid of a robot as STL, straight as it is cut or bent as its state is.

    Raises:
        InputError: See `straight_solid`.
    """
    from notchflex.export.solids.bent import DeformationMap, bent_solid, is_bent
    from notchflex.export.solids.straight import straight_solid

    robot = subject.robot
    cuts = cuts_of(robot)
    end = tube_end(robot, cuts)
    solid = straight_solid(robot, cuts, end, options)
    check_one_piece(len(solid.decompose()))
    warnings = [end.warning] if end.warning else []
    if is_bent(subject):
        motion = DeformationMap(subject, cuts)
        solid = bent_solid(solid, motion, cuts)
        if not all(zone.along_tube for zone in motion.zones):
            warnings.append(STRETCHED)
    return StlSolid(robot_digest(robot), solid, tuple(warnings))
