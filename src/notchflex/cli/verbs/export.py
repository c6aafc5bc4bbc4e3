"""`notchflex export`: files for the laser, for CAD and for simulators."""

from __future__ import annotations

from dataclasses import asdict, dataclass, make_dataclass
from typing import Annotated, Any, Literal

from cyclopts import Group, Parameter

from notchflex import InputError, Robot
from notchflex.cli import terminal
from notchflex.cli.options import OUTPUT, File, Outputs, Strokes, Tensions, converted, number
from notchflex.cli.robots import RobotName, Settings, chosen_robot, robot_files
from notchflex.cli.terminal import DONE
from notchflex.export.export import build, write
from notchflex.export.formats import (
    FORMATS,
    DeckOptions,
    Mesh,
    PatternOptions,
    SimulatorOptions,
    SolidOptions,
    Subject,
    check_suffix,
)
from notchflex.support import load_columns, parse_number

PATTERN = Group("Flat pattern (--dxf, --svg, --pdf)", sort_key=1)
SOLIDS = Group("Solids (--stl, --step)", sort_key=2)
FINITE_ELEMENTS = Group("Finite elements (--inp)", sort_key=3)
_LENGTH = "a length in mm, 0 or more"


def _kerf(text: str) -> float | tuple[float, ...]:
    widths = tuple(parse_number(word, _LENGTH, least=0.0) for word in text.split(","))
    return widths[0] if len(widths) == 1 else widths


Length = Annotated[float, number(_LENGTH, "MM", least=0.0)]
Kerf = Annotated[float | tuple[float, ...], converted(_kerf, "MM[,MM]")]


@Parameter(name="*", group=PATTERN)
@dataclass(frozen=True)
class PatternArguments:
    """Options of flat patterns, with the defaults of `PatternOptions`.

    Attributes:
        kerf: Width of the beam [mm]; or two: along the tube and round it. The path runs half of it
            into the waste. With 0 the pattern is the nominal geometry, which the shop compensates.
            The drawing says which.
        corner_radius: Radius of the sharp corners of the cuts [mm], at least half the kerf.
        polishing: What electropolishing removes from every surface after cutting [mm]: tube and
            cuts are those before it; solids too.
        seam: Whether cuts that cross the seam run `past` it or are `split` in two.
        seam_deg: Side of the tube on which it is unrolled [deg].
        two_axis: The machine has a linear and a rotary axis only: refuse cuts whose walls do not
            point to the tube axis.
        shank: Uncut tube on the base side, up to the cut-off [mm]; solids have it too.
        chord: Largest distance of a curve from its chords [mm]; of solids too.
        dxf_version: Version of the DXF file; `R12` for old programs.
        paper: Size of the pages of the sheet.
    """

    kerf: Kerf = PatternOptions.kerf
    corner_radius: Length = PatternOptions.corner_radius
    polishing: Length = PatternOptions.polishing
    seam: Literal["past", "split"] = PatternOptions.seam
    seam_deg: Annotated[float, number("an angle in deg", "DEG"), Parameter(name="--seam-at")] = (
        PatternOptions.seam_deg
    )
    two_axis: bool = False
    shank: Length = PatternOptions.shank
    chord: Length = PatternOptions.chord
    dxf_version: Literal["R2000", "R12"] = PatternOptions.dxf_version
    paper: Literal["a4", "a3"] = PatternOptions.paper


_FORMAT_FILES = make_dataclass(
    "_FORMAT_FILES",
    [
        (
            name,
            Annotated[
                File,
                Parameter(help=f"Write a {form.text} to this {' or '.join(form.suffixes)} file."),
            ],
            None,
        )
        for name, form in FORMATS.items()
    ],
    bases=(Outputs,),
    frozen=True,
    namespace={"__module__": __name__},  # cyclopts looks into no class of the standard library
)
ExportOutputs = Parameter(name="*", group=OUTPUT)(_FORMAT_FILES)
"""Results of `export`: one option for each format, and those of all verbs."""


