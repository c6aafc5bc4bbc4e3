"""`notchflex show`: the notches of a robot and how they close."""

from __future__ import annotations

import textwrap
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.options import (
    OUTPUT,
    JsonFile,
    Quiet,
    RobotName,
    Settings,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.tables.notch_tables import closing_legend, closing_table, description_tables
from notchflex.results.files.writing import (
    PAPER,
    STANDARD_OUTPUT,
    check_distinct,
    check_output,
    check_picture,
)
from notchflex.robot import Robot
from notchflex.robot.robot import to_table

DrawingFile = Annotated[
    str | None,
    Parameter(
        name="--plot",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help="Draw the tube and its notches with their dimensions to this .png, .svg or .pdf file.",
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
    terminal.be_quiet(quiet)
    if json is not None:
        check_output(json, "--json", inputs=robot_files(robot))
    if plot is not None:
        check_picture(plot, "--plot", inputs=robot_files(robot), kinds=PAPER)
    check_distinct({"--json": json, "--plot": plot})
    chosen = chosen_robot(robot, settings)
    with terminal.working(f"solving {chosen.name}"):
        from notchflex.cli.compile_cache import use_compile_cache

        use_compile_cache()
        from notchflex.analysis import tip_from_angles
        from notchflex.analysis.notch_table import notch_table

        notches = notch_table(chosen)
        straight = np.zeros((1, chosen.number_of_notches))
        length = float(tip_from_angles(chosen, straight)[0][0, 2])
    if json is not None:
        from notchflex.results.files.json import document_head, write_json

        write_json(json, {**document_head(chosen), "notches": notches})
    if plot is not None:
        from notchflex.plotting.drawings.dimensioned import save_dimensioned

        save_dimensioned(chosen, plot)
    if json != STANDARD_OUTPUT and not quiet:
        _print(chosen, changed_title(chosen, settings), length, notches)


def _print(robot: Robot, title: str, length: float, notches: list[dict[str, Any]]) -> None:
    console = terminal.output()
    tube = robot.tube
    console.print(title, style="bold", soft_wrap=True)
    console.print(
        f"tube      outer diameter {tube.outer_diameter:g} mm, inner diameter "
        f"{tube.inner_diameter:g} mm, length {length:g} mm"
    )
    for title in ("material", "friction"):
        console.print(_hanging(title, _summary(to_table(robot)[title])))
    for index, tendon in enumerate(robot.tendon, start=1):
        number = f" {index}" if len(robot.tendon) > 1 else ""
        end = robot.number_of_notches if tendon.end_body is None else tendon.end_body
        console.print(
            f"tendon{number}".ljust(10)
            + f"radius {tendon.radius:g} mm, direction {tendon.direction_deg:g} deg, "
            f"{tendon.path}, ends behind notch {end}"
        )
    console.print()
    for table in description_tables(robot):
        console.print(table)
        console.print()
    console.print(closing_table(notches))
    console.print()
    console.print(textwrap.fill(closing_legend(notches), width=terminal.NARROW - 1))


UNITS = {
    "elastic_modulus": "MPa",
    "superelastic_modulus": "MPa",
    "plastic_modulus": "MPa",
    "density": "kg/m3",
}


def _summary(table: dict[str, Any]) -> str:
    """Return the values of a part in one line."""
    words = [str(table["kind"])]
    for key, value in table.items():
        if key != "kind":
            shown = value if isinstance(value, str) else f"{value:g}"
            words.append(f"{key.replace('_', ' ')} {shown} {UNITS.get(key, '')}".strip())
    return ", ".join(words)


def _hanging(title: str, text: str) -> str:
    return textwrap.fill(
        text, width=terminal.NARROW, initial_indent=title.ljust(10), subsequent_indent=" " * 10
    )
