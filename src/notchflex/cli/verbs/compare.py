"""`notchflex compare`: the model beside measured notch angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import texts
from notchflex.cli.arguments.robots import (
    Columns,
    MeasuredAs,
    OnePath,
    RobotName,
    Settings,
    chosen_robot,
    read_data,
    robot_files,
    variant,
)
from notchflex.cli.outputs import CsvFile, JsonFile, Outputs, PlotFile, Quiet
from notchflex.cli.terminal import DONE, NOT_CONVERGED

if TYPE_CHECKING:
    from notchflex.comparison import Comparison


def compare(
    robot: RobotName,
    data: Annotated[
        str,
        Parameter(
            help="CSV of measurements: `tendon_force_N` or `tendon_displacement_mm`, with some of "
            "`notch_1_deg`, `notch_2_deg`, ... base to tip, `total_deg` and `tip_x_mm`; optionally "
            "`trial`. All columns that `notchflex.read_measurements` reads."
        ),
    ],
    /,
    *,
    path: OnePath = None,
    measured: MeasuredAs = "ring",
    column: Columns = (),
    beside: Annotated[
        tuple[str, ...],
        texts(
            "--beside",
            "VARIANT",
            "Also compare the same robot with other values, written "
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
    angles. A negative force is the offset of a sensor: it stays in the table, and the model uses
    0 N.
    """
    outputs = Outputs([*robot_files(robot), data], quiet=quiet, json=json, csv=csv, plot=plot)
    chosen = chosen_robot(robot, settings)
    values = dict(_variant(text) for text in beside)
    seen = read_data(data, chosen, path, measured, column)
    robots = {label: chosen.with_values(one) for label, one in values.items() if one is not None}
    with terminal.counting(f"solving {len(seen)} rows of {chosen.name}") as counted:
        terminal.use_compile_cache()
        from notchflex import comparison as comparing

        comparison = comparing.compare(chosen, seen)
        others: dict[str, Comparison] = {}
        for number, label in enumerate(values, 1):
            counted(number, 1 + len(values))
            others[label] = (
                comparing.compare(robots[label], seen)
                if label in robots
                else comparing.compare_kinematics(comparison)
            )
    _write(comparison, others, outputs)
    return _report(comparison, others)


def _variant(text: str) -> tuple[str, list[tuple[str, object]] | None]:
    """Read one `--beside`; no values stand for the kinematic model."""
    if text.strip() == "kinematics":
        return "kinematics", None
    return variant(text, "kinematics, or ")


def _write(comparison: Comparison, others: dict[str, Comparison], outputs: Outputs) -> None:
    from notchflex.cli.tables.compare_table import print_comparison
    from notchflex.comparison import comparison_columns, comparison_document, errors_document

    def document() -> dict[str, Any]:
        beside = {label: errors_document(other) for label, other in others.items()}
        return comparison_document(comparison) | ({"beside": beside} if beside else {})

    def picture() -> Any:
        from notchflex.plotting import comparison_picture

        return comparison_picture(comparison, others)

    outputs.write_json(document)
    outputs.write_csv(lambda: comparison_columns(comparison))
    outputs.save_picture(picture)
    if outputs.prints_tables:
        print_comparison(comparison, others)


def _report(comparison: Comparison, others: dict[str, Comparison]) -> int:
    """Write notes and failures; return the exit code."""
    from notchflex.comparison import takes_stroke_of_model

    kinematics = next((one for one in others.values() if one.stroke_lost is not None), None)
    if kinematics is not None and takes_stroke_of_model(kinematics):
        terminal.note(
            "kinematics: only forces were measured, so it takes the stroke of the model. The total "
            "angle, and so its error, is that of the model by construction; compare the notches "
            "and the tip."
        )
    failed = [row for row, converged in enumerate(comparison.converged) if not converged]
    if not failed:
        return DONE
    terminal.error(
        f"not converged: {len(failed)} of {len(comparison.measured)} points, first row "
        f"{failed[0] + 1}: {comparison.reason[failed[0]]}. They are left out of the errors."
    )
    return NOT_CONVERGED
