"""The U-link of Gao 2017: the strip between two slots that are cut from opposite sides."""

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from notchflex.robot.cuts import CutLayout, Opening, cosine_of, slot
from notchflex.robot.kinds import GAO, Notch, Tendon, Tube
from notchflex.robot.part import Float, Problems, part, positive, quantity, unchecked

OTHER = {"away": "toward", "toward": "away"}


@part
class ULink(Notch):
    """One strip of a row of slots that are cut from the two sides in turn.

    The strip reaches from the wall on one side, round the end of a slot, across the tube and round
    the end of the next slot to the wall on the other side (Gao 2017, Fig. 3).  Behind it lies the
    wall piece on the side of its proximal slot, which spans two strips and the slot between them;
    the body's origin is on the tube axis at the strip's proximal face.  A row of n links stands
    between n + 1 slots.

    Args:
        slot_radius: Radius of the round slot ends [mm], half the width of a slot; Gao's r_c.
        strip_thickness: Thickness of the strip along the tube [mm]; Gao's l_s.
        strip_length: Length of the straight middle of the strip [mm], across the tube; Gao's w.
        proximal_slot: Side from which the slot on the base side of the (first) strip is cut:
            "toward" is the side toward which the link bends, "away" the opposite one.  In a
            repeated row the sides alternate.
        ends: "rigid" (the paper's strip with two curved ends) or "elastic" (the strip and the walls
            that it turns into, checked against finite elements).
        uncut_length: Uncut length beyond the last slot of the row, toward the tip [mm]; links that
            another one follows do without.
        direction_deg: Side toward which a positive angle bends the link [deg].
        precurvature_deg: 0; the row is straight when nothing pulls.
        repeat: How many links follow one another.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> row = ULink(0.275, 0.70, 2.0, "away", repeat=27)
        >>> row.slots, round(row.pitch, 9), row.expanded()[1].proximal_slot
        (28, 1.25, 'toward')
    """

    slot_radius: Annotated[
        Float, positive("mm", "radius of the slot ends, half the width of a slot")
    ]
    strip_thickness: Annotated[Float, positive("mm", "thickness of the strip along the tube")]
    strip_length: Annotated[Float, positive("mm", "length of the straight middle of the strip")]
    proximal_slot: Annotated[
        Literal["away", "toward"],
        Field(
            description='side of the slot before the (first) strip: "away" or "toward", as seen '
            "from the bend; the next slots alternate"
        ),
    ]
    _: KW_ONLY
    kind: Literal["u-link"] = "u-link"
    is_strip: ClassVar = True
    ends: Annotated[
        Literal["rigid", "elastic"],
        Field(
            description='"rigid" (the strip with two curved ends of the paper) or "elastic" (the '
            "strip and the walls that it turns into, from the drawing)"
        ),
    ] = "rigid"
    uncut_length: Annotated[
        Float, quantity("mm", "uncut length beyond the last slot of the row", at_least=0)
    ] = 0.0

    @property
    def papers(self) -> tuple[str, ...]:
        """Papers to cite for its model."""
        return (GAO,)

    @property
    def first_side_deg(self) -> float:
        """Side of the tube from which the slot before the strip is cut [deg]."""
        return self.direction_deg + (180.0 if self.proximal_slot == "away" else 0.0)

    @property
    def slots(self) -> int:
        """Number of slots of the row: one more than links."""
        return self.repeat + 1

    @property
    def height(self) -> float:
        """Width of a slot along the tube [mm], which the tube axis crosses."""
        return 2.0 * self.slot_radius

    @property
    def pitch(self) -> float:
        """Length of tube that a slot and a strip take [mm]."""
        return self.height + self.strip_thickness

    @property
    def end_width(self) -> float:
        """Gao's d_e [mm], which lays the strip's curved ends out.

        It follows from Gao 2017, eq. 6-7, and the assumption that the centre line begins at right
        angles to its section: d_e^2 + r_c d_e = (pi / 2) r_c (r_c + l_s).
        """
        radius = self.slot_radius
        return 0.5 * (
            math.sqrt(radius**2 + 2.0 * math.pi * radius * (radius + self.strip_thickness)) - radius
        )

    @property
    def span(self) -> float:
        """Width across the tube that the strip's centre line takes with its ends [mm]."""
        return self.strip_length + self.end_width + 2.0 * self.slot_radius

    def problems(self, tube: Tube) -> Problems:
        """Find a strip that is too long for the tube, and one bent when nothing pulls."""
        if self.span >= tube.outer_diameter:
            yield (
                "strip_length",
                f"is {self.strip_length} mm; with its round ends the strip takes "
                f"{self.span:.4g} mm across the tube, which must be less than the outer diameter, "
                f"{tube.outer_diameter} mm.",
            )
        if self.precurvature_deg:
            yield (
                "precurvature_deg",
                f"is {self.precurvature_deg} deg; it must be 0, because a row of U-links is "
                "straight when nothing pulls.",
            )

    def row_problems(self, before: Notch) -> Problems:
        """Find a link that disagrees with the one before it about the slot between them."""
        if not isinstance(before, ULink):
            return
        if abs(math.remainder(self.direction_deg - before.direction_deg, 360.0)) > 1e-9:
            yield (
                "direction_deg",
                f"is {self.direction_deg} deg; it must be that of the U-link before it, "
                f"{before.direction_deg} deg, because they share a slot.",
            )
        if self.slot_radius != before.slot_radius:
            yield (
                "slot_radius",
                f"is {self.slot_radius} mm; it must be that of the U-link before it, "
                f"{before.slot_radius} mm, because they share a slot.",
            )
        if self.proximal_slot == before.proximal_slot:
            yield (
                "proximal_slot",
                f'is "{self.proximal_slot}" like that of the U-link before it; the slots are cut '
                f'from the two sides in turn, so it must be "{OTHER[before.proximal_slot]}".',
            )

    def tendon_problems(self, tendon: Tendon) -> Problems:
        """Find a tendon on an arc of the wall, or one that would run through the strip."""
        if tendon.path == "wall-arc":
            yield (
                "path",
                'is "wall-arc"; a tendon runs straight over U-links: give "straight", '
                '"straight-dead" or "straight-follower".',
            )
        cosine = cosine_of(tendon.direction_deg - self.direction_deg)
        reach = tendon.radius * abs(cosine)
        if reach <= 0.5 * self.strip_length:
            yield (
                "radius",
                f"is {tendon.radius} mm at {tendon.direction_deg} deg, which is {reach:.4g} mm "
                f"from the axis toward the bend of the U-links ({self.direction_deg} deg or the "
                "opposite side); it must be more than half the strip length, "
                f"{0.5 * self.strip_length} mm.",
            )

    def expanded(self) -> tuple[Notch, ...]:
        """Return the links of the row, the slots before them from the two sides in turn."""
        if self.repeat == 1:
            return (self,)
        swapped = OTHER[self.proximal_slot]
        pair = unchecked(self, repeat=1), unchecked(self, repeat=1, proximal_slot=swapped)
        return (pair * self.repeat)[: self.repeat]

    @classmethod
    def further_on(cls, table: Mapping[str, Any], count: int) -> dict[str, Any]:
        """Return the table of what is left of a row: after an odd number the sides swap."""
        row = dict(table)
        side = row.get("proximal_slot")
        if count % 2 == 1 and isinstance(side, str):
            row["proximal_slot"] = OTHER.get(side, side)
        return row

    def spacing(self, following: Notch | None) -> float:
        """Return the strip's thickness, behind the last link with the last slot and the rest."""
        if isinstance(following, ULink):
            return self.strip_thickness
        return self.strip_thickness + self.height + self.uncut_length

    def cut_layout(self, tube: Tube, before: Notch | None, after: Notch | None) -> CutLayout:
        """Return the slot before the strip and, of the last link of a row, the last slot."""
        bottom = -0.5 * self.strip_length - self.slot_radius
        starts = [(self.first_side_deg, 0.0)]
        if not isinstance(after, ULink):
            starts.append((self.first_side_deg + 180.0, self.pitch))
        cuts = tuple(
            slot(
                to,
                (start, start + self.height),
                bottom,
                tube.outer_radius,
                radius=self.slot_radius,
            )
            for to, start in starts
        )
        return CutLayout(cuts, self.height + self.spacing(after))

    def openings(self, before: Notch | None, after: Notch | None) -> tuple[Opening, ...]:
        """Return the slot before the strip and, behind the last link of a row, the last slot.

        On the side of a slot the tendon comes from the wall piece two links nearer the base, which
        reaches a slot and a strip beyond its own strip; on the side of the first slot it comes
        from the body before the row.
        """
        leaves = before.pitch if isinstance(before, ULink) else 0.0
        openings = (
            Opening(self.first_side_deg, leaves, 0.0),
            Opening(self.first_side_deg + 180.0, self.pitch, self.pitch),
        )
        return openings[:1] if isinstance(after, ULink) else openings
