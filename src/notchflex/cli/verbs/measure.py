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
    if cut and (exif or loads or pattern or uncertainty or correct):
        raise InputError.CONFLICT(
            "--cut: straight robots have no loads, no angles and no page; leave out --loads, "
            "--pattern, --exif, --uncertainty and --correct"
        )
    if not cut and (turn or write_robot is not None):
        raise InputError.MISSING_VALUE("--turn and --write-robot need --cut")
    if not correct and (port is not None or open_browser):
        raise InputError.MISSING_VALUE("--port and --open need --correct")
    if correct:
        check_installed()
        check_host(HOST, port or PORT)
    from notchflex.photographs.measured import overlay_names

    if overlays is None and output not in (None, "-"):
        overlays = f"{Path(output).with_suffix('')}-overlays"
    written = {"-o": output, "--write-robot": write_robot}
    written = {option: file for option, file in written.items() if file is not None}
    files = outputs.check(
        [*photographs, *robot_files(robot), *([] if loads is None else [loads])],
        files=written,
        folder=("--overlays", overlays, overlay_names(photographs)),
    )
    chosen, done = chosen_robot(robot, settings), True
    with terminal.progress("measuring") as progress:
        from notchflex import photographs as reading

        options: dict[str, Any] = {
            "scale": scale,
            "board": None if board is None else reading.board_of(board),
        }
        if cut:
            measured = reading.measure_cut(
                photographs, chosen, turn_deg=turn, progress=progress, **options
            )
        else:
            if uncertainty is not None:
                options["uncertainty_deg"] = uncertainty
            measured = reading.measure(
                photographs,
                chosen,
                loads=loads,
                pattern=pattern,
                exif=exif,
                columns=dict(column),
                progress=progress,
                **options,
            )
    if correct and isinstance(measured, reading.MeasuredPhotographs):
        measured, done = _corrected(measured, options, port or PORT, open_browser)
    _write_overlays(measured, files)
    outputs.write(
        measured, lambda measured: measured.document(), None if "-" in written.values() else _print
    )
    code = _report(measured, written)
    return code if done else INTERRUPTED


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


def _write_overlays(measured: MeasuredPhotographs | MeasuredCut, files: Sequence[Path]) -> None:
    """Write each photograph with its fitted outline."""
    from notchflex.photographs import MeasuredCut
    from notchflex.photographs.measured import cut_lines, write_overlay
    from notchflex.photographs.reading import read_photograph

    lines = cut_lines(measured) if isinstance(measured, MeasuredCut) else []
    for file, photograph in zip(files, measured.photographs, strict=False):
        file.parent.mkdir(exist_ok=True)
        write_overlay(file, read_photograph(photograph.source), photograph, lines)


def _report(measured: MeasuredPhotographs | MeasuredCut, written: dict[str, str]) -> int:
    """Write files and what is missing; return the exit code."""
    from notchflex.photographs import MeasuredCut

    is_cut = isinstance(measured, MeasuredCut)
    if is_cut:
        refused = {"the cut": measured.reason} if measured.reason else {}
    else:
        refused = {photograph.source: photograph.reason for photograph in measured.refused}
    for name, reason in refused.items():
        terminal.warn(f"{name} is refused: {reason}.")
    if not measured.measured:
        if written:
            terminal.error(f"nothing was measured; not written: {', '.join(written.values())}.")
        return NOT_CONVERGED
    if "-o" in written:
        measured.write_csv(written["-o"])
        if not is_cut and not measured.loads:
            terminal.note("calibrate needs loads too: give --loads, --pattern or --exif.")
    if is_cut and "--write-robot" in written:
        measured.write_robot(written["--write-robot"])
    if is_cut and len(measured.photographs) == 1:
        terminal.note("depths need a second photograph, with the robot turned by some 20 deg.")
    return NOT_CONVERGED if refused else DONE


def _print(measured: MeasuredPhotographs | MeasuredCut) -> None:
    """Print the columns of the CSV."""
    if measured.measured:
        what = "notches as cut" if "depth_mm" in measured.columns() else "angles of notches"
        terminal.line(f"{measured.robot.name}: {what}, with standard deviations (sd)")
        tables.show(measured.columns(), forms={"notch": ".0f"})
