"""`notchflex board`: a board of markers for the printer, to be photographed beside a robot."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.outputs import output_file
from notchflex.cli.terminal import DONE
from notchflex.support import check_output


def board(
    layout: Annotated[
        str,
        Parameter(
            help="Columns x rows, side and gap of the markers in mm, and the set of markers if it "
            "is not 4x4_50: `4x3,marker=5,gap=1.5,dictionary=apriltag_36h11`."
        ),
    ],
    *,
    output: Annotated[
        str | None, output_file("-o", "Write the drawing to this .svg file; `-` prints it.")
    ] = None,
) -> int:
    """Draw a board of ArUco or AprilTag markers in its true size.

    Print it at 100 %, check a marker with a calliper, and lay it beside the robot, in the plane in
    which the robot bends. `notchflex measure --board` with the same layout reads scale and tilt
    from it.
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
