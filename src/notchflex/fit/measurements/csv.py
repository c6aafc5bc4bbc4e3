"""Reading measurements from a CSV; `docs/measurements.md` describes its columns."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.analysis import axis_places
from notchflex.errors import InputError
from notchflex.fit.measurements.columns import (
    BASE_TURN,
    BODY_FOLLOWING,
    BODY_VECTORS,
    FOLLOWING,
    FROM_REST,
    PULL,
    TIP_MASS,
    TIP_VECTORS,
    columns,
    numbered,
    places_on_axis,
)
from notchflex.fit.measurements.loading_order import Order, commands_of, loading_order
from notchflex.fit.measurements.measurements import Measurements
from notchflex.loads import BodyForce, ExternalLoad, LoadPath
from notchflex.results.files.csv_reading import Table, no_tendon_column, read_table, tendon_columns
from notchflex.results.quantities.registry import AXES
from notchflex.robot import Robot

_YES_OR_NO = {"0": False, "1": True, "false": False, "true": True}


def read_measurements(
    source: str | os.PathLike[str], robot: Robot, *, from_rest: bool | None = None
) -> Measurements:
    r"""Read measurements of a robot from a CSV.

    The file is UTF-8 with commas and its header first; lines that start with `#` are skipped. A
    column is named after its quantity and unit: what was done (`tendon_force_N`, `tip_mass_g`),
    what was measured (`notch_1_deg`, `tip_x_mm`) and, if known, its standard deviation
    (`notch_1_sd_deg`). An empty entry was not measured. `docs/measurements.md` lists all of them.

    Args:
        source: Path of the file.
        robot: The robot that was measured.
        from_rest: True if every row is a pull from rest, False if the rows of each pull are one
            path with friction history; None for what the file says (its column `from_rest`), and
            where it says nothing for what the order of the rows says: a force or displacement that
            falls step by step is unloading, one that falls at once to where it began is the next
            pull from rest. `Measurements.order` holds what was understood.

    Returns:
        The measurements, in the order of the file.

    Raises:
        InputError: The file cannot be used, or the order of its rows can be understood in two ways;
            one sentence names it, and line and column.

    Example:
        >>> from pathlib import Path
        >>> from notchflex import load_robot
        >>> _ = Path("pull.csv").write_text("tendon_force_N,total_deg\n0.25,12.4\n0.5,24.9\n")
        >>> read_measurements("pull.csv", load_robot("pacheco2021-a"))
        <Measurements of pull.csv: 2 rows of 1 pull, each from rest; total_angle>
    """
    table = read_table(source)
    _check_numbers(table, robot)
    taken: set[str] = set()
    external = _external(table, robot, taken)
    tension, stroke = _commanded(table, robot, taken)
    observed, deviation, axis_at = _observed(table, robot, taken)
    base_rotation = _base_rotation(table, taken)
    column = next((name for name in PULL if name in table.header), None)
    labels = None if column is None else table.texts(column)
    taken.update([column or ""])
    said = _from_rest(table, taken)
    said = said if from_rest is None else from_rest
    order = _order(table, tension, stroke, labels, said)
    return Measurements(
        source=table.name,
        load=LoadPath(np.maximum(tension, 0.0), stroke, base_rotation, external),
        pull=order.pull,
        from_rest=order.from_rest,
        observed=observed,
        deviation=deviation,
        axis_at=axis_at,
        measured_tension=tension,
        ignored=tuple(column for column in table.header if column not in taken),
        order=order.words,
    )


def _order(
    table: Table,
    tension: NDArray[np.float64],
    stroke: NDArray[np.float64],
    labels: tuple[str, ...] | None,
    said: bool | None,
) -> Order:
    """Which pull every row belongs to, and whether it was loaded from rest."""
    if said is False:
        return Order(False, ("1",) * len(table) if labels is None else labels)
    order = loading_order(commands_of(tension, stroke), labels, len(table))
    if said:
        return Order(True, order.pull)
    if order.unclear is None:
        return order
    row, name, top, bottom = order.unclear
    raise InputError.UNSUPPORTED(
        f"{table.at(row)}: the {name} falls from {top:g} to {bottom:g} neither step by step nor "
        "to where the pull began, so the order of the rows does not tell how the robot was loaded. "
        "Say so: --from-rest (a column from_rest "
        "of 1) if every row was loaded from rest, --path (0) if the rows of each pull are one "
        "loading path; a column trial separates pulls."
    )


def _check_numbers(table: Table, robot: Robot) -> None:
    """Refuse columns of notches, tendons or bodies that the robot does not have."""
    counts = {
        "notch": (1, robot.number_of_notches),
        "tendon": (1, robot.number_of_tendons),
        "body": (0, robot.number_of_notches),
    }
    for column in table.header:
        found = numbered(column)
        if found is None:
            continue
        first, last = counts[found[0]]
        if not first <= found[1] <= last:
            has = f"{found[0]} {first}" if first == last else f"{found[0]} {first} to {last}"
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: there is a column {column}, but {robot.name} has {has}; choose the "
                "robot that was measured."
            )


def _commanded(
    table: Table, robot: Robot, taken: set[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Measured tensions and strokes, rows by tendons; NaN where the other is given."""
    tendons = robot.number_of_tendons
    tension, stroke = (np.full((len(table), tendons), np.nan) for _ in range(2))
    by_force = tendon_columns(table.header, "tension", tendons)
    by_stroke = tendon_columns(table.header, "stroke", tendons)
    if not by_force and not by_stroke:
        if not taken:  # nor does anything act from outside
            raise no_tendon_column(table, tendons)
        return tension, stroke
    for tendon in sorted({*by_force, *by_stroke}):
        force, drawn = by_force.get(tendon), by_stroke.get(tendon)
        for column, values in ((force, tension), (drawn, stroke)):
            if column is not None:
                values[:, tendon] = table.numbers(column, may_miss=True)
        if force is not None:
            taken.add(force)
            stroke[~np.isnan(tension[:, tendon]), tendon] = np.nan
        if drawn is not None and not np.isnan(stroke[:, tendon]).all():
            taken.add(drawn)
        missing = np.flatnonzero(np.isnan(tension[:, tendon]) & np.isnan(stroke[:, tendon]))
        if len(missing):
            names = " and ".join(name for name in (force, drawn) if name is not None)
            raise InputError.MISSING_VALUE(
                f"{table.at(missing[0])}: {names} {'are' if ' and ' in names else 'is'} nothing; "
                "say what was done to the tendon, 0 N where it was slack."
            )
    return tension, stroke


