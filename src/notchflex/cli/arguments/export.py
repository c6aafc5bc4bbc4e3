"""Options of `notchflex export`, group by group."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, make_dataclass
from functools import partial
from typing import Annotated, Any, get_type_hints

from cyclopts import Group, Parameter

from notchflex.cli.arguments.conversion import converted, flag
from notchflex.cli.outputs import output_file
from notchflex.export.formats import FORMATS, PatternOptions
from notchflex.support import parse_number

PATTERN = Group("Flat pattern (--dxf, --svg, --pdf)", sort_key=1)
SOLIDS = Group("Solids (--stl, --step)", sort_key=2)
FINITE_ELEMENTS = Group("Finite elements (--inp)", sort_key=3)
_LENGTH = partial(parse_number, form="a length in mm, 0 or more", least=0.0)


def length(text: str, **options: Any) -> Parameter:
    """Return the parameter of a length."""
    return converted(_LENGTH, "MM", help=text, **options)


def _kerf(text: str) -> float | tuple[float, ...]:
    widths = [_LENGTH(word) for word in text.split(",")]
    return widths[0] if len(widths) == 1 else tuple(widths)


_PATTERN = {
    "kerf": converted(
        _kerf,
        "MM[,MM]",
        help="Width of the beam [mm]; or two: along the tube and round it. The path runs half of "
        "it into the waste. With 0 the pattern is the nominal geometry, which the shop "
        "compensates. The drawing says which.",
    ),
    "corner_radius": length(
        "Radius of the sharp corners of the cuts [mm], at least half the kerf."
    ),
    "polishing": length(
        "What electropolishing removes from every surface after cutting [mm]: tube and cuts are "
        "those before it; solids too."
    ),
    "seam": Parameter(help="Whether cuts that cross the seam run `past` it or are `split` in two."),
    "seam_deg": converted(
        partial(parse_number, form="an angle in deg"),
        "DEG",
        name="--seam-at",
        help="Side of the tube on which it is unrolled [deg].",
    ),
    "two_axis": flag(
        "The machine has a linear and a rotary axis only: refuse cuts whose walls do not point to "
        "the tube axis."
    ),
    "shank": length("Uncut tube on the base side, up to the cut-off [mm]; solids have it too."),
    "chord": length("Largest distance of a curve from its chords [mm]; of solids too."),
    "dxf_version": Parameter(help="Version of the DXF file; `R12` for old programs."),
    "paper": Parameter(help="Size of the pages of the sheet."),
}
_TYPES = get_type_hints(PatternOptions) | {"kerf": float | tuple[float, ...]}
_DEFAULTS = {field.name: field.default for field in fields(PatternOptions)}


def _options(name: str, parameters: Mapping[str, Parameter], types: Mapping[str, Any]) -> Any:
    """Return a class of options: its fields have these types, and the defaults of `_DEFAULTS`."""
    made = make_dataclass(
        name,
        [(key, Annotated[types[key], one], _DEFAULTS.get(key)) for key, one in parameters.items()],
        namespace={"__module__": __name__},  # cyclopts looks into no class of the standard library
    )
    return Parameter(name="*", group=PATTERN)(made)


def _file(name: str) -> Parameter:
    one = FORMATS[name]
    return output_file(f"--{name}", f"Write a {one.text} to this {' or '.join(one.suffixes)} file.")


_FILES = {name: _file(name) for name in FORMATS}

PatternArguments = _options("PatternArguments", _PATTERN, _TYPES)
"""Options of flat patterns, as `PatternOptions` has them."""
ExportFiles = _options("ExportFiles", _FILES, dict.fromkeys(_FILES, str | None))
"""The files of a call, one option a format."""
