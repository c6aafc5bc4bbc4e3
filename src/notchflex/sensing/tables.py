"""Readings from a CSV table, and what was sensed as columns and as a document."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from notchflex import InputError, Robot
from notchflex.sensing.sensed import SensedForce
from notchflex.support import (
    AXES,
    DEGREES,
    QUANTITIES,
    Table,
    document_head,
    no_tendon_column,
    read_data_table,
    tendon_columns,
)

BESIDE = ("tip", "angles")
"""Optional readings beside tensions and strokes."""


def read_sensor_table(
    file: str,
    robot: Robot,
    beside: Collection[str],
    named: Mapping[str, str],
) -> dict[str, np.ndarray]:
    """Read tensions and strokes of a table, one row a reading; empty entries were not measured.

    Args:
        file: A CSV with `tendon_force_N` and `tendon_displacement_mm`, of several tendons
            `tendon_1_force_N` and so on.
        robot: The robot that was read.
        beside: What else is read, of `BESIDE`: `tip_x_mm`, ... or `notch_1_deg`, ...
        named: Headers of the file for quantities, as for `read_measurements`.

    Returns:
        The readings by argument of `notchflex.sense`.

    Raises:
        InputError: No such table or column, or an entry that is not a number.
    """
    table, tendons = read_data_table(file, named), robot.number_of_tendons
    read: dict[str, np.ndarray] = {}
    used: set[str] = set()
    for argument, quantity in (("tensions", "tension"), ("strokes", "stroke")):
        columns = tendon_columns(table.header, quantity, tendons)
        read[argument] = _columns(table, columns, tendons)
        used |= {*columns.values()}
    if np.isnan(read["tensions"]).all() and np.isnan(read["strokes"]).all():
        raise no_tendon_column(table, tendons)
    count = robot.number_of_notches
    for what, names, scale in (
        ("tip", [QUANTITIES["tip_position"].header(axis=axis) for axis in AXES], 1.0),
        ("angles", [QUANTITIES["notch_angle"].header(notch=i + 1) for i in range(count)], DEGREES),
    ):
        used |= {*names}
        if what in beside:
            present = {place: name for place, name in enumerate(names) if name in table.header}
            if not present:
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there is no column {names[0]}; {table.columns}."
                )
            read[what] = _columns(table, present, len(names)) / scale
    table.unused(used)
    return read


def _columns(table: Table, columns: dict[int, str], width: int) -> np.ndarray:
    values = np.full((len(table), width), np.nan)
    for column, name in columns.items():
        values[:, column] = table.numbers(name, may_miss=True)
    return values


def sensed_columns(sensed: SensedForce) -> dict[str, Any]:
    """Return columns of a table: force, interval and standard deviation of every reading."""
    columns: dict[str, Any] = {"reading": range(1, len(sensed) + 1)}
    for which, name in enumerate(sensed.components):
        columns |= {
            f"force_{name}_N": sensed.force[:, which],
            f"force_{name}_low_N": sensed.low[:, which],
            f"force_{name}_high_N": sensed.high[:, which],
            f"force_{name}_sd_N": sensed.deviation[:, which],
            f"force_{name}_stuck": sensed.stuck[:, which],
            f"force_{name}_limited": sensed.limited[:, which],
        }
    columns["averaged_as"] = sensed.group + 1
    columns["contact"] = sensed.contact
    columns["contact_p"] = sensed.contact_probability
    columns["misfit"] = sensed.misfit
    return columns


def sensed_document(sensed: SensedForce) -> dict[str, Any]:
    """Return what was sensed as a document of plain values and arrays, for JSON."""
    names = sensed.components
    by_component = {
        "force_N": sensed.force,
        "low_N": sensed.low,
        "high_N": sensed.high,
        "limited": sensed.limited,
        "stuck": sensed.stuck,
    }
    readings = [
        {
            "reading": number + 1,
            "converged": bool(sensed.converged[number]),
            **{
                key: dict(zip(names, values[number].tolist(), strict=True))
                for key, values in by_component.items()
            },
            "covariance_N2": sensed.covariance[number],
            "contact": bool(sensed.contact[number]),
            "contact_p": float(sensed.contact_probability[number]),
            "misfit": float(sensed.misfit[number]),
            "explained": not sensed.unexplained[number],
            "numbers_read": int(sensed.read[number]),
            "averaged_as": int(sensed.group[number]) + 1,
            "not_observable": sensed.hidden[number],
        }
        for number in range(len(sensed))
    ]
    return {
        **document_head(sensed.robot),
        "components": list(names),
        "place": "tip" if sensed.place is None else sensed.place,
        "places": [
            {"place": "tip" if place is None else place, "misfit": misfit}
            for place, misfit in sensed.places.items()
        ],
        "level": sensed.level,
        "largest_N": sensed.largest,
        "converged": not sensed.reason,
        "reason": sensed.reason,
        "notes": sensed.not_observable,
        "readings": readings,
    }
