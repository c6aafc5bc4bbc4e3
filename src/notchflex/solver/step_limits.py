"""Limits of Newton's step: slack tendons, closing notches, tendons driven by stroke."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.block_elimination import NewtonStep
from notchflex.solver.element import Iterate, Memory, Unknowns, is_active, notch_heights
from notchflex.solver.friction_predictor import predict_log_ratios
from notchflex.solver.residual import Evaluation

LARGEST_LOG_RATIO = 1.0
"""A step may change a log ratio by so much; beyond, the linear model says nothing of use."""

# Lips are brought together by a little more than their gap, so that they count as closed: by this
# part of the gap, and of the notch's height. Without the latter a gap that is a rounding error
# would hold every step up at itself, and the lips would neither close nor open.
_BEYOND, _OVERLAP = 1e-6, 1e-12


def limit_slack(chain: Chain, point: Iterate, step: NewtonStep) -> NewtonStep:
    """Limit the log-ratio step of slack tendons.

    Without tension they act on nothing, and a sticking contact would change them at random: all
    that matters is which way it slides. The rest of the step need not be shortened for their sake.
    """
    slack = (point.base_tension == 0.0) & (step.base_tension == 0.0)
    logs = tuple(
        jnp.where(
            slack[jnp.array(group.numbers)][None, :, None],
            jnp.clip(change, -LARGEST_LOG_RATIO, LARGEST_LOG_RATIO),
            change,
        )
        for group, change in zip(chain.groups, step.unknowns.log_ratio, strict=True)
    )
    return step._replace(unknowns=step.unknowns._replace(log_ratio=logs))


def limit_closing(
    chain: Chain, unknowns: Unknowns, at: Evaluation, step: NewtonStep, part: Float[Array, ""]
) -> NewtonStep:
    """Limit a step of which a part is taken: no notch bends farther than to where its lips meet.

    Beyond, the material law would be evaluated at a strain that the notch cannot have, and what
    follows from it would open the lips again.
    """
    modes = step.unknowns.modes
    for group, touch, force in zip(chain.lips, at.touches, unknowns.lip_force, strict=True):
        if touch.slope is None:
            continue  # bodies have more than one flexure to come together by
        closing = -part * jnp.einsum("nlm,nm->nl", touch.slope, modes)
        is_open = ~is_active(chain.lip_stiffness, group.closes, force, touch.gap)
        stops = is_open & (closing > touch.gap) & (touch.gap > 0.0) & (group.closes > 0.0)
        reach = (1.0 + _BEYOND) * touch.gap + _OVERLAP * notch_heights(chain)[:, None]
        allowed = jnp.where(stops, reach / jnp.where(stops, closing, 1.0), 1.0)
        modes = modes * jnp.minimum(jnp.min(allowed, axis=-1, keepdims=True), 1.0)
    return step._replace(unknowns=step.unknowns._replace(modes=modes))


def predict_contacts(
    chain: Chain,
    command: Command,
    memory: Memory,
    last_tension: Float[Array, " t"],
    point: Iterate,
    step: NewtonStep,
    whole: Float[Array, ""],
    part: Float[Array, ""],
) -> NewtonStep:
    """Replace the log ratios of a step by those that the friction predictor gives.

    For tendons driven by stroke, while their tensions are still to be found. Sticking contacts make
    a tendon very stiff; the change of its tension is limited. Of the step that is returned `part`
    is to be taken, of the linear one it would have been `whole`. `last_tension` are the base
    tensions (N) of the last solved state.
    """
    assert command.by_stroke is not None
    tension = point.base_tension + whole * step.base_tension
    moderate = jnp.clip(
        tension, 0.5 * point.base_tension, 2.0 * point.base_tension + chain.closing_force
    )
    tension = command.either(moderate, tension)
    predicted = predict_log_ratios(chain, last_tension, tension, memory)
    logs = []
    for group, there, here, change in zip(
        chain.groups, predicted, point.unknowns.log_ratio, step.unknowns.log_ratio, strict=True
    ):
        by_stroke = command.by_stroke[jnp.array(group.numbers)][None, :, None]
        logs.append(jnp.where(by_stroke, there - here, whole * change) / part)
    return NewtonStep(
        step.unknowns._replace(log_ratio=tuple(logs)), (tension - point.base_tension) / part
    )
