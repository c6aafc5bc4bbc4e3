"""`notchflex show`: the notches of a robot and how they close."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any, cast

from cyclopts import Parameter

from notchflex import InputError, Robot
from notchflex.cli import tables, terminal
from notchflex.cli.options import OUTPUT, File, Outputs
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files
from notchflex.cli.tables import NO_NUMBER, Columns, tolerance_lines, wrapped
from notchflex.robot.part import unit_of
from notchflex.support import DEGREES, PAPER, fields_of, is_unsaid, to_table

if TYPE_CHECKING:
    from rich.table import Table

    from notchflex import Band
    from notchflex.analysis.bands import ClosingBands

NEVER, NOT_FOUND = "never", "not found"
_MEANINGS = {
    NEVER: "no tension closes the notch",
    NOT_FOUND: "the solver did not converge at the tensions in question, so the notch may close; "
    "`notchflex simulate` shows how far it bends",
}
_SHORTER = {"precurvature_deg": "precurved_deg", "direction_deg": "toward_deg"}
"""Heads for what every notch has, so that there is room for what is its own."""

_USUAL = (None, "rigid", "outer")
"""Values that a table leaves out where all notches have them."""


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class DimensionedOutputs(Outputs):
    """Results of a robot that is not loaded.

    Attributes:
        plot: Draw the tube and its notches with their dimensions to this .png, .svg or .pdf file.
    """

    plot: File = None


def show(
    robot: RobotName,
    /,
    *,
    settings: Settings = (),
    outputs: DimensionedOutputs = DimensionedOutputs(),
) -> None:
    """Show every notch of a robot: section, closing angle and force, strain at closing.

    The closing force is the tension at which a notch closes while the tendon with the longest
    moment arm on it is pulled from rest with all others slack.
    """
    outputs.check(robot_files(robot), pictures=PAPER)
    chosen = chosen_robot(robot, settings)
    with terminal.progress(f"solving {chosen.name}"):
        from notchflex import closing
        from notchflex.analysis.bands import closing_bands, closing_document
        from notchflex.analysis.closing_loads import notch_table
        from notchflex.support import document_head, unchecked_dimensions

        table = closing(chosen)
        notches = notch_table(chosen, table)
    for sentence in unchecked_dimensions(chosen):
        terminal.warn(sentence)
    if outputs.plot is not None:
        from notchflex.plotting import dimensioned_figure, save

        save(dimensioned_figure(chosen), outputs.plot)
    if outputs.prints_tables:
        print_robot(chosen, changed_title(chosen, settings), notches)
    bands = None
    if outputs.prints_tables or outputs.json is not None:
        with terminal.progress("drawing robots within the tolerances"):
            try:
                bands = closing_bands(chosen, table)
            except InputError as problem:
                terminal.warn(f"no bands: {problem}")
    more = {} if bands is None else {"tolerances": closing_document(bands)}
    outputs.write(lambda: {**document_head(chosen), "notches": notches, **more})
    if bands is not None and outputs.prints_tables:
        terminal.output().print("\n" + "\n".join(closing_lines(chosen, bands)))


def print_robot(robot: Robot, title: str, notches: list[dict[str, Any]]) -> None:
    """Print tube, parts, and how the notches are cut and close."""
    console = terminal.output()
    tube = robot.tube
    console.print(title, style="bold", soft_wrap=True)
    console.print(
        f"tube      outer diameter {tube.outer_diameter:g} mm, inner diameter "
        f"{tube.inner_diameter:g} mm, length {robot.geometry.length:g} mm"
    )
    for part in ("material", "friction"):
        console.print(_summary(robot, part))
    for index, tendon in enumerate(robot.tendon, start=1):
        number = f" {index}" if len(robot.tendon) > 1 else ""
        end = robot.number_of_notches if tendon.end_body is None else tendon.end_body
        console.print(
            f"tendon{number}".ljust(10)
            + f"radius {tendon.radius:g} mm, direction {tendon.direction_deg:g} deg, "
            f"{tendon.path}, ends behind notch {end}"
        )
    console.print()
    for table in (*description_tables(robot), closing_table(notches)):
        console.print(table)
        console.print()
    tables.say(closing_legend(notches))


def description_tables(robot: Robot) -> list[Table]:
    """Return how the notches are cut, with one table for each kind; equal notches share a row."""
    from notchflex.analysis.closing_loads import named_values

    kinds: dict[str, dict[tuple[tuple[str, Any], ...], list[int]]] = {}
    for number, notch in enumerate(robot.notches, start=1):
        values = named_values(notch)
        of_kind = kinds.setdefault(values.pop("kind"), {})
        of_kind.setdefault(tuple(values.items()), []).append(number)
    result: list[Table] = []
    for kind, of_kind in kinds.items():
        columns = [(f"{kind}\nnotch", [run_of(numbers) for numbers in of_kind.values()], ">")]
        for cells in zip(*of_kind, strict=True):  # the same key of all different notches
            if any(value not in _USUAL and not is_unsaid(name, value) for name, value in cells):
                name: str = cells[0][0]
                head = _SHORTER.get(name, name).replace("_", "\n")
                columns.append((head, [_value(value) for _, value in cells], ">"))
        result.append(_spaced(columns))
    return result


def run_of(numbers: list[int]) -> str:
    """Write rising numbers shortly.

    Example:
        >>> run_of([1, 2, 3, 7]), run_of([1, 3, 5, 7]), run_of([2, 6])
        ('1–3, 7', '1, 3 … 7', '2, 6')
    """
    steps = {after - before for before, after in pairwise(numbers)}
    if len(numbers) > 3 and len(steps) == 1 and steps != {1}:
        return f"{numbers[0]}, {numbers[1]} … {numbers[-1]}"
    runs = groupby(enumerate(numbers), key=lambda item: item[1] - item[0])
    ends = [[number for _, number in run] for _, run in runs]
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]}–{r[-1]}" for r in ends)


def closing_table(notches: list[dict[str, Any]]) -> Table:
    """Return the sections and the closing of all notches; columns without a number are left out."""
    several = len(notches[0]["moment_arm_mm"]) > 1
    rows = [
        {
            "notch": str(row["notch"]),
            "A\nmm²": row["area_mm2"],
            "y\nmm": row.get("centroid_mm"),
            "I\nmm⁴": row["second_moment_mm4"],
            "tendon": row["closing_tendon"] if several else None,
            "arm\nmm": row["moment_arm_mm"][row["closing_tendon"] - 1],
            "closing\ndeg": row["closing_angle_deg"],
            "tension\nN": row["closing_status"]
            if row["closing_status"] in _MEANINGS
            else f"{row['closing_tension_N']:.3f}",
            "strain\n%": 100.0 * row["closing_outer_strain"],
            "peak\n%": 100.0 * row["closing_peak_strain"],
        }
        for row in notches
    ]
    forms = {"notch": ">", "tension\nN": ">", "I\nmm⁴": ".4e", "closing\ndeg": ".2f"}
    forms |= dict.fromkeys(("A\nmm²", "y\nmm", "arm\nmm"), ".4f")
    forms |= dict.fromkeys(("strain\n%", "peak\n%"), ".2f")
    return _spaced(tables.records(rows, **forms))


def closing_legend(notches: list[dict[str, Any]]) -> str:
    """Return what the columns of the closing table mean."""
    pulled = "the tendon" if len(notches[0]["moment_arm_mm"]) == 1 else "the tendon named"
    words, strains = "A, I: area and second moment", ""
    if any("centroid_mm" in row for row in notches):
        words = "A, y, I: area, centroid (from the tube axis toward the spine) and second moment"
        strains = (
            ", and the strain there of the outer fibre (Pacheco 2021, eq. 16) and of the farthest "
            "fibre (peak)"
        )
    shown = {row["closing_status"] for row in notches}
    return (
        f"{words} of what the cut leaves, where it is weakest. arm: moment arm of {pulled}. "
        f"Closing: angle of the notch and tension of that tendon pulled alone from rest{strains}."
        + "".join(f" {status}: {text}." for status, text in _MEANINGS.items() if status in shown)
    )


def closing_lines(robot: Robot, bands: ClosingBands) -> list[str]:
    """Return the effect of tolerances on closing and a typical load, and what was assumed."""
    first, last = int(bands.tension.median.argmin()), int(bands.tension.median.argmax())
    words = [
        f"notch {bands.notches[step]} closes at {_range(bands.tension, '.3g', step=step)} N and "
        f"{_range(bands.angle, '.1f', DEGREES, step)} deg"
        for step in dict.fromkeys((first, last))
    ]
    pulled = f" of tendon {bands.tendon}" if robot.number_of_tendons > 1 else ""
    text = (
        f"Accuracy: of {bands.bands.draws} draws within the tolerances, 5 to 95 % give: "
        f"{'; '.join(words)}; total angle at {bands.load:.3g} N{pulled}: "
        f"{_range(bands.total_angle, '.1f', DEGREES)} deg."
    )
    if bands.shares:
        parts = sorted(bands.shares.items(), key=lambda part: -part[1])
        words = [f"{name} {100.0 * share:.0f} %" for name, share in parts if share > 0.005]
        text += f" Of the variance of that angle: {', '.join(words)}."
    if math.isfinite(bands.by_depth):
        change = abs(bands.by_depth) * DEGREES
        text += f" 10 µm of depth in all notches change that angle by {change:.2g} deg."
    return [*wrapped(text), *tolerance_lines(bands.bands)]


def _range(band: Band, form: str, scale: float = 1.0, step: int | None = None) -> str:
    ends = [band.low, band.high] if step is None else [band.low[step], band.high[step]]
    low, high = (float(end) * scale for end in ends)
    if math.isinf(high):
        return f"{low:{form}} or more" if math.isfinite(low) else "no"
    return f"{low:{form}} to {high:{form}}"


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(f"{number:g}" for number in cast("tuple[float, ...]", value))
    return tables.cell(value, "g")


def _spaced(columns: Columns) -> Table:
    """Make a table whose columns stand two characters apart, or one where it would be too wide."""
    shown = [
        one for one in columns if any(tables.cell(value, "g") != NO_NUMBER for value in one[1])
    ]
    wide = tables.table(shown, gap=2)
    return wide if tables.width_of(wide) <= terminal.NARROW else tables.table(shown)


def _summary(robot: Robot, part: str) -> str:
    """Return the values of a part in one line, or in some with its title beside them."""
    fields = fields_of(type(getattr(robot, part)))
    table = to_table(robot)[part]
    words = [str(table.pop("kind"))]
    for key, value in table.items():
        unit = unit_of(fields[key])
        words.append(f"{key.replace('_', ' ')} {_value(value)} {unit}".strip())
    return textwrap.fill(
        ", ".join(words),
        width=terminal.NARROW,
        initial_indent=part.ljust(10),
        subsequent_indent=" " * 10,
    )
