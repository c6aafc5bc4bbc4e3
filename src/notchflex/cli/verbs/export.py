"""`notchflex export`: files for the laser, for CAD and for simulators."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex._load_words import TendonCommand, load_columns, number
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted
from notchflex.cli.arguments.export import FINITE_ELEMENTS, SOLIDS, PatternArguments
from notchflex.cli.arguments.loads import tendon_command
from notchflex.cli.arguments.robots import RobotName, Settings, chosen_robot, robot_files
from notchflex.cli.outputs import JsonFile, Outputs, Quiet, output_file
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.errors import InputError
from notchflex.export.export import Exported, build, write
from notchflex.export.finite_elements.options import DeckOptions, Mesh
from notchflex.export.formats import FORMATS, check_suffix
from notchflex.export.options import PatternOptions, SolidOptions
from notchflex.export.simulators.options import SimulatorOptions

if TYPE_CHECKING:
    from notchflex.export.document import Subject
    from notchflex.robot import Robot


def _file(name: str) -> Parameter:
    """Return the parameter of the option of a format."""
    one = FORMATS[name]
    return output_file(f"--{name}", f"Write a {one.text} to this {' or '.join(one.suffixes)} file.")


def export(
    robot: RobotName,
    /,
    *,
    dxf: Annotated[str | None, _file("dxf")] = None,
    svg: Annotated[str | None, _file("svg")] = None,
    pdf: Annotated[str | None, _file("pdf")] = None,
    stl: Annotated[str | None, _file("stl")] = None,
    step: Annotated[str | None, _file("step")] = None,
    channels: Annotated[
        float,
        converted(partial(number, form="a diameter in mm, 0 or more", least=0.0), "MM"),
        Parameter(
            group=SOLIDS,
            help="Diameter of the channels of the tendons through the wall [mm]; 0 for none.",
        ),
    ] = 0.0,
    mjcf: Annotated[str | None, _file("mjcf")] = None,
    urdf: Annotated[str | None, _file("urdf")] = None,
    transmission: Annotated[str | None, _file("transmission")] = None,
    inp: Annotated[str | None, _file("inp")] = None,
    pattern: PatternArguments = PatternArguments(),  # noqa: B008 - frozen
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
    settings: Settings = (),
    json: JsonFile = None,
    quiet: Quiet = False,
) -> int:
    """Write files for the laser, for CAD and for simulators; give one option for each file.

    All files are made before the first one is written. A file that is already there is replaced.
    """
    outputs = Outputs(
        robot_files(robot),
        quiet=quiet,
        json=json,
        dxf=dxf,
        svg=svg,
        pdf=pdf,
        stl=stl,
        step=step,
        mjcf=mjcf,
        urdf=urdf,
        transmission=transmission,
        inp=inp,
    )
    options: dict[type, Any] = {
        PatternOptions: pattern.options(),
        SolidOptions: SolidOptions(channels=channels, shank=pattern.shank, chord=pattern.chord),
        SimulatorOptions: SimulatorOptions(),
        DeckOptions: DeckOptions.of_mesh(mesh),
    }
    files = {name: file for name, file in outputs.targets.items() if name in FORMATS}
    if not files:
        raise InputError.MISSING_VALUE(
            f"Give a file to write: {', '.join(f'--{name} FILE' for name in FORMATS)}."
        )
    for name, file in files.items():
        check_suffix(name, file, f"--{name}")
        FORMATS[name].check_packages(f"--{name}")
    chosen = chosen_robot(robot, settings)
    loaded = bool(tension or stroke)
    if loaded and not any(FORMATS[name].bends for name in files):
        bending = [f"--{name}" for name, one in FORMATS.items() if one.bends]
        raise InputError.CONFLICT(
            "--tension, --stroke: no file that was asked for shows the robot under load; leave "
            f"them out{f', or give {chr(32).join(bending)}' if bending else ''}."
        )
    with terminal.working(f"exporting {chosen.name}"):
        subject = _subject(chosen, tension, stroke)
        if subject.path is not None and not subject.path.converged[subject.step]:
            terminal.error(f"not converged: {subject.path.reason[subject.step]}.")
            return NOT_CONVERGED
        documents = {
            files[name]: build(
                name,
                subject if FORMATS[name].bends else _free(chosen),
                options[FORMATS[name].options],
            )
            for name in files
        }
        written = write(documents)
    return _report(chosen, written, outputs)


def _free(robot: Robot) -> Subject:
    from notchflex.export.document import Subject

    return Subject(robot)


def _subject(
    robot: Robot, tension: tuple[TendonCommand, ...], stroke: tuple[TendonCommand, ...]
) -> Subject:
    """Return the robot, solved under its loads where there are any."""
    from notchflex.export.document import Subject

    if not (tension or stroke):
        return Subject(robot)
    terminal.use_compile_cache()
    from notchflex.analysis import simulate
    from notchflex.loads import LoadPath

    path = simulate(robot, LoadPath(*load_columns(tension, stroke, robot.number_of_tendons)))
    return Subject(robot, path, len(path) - 1)


def _report(robot: Robot, written: list[Exported], outputs: Outputs) -> int:
    """Write the document of `--json`, warnings, and what was written."""

    def document() -> dict[str, Any]:
        from notchflex.results.files.json import document_head
        from notchflex.results.same_robot import robot_digest

        files = [{"file": one.file, "warnings": list(one.warnings), **one.facts} for one in written]
        return {**document_head(robot), "robot_hash": robot_digest(robot), "files": files}

    outputs.write_json(document)
    for sentence in dict.fromkeys(text for one in written for text in one.warnings):
        terminal.warn(sentence)
    if outputs.prints_tables:
        for one in written:
            print(f"Wrote {one.file}.")
    return DONE