def _observed(
    table: Table, robot: Robot, taken: set[str]
) -> tuple[dict[str, NDArray[np.float64]], dict[str, NDArray[np.float64]], NDArray[np.float64]]:
    """What was measured, its standard deviations, and where the points on the axis are."""
    places = places_on_axis(table.header)
    axis_at = np.array(list(places.values()))
    for written, at in places.items():
        try:
            axis_places(robot, at)
        except InputError as problem:
            column = next(name for name in table.header if name.startswith(f"axis_{written}_"))
            raise InputError.TABLE_COLUMNS(f"{table.name}: column {column}: {problem}.") from None
    if len(set(axis_at)) < len(axis_at):
        twice = [one for one in places if list(places.values()).count(places[one]) > 1]
        raise InputError.TABLE_COLUMNS(
            f"{table.name}: the columns axis_{twice[0]}_... and axis_{twice[1]}_... are of one "
            "point; keep one of them."
        )
    notches, tendons = robot.number_of_notches, robot.number_of_tendons
    shapes = {
        "notch_angle": (notches,),
        "total_angle": (),
        "tip_position": (3,),
        "tip_rotation": (3,),
        "tip_tension": (tendons,),
        "axis_points": (len(axis_at), 3),
    }
    observed: dict[str, NDArray[np.float64]] = {}
    deviation: dict[str, NDArray[np.float64]] = {}
    for column in columns(notches, tendons, axis_at.tolist()):
        name, spread = column.name, column.deviation
        if column.quantity == "axis_points":  # as the file writes the number
            written = list(places)[column.index[0]]
            name, spread = (f"axis_{written}_{one.split('_', 2)[2]}" for one in (name, spread))
        if column.quantity == "tip_tension" and tendons == 1 and name not in table.header:
            name, spread = (one.replace("tendon_", "tendon_1_") for one in (name, spread))
        if spread in table.header and name not in table.header:
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: there is a column {spread}, but none of what it is the standard "
                f"deviation of; add {name}."
            )
        for held, header in ((observed, name), (deviation, spread)):
            if header not in table.header:
                continue
            taken.add(header)
            values = table.numbers(header, may_miss=True)
            if held is deviation and (values <= 0.0).any():
                row = int(np.argmax(values <= 0.0))
                raise InputError.OUT_OF_RANGE(
                    f"{table.at(row)}: {header} is {values[row]:g}; a standard deviation is above "
                    "0, or empty where it is not known."
                )
            if np.isnan(values).all():
                continue
            empty = np.full((len(table), *shapes[column.quantity]), np.nan)
            whole = held.setdefault(column.quantity, empty)
            whole[(slice(None), *column.index)] = (
                np.radians(values) if column.in_degrees else values
            )
    if not observed:
        raise InputError.NO_DATA(
            f"{table.name}: nothing is measured; there is no number in a column such as "
            f"notch_1_deg, total_deg, tip_x_mm or axis_5_x_mm; {table.columns}."
        )
    for name in [one for one in deviation if one not in observed]:
        del deviation[name]
    if "axis_points" not in observed:
        axis_at = np.zeros(0)
    return observed, deviation, axis_at


