"""`notchflex show`: the notches of a robot and how they close."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from notchflex import InputError, Robot
from notchflex.cli import tables, terminal
from notchflex.cli.options import OUTPUT, File, Outputs
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files
from notchflex.support import DEGREES, PAPER, described_at, to_table

if TYPE_CHECKING:
    from notchflex.analysis.bands import ClosingBands

_MEANINGS = {
    "never": "no tension closes the notch",
    "not found": "the solver did not converge at the tensions in question, so the notch may close; "
    "`notchflex simulate` shows how far it bends",
}


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class DimensionedOutputs(Outputs):
    """Results of a robot that is not loaded.

    Attributes:
        plot: Draw the tube and its notches with their dimensions to this .png, .svg or .pdf file.
    """

    plot: File = None


def show(
    robot: RobotName,
    /,
    *,
    settings: Settings = (),
    outputs: DimensionedOutputs = DimensionedOutputs(),
) -> None:
    """Show every notch of a robot: section, closing angle and force, strain at closing.

    The closing force is the tension at which a notch closes while the tendon with the longest
    moment arm on it is pulled from rest with all others slack.
    """
    outputs.check(robot_files(robot), pictures=PAPER)
    chosen = chosen_robot(robot, settings)
    with terminal.progress(f"solving {chosen.name}"):
        from notchflex import closing
        from notchflex.analysis.bands import closing_bands, closing_document
        from notchflex.analysis.closing_loads import notch_table
        from notchflex.support import document_head, unchecked_dimensions

        table = closing(chosen)
        document: dict[str, Any] = document_head(chosen)
        document["notches"] = notch_table(chosen, table)
        if warm := list(_at_temperatures(chosen)):
            document["temperatures"] = warm
    for sentence in unchecked_dimensions(chosen):
        terminal.warn(sentence)
    if outputs.prints_tables:
        _print(chosen, changed_title(chosen, settings), document["notches"])
        if warm:
            print()
            tables.show(warm, forms={"temperature_C": "g"})
    bands = None
    if outputs.prints_tables or outputs.json is not None:
        with terminal.progress("drawing robots within the tolerances"):
            try:
                bands = closing_bands(chosen, table)
            except InputError as problem:
                terminal.warn(f"no bands: {problem}")
        if bands is not None:
            document["tolerances"] = closing_document(bands)

    def draw(robot: Robot, target: str, _: object) -> None:
        from notchflex.plotting import dimensioned_figure, save

        save(dimensioned_figure(robot), target)

    outputs.write(chosen, lambda _: document, plot=draw)
    if bands is not None and outputs.prints_tables:
        _print_accuracy(chosen, bands, document["tolerances"])


def _at_temperatures(robot: Robot) -> Iterator[dict[str, Any]]:
    """Yield plateaus and closing tensions in the workshop and in the body, where they are known."""
    import numpy as np

    from notchflex import closing

    places = [
        f"notch[{number}].material.temperature" if number else "material.temperature"
        for number, part in enumerate((robot, *robot.notches))
        if getattr(part.material, "reference_temperature", None) is not None
    ]
    for temperature in (22.0, 37.0) if places else ():
        try:
            warm = robot.with_values(dict.fromkeys(places, temperature))
        except InputError as problem:
            terminal.warn(f"{problem}")
            continue
        tension = closing(warm).tension
        materials = [notch.made_of(warm.material) for notch in warm.notches]
        different = dict.fromkeys(materials)
        for material in different:
            if getattr(material, "temperature", None) != temperature:
                continue
            members = np.flatnonzero([other == material for other in materials])
            of = {"notches": ", ".join(map(str, members + 1))} if len(different) > 1 else {}
            row = zip(("plateau_MPa", "lower_plateau_MPa"), material.plateaus, strict=False)
            ends = [function.reduce(tension[members]) for function in (np.fmin, np.fmax)]
            yield {"temperature_C": temperature, **of, **dict(row), "closing_tension_N": ends}


def _print(robot: Robot, title: str, notches: list[dict[str, Any]]) -> None:
    """Print the parts of a robot, in what its notches differ, and how they close."""
    terminal.line(title, "bold")
    _, *parts, _ = repr(robot).splitlines()
    lines = [part for part in parts if part.split()[0] not in ("material", "friction")]
    lines.append(f"length    {robot.geometry.length:g} mm")
    parts_of_file = to_table(robot)
    for name in ("material", "friction"):  # with all values, the usual ones as well
        values = parts_of_file[name]
        words = [values.pop("kind")]
        for key, value in values.items():
            shown = f"{value:g}" if isinstance(value, float) else value
            unit = described_at(robot, f"{name}.{key}").unit
            words.append(f"{key.replace('_', ' ')} {shown} {unit}".strip())
        lines.append(f"{name:10}{', '.join(words)}")
    terminal.show(*(tables.wrapped(line.strip(), " " * 10) for line in lines), "")
    _print_differences(robot)
    rows = [
        {
            **row,
            "notch": str(row["notch"]),
            "arm_mm": row["moment_arm_mm"][row["closing_tendon"] - 1],
            "closing_tension_N": row["closing_status"]
            if row["closing_status"] in _MEANINGS
            else f"{row['closing_tension_N']:.3f}",
            "outer_strain_%": 100.0 * row["closing_outer_strain"],
            "peak_strain_%": 100.0 * row["closing_peak_strain"],
        }
        for row in notches
    ]
    tendon = "closing_tendon" if robot.number_of_tendons > 1 else ""
    tables.show(
        rows,
        "notch area_mm2 centroid_mm second_moment_mm4 " + tendon + " arm_mm closing_angle_deg "
        "closing_tension_N outer_strain_% peak_strain_%",
        {"arm_mm": ".4f", "centroid_mm": ".4f", "notch": ">", "closing_tension_N": ">"},
    )
    statuses = {row["closing_status"] for row in notches}
    print()
    terminal.show(
        tables.wrapped(
            _LEGEND
            + "".join(
                f" {status}: {text}." for status, text in _MEANINGS.items() if status in statuses
            )
        )
    )


def _print_differences(robot: Robot) -> None:
    """Print in what notches of one kind differ; equal notches share a row."""
    from notchflex.analysis.closing_loads import named_values

    values = [named_values(notch) for notch in robot.notches]
    kinds: dict[str, list[dict[str, Any]]] = {}
    for row in values:
        kinds.setdefault(row["kind"], []).append(row)
    names = [
        name
        for same in kinds.values()
        for name in dict.fromkeys(name for notch in same for name in notch)
        if len({notch.get(name) for notch in same}) > 1 or (name == "kind" and len(kinds) > 1)
    ]
    if differ := list(dict.fromkeys(names)):
        equal: dict[tuple[Any, ...], list[str]] = {}
        for number, row in enumerate(values, start=1):
            equal.setdefault(tuple(map(row.get, differ)), []).append(str(number))
        columns = dict(zip(differ, zip(*equal, strict=True), strict=True))
        tables.show({"notches": [", ".join(numbers) for numbers in equal.values()]} | columns)
        print()


_LEGEND = (
    "area, second moment and centroid (from the tube axis toward the spine): of what the cut "
    "leaves, where it is weakest. arm: moment arm of the tendon with the longest, whose tension, "
    "pulled alone from rest, closes the notch. Strains at closing: of the outer fibre (Pacheco "
    "2021, eq. 16) and of the farthest one (peak)."
)


def _print_accuracy(robot: Robot, bands: ClosingBands, document: dict[str, Any]) -> None:
    """Print the effect of tolerances on closing and a typical load, and what was assumed."""
    from notchflex.support import law_errors

    columns: dict[str, Any] = {"notch": map(str, document["notches"])}
    for name in ("closing_tension_N", "closing_angle_deg"):
        ends = document[name]
        columns[name] = list(zip(ends["low"], ends["high"], strict=True))
    terminal.show("", f"Accuracy: 5 to 95 % of {document['draws']} draws within the tolerances")
    tables.show(columns, forms={"notch": ">"})
    angle = document["total_angle_deg"]
    pulled = f" of tendon {bands.tendon}" if robot.number_of_tendons > 1 else ""
    text = (
        f"total angle at {bands.load:.3g} N{pulled}: {angle['low']:.1f} to {angle['high']:.1f} deg."
    )
    if bands.shares:
        parts = sorted(bands.shares.items(), key=lambda part: -part[1])
        words = [f"{name} {100.0 * share:.0f} %" for name, share in parts if share > 0.005]
        text += f" Of its variance: {', '.join(words)}."
    if math.isfinite(bands.by_depth):
        change = abs(bands.by_depth) * DEGREES
        text += f" 10 µm of depth in all notches change that angle by {change:.2g} deg."
    if errors := law_errors(robot):
        sizes = ", ".join(f"{name} {100.0 * error:.2g} %" for name, error in errors.items())
        text += f" Law's error (1 SD) of the stiffness: {sizes}."
    tolerances = tables.tolerance_words(robot, bands.bands.tolerances, bands.bands.assumed)
    terminal.show("", tables.wrapped(text), *tolerances)
