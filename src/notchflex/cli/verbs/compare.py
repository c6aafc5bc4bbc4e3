"""`notchflex compare`: the model beside measured notch angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from notchflex._quantity import DEGREES
from notchflex.cli import terminal
from notchflex.cli.arguments.measured import OnePath, from_rest, note_table
from notchflex.cli.arguments.options import (
    CsvFile,
    JsonFile,
    PlotFile,
    Quiet,
    RobotName,
    Settings,
    chosen_robot,
    robot_files,
    variant,
)
from notchflex.results.files.writing import (
    STANDARD_OUTPUT,
    check_distinct,
    check_output,
    check_picture,
)

if TYPE_CHECKING:
    from notchflex.comparison import Comparison

MOST_COLUMNS = 8
"""Numbers side by side in one table; more of them go below."""


def compare(
    robot: RobotName,
    data: Annotated[
        str,
        Parameter(
            help="CSV of measurements: `tendon_force_N` or `tendon_displacement_mm`, with some of "
            "`notch_1_deg`, `notch_2_deg`, ... base to tip, `total_deg` and `tip_x_mm`; if wanted "
            "`trial`. All columns that `notchflex.read_measurements` reads."
        ),
    ],
    /,
    *,
    path: OnePath = None,
    beside: Annotated[
        tuple[str, ...],
        Parameter(
            name="--beside",
            negative=(),
            show_default=False,
            help="Also compare the same robot with other values, written "
            '`"LABEL: PATH=VALUE, PATH=VALUE"`, or `kinematics` for the model that shares the '
            "stroke equally over the notches. May be given several times.",
        ),
    ] = (),
    settings: Settings = (),
    json: JsonFile = None,
    csv: CsvFile = None,
    plot: PlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Compare a robot with measured angles or tip positions.

    Prints the root-mean-square error of every notch, of the total angle and of the tip, as far as
    they were measured. Where the tip was not measured it is the forward kinematics of the measured
    angles. A negative force is the offset of a sensor: it stays in the table, and the model is
    given 0 N.
    """
    terminal.be_quiet(quiet)
    inputs = [*robot_files(robot), data]
    check_distinct({"--json": json, "--csv": csv, "--plot": plot})
    for option, target in (("--json", json), ("--csv", csv)):
        if target is not None:
            check_output(target, option, inputs=inputs)
    if plot is not None:
        check_picture(plot, "--plot", inputs=inputs)
    chosen = chosen_robot(robot, settings)
    variants = [_variant(text) for text in beside]

    from notchflex.fit.measurements.csv import read_measurements

    measured = read_measurements(data, chosen, from_rest=from_rest(path))
    robots = {
        label: chosen if values is None else chosen.with_values(values)
        for label, values in variants
    }
    with terminal.counting(f"solving {len(measured)} rows of {chosen.name}") as counted:
        from notchflex.cli.compile_cache import use_compile_cache

        use_compile_cache()
        from notchflex import comparison as comparing

        comparison = comparing.compare(chosen, measured)
        others: dict[str, Comparison] = {}
        for number, (label, values) in enumerate(variants, 1):
            counted(number, 1 + len(variants))
            others[label] = (
                comparing.compare_kinematics(comparison)
                if values is None
                else comparing.compare(robots[label], measured)
            )
    _write(comparison, others, json=json, csv=csv, plot=plot)
    if STANDARD_OUTPUT not in (json, csv) and not quiet:
        _print(comparison, others)
    return _say_what_matters(comparison, others)


def _variant(text: str) -> tuple[str, list[tuple[str, object]] | None]:
    """Read what stands beside; None stands for the kinematic model."""
    if text.strip() == "kinematics":
        return "kinematics", None
    return variant(text, "kinematics, or ")


def _write(
    comparison: Comparison,
    others: dict[str, Comparison],
    *,
    json: str | None,
    csv: str | None,
    plot: str | None,
) -> None:
    from notchflex.comparison import comparison_columns, comparison_document, errors_document

    if json is not None:
        from notchflex.results.files.json import write_json

        document = comparison_document(comparison)
        if others:
            document["beside"] = {label: errors_document(other) for label, other in others.items()}
        write_json(json, document)
    if csv is not None:
        from notchflex.results.files.csv import write_csv

        columns = comparison_columns(comparison)
        write_csv(csv, list(columns), zip(*columns.values(), strict=True))
    if plot is not None:
        with terminal.working(f"drawing {plot}"):
            from notchflex.plotting import comparison_picture

            comparison_picture(comparison, others).save(plot)


def _print(comparison: Comparison, others: dict[str, Comparison]) -> None:
    from rich.table import Table

    from notchflex.fit.assessment.errors_of_parts import edge

    console = terminal.output()
    measured = comparison.measured
    trials = len(measured.pulls)
    console.print(f"{comparison.robot.name}, {measured.source}", soft_wrap=True)
    console.print(
        f"{comparison.points} points of {trials} trial{'s' if trials > 1 else ''}, each "
        f"{'pulled from rest' if measured.from_rest else 'trial one loading path'}"
    )
    models = {"model": comparison, **others}
    columns = _columns(models)
    for first in range(0, len(columns), MOST_COLUMNS):  # a wide robot in parts, each of 80 columns
        table = Table(box=None, padding=(0, 1, 0, 0), header_style="bold", pad_edge=False)
        table.add_column("root-mean-square error\n", no_wrap=True, max_width=24)
        some = columns[first : first + MOST_COLUMNS]
        for head, _ in some:
            table.add_column(head, justify="right")
        for number, label in enumerate(models):
            table.add_row(label, *(cells[number] for _, cells in some))
        console.print(table)
    for name, error in comparison.others.items():
        title, unit, scale = edge(name)
        console.print(f"{title}: {error * scale:.3f} {unit}")
    for sentence in comparison.diagnosis:
        console.print(sentence)


def _columns(models: dict[str, Comparison]) -> list[tuple[str, list[str]]]:
    """Head and one number for each model, of every notch, the total and the tip if measured."""
    first = next(iter(models.values()))
    notches = first.robot.number_of_notches
    columns = [
        (f"n{n + 1}\ndeg", [f"{one.rmse_notches[n] * DEGREES:.2f}" for one in models.values()])
        for n in range(notches)
        if np.isfinite(first.measured_notch_angle[:, n]).any()
    ]
    if np.isfinite(first.measured_total_angle).any():
        numbers = [f"{one.rmse_total * DEGREES:.2f}" for one in models.values()]
        columns.append(("total\ndeg", numbers))
    if np.isfinite(first.measured_tip).any():
        columns.append(("tip\nmm", [f"{one.tip_rmse:.3f}" for one in models.values()]))
    return columns


def _say_what_matters(comparison: Comparison, others: dict[str, Comparison]) -> int:
    from notchflex.cli.app import DONE, NOT_CONVERGED
    from notchflex.comparison.tables import takes_stroke_of_model

    measured = comparison.measured
    note_table(measured)
    kinematics = next((one for one in others.values() if one.stroke_lost is not None), None)
    if kinematics is not None and takes_stroke_of_model(kinematics):
        terminal.note(
            "kinematics: only forces were measured, so it takes the stroke of the model. The total "
            "angle, and so its error, is that of the model by construction; compare the notches "
            "and the tip."
        )
    failed = np.flatnonzero(~comparison.converged)
    if not len(failed):
        return DONE
    terminal.error(
        f"not converged: {len(failed)} of {len(measured)} points, first row {failed[0] + 1}: "
        f"{comparison.reason[failed[0]]}. They are left out of the errors."
    )
    return NOT_CONVERGED
