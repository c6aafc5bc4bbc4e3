"""Reasons why a step of a path did not converge, as sentences for the user."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int
from numpy.linalg import norm
from numpy.typing import ArrayLike

from notchflex._jax import constant, jax
from notchflex.errors import Failure
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.tendon.straight import Straight
from notchflex.solver.actuation import closing_stroke
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.run import run

if TYPE_CHECKING:  # for the type only: a path tells its reasons
    from notchflex.results.path import EquilibriumPath

# Largest opening of a notch that counts as closed, as a fraction of its height: a stroke converges
# up to the last state before the last notch closes.
_CLOSED_TOLERANCE = 1e-3
# Largest free span of a tendon at which the edges of its channel count as meeting, relative to the
# natural span.
_EDGES_MEET = 5e-2
# Tension of a slack tendon, relative to what friction takes: rounding.
_SLACK = 1e-6
# Axial stiffnesses, in closing forces of a notch, in ratios of ten. Where only stretch allows a
# stroke, the second step changes the tension about ten times as much as the first; where the shape
# determines the tension, a tenth as much.
_STIFFNESSES, _GROWS = (1e2, 1e3, 1e4), 3.0


def why_not(path: EquilibriumPath, step: int) -> tuple[Failure | None, str]:
    """Return the failure at a step, and a sentence on it; None and "" where it converged."""
    if path.converged[step]:
        return None, ""
    if not path.run.tried[step]:
        return _said(Failure.NOT_TRIED, failed=int(np.argmin(path.converged)) + 1)
    if path.run.converged[step]:  # but beyond the limits of the model
        if not path.run.quantity("bend_possible")[step]:
            return _said(Failure.BENT_TOO_FAR)
        if path.run.quantity("friction_holds")[step]:
            return _said(Failure.TOO_FEW_MODES, percent=100 * path.moment_error[step])
        return _said(Failure.FRICTION_LOCKS)
    tension = ", ".join(f"{value:.4g}" for value in path.tension[step])
    drawn = ", ".join(f"{value:.4g}" for value in path.stroke[step])
    last = f"; the last good state has tension {tension} N and stroke {drawn} mm"
    opening = np.asarray(path.chain.rods.length).sum(axis=-1)
    all_closed = (path.gap[step] < _CLOSED_TOLERANCE * opening).all()
    if (all_closed or _past_closing(path, step)) and not np.isnan(path.load.stroke[step]).all():
        return _said(Failure.NOTCHES_CLOSED, last)
    if (slack := _slack_by_loss(path, step)) is not None:
        return _said(Failure.LOSS_LEAVES_SLACK, last, tendon=slack[0] + 1, loss=slack[1])
    tendons = [str(tendon + 1) for tendon in _drawn_by_stretch_alone(path, step)]
    if len(tendons) == 1:
        return _said(Failure.STROKE_OUT_OF_REACH, last, tendon=tendons[0])
    if tendons:
        return _said(Failure.STROKES_CONTRADICT, last, tendons=" and ".join(tendons))
    if (met := _edges_that_meet(path, step)) is not None:
        return _said(Failure.TENDON_EDGES_MEET, last, tendon=met[0] + 1, notch=met[1] + 1)
    reached, left = 100.0 * float(path.run.reached[step]), float(path.residual[step])
    return _said(Failure.NO_EQUILIBRIUM, last, percent=reached, residual=left)


def _said(failure: Failure, last: str = "", **values: object) -> tuple[Failure, str]:
    return failure, f"{failure.text.format(**values)}{last}; {failure.remedy}"


def _past_closing(path: EquilibriumPath, step: int) -> bool:
    """Return whether a stroke of a step exceeds the closing stroke of an inextensible tendon."""
    reach = closing_stroke(path.chain)
    inextensible = np.isinf(np.asarray(path.chain.axial_stiffness))
    return bool((inextensible & (path.load.stroke[step] >= reach)).any())


def _edges_that_meet(path: EquilibriumPath, step: int) -> tuple[int, int] | None:
    """Return a straight tendon and a notch, from 0, where its free span vanishes.

    Where the edges of its channel meet before those of the notch, the span between them has no
    direction. A compliant contact lets a closed notch reach that state.
    """
    chain = path.chain
    position, rotation = path.body_position[step], path.body_rotation[step]
    for group in chain.groups:
        if not isinstance(group, Straight):
            continue
        leaves, enters = (_in_space(chain, one) for one in (group.leaves, group.enters))
        runs, natural = np.asarray(group.runs), np.asarray(group.natural_gap)
        for (notch, one), before in np.ndenumerate(np.asarray(group.back)):
            at, anchor = notch + 1, notch + 1 - int(before)
            entered = position[at] + rotation[at] @ enters[notch, one]
            left = position[anchor] + rotation[anchor] @ leaves[notch, one]
            if runs[notch, one] and norm(entered - left) < _EDGES_MEET * natural[notch, one]:
                return group.numbers[one], notch
    return None


def _slack_by_loss(path: EquilibriumPath, step: int) -> tuple[int, float] | None:
    """Return a tendon driven by stroke, from 0, that its constant losses leave slack; their sum, N.

    While the slack passes from a closed notch to the next, the tension rises at the same stroke.
    """
    for tendon in np.flatnonzero(np.isfinite(path.load.stroke[step])):
        turning = path.contact_turning[step, tendon]
        losses = path.chain.friction.constant_loss(turning, turning)
        loss = 0.0 if losses is None else float(np.nansum(losses[0]))
        tension = path.span_tension[step, tendon]
        if np.nanmin(tension) < _SLACK * loss < np.nanmax(tension):
            return int(tendon), loss
    return None


def _in_space(chain: Chain, points: ArrayLike) -> Float[np.ndarray, "n t 3"]:
    """Transform points of the tendons to the frames of the bodies."""
    points = np.asarray(points)
    if chain.frame is None:
        return points
    return np.insert(points, 1, 0.0, axis=-1) @ np.asarray(chain.frame).T


def _drawn_by_stretch_alone(path: EquilibriumPath, step: int) -> Int[np.ndarray, " some"]:
    """Return the inextensible tendons, from 0, whose stroke no shape of the robot allows.

    Solved again with extensible tendons, their tension grows with their stiffness.
    """
    chain = path.chain
    inextensible = np.isinf(np.asarray(chain.axial_stiffness))
    asked = inextensible & np.isfinite(path.load.stroke[step])
    tensions: list[np.ndarray] = []
    for forces in _STIFFNESSES if asked.any() else ():
        stiffness = np.where(inextensible, forces * chain.closing_force, chain.axial_stiffness)
        softer = PreparedChain(dataclasses.replace(chain, axial_stiffness=constant(stiffness)))
        command = jax.tree.map(lambda leaf: np.asarray(leaf)[step : step + 1], path.commands)
        start = jax.tree.map(lambda leaf: np.asarray(leaf)[step], path.run.solved)
        came = run(softer, command, start, path.settings, each_from_start=True)
        if not came.converged[0]:
            return np.zeros(0, int)
        tensions.append(came.quantity("tension")[0])
    if not tensions:
        return np.zeros(0, int)
    threshold = 1e-3 * float(chain.closing_force)
    first, second = np.diff(tensions, axis=0)
    return np.flatnonzero(asked & (second > np.maximum(_GROWS * first, threshold)))
