"""`notchflex compare`: the model beside measured notch angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from notchflex.cli import tables, terminal
from notchflex.cli.options import Columns, TableOutputs, texts
from notchflex.cli.robots import (
    MeasuredAs,
    OnePath,
    RobotName,
    Settings,
    chosen_robot,
    read_data,
    robot_files,
    variant,
)
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import DEGREES

if TYPE_CHECKING:
    from notchflex.comparison import Comparison

_MOST_COLUMNS = 8
"""Numbers side by side in one table of 80 columns; more of them go below."""


def compare(
    robot: RobotName,
    data: str,
    /,
    *,
    path: OnePath = None,
    measured: MeasuredAs = "ring",
    column: Columns = (),
    beside: Annotated[tuple[str, ...], texts("--beside", "VARIANT")] = (),
    settings: Settings = (),
    outputs: TableOutputs = TableOutputs(),
) -> int:
    """Compare a robot with measured angles or tip positions.

    Prints the root-mean-square error of every notch, of the total angle and of the tip, as far as
    they were measured. Where the tip was not measured it is the forward kinematics of the measured
    angles. A negative force is the offset of a sensor: it stays in the table, and the model uses
    0 N.

    Args:
        data: CSV of measurements: `tendon_force_N` or `tendon_displacement_mm`, with some of
            `notch_1_deg`, `notch_2_deg`, ... base to tip, `total_deg` and `tip_x_mm`; optionally
            `trial`. All columns that `notchflex.read_measurements` reads.
        beside: Also compare the same robot with other values, written
            `"LABEL: PATH=VALUE, PATH=VALUE"`, or `kinematics` for the model that shares the stroke
            equally over the notches. May be given several times.
    """
    outputs.check([*robot_files(robot), data])
    chosen = chosen_robot(robot, settings)
    values = dict(_variant(text) for text in beside)
    seen = read_data(data, chosen, path, measured, column)
    robots = {label: chosen.with_values(new) for label, new in values.items() if new is not None}
    text = f"solving {len(seen)} rows of {chosen.name}"
    with terminal.progress(text) as progress:
        from notchflex import comparison as comparing

        models = {"model": comparing.compare(chosen, seen)}
        for number, label in enumerate(values, 1):
            progress(text, number, 1 + len(values))
            models[label] = (
                comparing.compare(robots[label], seen)
                if label in robots
                else comparing.compare_kinematics(models["model"])
            )
    _write(models, outputs)
    return _report(models)


def _variant(text: str) -> tuple[str, list[tuple[str, object]] | None]:
    """Read one `--beside`; no values stand for the kinematic model."""
    if text.strip() == "kinematics":
        return "kinematics", None
    return variant(text, "kinematics, or ")


def _write(models: dict[str, Comparison], outputs: TableOutputs) -> None:
    from notchflex.comparison import comparison_columns, comparison_document, errors_document

    comparison = models["model"]
    others = {label: other for label, other in models.items() if other is not comparison}

    def document() -> dict[str, Any]:
        beside = {label: errors_document(other) for label, other in others.items()}
        return comparison_document(comparison) | ({"beside": beside} if beside else {})

    def picture() -> Any:
        from notchflex.plotting import comparison_picture

        return comparison_picture(comparison, others)

    outputs.write(
        document,
        lambda: _print(models),
        columns=lambda: comparison_columns(comparison),
        picture=picture,
    )


def _print(models: dict[str, Comparison]) -> None:
    """Print the errors of a model, and of others beside it, of every part that was measured."""
    from notchflex.fit import edge

    console = terminal.output()
    comparison = models["model"]
    measured = comparison.measured
    console.print(f"{comparison.robot.name}, {measured.source}", soft_wrap=True)
    points, trials = (
        f"{number} {what}{'s' if number != 1 else ''}"
        for number, what in ((comparison.points, "point"), (len(measured.pulls), "trial"))
    )
    console.print(
        f"{points} of {trials}, each "
        f"{'pulled from rest' if measured.from_rest else 'trial one loading path'}"
    )
    if comparison.angle == "edge_angle":
        console.print("angles between the faces of the notches (edge angles)")
    labels = [tables.shortened(label, 24) for label in models]
    columns = tables.frame(_columns(models))
    for first in range(0, len(columns), _MOST_COLUMNS):
        heads = ("root-mean-square error\n", labels, "")
        tables.show([heads, *columns[first : first + _MOST_COLUMNS]])
    for name, error in comparison.others.items():
        title, unit, scale = edge(name)
        console.print(f"{title}: {error * scale:.3f} {unit}")
    for sentence in comparison.diagnosis:
        console.print(sentence)


def _columns(models: dict[str, Comparison]) -> dict[str, list[float]]:
    """Return the errors of every notch, of the total angle and of the tip, as far as measured."""
    first, every = models["model"], models.values()
    columns = {
        f"n{n + 1}_deg": [one.rmse_notches[n] * DEGREES for one in every]
        for n in range(first.robot.number_of_notches)
        if np.isfinite(first.measured_notch_angle[:, n]).any()
    }
    if np.isfinite(first.measured_total_angle).any():
        columns["total_deg"] = [one.rmse_total * DEGREES for one in every]
    if np.isfinite(first.measured_tip).any():
        columns["tip_mm"] = [one.rmse_tip for one in every]
    return columns


def _report(models: dict[str, Comparison]) -> int:
    """Write notes and failures; return the exit code."""
    from notchflex.comparison import takes_stroke_of_model

    comparison = models["model"]
    if any(takes_stroke_of_model(m) for m in models.values() if m.stroke_lost is not None):
        terminal.note(
            "kinematics: only forces were measured, so it takes the stroke of the model. The total "
            "angle, and so its error, is that of the model by construction; compare the notches "
            "and the tip."
        )
    failed = np.flatnonzero(~np.asarray(comparison.converged))
    if not len(failed):
        return DONE
    terminal.error(
        f"not converged: {len(failed)} of {len(comparison.measured)} points, first row "
        f"{failed[0] + 1}: {comparison.reason[failed[0]]}. They are left out of the errors."
    )
    return NOT_CONVERGED
