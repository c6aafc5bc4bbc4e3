"""The compiled program of a batch: the path of one row."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex.analysis.outputs import follow_path
from notchflex.solver.continuation import at_rest
from notchflex.solver.newton import Settings
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.static_structure import StaticStructure


@native(3, lane_sizes)
def follow_row(
    chain: Float[Array, " chain"],
    commands: Float[Array, "s command"],
    numbers: Float[Array, " settings"],
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    outputs: tuple[str, ...],
) -> dict[str, Array]:
    """Follow the path of one row.

    Args:
        chain: The robot.
        commands: Its loads, step by step.
        numbers: Tolerance and limits of the solver.
        chain_layout: Structure of the robot and layout of its other numbers.
        command_layout: Layout of one step.
        outputs: Names of the outputs.

    Returns:
        By name, steps as leading axis.
    """
    robot, loads = chain_layout.unpack(chain), command_layout.unpack(commands)
    start, settings = at_rest(robot), Settings.of(numbers)
    return follow_path(robot, loads, start, settings, outputs)
