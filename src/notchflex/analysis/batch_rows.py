"""The compiled program of a batch: what is done with every row."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex.analysis.outputs import followed
from notchflex.solver.continuation import at_rest
from notchflex.solver.newton import Settings
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import Form, lane_sizes
from notchflex.solver.programs.static_structure import KnownForm


@native(3, lane_sizes)
def followed_row(
    chain: Float[Array, " chain"],
    commands: Float[Array, "s command"],
    numbers: Float[Array, " settings"],
    chain_form: KnownForm,
    command_form: Form,
    outputs: tuple[str, ...],
) -> dict[str, Array]:
    """Follow the path of one row.

    Args:
        chain: The robot.
        commands: Its loads, step by step.
        numbers: How hard the solver tries.
        chain_form: Form of what is not known of the robot.
        command_form: Form of one step.
        outputs: Names of what is asked.

    Returns:
        By name, steps as leading axis.
    """
    robot, loads = chain_form.unpack(chain), command_form.unpack(commands)
    start, settings = at_rest(robot), Settings.of(numbers)
    return followed(robot, loads, start, settings, outputs)


__all__ = ["followed_row"]
