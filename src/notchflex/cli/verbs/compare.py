"""`notchflex compare`: the model beside measured notch angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import Columns, TableOutputs, as_csv
from notchflex.cli.robots import (
    MeasuredAs,
    OnePath,
    RobotName,
    Settings,
    Variant,
    beside_parameter,
    chosen_robot,
    read_data,
    robot_files,
)
from notchflex.cli.terminal import DONE

if TYPE_CHECKING:
    from notchflex.comparison import Comparison


def compare(
    robot: RobotName,
    data: str,
    /,
    *,
    path: OnePath = None,
    measured: MeasuredAs = "ring",
    column: Columns = (),
    beside: Annotated[tuple[Variant, ...], beside_parameter("VARIANT")] = (),
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
    for variant in beside:
        if not variant.values and variant.robot != "kinematics":
            raise InputError.BAD_SYNTAX(
                f"--beside {variant.robot}: another robot was not measured; give kinematics, or "
                '"LABEL: PATH=VALUE", for example "linear: material.kind=linear".'
            )
    robots = {label: chosen.with_values(values) for label, _, values in beside if values}
    seen = read_data(data, chosen, path, measured, column)
    text = f"solving {len(seen)} rows of {chosen.name}"
    with terminal.progress(text) as progress:
        from notchflex import comparison as comparing

        models = {"model": comparing.compare(chosen, seen)}
        for number, (label, *_) in enumerate(beside, 1):
            progress(text, number, 1 + len(beside))
            models[label] = (
                comparing.compare(robots[label], seen)
                if label in robots
                else comparing.compare_kinematics(models["model"])
            )
    _write(models, outputs)
    if any(
        comparing.takes_stroke_of_model(m) for m in models.values() if m.stroke_lost is not None
    ):
        terminal.note(
            "kinematics: only forces were measured, so it takes the stroke of the model. The total "
            "angle, and so its error, is that of the model by construction; compare the notches "
            "and the tip."
        )
    comparison = models["model"]
    failed = np.flatnonzero(~np.asarray(comparison.converged))
    if not len(failed):
        return DONE
    return terminal.failed(
        f"not converged: {len(failed)} of {len(seen)} points, first row {failed[0] + 1}: "
        f"{comparison.reason[failed[0]]}. They are left out of the errors."
    )


def _write(models: dict[str, Comparison], outputs: TableOutputs) -> None:
    from notchflex.comparison import comparison_columns, comparison_document, errors_document

    comparison = models["model"]
    others = {label: other for label, other in models.items() if label != "model"}
    errors = {label: errors_document(model) for label, model in models.items()}

    def document(comparison: Comparison) -> dict[str, Any]:
        beside = {label: errors[label] for label in others}
        return comparison_document(comparison) | ({"beside": beside} if beside else {})

    def draw(comparison: Comparison, target: str, _: object) -> None:
        from notchflex.plotting import comparison_picture

        comparison_picture(comparison, others).save(target)

    outputs.write(
        comparison,
        document,
        lambda comparison: _print(comparison, errors),
        csv=as_csv(comparison_columns),
        plot=draw,
    )


def _print(comparison: Comparison, errors: dict[str, dict[str, Any]]) -> None:
    """Print the errors of every part that was measured, of a model and of others beside it."""
    measured = comparison.measured
    terminal.line(f"{comparison.robot.name}, {measured.source}")
    points, trials = (
        f"{number} {what}{'s' if number != 1 else ''}"
        for number, what in ((comparison.points, "point"), (len(measured.pulls), "trial"))
    )
    loaded = "pulled from rest" if measured.from_rest else "trial one loading path"
    edges = "; edge angles, between the faces of the notches"
    terminal.line(
        f"{points} of {trials}, each {loaded}{edges * (comparison.angle == 'edge_angle')}"
    )
    rows: dict[str, dict[str, Any]] = {}
    for label, document in errors.items():
        angles = document["rmse_deg"]
        numbers = dict(enumerate(() if angles["notches"] is None else angles["notches"], start=1))
        parts = {f"notch {number} [deg]": value for number, value in numbers.items()}
        parts |= {"total [deg]": angles["total"], "tip [mm]": document["tip_rmse_mm"]}
        parts |= document["rmse_others"]
        for part, value in parts.items():
            if np.isfinite(value) or part in rows:
                row = rows.setdefault(part, {"rms error": part})
                row[tables.shortened(label, 24)] = value
    labels = (tables.shortened(label, 24) for label in errors)
    tables.show([*rows.values()], forms=dict.fromkeys(labels, ".3f"))
    terminal.show(*comparison.diagnosis)
