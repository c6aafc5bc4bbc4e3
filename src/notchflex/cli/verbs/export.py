"""`notchflex export`: files for the laser, for CAD and for simulators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import flag
from notchflex.cli.arguments.export import (
    FINITE_ELEMENTS,
    PATTERN,
    SOLIDS,
    ExportFiles,
    PatternArguments,
    length,
)
from notchflex.cli.arguments.loads import tendon_command
from notchflex.cli.arguments.robots import RobotName, Settings, chosen_robot, robot_files
from notchflex.cli.outputs import JsonFile, Outputs, Quiet
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.export.export import Exported, build, write
from notchflex.export.formats import (
    FORMATS,
    DeckOptions,
    Document,
    Mesh,
    PatternOptions,
    SimulatorOptions,
    SolidOptions,
    Subject,
    check_suffix,
)
from notchflex.support import TendonCommand, load_columns

if TYPE_CHECKING:
    from notchflex import Robot


def export(
    robot: RobotName,
    /,
    *,
    files: ExportFiles = ExportFiles(),  # noqa: B008  # pyright: ignore[reportInvalidTypeForm]
    channels: Annotated[
        float,
        length(
            "Diameter of the channels of the tendons through the wall [mm]; 0 for none.",
            group=SOLIDS,
        ),
    ] = 0.0,
    degrees: Annotated[
        bool, flag("Write y in degrees round the tube instead of mm.", group=PATTERN)
    ] = False,
    pattern: PatternArguments = PatternArguments(),  # noqa: B008  # pyright: ignore
    mesh: Annotated[
        Mesh,
        Parameter(group=FINITE_ELEMENTS, help="How fine the mesh is."),
    ] = "medium",
    tension: Annotated[
        tuple[TendonCommand, ...],
        tendon_command("--tension"),
        Parameter(
            group=SOLIDS,
            help="Bend a solid by this tension at the base of a tendon [N], written as for "
            "`simulate`; its last step counts. It is the load of a deck, and the largest tension "
            "that the joints of a simulator are fitted to.",
        ),
    ] = (),
    stroke: Annotated[
        tuple[TendonCommand, ...],
        tendon_command("--stroke", negative=True),
        Parameter(
            group=SOLIDS,
            help="Bend a solid by this tendon length drawn out at the base [mm].",
        ),
    ] = (),
    straight: Annotated[
        bool,
        flag("Leave solids straight under a load that is for a deck or a simulator.", group=SOLIDS),
    ] = False,
    settings: Settings = (),
    json: JsonFile = None,
    quiet: Quiet = False,
) -> int:
    """Write files for the laser, for CAD and for simulators; give one option for each file.

    All files are made before the first one is written. A file that is already there is replaced.
    """
    outputs = Outputs(robot_files(robot), quiet=quiet, json=json, **vars(files))
    y_unit = "deg" if degrees else "mm"
    options: dict[type, Any] = {
        PatternOptions: PatternOptions(**vars(pattern), y_unit=y_unit),
        SolidOptions: SolidOptions(channels, pattern.shank, pattern.chord, pattern.polishing),
        SimulatorOptions: SimulatorOptions(),
        DeckOptions: DeckOptions.of_mesh(mesh),
    }
    targets = {name: file for name, file in outputs.targets.items() if name in FORMATS}
    if not targets:
        raise InputError.MISSING_VALUE(
            f"Give a file to write: {', '.join(f'--{name} FILE' for name in FORMATS)}."
        )
    for name, file in targets.items():
        check_suffix(name, file, f"--{name}")
        FORMATS[name].check_packages(f"--{name}")
    chosen = chosen_robot(robot, settings)
    if (tension or stroke) and not any(FORMATS[name].bends for name in targets):
        bending = " ".join(f"--{name}" for name, one in FORMATS.items() if one.bends)
        raise InputError.CONFLICT(
            "--tension, --stroke: no file that was asked for shows the robot under load; leave "
            f"them out, or give {bending}."
        )
    with terminal.working(f"exporting {chosen.name}"):
        subject = _subject(chosen, tension, stroke)
        if subject.path is not None and not subject.path.converged[subject.step]:
            terminal.error(f"not converged: {subject.path.reason[subject.step]}.")
            return NOT_CONVERGED
        documents: dict[str, Document] = {}
        for name, file in targets.items():
            kind = FORMATS[name].options
            loads = FORMATS[name].bends and not (straight and kind is SolidOptions)
            documents[file] = build(name, subject if loads else Subject(chosen), options[kind])
        written = write(documents)
    return _report(chosen, written, outputs)


def _subject(
    robot: Robot, tension: tuple[TendonCommand, ...], stroke: tuple[TendonCommand, ...]
) -> Subject:
    """Return the robot, solved under its loads where there are any."""
    if not (tension or stroke):
        return Subject(robot)
    terminal.use_compile_cache()
    from notchflex import LoadPath, simulate

    path = simulate(robot, LoadPath(*load_columns(tension, stroke, robot.number_of_tendons)))
    return Subject(robot, path, len(path) - 1)


def _report(robot: Robot, written: list[Exported], outputs: Outputs) -> int:
    """Write the document of `--json`, warnings, and what was written."""

    def document() -> dict[str, Any]:
        from notchflex.support import document_head, robot_digest

        files = [{"file": one.file, "warnings": list(one.warnings), **one.facts} for one in written]
        return {**document_head(robot), "robot_hash": robot_digest(robot), "files": files}

    outputs.write_json(document)
    for sentence in dict.fromkeys(text for one in written for text in one.warnings):
        terminal.warn(sentence)
    if outputs.prints_tables:
        for one in written:
            print(f"Wrote {one.file}.")
    return DONE
