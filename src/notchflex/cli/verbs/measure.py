"""`notchflex measure`: notch angles from photographs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted, flag
from notchflex.cli.arguments.robots import (
    Columns,
    Settings,
    chosen_robot,
    named_columns,
    robot_files,
)
from notchflex.cli.outputs import OUTPUT, JsonFile, Outputs, Quiet, output_file
from notchflex.cli.tables.measured_cut import write_cut
from notchflex.cli.terminal import DONE, INTERRUPTED, NOT_CONVERGED
from notchflex.support import check_folder, check_output, parse_number, parse_whole
from notchflex.viewer import HOST, PORT, check_host, check_installed

if TYPE_CHECKING:
    from notchflex.photographs import MeasuredPhotographs


def _angle(text: str) -> float:
    return parse_number(text, "an angle in deg, such as 20")


def _scale(text: str) -> float:
    return parse_number(text, "a scale in px/mm, such as 75.3")


def measure(
    *photographs: Annotated[
        str, Parameter(help="Photographs of the robot from the side: PNG, JPEG or TIFF.")
    ],
    robot: Annotated[
        str, Parameter(help="Robot file (.toml), or the name of a ready robot, in all of them.")
    ],
    output: Annotated[
        str | None,
        output_file("-o", "Write the CSV that `calibrate` reads to this file; `-` prints it."),
    ] = None,
    loads: Annotated[
        str | None,
        Parameter(
            metavar="FILE",
            help="CSV with a column `photograph` and columns of loads, such as `tendon_force_N`.",
        ),
    ] = None,
    column: Columns = (),
    pattern: Annotated[
        str | None,
        Parameter(
            help="Pattern of the file names: `{tension}` is the tension in N, `{pull}` the label "
            "of the pull."
        ),
    ] = None,
    exif: Annotated[
        bool,
        flag("Read the tension from the EXIF of each photograph: a comment `tension=1.2 N`."),
    ] = False,
    overlays: Annotated[
        str | None,
        Parameter(
            group=OUTPUT,
            metavar="FOLDER",
            help="Write each photograph with its fitted outline as PNG into this folder; with `-o "
            "NAME.csv` NAME-overlays by default.",
        ),
    ] = None,
    scale: Annotated[
        float | None,
        converted(_scale, "PX/MM"),
        Parameter(
            help="Pixels of the photographs per mm, at the robot; by default the scale follows "
            "from the outer diameter alone."
        ),
    ] = None,
    board: Annotated[
        str | None,
        Parameter(
            metavar="LAYOUT",
            help="Board of markers beside the robot, which gives scale and tilt: columns x rows, "
            "side and gap of the markers in mm, such as `4x3,marker=5,gap=1.5`; "
            "`notchflex board` draws it.",
        ),
    ] = None,
    uncertainty: Annotated[
        float | None,
        converted(_angle, "DEG"),
        Parameter(
            help="Refuse photographs whose standard deviations have a larger root mean square; "
            "0.11 deg by default."
        ),
    ] = None,
    correct: Annotated[
        bool,
        flag(
            "Serve a page for the browser on which each fit is corrected by hand: drag points of "
            "the chain, fit again, and accept the fit or leave the photograph out."
        ),
    ] = False,
    open_browser: Annotated[
        bool, flag("With `--correct`: open a browser there.", name="--open")
    ] = False,
    port: Annotated[
        int | None,
        converted(parse_whole(1, 65535), "N"),
        Parameter(
            help="With `--correct`: port of the page, or the next one that is free; "
            f"{PORT} by default."
        ),
    ] = None,
    cut: Annotated[
        bool,
        flag(
            "Measure height, depth and uncut length of every notch instead, in photographs of the "
            "straight robot."
        ),
    ] = False,
    turn: Annotated[
        tuple[float, ...],
        converted(
            _angle,
            "DEG",
            several=True,
            help="With `--cut`: by how much the robot was turned about its axis for each "
            "photograph after the first, from the first on [deg].",
        ),
    ] = (),
    write_robot: Annotated[
        str | None,
        output_file("--write-robot", "With `--cut`: write the robot as it was cut to this file."),
    ] = None,
    settings: Settings = (),
    json: JsonFile = None,
    quiet: Quiet = False,
) -> int:
    """Measure the angle of every notch in photographs of a bent robot.

    The outline of the robot file is fitted to the edges of each photograph. A photograph in which
    anything is doubtful is refused with its reason (exit code 1); look at the overlays.
    """
    _check_options(cut, turn, write_robot, exif or loads is not None or pattern is not None)
    if cut and uncertainty is not None:
        raise InputError.CONFLICT("--cut: --uncertainty is of angles; leave it out")
    _check_page(correct, cut, port, open_browser)
    inputs = [*photographs, *robot_files(robot), *([] if loads is None else [loads])]
    folder = overlays
    if folder is None and output not in (None, "-"):
        folder = str(Path(str(output)).with_suffix("")) + "-overlays"
    from notchflex.photographs.overlay import overlay_names

    files: tuple[Path, ...] = ()
    if folder is not None:
        files = check_folder(folder, overlay_names(photographs), "--overlays", inputs=inputs)
    named = {f"--overlays ({file.name})": str(file) for file in files}
    if output is not None:
        named = {"-o": output, **named}
    if write_robot is not None:
        named["--write-robot"] = write_robot
    outputs = Outputs(inputs, quiet=quiet, files=named, json=json)
    for option, target in (("-o", output), ("--write-robot", write_robot)):
        if target is not None:
            check_output(target, option, inputs=inputs)
    chosen = chosen_robot(robot, settings)
    with terminal.bars("measuring") as progress:
        terminal.use_compile_cache()
        from notchflex.photographs import board_of, measure_cut
        from notchflex.photographs import measure as measured

        limit: dict[str, Any] = {}
        ruler: dict[str, Any] = {
            "scale": scale,
            "board": None if board is None else board_of(board),
        }
        if cut:
            as_cut = measure_cut(photographs, chosen, turn_deg=turn, progress=progress, **ruler)
            return write_cut(as_cut, outputs, output, write_robot, files)
        if uncertainty is not None:
            limit["uncertainty_deg"] = uncertainty
        given: dict[str, Any] = {
            "loads": loads,
            "pattern": pattern,
            "exif": exif,
            "columns": named_columns(column),
        }
        result = measured(photographs, chosen, progress=progress, **given, **ruler, **limit)
    done = True
    if correct:
        result, done = _corrected(result, {**ruler, **limit}, port or PORT, open_browser)
    _write(result, outputs, output, files)
    if not done:
        return INTERRUPTED
    return DONE if not result.refused else NOT_CONVERGED


def _check_page(correct: bool, cut: bool, port: int | None, open_browser: bool) -> None:
    """Check the options of the page before anything is measured."""
    if correct and cut:
        raise InputError.CONFLICT("--correct: notches as cut (--cut) have no page; leave it out")
    if not correct and (port is not None or open_browser):
        raise InputError.MISSING_VALUE("--port and --open need --correct")
    if correct:
        check_installed()
        check_host(HOST, port or PORT)


def _corrected(
    photographs: MeasuredPhotographs, options: dict[str, Any], port: int, open_browser: bool
) -> tuple[MeasuredPhotographs, bool]:
    """Serve the page until every photograph was accepted or left out, or until Ctrl-C.

    Returns:
        What was accepted, and whether every photograph was looked at.
    """
    from notchflex.viewer.correction.correction import Correction

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


def _check_options(cut: bool, turn: tuple[float, ...], robot: str | None, loaded: bool) -> None:
    if cut and loaded:
        raise InputError.CONFLICT(
            "--cut: straight robots have no loads; leave out --loads, --pattern and --exif"
        )
    if not cut and (turn or robot is not None):
        raise InputError.MISSING_VALUE("--turn and --write-robot need --cut")


def _write(
    photographs: MeasuredPhotographs, outputs: Outputs, output: str | None, files: tuple[Path, ...]
) -> None:
    from notchflex.photographs.overlay import write_overlay
    from notchflex.photographs.reading import read_photograph

    if files:
        files[0].parent.mkdir(exist_ok=True)
    for file, one in zip(files, photographs.photographs, strict=False):
        write_overlay(file, read_photograph(one.source), one)
    outputs.write_json(photographs.document)
    if output is not None and photographs.measured:
        photographs.write_csv(output)
    if outputs.prints_tables and output != "-":
        _print(photographs)
    for one in photographs.refused:
        terminal.warn(f"{one.source} is refused: {one.reason}.")
    if output is not None and not photographs.measured:
        terminal.error(f"no photograph was measured; {output} is not written.")
    elif output is not None and not photographs.loads:
        terminal.note("calibrate needs loads too: give --loads, --pattern or --exif.")


def _print(photographs: MeasuredPhotographs) -> None:
    import numpy as np

    if not photographs.measured:
        return
    console = terminal.output()
    console.print(f"Notch angles of {photographs.robot.name}, with standard deviations")
    heads = ["\nphotograph"]
    for notch in range(photographs.robot.number_of_notches):
        heads += [f">notch {notch + 1}\ndeg", ">±\ndeg"]
    rows: list[list[str]] = []
    for one in photographs.measured:
        row = [Path(one.source).name]
        for angle, spread in zip(
            np.degrees(one.notch_angle), np.degrees(one.notch_angle_deviation), strict=True
        ):
            row += [f"{angle:.2f}", f"{spread:.2f}"]
        rows.append(row)
    console.print(terminal.table(heads, rows))
