"""The notch of Pacheco 2021 and York 2015: a cut that leaves an arc of the wall."""

import math
from dataclasses import KW_ONLY
from typing import Annotated, Literal

from pydantic import Field

from notchflex.robot.cuts import CutLayout, slot
from notchflex.robot.kinds import PACHECO, YORK, Notch, Tube
from notchflex.robot.part import Float, Problems, part, positive


@part
class ArcNotch(Notch):
    """A notch whose remaining wall bends in one plane, with an arc of the tube as its section.

    Args:
        cut: "on-axis" (a laser on the axis: radial edges, an annular sector is left) or "off-axis"
            (a saw or wire across the tube: a straight edge, an annular segment is left).
            The two differ in stiffness by 34-51 % at equal depth, hence there is no default.
        depth: Depth of the cut [mm], from the outer surface opposite the spine.
        height: Height of the notch along the tube [mm].
        uncut_length: Uncut length behind the notch, toward the tip [mm].
        ends: "rigid" (beam theory of the arc between rigid rings, as in the papers) or "shell"
            (the rings beside the notch deform and the arc flattens; checked against finite
            elements).
        depth_at: Where the depth of an "on-axis" cut was read, which decides the angle of its
            radial edges: "outer", "mid-wall" or "inner" surface.
        closing: "rigid" (the edges touch at height / (r_o + centroid), as in the papers, without
            compliance) or "elastic" (the angle and the stiffness of the closed notch from finite
            elements).
        direction_deg: Side toward which the notch bends [deg].
        precurvature_deg: Angle of the notch without loads [deg].
        repeat: Number of equal notches in a row.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> ArcNotch("on-axis", depth=1.40, height=0.8, uncut_length=1.2, repeat=5).repeat
        5
    """

    cut: Annotated[
        Literal["on-axis", "off-axis"],
        Field(
            description='"on-axis" (laser on the axis: radial edges, an annular sector is left) or '
            '"off-axis" (saw or wire across: straight edge, an annular segment is left)'
        ),
    ]
    depth: Annotated[
        Float,
        positive("mm", "depth of the cut, from the surface opposite the spine", usual=(0.01, 50)),
    ]
    height: Annotated[Float, positive("mm", "height of the notch along the tube", usual=(0.01, 50))]
    _: KW_ONLY
    kind: Literal["arc"] = "arc"
    ends: Annotated[
        Literal["rigid", "shell"],
        Field(
            description='"rigid" (beam theory of the arc between rigid rings) or "shell" (the '
            "rings beside the notch yield, the arc flattens)"
        ),
    ] = "rigid"
    depth_at: Annotated[
        Literal["outer", "mid-wall", "inner"],
        Field(
            description="surface at which the depth of an on-axis cut was read: "
            '"outer", "mid-wall" or "inner"'
        ),
    ] = "outer"

    closing: Annotated[
        Literal["rigid", "elastic"],
        Field(
            description='"rigid" (at height / (outer radius + centroid), then stiff) or "elastic" '
            "(at the angle, and with the stiffness beyond, of finite elements)"
        ),
    ] = "rigid"

    @property
    def papers(self) -> tuple[str, ...]:
        """Papers to cite for its model."""
        return (PACHECO, YORK) if self.cut == "off-axis" else (PACHECO,)

    @property
    def spine_cut(self) -> tuple[float, bool]:
        """Depth of the cut [mm], and whether its edges are radial."""
        return self.depth, self.cut == "on-axis"

    @property
    def has_elastic_ends(self) -> bool:
        """Whether its stiffness depends on the rings beside it."""
        return super().has_elastic_ends or self.closing == "elastic"

    def section_depth(self, tube: Tube) -> float:
        """Return the depth at the outer surface that gives the same section [mm]."""
        if self.cut == "off-axis" or self.depth_at == "outer":
            return self.depth
        outer, inner = tube.outer_radius, tube.inner_radius
        read = inner if self.depth_at == "inner" else 0.5 * (outer + inner)
        return outer + (self.depth - outer) * outer / read

    def cut_layout(self, tube: Tube, before: Notch | None, after: Notch | None) -> CutLayout:
        """Return the window that leaves the arc."""
        bottom = tube.outer_radius - self.section_depth(tube)
        window = slot(
            self.direction_deg,
            (0.0, self.height),
            bottom,
            tube.outer_radius,
            radial=self.cut == "on-axis",
        )
        return CutLayout((window,), self.height + self.uncut_length)

    def problems(self, tube: Tube) -> Problems:
        """Find a cut that goes through the tube, and a precurvature beyond any closing angle."""
        if self.depth >= tube.outer_diameter:
            yield (
                "depth",
                f"is {self.depth} mm; it must be greater than 0 and less than the outer diameter, "
                f"{tube.outer_diameter} mm.",
            )
            return
        if self.depth_at != "outer" and self.cut == "off-axis":
            yield "depth_at", 'is for cuts "on-axis"; leave it out for an "off-axis" cut.'
            return
        if not 0.0 < self.section_depth(tube) < tube.outer_diameter:
            yield (
                "depth",
                f"is {self.depth} mm, read at the {self.depth_at} surface; there its edges would "
                "not meet the tube. Read it at the outer surface, or use another depth.",
            )
            return
        free = math.radians(self.precurvature_deg)
        # The neutral axis lies between the tube axis and the spine: this bound decides for most
        # notches without computing a section.
        if free >= 0.5 * self.height / tube.outer_radius and free >= self.closing_angle(tube):
            yield (
                "precurvature_deg",
                f"is {self.precurvature_deg} deg; a notch {self.height} mm high in this tube "
                f"closes at {math.degrees(self.closing_angle(tube)):.4g} deg; it must be less than "
                "that.",
            )

    def closing_angle(self, tube: Tube) -> float:
        """Return the angle at which the edges touch, h / (r_o + centroid) (Pacheco 2021) [rad]."""
        from notchflex.mechanics.cuts import SECTION_OF_CUT  # it loads JAX

        depth = self.section_depth(tube)
        left = SECTION_OF_CUT[self.cut](tube.outer_radius, tube.inner_radius, depth)
        return self.height / (tube.outer_radius + float(left.centroid))
