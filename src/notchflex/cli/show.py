"""`notchflex show`: the notches of a robot and how they close."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from rich.table import Table

from notchflex.cli import terminal
from notchflex.cli.options import JsonFile, RobotName, Settings, chosen_robot, robot_files
from notchflex.results.files import STANDARD_OUTPUT, check_output
from notchflex.robot import Robot
from notchflex.robot.robot import to_table


def show(robot: RobotName, /, *, settings: Settings = (), json: JsonFile = None) -> None:
    """Show every notch of a robot: section, closing angle and force, strain at closing.

    The closing force is the tension at which a notch closes while the tendon with the longest
    moment arm on it is pulled from rest with all others slack.
    """
    if json is not None:
        check_output(json, "--json", inputs=robot_files(robot))
    chosen = chosen_robot(robot, settings)
    with terminal.working(f"solving {chosen.name}"):
        from notchflex.cli.compile_cache import use_compile_cache

        use_compile_cache()
        from notchflex.results.notch_table import notch_table

        notches = notch_table(chosen)
    if json is not None:
        from notchflex.results.json import document_head, write_json

        write_json(json, {**document_head(chosen), "notches": notches})
    if json != STANDARD_OUTPUT:
        _print(chosen, notches)


def _print(robot: Robot, notches: list[dict[str, Any]]) -> None:
    console = terminal.output()
    tube = robot.tube
    length = tube.base_length + sum(n["height_mm"] + n["uncut_length_mm"] for n in notches)
    console.print(robot.name, style="bold", soft_wrap=True)
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
    pulled = "the tendon" if len(robot.tendon) == 1 else "the tendon named"
    console.print()
    console.print(_notch_rows(notches))
    console.print()
    console.print(_section_rows(notches))
    console.print(
        textwrap.fill(
            "A, y, I: area, centroid (from the tube axis toward the spine) and second moment of "
            f"what the cut leaves. arm: moment arm of {pulled}. Closing: angle of the notch, "
            "tension of that tendon pulled alone from rest, and the strain there of the outer "
            "fibre (Pacheco 2021, eq. 16) and of the farthest fibre (peak).",
            width=terminal.NARROW - 1,
        )
    )


def _notch_rows(notches: list[dict[str, Any]]) -> Table:
    table = _table()
    for head in ("notch", "cut", "depth\nmm", "height\nmm", "uncut\nmm", "direction\ndeg"):
        table.add_column(head if "\n" in head else f"{head}\n", justify="right")
    table.add_column("precurved\ndeg", justify="right")
    for row, label in _grouped(
        notches,
        ("cut", "depth_mm", "height_mm", "uncut_length_mm", "direction_deg", "precurvature_deg"),
    ):
        table.add_row(
            label,
            row["cut"],
            *(f"{row[key]:g}" for key in ("depth_mm", "height_mm", "uncut_length_mm")),
            f"{row['direction_deg']:g}",
            f"{row['precurvature_deg']:g}",
        )
    return table


def _section_rows(notches: list[dict[str, Any]]) -> Table:
    several = len(notches[0]["moment_arm_mm"]) > 1
    table = _table(gap=1 if several else 2)
    for head in (
        "notch\n",
        "A\nmm²",
        "y\nmm",
        "I\nmm⁴",
        *(("tendon\n",) if several else ()),
        "arm\nmm",
        "closing\ndeg",
        "tension\nN",
        "strain\n%",
        "peak\n%",
    ):
        table.add_column(head, justify="right")
    for number, row in enumerate(notches, start=1):
        table.add_row(
            str(number),
            f"{row['area_mm2']:.4f}",
            f"{row['centroid_mm']:.4f}",
            f"{row['second_moment_mm4']:.4e}",
            *((str(row["closing_tendon"]),) if several else ()),
            f"{row['moment_arm_mm'][row['closing_tendon'] - 1]:.4f}",
            f"{row['closing_angle_deg']:.2f}",
            _or_never(row["closing_tension_N"], ".3f"),
            f"{100 * row['closing_outer_strain']:.2f}",
            f"{100 * row['closing_peak_strain']:.2f}",
        )
    return table


def _table(gap: int = 2) -> Table:
    return Table(box=None, padding=(0, gap, 0, 0), header_style="bold", pad_edge=False)


def _grouped(rows: list[dict[str, Any]], keys: tuple[str, ...]) -> list[tuple[dict[str, Any], str]]:
    """Gather equal neighbours under a label such as `1-5`."""
    groups: list[tuple[dict[str, Any], int, int]] = []
    for number, row in enumerate(rows, start=1):
        if groups and all(groups[-1][0][key] == row[key] for key in keys):
            groups[-1] = (groups[-1][0], groups[-1][1], number)
        else:
            groups.append((row, number, number))
    return [
        (row, str(first) if first == last else f"{first}–{last}") for row, first, last in groups
    ]


def _or_never(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "never"


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
