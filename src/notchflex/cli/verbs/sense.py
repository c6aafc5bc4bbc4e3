"""`notchflex sense`: the force on a robot from tensions and strokes of its tendons."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted
from notchflex.cli.arguments.loads import ExternalLoads
from notchflex.cli.arguments.robots import (
    Columns,
    RobotName,
    Settings,
    chosen_robot,
    named_columns,
    robot_files,
)
from notchflex.cli.outputs import CsvFile, JsonFile, Outputs, PlotFile, Quiet
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import parse_number

if TYPE_CHECKING:
    from notchflex.sensing import SensedForce

_MOST_ROWS = 60


def _deviation(option: str, what: str) -> Any:
    form = "a finite standard deviation, 0 or more"
    return (
        converted(partial(parse_number, form=form, least=0.0), "SD", name=option),
        Parameter(help=f"Standard deviation of {what}."),
    )


def _beside(text: str) -> tuple[str, ...]:
    names = tuple(part.strip() for part in text.split(","))
    if not set(names) <= {"tip", "angles"}:
        raise InputError.UNKNOWN_NAME("give tip, angles or tip,angles.")
    return names


def _place(text: str) -> int | str:
    return int(text) if text.isdecimal() and len(text) < 9 else text


def sense(
    robot: RobotName,
    data: Annotated[
        str,
        Parameter(
            help="CSV with `tendon_force_N` and `tendon_displacement_mm` (of several tendons "
            "`tendon_1_force_N`, ...), one row a reading, in their order from rest."
        ),
    ],
    /,
    *,
    components: Annotated[
        str | None,
        Parameter(
            metavar="AXES",
            help="Axes of the world along which the force may act: `x`, `xz`, `xyz`, ...; by "
            "default those across the straight tube in which the robot bends.",
        ),
    ] = None,
    place: Annotated[
        int | str,
        converted(_place, "PLACE"),
        Parameter(
            help="Where the force acts: `tip`, the number of a body (1 is the one beyond the first "
            "notch), or `search`."
        ),
    ] = "tip",
    beside: Annotated[
        tuple[str, ...],
        converted(_beside, "NAMES", name="--with", show_default=False),
        Parameter(help="Also use measured columns: `tip` (tip_x_mm, ...), `angles` (notch_1_deg)."),
    ] = (),
    tension_noise: Annotated[float, *_deviation("--tension-noise", "the tensions [N]")] = 0.01,
    stroke_noise: Annotated[float, *_deviation("--stroke-noise", "the strokes [mm]")] = 0.01,
    tip_noise: Annotated[
        float, *_deviation("--tip-noise", "each coordinate of the tip [mm]")
    ] = 0.1,
    angle_noise: Annotated[float, *_deviation("--angle-noise", "the notch angles [deg]")] = 0.5,
    largest: Annotated[
        float | None,
        converted(partial(parse_number, form="a force in N, above 0"), "N"),
        Parameter(
            help="Largest component of the force that is looked for [N]; by default three times "
            "the force at the tip that balances the largest tension at the base."
        ),
    ] = None,
    external: ExternalLoads = ExternalLoads(),  # noqa: B008 - frozen
    settings: Settings = (),
    column: Columns = (),
    json: JsonFile = None,
    csv: CsvFile = None,
    plot: PlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Find the force on a robot from tensions and strokes of its tendons, reading by reading.

    External loads that are given are known and act in all readings, beside the unknown force. The
    interval of 95 % contains what the noise of the sensors and what stuck friction leave open.
    """
    outputs = Outputs([*robot_files(robot), data], quiet=quiet, json=json, csv=csv, plot=plot)
    chosen = chosen_robot(robot, settings)
    from notchflex.sensing.tables import read_sensor_table

    read = read_sensor_table(data, chosen, beside, named_columns(column))
    with terminal.bars("finding the force") as show:
        terminal.use_compile_cache()
        import math

        from notchflex import pull, sensing

        known = external.on(pull(0.0, 0.0, steps=1)).external[0]
        noise = sensing.SensorNoise(
            tension_noise, stroke_noise, tip_noise, math.radians(angle_noise)
        )
        sensed = sensing.sense(
            chosen,
            **read,
            noise=noise,
            components=components,
            place=place,
            known=known,
            largest=largest,
            progress=show,
        )
    _write(sensed, outputs)
    if sensed.unexplained.any():
        first, count = int(sensed.unexplained.argmax()) + 1, int(sensed.unexplained.sum())
        terminal.warn(
            f"{count} of {len(sensed)} readings, first reading {first}, are explained by no force "
            "within the noise; the robot may differ from its model, or the noise be larger. "
            "Intervals from there on may not hold the force."
        )
    if not sensed.reason:
        return DONE
    terminal.error(f"not converged: {sensed.reason}. The readings after it are left out.")
    return NOT_CONVERGED


def _write(sensed: SensedForce, outputs: Outputs) -> None:
    from notchflex.sensing.tables import sensed_columns, sensed_document

    outputs.write_json(lambda: sensed_document(sensed))
    outputs.write_csv(lambda: sensed_columns(sensed))
    outputs.draw(sensed)
    if outputs.prints_tables:
        _print(sensed)


def _mark(sensed: SensedForce, reading: int, which: int) -> str:
    """Return what else than noise makes an interval as wide as it is."""
    if sensed.limited[reading, which]:
        return "open"
    return "stuck" if sensed.stuck[reading, which] else ""


def _print(sensed: SensedForce) -> None:
    console = terminal.output()
    where = "the tip" if sensed.place is None else f"body {sensed.place}"
    console.print(f"Force on {where} of {sensed.robot.name}, 95 % intervals", soft_wrap=True)
    heads = [">\nreading"]
    for name in sensed.components:
        heads += [f">{name}\nN", ">low\nN", ">high\nN", "\n"]
    heads.append("\ncontact")
    count = len(sensed)
    step = -(-count // _MOST_ROWS)
    shown = sorted({*range(0, count, step), count - 1})
    rows: list[list[str]] = []
    for number_ in shown:
        row = [str(number_ + 1)]
        for which in range(len(sensed.components)):
            values = (sensed.force, sensed.low, sensed.high)
            row += [f"{one[number_, which]:.4f}" for one in values]
            row.append(_mark(sensed, number_, which))
        row.append("yes" if sensed.contact[number_] else "")
        rows.append(row)
    console.print(terminal.table(heads, rows))
    if step > 1:
        console.print(f"every {step}th of {count} readings; --csv and --json have all")
    if sensed.limited.any():
        terminal.note(
            f"open: the interval ends at the range of the search, {sensed.largest:.3g} N."
        )
    for sentence in sensed.not_observable:
        terminal.note(f"{sentence}.")
