"""`notchflex fatigue`: the strain cycle of a loop, against a limit line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_LOADS,
    ExternalLoads,
    Refinement,
    Strokes,
    TableOutputs,
    Tensions,
    as_csv,
)
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files
from notchflex.cli.terminal import DONE
from notchflex.support import load_columns

if TYPE_CHECKING:
    from notchflex.fatigue import StrainCycle


def fatigue(
    robot: RobotName,
    /,
    *,
    tension: Tensions = (),
    stroke: Strokes = (),
    external: ExternalLoads = NO_LOADS,
    refinement: Refinement = 0,
    settings: Settings = (),
    outputs: TableOutputs = TableOutputs(),
) -> int:
    """Find mean and amplitude of the strain of every notch, and the margin below a limit line.

    The steps are a loop, followed until its strains repeat. The line is that of the robot file:
    `--set fatigue.line=cao2020`, or a table `[fatigue]` with `mean` and `amplitude`. No number of
    cycles is predicted. The CSV has a row for every point of every section.

    Args:
        tension: Tension at the base of a tendon [N], step by step, as for `simulate`.
        stroke: Tendon length drawn out at the base [mm], step by step.
    """
    outputs.check(robot_files(robot))
    chosen = chosen_robot(robot, settings)
    columns = load_columns(tension, stroke, chosen.number_of_tendons)
    with terminal.progress(f"solving loops of {chosen.name}"):
        from notchflex import LoadPath, simulate
        from notchflex.fatigue import cycle_columns, cycle_document, line_words, strain_cycle

        load = LoadPath(*columns).loaded(**external.arguments())
        cycle = strain_cycle(simulate(chosen, load, refinement=refinement))

    def show(cycle: StrainCycle) -> None:
        terminal.line(changed_title(chosen, settings), "bold")
        tables.show(cycle.to_table(), forms=dict.fromkeys(("mean_%", "margin_%"), ".3f"))
        about = ", ".join(line_words(cycle.limit)) or "none"
        terminal.show("", tables.wrapped(f"Limit line: {about}. Loops: {cycle.loops}."))

    outputs.write(cycle, cycle_document, show, csv=as_csv(cycle_columns))
    for sentence in cycle.warnings():
        terminal.warn(sentence)
    return terminal.failed(cycle.reason) if cycle.reason else DONE
