"""The table of formats: which file each one writes, with which function, options and libraries.

A new format is a line here and its function; its option of the command line follows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from notchflex import InputError
from notchflex.support import Float, Int, need, part, quantity

if TYPE_CHECKING:
    from notchflex import EquilibriumPath, Robot


_Length = Annotated[Float, quantity("mm", "length", at_least=0.0, at_most=10.0)]
_Tube = Annotated[Float, quantity("mm", "length of tube", at_least=0.0, at_most=1e4)]
_Kerf = Annotated[
    tuple[_Length, _Length],
    BeforeValidator(lambda kerf: kerf if isinstance(kerf, tuple | list) else (kerf, kerf)),
    Field(validate_default=True),
]
_Chord = Annotated[
    Float, quantity("mm", "distance of a curve from its chords", at_least=1e-5, at_most=1.0)
]


@part(kw_only=False, refuse=InputError)
class PatternOptions:
    """Options of flat patterns (DXF, SVG, dimensioned PDF sheet).

    Args:
        kerf: Width of the slot that the beam leaves [mm], or two: that of a slot round the tube,
            measured along it, and that of a slot along the tube, measured round it. With 0 the
            pattern is the nominal geometry, and the shop compensates; otherwise the path runs half
            a kerf into the waste. The drawing says which.
        corner_radius: Radius of the sharp corners of the cuts [mm]; 0 or at least half the kerf.
        polishing: What electropolishing removes from every surface after cutting [mm]. Tube and
            cuts are then those before it, so that the finished robot has its dimensions.
        seam: Cuts that cross the seam run `"past"` it, or are `"split"` into two closed outlines.
        seam_deg: Side of the tube on which it is unrolled [deg].
        two_axis: Whether the machine has a linear and a rotary axis only, so that its beam always
            points to the tube axis; cuts with other walls are then refused.
        y_unit: Unit of the coordinate round the tube: `"mm"` on the outer surface, or `"deg"`.
        shank: Uncut tube on the base side, by which the robot is held [mm]; the cut-off runs at
            its end.
        chord: Largest distance of a curve from its chords [mm].
        dxf_version: `"R2000"`, or `"R12"` for old programs.
        paper: Size of the pages of the sheet, which lie across: `"a4"` or `"a3"`.

    Raises:
        InputError: A value is not allowed.

    Example:
        >>> PatternOptions(kerf=0.025).inside
        (0.0125, 0.0125)
    """

    kerf: _Kerf = 0.0  # pyright: ignore[reportAssignmentType] - made two widths
    corner_radius: _Length = 0.0
    polishing: _Length = 0.0
    seam: Literal["past", "split"] = "past"
    seam_deg: Annotated[
        Float, quantity("deg", "side of the seam", at_least=-360.0, at_most=360.0)
    ] = 180.0
    two_axis: Annotated[bool, Field(strict=True)] = False
    y_unit: Literal["mm", "deg"] = "mm"
    shank: _Tube = 10.0
    chord: _Chord = 0.001
    dxf_version: Literal["R2000", "R12"] = "R2000"
    paper: Literal["a4", "a3"] = "a4"

    @property
    def inside(self) -> tuple[float, float]:
        """Distance of the path from the edges of the cuts, along the tube and round it [mm]."""
        along, around = self.kerf
        return 0.5 * along, 0.5 * around


@part(kw_only=False, refuse=InputError)
class SolidOptions:
    """Options of solids (STL, STEP).

    Args:
        channels: Diameter of the channels of the tendons, drilled through the wall along the whole
            tube [mm]; 0 for none.
        shank: Uncut tube on the base side [mm].
        chord: Largest distance of the flat sides of an STL from the round surface [mm].
        polishing: What electropolishing removes from every surface after cutting [mm]. The solid
            is then that before it, straight, so that the finished robot has its dimensions.

    Raises:
        InputError: A value is not allowed.

    Example:
        >>> SolidOptions(shank=2.0).channels
        0.0
    """

    channels: _Tube = 0.0
    shank: _Tube = 10.0
    chord: _Chord = 0.001
    polishing: _Length = 0.0


Mesh = Literal["coarse", "medium", "fine"]
# Of each the elements that the first five options of a deck count. One element of reduced
# integration through the wall would have modes without energy.
_MESHES = {"coarse": (2, 3, 4, 3, 4), "medium": (2, 5, 6, 6, 8), "fine": (2, 8, 8, 10, 12)}


_Elements = Annotated[Int, Field(ge=1, le=100)]


@part(kw_only=False, refuse=InputError)
class DeckOptions:
    """Options of a deck of finite elements.

    Args:
        wall: Elements through the wall.
        spine: Elements over half the arc that a notch leaves.
        opening: Elements over half the opening of a notch.
        notch: Elements along a notch.
        uncut: Elements along an uncut length.
        contact: Whether the faces of the notches may touch.
        tip_moment: A moment on the end of the tube, which it keeps plane, toward the notches, N mm.
    """

    wall: _Elements = 2
    spine: _Elements = 5
    opening: _Elements = 6
    notch: _Elements = 6
    uncut: _Elements = 8
    contact: Annotated[bool, Field(strict=True)] = True
    tip_moment: Float = 0.0

    @classmethod
    def of_mesh(cls, mesh: Mesh, **options: Any) -> DeckOptions:
        """Return the options with one of three meshes.

        Args:
            mesh: "coarse", "medium" or "fine".
            **options: Other options.

        Raises:
            InputError: No such mesh.
        """
        if mesh not in _MESHES:
            raise InputError.UNKNOWN_NAME(f"there is no mesh {mesh!r}; give {', '.join(_MESHES)}")
        return cls(*_MESHES[mesh], **options)


@dataclass(frozen=True)
class SimulatorOptions:
    """Options of models for simulators of rigid bodies.

    Args:
        largest_tension: Largest tension of the range that the joints are fitted over, N. None for
            that of the load, or without a load for 1.1 times the tension that closes the last notch
            (the one that closes the first, where some notch never closes).
    """

    largest_tension: float | None = None


@dataclass(frozen=True)
class Subject:
    """Subject of an export: a robot, and for a robot under load the step of a path."""

    robot: Robot
    path: EquilibriumPath | None = None
    step: int = 0


def _write(content: str | bytes, file: Path) -> None:
    file.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@dataclass(frozen=True)
class Document:
    """A file that is complete before it is written.

    Args:
        content: What is written: text (as UTF-8), bytes, or what its writer takes.
        warnings: Sentences for the user about what is in the file.
        facts: Numbers about what is in the file, for `--json`; plain values, units in the names.
        writer: Writes the content to a file, which is then renamed.
    """

    content: Any
    warnings: tuple[str, ...] = ()
    facts: dict[str, Any] = field(default_factory=dict[str, Any])
    writer: Callable[[Any, Path], None] = _write


@dataclass(frozen=True)
class Format:
    """One format of files.

    Args:
        text: What it is, for messages and for the help of its option.
        suffixes: Suffixes of its files; no two formats share one.
        builder: `module:function` in this folder that makes the document of a subject with options.
        options: Class of its options; it can be made without arguments.
        needs: Packages that it needs, each with the extra that installs it.
    """

    text: str
    suffixes: tuple[str, ...]
    builder: str
    options: type
    needs: tuple[tuple[str, str], ...] = ()

    @property
    def bends(self) -> bool:
        """Whether it shows the robot under load; others are of the robot as it is cut."""
        return self.options is not PatternOptions

    def build(self, subject: Subject, options: Any) -> Document:
        """Make the document; nothing is written."""
        return resolve_name(f"notchflex.export.{self.builder}")(subject, options)

    def check_packages(self, option: str) -> None:
        """Raise if a package that it needs is not installed."""
        for module, extra in self.needs:
            need(module, extra, option)


_EZDXF, _MATPLOTLIB = ("ezdxf", "export"), ("matplotlib", "plot")
_MANIFOLD, _TRIMESH = ("manifold3d", "export"), ("trimesh", "export")
_SHAPELY = ("shapely", "export")
_BUILD123D = ("build123d", "cad")

FORMATS: dict[str, Format] = {
    "dxf": Format(
        "flat pattern for the laser",
        (".dxf",),
        "drawing:dxf_pattern",
        PatternOptions,
        (_EZDXF, _SHAPELY),
    ),
    "svg": Format(
        "flat pattern at full size", (".svg",), "drawing:svg_pattern", PatternOptions, (_SHAPELY,)
    ),
    "pdf": Format(
        "sheet with the pattern, a table of the cuts and a dimensioned drawing",
        (".pdf",),
        "sheet:pattern_sheet",
        PatternOptions,
        (_MATPLOTLIB, _SHAPELY),
    ),
    "stl": Format(
        "solid as triangles",
        (".stl",),
        "solids:stl_solid",
        SolidOptions,
        (_MANIFOLD, _TRIMESH, _MATPLOTLIB),
    ),
    "step": Format(
        "solid for CAD",
        (".step", ".stp"),
        "step:step_solid",
        SolidOptions,
        (_BUILD123D, _MATPLOTLIB),
    ),
    "mjcf": Format("MuJoCo model", (".xml", ".mjcf"), "simulators:mjcf_document", SimulatorOptions),
    "urdf": Format("URDF model", (".urdf",), "simulators:urdf_document", SimulatorOptions),
    "transmission": Format(
        "table of levers and joint moments, for a URDF model,",
        (".csv",),
        "simulators:transmission_document",
        SimulatorOptions,
    ),
    "inp": Format(
        "deck of finite elements for CalculiX", (".inp",), "deck:deck_document", DeckOptions
    ),
}
"""Name of a format, which is also that of its option, to what writes it."""


def plain(text: str) -> str:
    """Return a text in one line, without characters that no file takes."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def plain_name(robot: Robot) -> str:
    """Return the name of a robot as `plain` text."""
    return plain(robot.name) or "robot"


def format_of(file: str) -> str:
    """Return the name of the format that a file has by its suffix.

    Raises:
        InputError: No format has this suffix.
    """
    suffix = Path(file).suffix.lower()
    names = {suffix: name for name, kind in FORMATS.items() for suffix in kind.suffixes}
    if suffix in names:
        return names[suffix]
    got = f"the suffix {suffix}" if suffix else "no suffix"
    raise InputError.FILE_FORMAT(
        f"{file}: got {got}; the file must end in one of {', '.join(names)}."
    )


def check_suffix(name: str, file: str, option: str) -> None:
    """Raise if a file has not the suffix of its format.

    Raises:
        InputError: It has another suffix, or is standard output.
    """
    suffixes = FORMATS[name].suffixes
    if Path(file).suffix.lower() not in suffixes:
        raise InputError.FILE_FORMAT(
            f"{option} {file}: give the name of a file that ends in {' or '.join(suffixes)}."
        )
