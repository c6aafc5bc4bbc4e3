"""`notchflex sense`: the force on a robot from tensions and strokes of its tendons."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_LOADS,
    Columns,
    ExternalLoads,
    TableOutputs,
    as_csv,
    converted,
    number,
)
from notchflex.cli.robots import RobotName, Settings, chosen_robot, robot_files
from notchflex.cli.terminal import DONE

if TYPE_CHECKING:
    from notchflex.sensing import SensedForce

_NOT_SHOWN = ("_sd_N", "averaged_as", "contact_p", "misfit")
"""Columns of the CSV that the table leaves out."""

Deviation = Annotated[float, number("a finite standard deviation, 0 or more", "SD", least=0.0)]


def _beside(text: str) -> tuple[str, ...]:
    names = tuple(part.strip() for part in text.split(","))
    if not set(names) <= {"tip", "angles"}:
        raise InputError.UNKNOWN_NAME("give tip, angles or tip,angles.")
    return names


def _place(text: str) -> int | str:
    return int(text) if text.isdecimal() and len(text) < 9 else text


def sense(
    robot: RobotName,
    data: str,
    /,
    *,
    components: Annotated[str | None, Parameter(metavar="AXES")] = None,
    place: Annotated[int | str, converted(_place, "PLACE")] = "tip",
    beside: Annotated[tuple[str, ...], converted(_beside, "NAMES", name="--with")] = (),
    tension_noise: Deviation = 0.01,
    stroke_noise: Deviation = 0.01,
    tip_noise: Deviation = 0.1,
    angle_noise: Deviation = 0.5,
    largest: Annotated[float | None, number("a force in N, above 0", "N")] = None,
    external: ExternalLoads = NO_LOADS,
    settings: Settings = (),
    column: Columns = (),
    outputs: TableOutputs = TableOutputs(),
) -> int:
    """Find the force on a robot from tensions and strokes of its tendons, reading by reading.

    External loads that are given are known and act in all readings, beside the unknown force. The
    interval of 95 % contains what the noise of the sensors and what stuck friction leave open.

    Args:
        data: CSV with `tendon_force_N` and `tendon_displacement_mm` (of several tendons
            `tendon_1_force_N`, ...), one row a reading, in their order from rest.
        components: Axes of the world along which the force may act: `x`, `xz`, `xyz`, ...; by
            default those across the straight tube in which the robot bends.
        place: Where the force acts: `tip`, the number of a body (1 is the one beyond the first
            notch), or `search`.
        beside: Also use measured columns: `tip` (tip_x_mm, ...), `angles` (notch_1_deg).
        tension_noise: Standard deviation of the tensions [N].
        stroke_noise: Standard deviation of the strokes [mm].
        tip_noise: Standard deviation of each coordinate of the tip [mm].
        angle_noise: Standard deviation of the notch angles [deg].
        largest: Largest component of the force that is looked for [N]; by default three times the
            force at the tip that balances the largest tension at the base.
    """
    outputs.check([*robot_files(robot), data])
    chosen = chosen_robot(robot, settings)
    from notchflex.sensing import tables as files

    readings = files.read_sensor_table(data, chosen, beside, dict(column))
    with terminal.progress("finding the force") as progress:
        from notchflex import sensing
        from notchflex.support import ExternalLoad

        sensed = sensing.sense(
            chosen,
            **readings,
            noise=sensing.SensorNoise(
                tension_noise, stroke_noise, tip_noise, math.radians(angle_noise)
            ),
            components=components,
            place=place,
            known=ExternalLoad(**external.arguments()),
            largest=largest,
            progress=progress,
        )
    outputs.write(sensed, files.sensed_document, _print, csv=as_csv(files.sensed_columns))
    if sensed.unexplained.any():
        first, count = int(sensed.unexplained.argmax()) + 1, int(sensed.unexplained.sum())
        terminal.warn(
            f"{count} of {len(sensed)} readings, first reading {first}, are explained by no force "
            "within the noise; the robot may differ from its model, or the noise be larger. "
            "Intervals from there on may not hold the force."
        )
    if not sensed.reason:
        return DONE
    return terminal.failed(f"not converged: {sensed.reason}. The readings after it are left out.")


def _print(sensed: SensedForce) -> None:
    from notchflex.sensing.tables import sensed_columns

    where = "the tip" if sensed.place is None else f"body {sensed.place}"
    terminal.line(f"Force on {where} of {sensed.robot.name}, 95 % intervals")
    columns = {
        name: column
        for name, column in sensed_columns(sensed).items()
        if not name.endswith(_NOT_SHOWN)
    }
    forms = {name: ".4f" for name in columns if name.endswith("_N")}
    tables.show(columns, forms=forms, wide=True, most=60)
    if sensed.limited.any():
        terminal.note(
            f"limited: the interval ends at the range of the search, {sensed.largest:.3g} N."
        )
    for sentence in sensed.not_observable:
        terminal.note(f"{sentence}.")
