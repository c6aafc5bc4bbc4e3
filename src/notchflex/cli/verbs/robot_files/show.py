"""`notchflex show`: the notches of a robot and how they close."""

from __future__ import annotations

from typing import Annotated

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.robots import (
    RobotName,
    Settings,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.outputs import JsonFile, Outputs, Quiet, output_file
from notchflex.support import PAPER

DrawingFile = Annotated[
    str | None,
    output_file(
        "--plot",
        "Draw the tube and its notches with their dimensions to this .png, .svg or .pdf file.",
    ),
]


def show(
    robot: RobotName,
    /,
    *,
    settings: Settings = (),
    json: JsonFile = None,
    plot: DrawingFile = None,
    quiet: Quiet = False,
) -> None:
    """Show every notch of a robot: section, closing angle and force, strain at closing.

    The closing force is the tension at which a notch closes while the tendon with the longest
    moment arm on it is pulled from rest with all others slack.
    """
    outputs = Outputs(robot_files(robot), quiet=quiet, pictures=PAPER, json=json, plot=plot)
    chosen = chosen_robot(robot, settings)
    with terminal.working(f"solving {chosen.name}"):
        terminal.use_compile_cache()
        from notchflex import closing
        from notchflex.analysis.bands import closing_bands, closing_document
        from notchflex.analysis.closing_loads import notch_table
        from notchflex.support import document_head, unchecked_dimensions

        table = closing(chosen)
        notches = notch_table(chosen, table)
        length = chosen.geometry.length
    for sentence in unchecked_dimensions(chosen):
        terminal.warn(sentence)
    if plot is not None:
        from notchflex.plotting import dimensioned_figure, save

        save(dimensioned_figure(chosen), plot)
    if outputs.prints_tables:
        from notchflex.cli.tables.notch_tables import print_robot

        print_robot(chosen, changed_title(chosen, settings), length, notches)
    bands = None
    if outputs.prints_tables or json is not None:
        with terminal.working("drawing robots within the tolerances"):
            try:
                bands = closing_bands(chosen, table)
            except InputError as problem:
                terminal.warn(f"no bands: {problem}")
    more = {} if bands is None else {"tolerances": closing_document(bands)}
    outputs.write_json(lambda: {**document_head(chosen), "notches": notches, **more})
    if bands is not None and outputs.prints_tables:
        from notchflex.cli.tables.tolerance_tables import closing_lines

        terminal.output().print("\n" + "\n".join(closing_lines(chosen, bands)))
