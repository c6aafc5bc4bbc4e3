"""Options of `notchflex export`, group by group."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from cyclopts import Group, Parameter

from notchflex._load_words import number
from notchflex.cli.arguments.conversion import converted, flag
from notchflex.export.options import DxfVersion, PatternOptions, Seam

PATTERN = Group("Flat pattern (--dxf, --svg, --pdf)", sort_key=1)
SOLIDS = Group("Solids (--stl, --step)", sort_key=2)
FINITE_ELEMENTS = Group("Finite elements (--inp)", sort_key=3)
_LENGTH = partial(number, form="a length in mm, 0 or more", least=0.0)


def _length(text: str) -> Parameter:
    return converted(_LENGTH, "MM", help=text)


@Parameter(name="*", group=PATTERN)
@dataclass(frozen=True)
class PatternArguments:
    """Options of flat patterns."""

    kerf: Annotated[
        float,
        _length(
            "Width of the beam [mm]: the path runs half of it into the waste. With 0 the pattern "
            "is the nominal geometry, which the shop compensates. The drawing says which."
        ),
    ] = 0.0
    corner_radius: Annotated[
        float, _length("Radius of the sharp corners of the cuts [mm], at least half the kerf.")
    ] = 0.0
    polishing: Annotated[
        float,
        _length(
            "Wall that electropolishing removes from each edge after cutting [mm]; the path runs "
            "this much farther into the waste."
        ),
    ] = 0.0
    seam: Annotated[
        Seam,
        Parameter(help="Whether cuts that cross the seam run `past` it or are `split` in two."),
    ] = "past"
    seam_at: Annotated[
        float,
        converted(partial(number, form="an angle in deg"), "DEG"),
        Parameter(help="Side of the tube on which it is unrolled [deg]."),
    ] = 180.0
    two_axis: Annotated[
        bool,
        flag(
            "The machine has a linear and a rotary axis only: refuse cuts whose walls do not point "
            "to the tube axis."
        ),
    ] = False
    degrees: Annotated[bool, flag("Write y in degrees round the tube instead of mm.")] = False
    shank: Annotated[
        float,
        _length("Uncut tube on the base side, up to the cut-off [mm]; solids have it too."),
    ] = 10.0
    chord: Annotated[
        float, _length("Largest distance of a curve from its chords [mm]; of solids too.")
    ] = 0.001
    dxf_version: Annotated[
        DxfVersion, Parameter(help="Version of the DXF file; `R12` for old programs.")
    ] = "R2000"

    def options(self) -> PatternOptions:
        """Return them as those of the library."""
        return PatternOptions(
            kerf=self.kerf,
            corner_radius=self.corner_radius,
            polishing=self.polishing,
            seam=self.seam,
            seam_deg=self.seam_at,
            two_axis=self.two_axis,
            y_unit="deg" if self.degrees else "mm",
            shank=self.shank,
            chord=self.chord,
            dxf_version=self.dxf_version,
        )
