"""Sheaths along a path: what drives are to reach, and what the wires remember of a solved state."""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.sheath import (
    SheathMemory,
    from_base,
    from_drive,
    kept,
    log_tension,
    mean_tension,
    within,
)
from notchflex.solver.residual import Iterate, Memory, SolverState, sheath_contact

# Halvings of the range of a drive's ln T, and the least motion of a wire that its backlash follows,
# mm.
_HALVINGS, _MOTION = 54, 1e-9


def aimed(chain: Chain, command: Command, memory: SheathMemory | None) -> Command:
    """Return a command with strokes of the wires' ends: a drive first goes through its backlash."""
    if chain.sheath is None or memory is None or command.by_stroke is None:
        return command
    end, backlash = chain.sheath.wire_end(memory), chain.sheath.backlash
    stroke = jnp.clip(end, command.target, command.target + backlash)
    return command._replace(target=command.either(stroke, command.target))


def state_after(
    chain: Chain,
    command: Command,
    point: Iterate,
    memory: Memory,
    drawn: Float[Array, " t"],
    before: SheathMemory | None,
) -> SolverState:
    """Return the state at a solved point, with the memory there and that of its sheaths before."""
    sheath, stop = chain.sheath, jax.lax.stop_gradient
    if sheath is None or before is None:
        return SolverState(point, memory, drawn, command.applied)
    limit, base = sheath.log_ratio(command.bend), log_tension(point.base_tension)
    profile = within(before, limit)

    def ends(drive: Array) -> tuple[Any, Array]:
        moved = from_base(from_drive(profile, drive, limit), base, limit)
        return moved, drawn + sheath.compliance * mean_tension(moved)

    # Where a wire slides all along, the tension of the drive follows from that of the base: near
    # there the stroke changes with its square, and would tell it by the root of what is left of the
    # imbalance. Else the stroke of the wire's end rises with the tension of the drive: halving
    # finds it. Its derivatives are those of a step of Newton's method from there.
    aim = aimed(chain, command, before)
    side = sheath_contact(chain, aim, before, point.base_tension, drawn)[1]

    def halve(_: Any, limits: tuple[Array, Array]) -> tuple[Array, Array]:
        middle = 0.5 * (limits[0] + limits[1])
        less = ends(middle)[1] < aim.target
        return jnp.where(less, middle, limits[0]), jnp.where(less, limits[1], middle)

    low, high = stop(jax.lax.fori_loop(0, _HALVINGS, halve, (base - limit, base + limit)))
    found = 0.5 * (low + high)
    end, slope = jax.jvp(lambda drive: ends(drive)[1], (found,), (jnp.ones_like(found),))
    step = (aim.target - end) / stop(jnp.where(slope > 0.0, slope, jnp.inf))
    by_stroke = jnp.where(side == 0.0, found + (step - stop(step)), base + side * limit)
    drive = command.either(by_stroke, log_tension(command.target))
    moved, end = ends(drive)
    tight = point.base_tension > 0.0
    tension = command.either(jnp.where(tight, jnp.exp(drive), 0.0), command.target)
    motion = end - sheath.wire_end(before)
    turned = jnp.where(motion < -_MOTION, -sheath.backlash, before.play)
    turned = jnp.where(motion > _MOTION, 0.0, turned)
    play = command.either(jnp.clip(command.target - end, -sheath.backlash, 0.0), turned)
    memory = memory._replace(sheath=SheathMemory(tension, *kept(moved), limit, drawn, play))
    return SolverState(point, memory, end + play, command.applied)
