"""A gap of a robot of disks: a round backbone, free from one disk to the next."""

from dataclasses import KW_ONLY
from typing import Annotated, ClassVar, Literal

from notchflex.robot.cuts import CutLayout, whole_gap
from notchflex.robot.kinds import Notch, Tendon, Tube
from notchflex.robot.part import Float, Problems, part, positive, quantity


@part
class RodGap(Notch):
    """A gap between two disks; the round or tubular backbone between them bends, and stretches.

    The disk behind the gap is a rigid piece of the tube, as thick as `uncut_length`. `[tube]`
    describes disks and base: their outer diameter, and the hole that holds the backbone. The
    backbone bends to all sides alike; `direction_deg` is the plane of its precurvature.

    Args:
        length: Free length of the backbone between the disks [mm].
        diameter: Outer diameter of the backbone [mm].
        inner_diameter: Inner diameter of a tubular backbone [mm]; 0 is a round one.
        uncut_length: Thickness of the disk behind the gap [mm].
        disk_mass: Mass of that disk [g]; None takes a ring of the tube, as dense as the material.
        direction_deg: Side toward which a precurved backbone bends [deg].
        precurvature_deg: Angle of the gap without loads [deg], of constant curvature.
        repeat: Number of equal gaps in a row.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> RodGap(length=20.0, diameter=1.4, uncut_length=0.0, repeat=20).length
        20.0
    """

    length: Annotated[Float, positive("mm", "free length of the backbone", usual=(0.1, 500))]
    diameter: Annotated[Float, positive("mm", "outer diameter of the backbone", usual=(0.05, 50))]
    inner_diameter: Annotated[
        Float, quantity("mm", "inner diameter of the backbone; 0 is round", at_least=0)
    ] = 0.0
    _: KW_ONLY
    kind: Literal["rod"] = "rod"
    is_round: ClassVar = True
    uncut_length: Annotated[
        Float, quantity("mm", "thickness of the disk behind the gap", at_least=0)
    ]
    disk_mass: Annotated[
        Float | None,
        quantity(
            "g", "mass of the disk; left out: a ring of the tube, of the material", at_least=0
        ),
    ] = None

    @property
    def mass(self) -> float | None:
        """Mass of the disk [g]."""
        return self.disk_mass

    def problems(self, tube: Tube) -> Problems:
        """Find a backbone without a wall, and one that does not fit the disks."""
        if self.inner_diameter >= self.diameter:
            yield (
                "inner_diameter",
                f"is {self.inner_diameter} mm; it must be less than the diameter, "
                f"{self.diameter} mm.",
            )
        # A hole is drilled to fit its wire; both have tolerances.
        if self.diameter > 1.05 * tube.inner_diameter:
            yield (
                "diameter",
                f"is {self.diameter} mm; the backbone must fit the hole of the disks, "
                f"`tube.inner_diameter`, {tube.inner_diameter} mm.",
            )

    def cut_layout(self, tube: Tube, before: Notch | None, after: Notch | None) -> CutLayout:
        """Return the whole gap, in which only the backbone is left."""
        return whole_gap(self, tube.outer_radius)

    def tendon_problems(self, tendon: Tendon) -> Problems:
        """Find a tendon on an arc of the wall, which is not there."""
        if tendon.path == "wall-arc":
            yield (
                "path",
                'is "wall-arc"; a tendon runs straight from disk to disk: give "straight", '
                '"straight-dead" or "straight-follower".',
            )
