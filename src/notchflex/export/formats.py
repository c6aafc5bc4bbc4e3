"""The table of formats: which file each one writes, with which function, options and libraries.

A new format is a line here, its function, and an option of `cli/verbs/export.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.export.document import Document, Subject
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.options import PatternOptions, SolidOptions
from notchflex.export.simulators.options import SimulatorOptions

Builder = Callable[[Subject, Any], Document]


@dataclass(frozen=True)
class Format:
    """One format of files.

    Args:
        text: What it is, for messages and for the help of its option.
        suffixes: Suffixes of its files; no two formats share one.
        builder: `module:function` that makes the document of a subject with options.
        options: Class of its options; it can be made without arguments.
        needs: Packages that it needs, each with the extra that installs it.
        bends: Whether it shows the robot under load; others are of the robot as it is cut.
    """

    text: str
    suffixes: tuple[str, ...]
    builder: str
    options: type
    needs: tuple[tuple[str, str], ...] = ()
    bends: bool = False

    def build(self, subject: Subject, options: Any) -> Document:
        """Make the document; nothing is written."""
        module, _, function = self.builder.partition(":")
        builder: Builder = getattr(import_module(module), function)
        return builder(subject, options)

    def check_packages(self, option: str) -> None:
        """Raise if a package that it needs is not installed."""
        for module, extra in self.needs:
            need(module, extra, option)


_EZDXF = (("ezdxf", "export"),)

FORMATS: dict[str, Format] = {
    "dxf": Format(
        "flat pattern for the laser",
        (".dxf",),
        "notchflex.export.flat.dxf:dxf_pattern",
        PatternOptions,
        _EZDXF,
    ),
    "svg": Format(
        "flat pattern at full size",
        (".svg",),
        "notchflex.export.flat.svg:svg_pattern",
        PatternOptions,
    ),
    "pdf": Format(
        "sheet with the pattern, a table of the cuts and a dimensioned drawing",
        (".pdf",),
        "notchflex.export.flat.sheet:pattern_sheet",
        PatternOptions,
        (("matplotlib", "plot"),),
    ),
    "stl": Format(
        "solid as triangles",
        (".stl",),
        "notchflex.export.solids.stl:stl_solid",
        SolidOptions,
        (("manifold3d", "export"), ("matplotlib", "plot")),
        bends=True,
    ),
    "step": Format(
        "solid for CAD",
        (".step", ".stp"),
        "notchflex.export.solids.step:step_solid",
        SolidOptions,
        (("build123d", "cad"), ("matplotlib", "plot")),
        bends=True,
    ),
    "mjcf": Format(
        "MuJoCo model",
        (".xml", ".mjcf"),
        "notchflex.export.simulators.document:mjcf_document",
        SimulatorOptions,
        bends=True,
    ),
    "urdf": Format(
        "URDF model",
        (".urdf",),
        "notchflex.export.simulators.document:urdf_document",
        SimulatorOptions,
        bends=True,
    ),
    "transmission": Format(
        "table of levers and joint moments, for a URDF model,",
        (".csv",),
        "notchflex.export.simulators.document:transmission_document",
        SimulatorOptions,
        bends=True,
    ),
    "inp": Format(
        "deck of finite elements for CalculiX",
        (".inp",),
        "notchflex.export.finite_elements.document:deck_document",
        DeckOptions,
        bends=True,
    ),
}
"""Name of a format, which is also that of its option, to what writes it."""


def format_of(file: str) -> str:
    """Return the name of the format that a file has by its suffix.

    Raises:
        InputError: No format has this suffix.
    """
    suffix = Path(file).suffix.lower()
    for name, one in FORMATS.items():
        if suffix in one.suffixes:
            return name
    suffixes = ", ".join(suffix for one in FORMATS.values() for suffix in one.suffixes)
    got = f"the suffix {suffix}" if suffix else "no suffix"
    raise InputError.FILE_FORMAT(f"{file}: got {got}; the file must end in one of {suffixes}.")


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
