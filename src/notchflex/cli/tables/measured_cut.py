"""Output of `notchflex measure --cut`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.cli.outputs import Outputs
from notchflex.cli.terminal import DONE, NOT_CONVERGED

if TYPE_CHECKING:
    from notchflex.photographs import MeasuredCut


def write_cut(
    cut: MeasuredCut,
    outputs: Outputs,
    output: str | None,
    robot: str | None,
    overlays: tuple[Path, ...],
) -> int:
    """Write and print the notches as they were cut; return the exit code.

    Args:
        cut: What was measured.
        outputs: Where results go.
        output: The CSV.
        robot: The robot file with the measured lengths.
        overlays: A file for each photograph, or none.
    """
    from notchflex.photographs.overlay import cut_lines, write_overlay
    from notchflex.photographs.reading import read_photograph

    if overlays:
        overlays[0].parent.mkdir(exist_ok=True)
    for file, one in zip(overlays, cut.photographs, strict=False):
        write_overlay(file, read_photograph(one.source), one, cut_lines(cut))
    outputs.write_json(cut.document)
    if cut.reason:
        terminal.warn(f"the cut is refused: {cut.reason}.")
        unwritten = [name for name in (output, robot) if name is not None]
        if unwritten:
            terminal.error(f"nothing was measured; not written: {', '.join(unwritten)}.")
        return NOT_CONVERGED
    if output is not None:
        cut.write_csv(output)
    if robot is not None:
        cut.write_robot(robot)
    if outputs.prints_tables and "-" not in (output, robot):
        _print(cut)
    if len(cut.photographs) == 1:
        terminal.note("depths need a second photograph, with the robot turned by some 20 deg.")
    return DONE


def _print(cut: MeasuredCut) -> None:
    console = terminal.output()
    console.print(f"Notches of {cut.robot.name} as cut, with standard deviations")
    heads = [">\nnotch", ">height\nmm", ">±\nmm", ">depth\nmm", ">±\nmm"]
    heads += [">uncut\nmm", ">±\nmm"]
    first, *others = cut.columns().values()
    rows = [
        [f"{number:.0f}", *(f"{value:.3f}" for value in values)]
        for number, *values in zip(first, *others, strict=True)
    ]
    console.print(terminal.table(heads, rows))
