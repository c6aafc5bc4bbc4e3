"""`notchflex measure` and `notchflex board`: notches from photographs, and their scale."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    OUTPUT,
    Columns,
    File,
    Outputs,
    ShortFile,
    converted,
    integer,
    named_columns,
    number,
)
from notchflex.cli.robots import Settings, chosen_robot, robot_files
from notchflex.cli.terminal import DONE, INTERRUPTED, NOT_CONVERGED
from notchflex.support import check_output, parse_number
from notchflex.viewer import HOST, PORT, check_host, check_installed

if TYPE_CHECKING:
    from notchflex.photographs import MeasuredCut, MeasuredPhotographs

_ANGLE = "an angle in deg, such as 20"


def board(layout: str, *, output: ShortFile = None) -> int:
    """Draw a board of ArUco or AprilTag markers in its true size.

    Print it at 100 %, check a marker with a calliper, and lay it beside the robot, in the plane in
    which the robot bends. `notchflex measure --board` with the same layout reads scale and tilt
    from it.

    Args:
        layout: Columns x rows, side and gap of the markers in mm, and the set of markers if it is
            not 4x4_50: `4x3,marker=5,gap=1.5,dictionary=apriltag_36h11`.
        output: Write the drawing to this .svg file; `-` prints it.
    """
    if output is None:
        raise InputError.MISSING_VALUE("-o is missing: give the drawing a name, -o board.svg")
    if output != "-":
        if not output.lower().endswith(".svg"):
            raise InputError.FILE_FORMAT(f"-o {output}: boards are written as .svg; choose that")
        check_output(output, "-o")
    from notchflex.photographs import board_of

    sheet = board_of(layout)
    sheet.write_svg(output)
    if output != "-":
        width, height = sheet.size
        terminal.note(
            f"{output}: markers on {width:g} x {height:g} mm; print it at 100 % and check a marker "
            f"with a calliper ({sheet.marker:g} mm)."
        )
    return DONE


def measure(
    *photographs: str,
    robot: str,
    output: ShortFile = None,
    loads: Annotated[str | None, Parameter(metavar="FILE")] = None,
    column: Columns = (),
    pattern: str | None = None,
    exif: bool = False,
    overlays: Annotated[str | None, Parameter(group=OUTPUT, metavar="FOLDER")] = None,
    scale: Annotated[float | None, number("a scale in px/mm, such as 75.3", "PX/MM")] = None,
    board: Annotated[str | None, Parameter(metavar="LAYOUT")] = None,
    uncertainty: Annotated[float | None, number(_ANGLE, "DEG")] = None,
    correct: bool = False,
    open_browser: Annotated[bool, Parameter(name="--open")] = False,
    port: Annotated[
        int | None,
        integer(1, 65535),
        Parameter(
            help="With `--correct`: port of the page, or the next one that is free; "
            f"{PORT} by default."
        ),
    ] = None,
    cut: bool = False,
    turn: Annotated[
        tuple[float, ...],
        converted(lambda text: parse_number(text, _ANGLE), "DEG", several=True),
    ] = (),
    write_robot: File = None,
    settings: Settings = (),
    outputs: Outputs = Outputs(),
) -> int:
    """Measure the angle of every notch in photographs of a bent robot.

    The outline of the robot file is fitted to the edges of each photograph. A photograph in which
    anything is doubtful is refused with its reason (exit code 1); look at the overlays.

    Args:
        photographs: Photographs of the robot from the side: PNG, JPEG or TIFF.
        robot: Robot file (.toml), or the name of a ready robot, in all of them.
        output: Write the CSV that `calibrate` reads to this file; `-` prints it.
        loads: CSV with a column `photograph` and columns of loads, such as `tendon_force_N`.
        pattern: Pattern of the file names: `{tension}` is the tension in N, `{pull}` the label of
            the pull.
        exif: Read the tension from the EXIF of each photograph: a comment `tension=1.2 N`.
        overlays: Write each photograph with its fitted outline as PNG into this folder; with `-o
            NAME.csv` NAME-overlays by default.
        scale: Pixels of the photographs per mm, at the robot; by default the scale follows from the
            outer diameter alone.
        board: Board of markers beside the robot, which gives scale and tilt: columns x rows, side
            and gap of the markers in mm, such as `4x3,marker=5,gap=1.5`; `notchflex board` draws
            it.
        uncertainty: Refuse photographs whose standard deviations have a larger root mean square;
            0.11 deg by default.
        correct: Serve a page for the browser on which each fit is corrected by hand: drag points of
            the chain, fit again, and accept the fit or leave the photograph out.
        open_browser: With `--correct`: open a browser there.
        cut: Measure height, depth and uncut length of every notch instead, in photographs of the
            straight robot.
        turn: With `--cut`: by how much the robot was turned about its axis for each photograph
            after the first, from the first on [deg].
        write_robot: With `--cut`: write the robot as it was cut to this file.
    """
    if cut and (exif or loads is not None or pattern is not None):
        raise InputError.CONFLICT(
            "--cut: straight robots have no loads; leave out --loads, --pattern and --exif"
        )
    if not cut and (turn or write_robot is not None):
        raise InputError.MISSING_VALUE("--turn and --write-robot need --cut")
    if cut and uncertainty is not None:
        raise InputError.CONFLICT("--cut: --uncertainty is of angles; leave it out")
    _check_page(correct, cut, port, open_browser)
    inputs = [*photographs, *robot_files(robot), *([] if loads is None else [loads])]
    written = {"-o": output, "--write-robot": write_robot}
    files = _check_files(photographs, inputs, overlays, written, outputs)
    chosen = chosen_robot(robot, settings)
    with terminal.progress("measuring") as progress:
        from notchflex import photographs as reading

        options: dict[str, Any] = {
            "scale": scale,
            "board": None if board is None else reading.board_of(board),
        }
        if cut:
            as_cut = reading.measure_cut(
                photographs, chosen, turn_deg=turn, progress=progress, **options
            )
            return _write_cut(as_cut, outputs, written, files)
        if uncertainty is not None:
            options["uncertainty_deg"] = uncertainty
        measured = reading.measure(
            photographs,
            chosen,
            loads=loads,
            pattern=pattern,
            exif=exif,
            columns=named_columns(column),
            progress=progress,
            **options,
        )
    done = True
    if correct:
        measured, done = _corrected(measured, options, port or PORT, open_browser)
    _write(measured, outputs, output, files)
    if not done:
        return INTERRUPTED
    return NOT_CONVERGED if measured.refused else DONE


def _check_page(correct: bool, cut: bool, port: int | None, open_browser: bool) -> None:
    """Check the options of the page before anything is measured."""
    if correct and cut:
        raise InputError.CONFLICT("--correct: notches as cut (--cut) have no page; leave it out")
    if not correct and (port is not None or open_browser):
        raise InputError.MISSING_VALUE("--port and --open need --correct")
    if correct:
        check_installed()
        check_host(HOST, port or PORT)


def _check_files(
    photographs: Sequence[str],
    inputs: Sequence[str | Path],
    overlays: str | None,
    written: dict[str, str | None],
    outputs: Outputs,
) -> Sequence[Path]:
    """Check the files of a call before anything is measured; return those of the overlays."""
    from notchflex.photographs.measured import overlay_names

    output = written["-o"]
    if overlays is None and output not in (None, "-"):
        overlays = f"{Path(str(output)).with_suffix('')}-overlays"
    named = {option: target for option, target in written.items() if target is not None}
    folder = ("--overlays", overlays, overlay_names(photographs))
    files = outputs.check(inputs, files=named, folder=folder)
    for option, target in named.items():
        check_output(target, option, inputs=inputs)
    return files


def _corrected(
    photographs: MeasuredPhotographs, options: dict[str, Any], port: int, open_browser: bool
) -> tuple[MeasuredPhotographs, bool]:
    """Serve the page until every photograph was accepted or left out, or until Ctrl-C.

    Returns:
        What was accepted, and whether every photograph was looked at.
    """
    from notchflex.viewer import Correction

    page = Correction(photographs, port=port, **options)
    terminal.note(f"correct the fits on {page.address} (Ctrl+C ends, what was accepted is written)")
    if open_browser:
        import webbrowser

        webbrowser.open(page.address)
    corrected = page.run()
    if page.number == 0:
        raise KeyboardInterrupt
    if not page.done:
        terminal.note(
            f"ended at photograph {page.number + 1} of {len(photographs)}; "
            "photographs accepted before are kept."
        )
    return corrected, page.done


def _write_overlays(
    measured: MeasuredPhotographs | MeasuredCut, files: Sequence[Path], *lines: Any
) -> None:
    """Write each photograph with its fitted outline."""
    from notchflex.photographs.measured import write_overlay
    from notchflex.photographs.reading import read_photograph

    for file, photograph in zip(files, measured.photographs, strict=False):
        file.parent.mkdir(exist_ok=True)
        write_overlay(file, read_photograph(photograph.source), photograph, *lines)


def _write(
    measured: MeasuredPhotographs, outputs: Outputs, output: str | None, files: Sequence[Path]
) -> None:
    _write_overlays(measured, files)
    if output is not None and measured.measured:
        measured.write_csv(output)
    outputs.write(
        measured.document,
        lambda: None if output == "-" else _print("angles of notches", measured),
    )
    for photograph in measured.refused:
        terminal.warn(f"{photograph.source} is refused: {photograph.reason}.")
    if output is not None and not measured.measured:
        terminal.error(f"no photograph was measured; {output} is not written.")
    elif output is not None and not measured.loads:
        terminal.note("calibrate needs loads too: give --loads, --pattern or --exif.")


def _write_cut(
    cut: MeasuredCut, outputs: Outputs, written: dict[str, str | None], overlays: Sequence[Path]
) -> int:
    """Write and print the notches as they were cut; return the exit code."""
    from notchflex.photographs.measured import cut_lines

    _write_overlays(cut, overlays, cut_lines(cut))
    targets = [target for target in written.values() if target is not None]
    shown = not cut.reason and "-" not in targets
    outputs.write(cut.document, lambda: _print("notches as cut", cut) if shown else None)
    if cut.reason:
        terminal.warn(f"the cut is refused: {cut.reason}.")
        if targets:
            terminal.error(f"nothing was measured; not written: {', '.join(targets)}.")
        return NOT_CONVERGED
    for target, write in zip(written.values(), (cut.write_csv, cut.write_robot), strict=True):
        if target is not None:
            write(target)
    if len(cut.photographs) == 1:
        terminal.note("depths need a second photograph, with the robot turned by some 20 deg.")
    return DONE


def _print(what: str, measured: MeasuredPhotographs | MeasuredCut) -> None:
    """Print the columns of the CSV."""
    columns = measured.columns()
    if any(len(values) for values in columns.values()):
        terminal.output().print(f"{measured.robot.name}: {what}, with standard deviations (sd)")
        tables.show(tables.frame(columns, notch=".0f"))
