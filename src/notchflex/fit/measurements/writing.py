"""Writing measurements as a CSV that reads back equal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.fit.measurements import columns
from notchflex.fit.measurements.measurements import Measurements
from notchflex.loads import BodyForce
from notchflex.results.files.csv import write_columns
from notchflex.results.quantities.registry import AXES, QUANTITIES


def write_measurements(measurements: Measurements, target: str | Path) -> None:
    """Write measurements as a CSV, whole or not at all.

    Angles are written in degrees. Those that were read from a file, or made by
    `simulate_measurements`, read back exactly; any other to its last digit.

    Args:
        measurements: What to write.
        target: Path, or `-` for standard output.

    Raises:
        InputError: The file cannot be written, or a table cannot hold the loads: several forces on
            one body, gravity or a commanded tendon in some rows only.
    """
    table = {columns.PULL[0]: list(measurements.pull)} | _commands(measurements)
    table |= _external(measurements) | _observed(measurements)
    table[columns.FROM_REST] = [measurements.from_rest] * len(measurements)
    write_columns(target, table)


def exactly_in_degrees(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return degrees that `numpy.radians` turns into exactly these angles, where there are such.

    Example:
        >>> angle = np.radians(np.arange(1.0, 400.0) / 7.0)
        >>> bool((np.radians(exactly_in_degrees(angle)) == angle).all())
        True
    """
    degrees = np.degrees(angle)
    up = down = degrees
    for _ in range(3):
        up, down = np.nextafter(up, np.inf), np.nextafter(down, -np.inf)
        for near in (up, down):
            better = (np.radians(degrees) != angle) & (np.radians(near) == angle)
            degrees = np.where(better, near, degrees)
    return degrees


def _commands(measurements: Measurements) -> dict[str, Any]:
    tension, stroke = measurements.measured_tension, measurements.load.stroke
    tendons = tension.shape[1]
    table: dict[str, Any] = {}
    for tendon in range(tendons):
        commanded = ~np.isnan(tension[:, tendon]) | ~np.isnan(stroke[:, tendon])
        if commanded.any() and not commanded.all():
            raise InputError.UNSUPPORTED(
                f"tendon {tendon + 1} is commanded in some rows only; give 0 N where it is slack"
            )
        for name, values in (("tension", tension), ("stroke", stroke)):
            if not np.isnan(values[:, tendon]).all():
                header = QUANTITIES[name].header(tendon="" if tendons == 1 else tendon + 1)
                table[header] = values[:, tendon]
    return table


def _observed(measurements: Measurements) -> dict[str, Any]:
    observed, deviation = measurements.observed, measurements.deviation
    angles = [observed[name] for name in ("notch_angle", "edge_angle") if name in observed]
    notches = angles[0].shape[1] if angles else 0
    tendons = measurements.measured_tension.shape[1]
    table: dict[str, Any] = {}
    for column in columns.measured_columns(notches, tendons, measurements.axis_at.tolist()):
        for tables, name in ((observed, column.name), (deviation, column.deviation)):
            if column.quantity not in tables:
                continue
            values, measured = (
                one[column.quantity][:, *column.index] for one in (tables, observed)
            )
            # The deviation of what was never measured would not be read back.
            if not (np.isnan(values).all() or np.isnan(measured).all()):
                table[name] = exactly_in_degrees(values) if column.in_degrees else values
    return table


def _external(measurements: Measurements) -> dict[str, Any]:
    loads = measurements.load.external
    table: dict[str, Any] = {}
    if len({one.gravity is None for one in loads}) > 1:
        raise InputError.UNSUPPORTED(
            "gravity is given in some rows only; give it in all or in none"
        )
    for name, pattern in columns.TIP_VECTORS.items():
        rows = [getattr(one, name) for one in loads]
        # Gravity of 0 differs from no gravity given, with which a mass hangs.
        if rows[0] is not None and (name == "gravity" or np.any(rows)):
            table |= _vector(pattern, rows)
    if any(one.following for one in loads):
        table[columns.FOLLOWING] = [one.following for one in loads]
    if any(one.tip_mass for one in loads):
        table[columns.TIP_MASS] = [one.tip_mass for one in loads]
    for body in sorted({force.body for one in loads for force in one.body_forces}):
        of_body = [[force for force in one.body_forces if force.body == body] for one in loads]
        if max(map(len, of_body)) > 1:
            raise InputError.UNSUPPORTED(
                f"several forces act on body {body}; a table has room for one"
            )
        forces = [one[0] if one else BodyForce(body, (0.0, 0.0, 0.0)) for one in of_body]
        for name, pattern in columns.BODY_VECTORS.items():
            rows = [getattr(force, name) for force in forces]
            if np.any(rows):
                table |= _vector(pattern, rows, b=body)
        if any(force.following for force in forces):
            table[columns.BODY_FOLLOWING.format(b=body)] = [force.following for force in forces]
    turn = measurements.load.base_rotation
    if turn.any():
        table |= _vector(columns.BASE_TURN, [exactly_in_degrees(turn)] * len(loads))
    return table


def _vector(pattern: str, rows: Sequence[Any], **number: object) -> dict[str, Any]:
    coordinates = zip(AXES, zip(*rows, strict=True), strict=True)
    return {pattern.format(a=axis, **number): values for axis, values in coordinates}
