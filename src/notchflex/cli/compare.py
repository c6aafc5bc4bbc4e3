"""`notchflex compare`: the model beside measured notch angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.options import (
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
from notchflex.results.files import (
    STANDARD_OUTPUT,
    check_distinct,
    check_output,
    check_picture,
)
from notchflex.results.quantities import DEGREES

if TYPE_CHECKING:
    from notchflex.comparison import Comparison

MOST_COLUMNS = 6
"""Notches of a robot side by side in one table; more of them go below."""


def compare(
    robot: RobotName,
    data: Annotated[
        str,
        Parameter(
            help="CSV with `tendon_force_N` or `tendon_displacement_mm` and `notch_1_deg`, "
            "`notch_2_deg`, ... base to tip; if wanted `trial` and `total_deg`."
        ),
    ],
    /,
    *,
    path: Annotated[
        bool,
        Parameter(
            name="--path",
            negative=(),
            help="Take the rows of each trial as one path with memory of friction, in their "
            "order. Without it every row is a pull from rest.",
        ),
    ] = False,
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
    """Compare a robot with measured notch angles.

    Prints the root-mean-square error of every notch, of the total angle and of the tip. The
    measured tip is the forward kinematics of the measured angles. A negative force is the offset
    of a sensor: it stays in the table, and the model is given 0 N.
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

    from notchflex.comparison.measured import read_measured

    measured = read_measured(data, chosen)
    robots = {
        label: chosen if values is None else chosen.with_values(values)
        for label, values in variants
    }
    with terminal.counting(f"solving {len(measured)} points of {chosen.name}") as counted:
        from notchflex.cli.compile_cache import use_compile_cache

        use_compile_cache()
        from notchflex import comparison as comparing

        comparison = comparing.compare(chosen, measured, from_rest=not path)
        others: dict[str, Comparison] = {}
        for number, (label, values) in enumerate(variants, 1):
            counted(number, 1 + len(variants))
            others[label] = (
                comparing.compare_kinematics(comparison)
                if values is None
                else comparing.compare(robots[label], measured, from_rest=not path)
            )
    _write(comparison, others, json=json, csv=csv, plot=plot)
    if STANDARD_OUTPUT not in (json, csv) and not quiet:
        _print(comparison, others)
    return _say_what_matters(comparison)


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
        from notchflex.results.json import write_json

        document = comparison_document(comparison)
        if others:
            document["beside"] = {label: errors_document(other) for label, other in others.items()}
        write_json(json, document)
    if csv is not None:
        from notchflex.results.csv import write_csv

        columns = comparison_columns(comparison)
        write_csv(csv, list(columns), zip(*columns.values(), strict=True))
    if plot is not None:
        with terminal.working(f"drawing {plot}"):
            from notchflex.plotting import comparison_picture

            comparison_picture(comparison, others).save(plot)


def _print(comparison: Comparison, others: dict[str, Comparison]) -> None:
    from rich.table import Table

    console = terminal.output()
    measured = comparison.measured
    trials = len(set(measured.trial))
    console.print(f"{comparison.robot.name}, {measured.source}", soft_wrap=True)
    console.print(
        f"{comparison.points} points of {trials} trial{'s' if trials > 1 else ''}, each "
        f"{'pulled from rest' if comparison.from_rest else 'trial one path with memory'}"
    )
    models = {"model": comparison, **others}
    notches = comparison.robot.number_of_notches
    for first in range(0, notches, MOST_COLUMNS):  # a wide robot in parts, each of 80 columns
        last = min(first + MOST_COLUMNS, notches)
        table = Table(box=None, padding=(0, 1, 0, 0), header_style="bold", pad_edge=False)
        table.add_column("root-mean-square error\n", no_wrap=True, max_width=24)
        for notch in range(first, last):
            table.add_column(f"n{notch + 1}\ndeg", justify="right")
        if last == notches:
            table.add_column("total\ndeg", justify="right")
            table.add_column("tip\nmm", justify="right")
        for label, one in models.items():
            cells = [f"{number:.2f}" for number in one.rmse_notches[first:last] * DEGREES]
            if last == notches:
                cells += [f"{one.rmse_total * DEGREES:.2f}", f"{one.tip_rmse:.3f}"]
            table.add_row(label, *cells)
        console.print(table)


def _say_what_matters(comparison: Comparison) -> int:
    from notchflex.cli.app import DONE, NOT_CONVERGED

    measured = comparison.measured
    if measured.ignored:
        terminal.note(f"ignored columns: {', '.join(measured.ignored)}.")
    if measured.negative_forces:
        count = measured.negative_forces
        are = "force is" if count == 1 else "forces are"
        terminal.note(f"{count} measured {are} negative (sensor offset); the model is given 0 N.")
    failed = np.flatnonzero(~comparison.converged)
    if not len(failed):
        return DONE
    terminal.error(
        f"not converged: {len(failed)} of {len(measured)} points, first row {failed[0] + 1}: "
        f"{comparison.reason[failed[0]]}. They are left out of the errors."
    )
    return NOT_CONVERGED