def _vectors(
    table: Table, names: dict[str, str], taken: set[str], **number: object
) -> dict[str, NDArray[np.float64]]:
    """Three numbers a row for each argument that has a column; axes without one are 0."""
    found: dict[str, NDArray[np.float64]] = {}
    for argument, pattern in names.items():
        for axis, letter in enumerate(AXES):
            column = pattern.format(a=letter, **number)
            if column in table.header:
                values = found.setdefault(argument, np.zeros((len(table), 3)))
                values[:, axis] = table.numbers(column)
                taken.add(column)
    return found


def _flags(table: Table, column: str, taken: set[str]) -> list[bool] | None:
    """A column of 0 and 1; None where there is none."""
    if column not in table.header:
        return None
    taken.add(column)
    flags: list[bool] = []
    for row, text in enumerate(table.texts(column)):
        if text.lower() not in _YES_OR_NO:
            raise InputError.NOT_A_NUMBER(
                f"{table.at(row)}: {column} is {text or 'nothing'!r}; give 0 or 1."
            )
        flags.append(_YES_OR_NO[text.lower()])
    return flags


def _external(table: Table, robot: Robot, taken: set[str]) -> tuple[ExternalLoad, ...]:
    """What acts from outside, row by row."""
    at_tip = _vectors(table, TIP_VECTORS, taken)
    following = _flags(table, FOLLOWING, taken)
    mass = table.numbers(TIP_MASS) if TIP_MASS in table.header else None
    if mass is not None:
        taken.add(TIP_MASS)
    bodies: dict[int, tuple[dict[str, NDArray[np.float64]], list[bool] | None]] = {}
    for body in range(robot.number_of_notches + 1):
        vectors = _vectors(table, BODY_VECTORS, taken, b=body)
        follows = _flags(table, BODY_FOLLOWING.format(b=body), taken)
        if vectors:
            bodies[body] = vectors, follows
    loads: list[ExternalLoad] = []
    for row in range(len(table)):
        given: dict[str, Any] = {name: values[row].tolist() for name, values in at_tip.items()}
        if following is not None:
            given["following"] = following[row]
        if mass is not None:
            given["tip_mass"] = float(mass[row])
        given["body_forces"] = [
            BodyForce(
                body,
                **{"force": (0.0, 0.0, 0.0)}
                | {name: values[row].tolist() for name, values in vectors.items()},
                following=follows is not None and follows[row],
            )
            for body, (vectors, follows) in bodies.items()
            if any(vectors[name][row].any() for name in ("force", "moment") if name in vectors)
        ]
        try:
            loads.append(ExternalLoad(**given))
        except InputError as problem:
            raise InputError(f"{table.at(row)}: {problem}.", problem.code) from None
        has_mass = robot.material.density is not None or given.get("tip_mass")
        if any(given.get("gravity", ())) and not has_mass:
            raise InputError.UNSUPPORTED(
                f"{table.at(row)}: gravity has nothing to act on, because the density of "
                f"{robot.name} is not known; give material.density, or a {TIP_MASS}."
            )
    return tuple(loads)


def _base_rotation(table: Table, taken: set[str]) -> NDArray[np.float64]:
    turned = _vectors(table, {"base": BASE_TURN}, taken).get("base", np.zeros((1, 3)))
    differs = np.flatnonzero((turned != turned[0]).any(axis=1))
    if len(differs):
        raise InputError.UNSUPPORTED(
            f"{table.at(differs[0])}: the base is turned otherwise than in the row before it; "
            "write a file for each way that it is turned."
        )
    return np.radians(turned[0])


def _from_rest(table: Table, taken: set[str]) -> bool | None:
    """What the file says; None where it says nothing."""
    flags = _flags(table, FROM_REST, taken)
    if flags is None:
        return None
    if len(set(flags)) > 1:
        row = flags.index(not flags[0])
        raise InputError.UNSUPPORTED(
            f"{table.at(row)}: {FROM_REST} differs from the rows before; it is the same for all."
        )
    return flags[0]