def export(
    robot: RobotName,
    /,
    *,
    channels: Annotated[Length, Parameter(group=SOLIDS)] = 0.0,
    degrees: Annotated[bool, Parameter(group=PATTERN)] = False,
    pattern: PatternArguments = PatternArguments(),
    mesh: Annotated[Mesh, Parameter(group=FINITE_ELEMENTS)] = "medium",
    tension: Annotated[Tensions, Parameter(group=SOLIDS)] = (),
    stroke: Annotated[Strokes, Parameter(group=SOLIDS)] = (),
    straight: Annotated[bool, Parameter(group=SOLIDS)] = False,
    settings: Settings = (),
    outputs: ExportOutputs = ExportOutputs(),  # pyright: ignore[reportInvalidTypeForm]
) -> int:
    """Write files for the laser, for CAD and for simulators; give one option for each file.

    All files are made before the first one is written. A file that is already there is replaced.

    Args:
        channels: Diameter of the channels of the tendons through the wall [mm]; 0 for none.
        degrees: Write y in degrees round the tube instead of mm.
        mesh: How fine the mesh is.
        tension: Bend a solid by this tension at the base of a tendon [N], written as for
            `simulate`; its last step counts. It is the load of a deck, and the largest tension that
            the joints of a simulator are fitted to.
        stroke: Bend a solid by this tendon length drawn out at the base [mm].
        straight: Leave solids straight under a load that is for a deck or a simulator.
    """
    outputs.check(robot_files(robot))
    options: dict[type, Any] = {
        PatternOptions: PatternOptions(**asdict(pattern), y_unit="deg" if degrees else "mm"),
        SolidOptions: SolidOptions(channels, pattern.shank, pattern.chord, pattern.polishing),
        SimulatorOptions: SimulatorOptions(),
        DeckOptions: DeckOptions.of_mesh(mesh),
    }
    targets = {name: file for name in FORMATS if (file := getattr(outputs, name)) is not None}
    if not targets:
        raise InputError.MISSING_VALUE(
            f"Give a file to write: {', '.join(f'--{name} FILE' for name in FORMATS)}."
        )
    for name, file in targets.items():
        check_suffix(name, file, f"--{name}")
        FORMATS[name].check_packages(f"--{name}")
    chosen = chosen_robot(robot, settings)
    loaded = bool(tension or stroke)
    if loaded and not any(FORMATS[name].bends for name in targets):
        bending = " ".join(f"--{name}" for name, kind in FORMATS.items() if kind.bends)
        raise InputError.CONFLICT(
            "--tension, --stroke: no file that was asked for shows the robot under load; leave "
            f"them out, or give {bending}."
        )
    with terminal.progress(f"exporting {chosen.name}", compiles=loaded):
        unloaded = subject = Subject(chosen)
        if loaded:
            from notchflex import LoadPath, simulate

            load = LoadPath(*load_columns(tension, stroke, chosen.number_of_tendons))
            path = simulate(chosen, load)
            if not path.converged[-1]:
                return terminal.failed(f"not converged: {path.reason[-1]}.")
            subject = Subject(chosen, path, len(path) - 1)
        documents: dict[str, Any] = {}
        for name, file in targets.items():
            kind = FORMATS[name].options
            bent = FORMATS[name].bends and not (straight and kind is SolidOptions)
            documents[file] = build(name, subject if bent else unloaded, options[kind])
        written = write(documents)

    def document(robot: Robot) -> dict[str, Any]:
        from notchflex.support import document_head, robot_digest

        files = [{"file": one.file, "warnings": list(one.warnings), **one.facts} for one in written]
        return {**document_head(robot), "robot_hash": robot_digest(robot), "files": files}

    outputs.write(chosen, document)
    for sentence in dict.fromkeys(text for one in written for text in one.warnings):
        terminal.warn(sentence)
    for one in written if outputs.prints_tables else ():
        print(f"Wrote {one.file}.")
    return DONE
