"""The notch of Liu 2022: two triangular cuts from opposite sides and the strip between them."""

from dataclasses import KW_ONLY
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from notchflex.robot.cuts import CutLayout, NotchCut, Opening, cosine_of
from notchflex.robot.kinds import LIU, Notch, Tendon, Tube
from notchflex.robot.part import Float, Problems, part, positive, quantity

LEAST_COSINE = 0.5  # a cable farther round the tube than 60 deg would twist the strip


@part
class StripNotch(Notch):
    """A pair of opposite triangular notches; the strip across the tube between them bends.

    The strip begins at the wall on one side and carries the next rigid body at its other end,
    where the pulled cable passes.  The body's origin lies level with the middle of the strip.
    The pair looks the same after half a turn about the middle of the strip, so that a cable on the
    other side bends it back as easily.

    With elastic ends the strip is that of the drawing: as long as the cuts overlap, as wide as the
    wall, with the walls that it turns into.  Its lower face then lies `height` above the proximal
    face, and a tendon leaves the bodies at the leaning edges of the notches.

    Args:
        height: Opening of a notch along the tube at the outer surface [mm]; Liu's H.
        strip_thickness: Thickness of the strip along the tube [mm]; Liu's h.
        depth: Depth of each of the two cuts [mm], from the outer surface; both pass the axis.
        strip_length: Length of the strip across the tube [mm]; None is (D + d) / 2, the distance
            between two cables in the middle of the wall.
        wall_width: Width of both walls of the strip together [mm]; None is D - d.  With the
            thickness h its second moment of area is wall_width h^3 / 12.
        deflection: "large" (elastica) or "small" (linear beam, Liu's model for comparison).
        ends: "rigid" (the paper's beam, clamped in rigid bodies) or "elastic" (the strip of the
            drawing and the walls beside it, checked against finite elements); `strip_length` is
            for rigid ends alone.
        uncut_length: Uncut length behind the pair, toward the tip [mm].
        direction_deg: Side toward which it bends [deg]: that of the pulled cable.
        precurvature_deg: 0; a strip is straight when nothing pulls.
        repeat: How many equal pairs follow one another, all of the same hand.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> pair = StripNotch(height=3.5, strip_thickness=1.5, depth=6.9, repeat=7)
        >>> pair.strip_length_in(Tube(10.0, 6.0))
        8.0
    """

    height: Annotated[Float, positive("mm", "opening of a notch at the outer surface")]
    strip_thickness: Annotated[Float, positive("mm", "thickness of the strip along the tube")]
    depth: Annotated[
        Float, positive("mm", "depth of each of the two opposite cuts, from the surface")
    ]
    strip_length: Annotated[
        Float | None,
        positive("mm", "length of the strip across the tube; left out: (D + d) / 2"),
    ] = None
    wall_width: Annotated[
        Float | None,
        positive("mm", "width of both walls of the strip together; left out: D - d"),
    ] = None
    deflection: Annotated[
        Literal["large", "small"],
        Field(description='"large" (elastica) or "small" (linear beam) deflection of the strip'),
    ] = "large"
    _: KW_ONLY
    kind: Literal["strip"] = "strip"
    is_strip: ClassVar = True
    ends: Annotated[
        Literal["rigid", "elastic"],
        Field(
            description='"rigid" (the beam of strip_length, clamped in rigid bodies) or "elastic" '
            "(the strip where the cuts overlap, and the walls beside it, from the drawing)"
        ),
    ] = "rigid"
    uncut_length: Annotated[
        Float, quantity("mm", "uncut length behind the pair, toward the tip", at_least=0)
    ] = 0.0

    @property
    def papers(self) -> tuple[str, ...]:
        """Papers to cite for its model."""
        return (LIU,)

    def strip_length_in(self, tube: Tube) -> float:
        """Return the length of the strip, by default that between cables in mid-wall [mm]."""
        mean = tube.outer_radius + tube.inner_radius
        return mean if self.strip_length is None else self.strip_length

    def wall_width_in(self, tube: Tube) -> float:
        """Return the width of both walls of the strip together [mm]."""
        walls = tube.outer_diameter - tube.inner_diameter
        return walls if self.wall_width is None else self.wall_width

    def problems(self, tube: Tube) -> Problems:
        """Find cuts that leave no strip, and a strip that is bent when nothing pulls."""
        if not tube.outer_radius < self.depth < tube.outer_diameter:
            yield (
                "depth",
                f"is {self.depth} mm; it must be greater than the outer radius, "
                f"{tube.outer_radius} mm, so that the two cuts leave a strip between them, and "
                f"less than the outer diameter, {tube.outer_diameter} mm.",
            )
        length, width = self.strip_length_in(tube), self.wall_width_in(tube)
        if length > tube.outer_diameter:
            yield (
                "strip_length",
                f"is {length} mm; a strip across the tube is at most as long as the outer "
                f"diameter, {tube.outer_diameter} mm.",
            )
        if width > tube.outer_diameter:
            yield (
                "wall_width",
                f"is {width} mm; both walls together are at most as wide as the outer diameter, "
                f"{tube.outer_diameter} mm.",
            )
        if self.strip_thickness >= length:
            yield (
                "strip_thickness",
                f"is {self.strip_thickness} mm; a strip must be thinner than it is long, "
                f"{length:.4g} mm.",
            )
        if self.tube is not None and self.has_elastic_ends:
            yield "tube", "is not for a strip with elastic ends, which takes that of the robot."
        if self.precurvature_deg:
            yield (
                "precurvature_deg",
                f"is {self.precurvature_deg} deg; it must be 0, because a strip is straight when "
                "nothing pulls.",
            )

    def tendon_problems(self, tendon: Tendon) -> Problems:
        """Find a tendon on an arc of the wall, of which little is left, or beside the strip."""
        if tendon.path == "wall-arc":
            yield (
                "path",
                'is "wall-arc"; a tendon runs straight over a strip: give "straight", '
                '"straight-dead" or "straight-follower".',
            )
        cosine = cosine_of(tendon.direction_deg - self.direction_deg)
        if abs(cosine) <= LEAST_COSINE:
            yield (
                "direction_deg",
                f"is {tendon.direction_deg} deg; over a strip that bends toward "
                f"{self.direction_deg} deg a tendon must lie within 60 deg of that side or of the "
                "opposite one.",
            )

    def spacing(self, following: Notch | None) -> float:
        """Return the length from the middle of the strip to the next notch [mm].

        Consecutive notches adjoin at the strip's far face, so that a pair takes height + thickness
        of the tube.
        """
        return self.strip_thickness - self.rise + self.uncut_length

    @property
    def rise(self) -> float:
        """Height of the body's origin above the strip's lower face [mm].

        The paper's beam has no thickness where it is clamped.
        """
        return 0.5 * self.strip_thickness if self.has_elastic_ends else 0.0

    def cut_layout(self, tube: Tube, before: Notch | None, after: Notch | None) -> CutLayout:
        """Return the triangle below the strip and the one above it, from the opposite side."""
        surface, bottom = tube.outer_radius, tube.outer_radius - self.depth
        low, high = self.height, self.height + self.strip_thickness
        below = ((0.0, surface), (low, bottom), (low, surface))
        above = ((high, surface), (high, bottom), (high + self.height, surface))
        sharp = (0.0, 0.0, 0.0)
        cuts = (
            NotchCut(self.direction_deg, below, sharp),
            NotchCut(self.direction_deg + 180.0, above, sharp),
        )
        return CutLayout(cuts, high + self.uncut_length)

    def openings(self, before: Notch | None, after: Notch | None) -> tuple[Opening, ...]:
        """Return the notch below the strip and, on the other side, the one above it."""
        up, rise = self.height, self.rise
        lean = self.height / self.depth if self.has_elastic_ends else 0.0
        return (
            Opening(self.direction_deg, 0.0, -rise, leaves_rise=lean),
            Opening(self.direction_deg + 180.0, up + 2.0 * rise, up + rise, enters_rise=-lean),
        )
