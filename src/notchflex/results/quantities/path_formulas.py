"""Quantities of a path that follow from what the solver returned, each beside its formula."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from notchflex._quantity import REGISTERED, Quantity
from notchflex.solver.derived.quantities import believable

if TYPE_CHECKING:  # for the type only: a path evaluates these
    from notchflex.results.path import EquilibriumPath

# Log ratios this close to their bound are on it.
_BOUND_TOLERANCE = 1e-9


@Quantity("path", "commanded tension", "T", "N", key="load.tension_N", per=("tendon",), after="")
def commanded_tension(path: EquilibriumPath) -> np.ndarray:
    """Tension commanded at the base of a tendon; empty (NaN) where it is not commanded."""
    return path.load.tension


@Quantity("path", "commanded stroke", "u", "mm", key="load.stroke_mm", per=("tendon",),
          after="commanded_tension")  # fmt: skip
def commanded_stroke(path: EquilibriumPath) -> np.ndarray:
    """Tendon length commanded to be drawn out at the base; empty (NaN) where not commanded."""
    return path.load.stroke


@Quantity("path", "total chord angle", r"\psi", "deg", key="total_chord_angle_deg",
          column="total_chord_deg", after="chord_angle", optional=True)  # fmt: skip
def total_chord_angle(path: EquilibriumPath) -> np.ndarray:
    """Sum of the chord angles, where every flexure has one."""
    return path.chord_angle.sum(axis=-1)


@Quantity("path", "dissipation", "D_i", "N mm", per=("tendon", "contact"), after="contact_bound",
          work_of=("span_tension", "contact_slid"),
          note="Integrated by the trapezoid rule from step to step, as is the tendon work, so the "
          "two balance with the stored energy as the steps get small. A few coarse steps across a "
          "reversal give a rough value, which may even decrease.")  # fmt: skip
def dissipation(path: EquilibriumPath) -> np.ndarray:
    """Work that a friction contact has turned to heat since the start of the path."""
    return _accumulated(path, *REGISTERED["dissipation"].work_of)


@Quantity("path", "dissipation of the material", "D_j", "N mm", per=("notch",),
          after="dissipation",
          note="Half the width of the hysteresis of every fibre times the change of its "
          "transformed strain, from step to step. Where the notch flattens, the loss of flattening "
          "is added by the trapezoid rule. Zero for materials without hysteresis."
          )  # fmt: skip
def material_dissipation(path: EquilibriumPath) -> np.ndarray:
    """Energy that the material of a notch has turned to heat since the start of the path."""
    chain, after = path.chain, path.run.solved.memory.material
    if isinstance(after, tuple):  # no memory
        return np.zeros((len(path), chain.flexures))
    before, after = _before_and_after(path, after, "material")
    loss = np.sum(chain.law.dissipated(chain.rods.section, before, after) * chain.rods.length, -1)
    flat_before, flat_after = _before_and_after(
        path, path.solver_quantity("flattening"), "flattening"
    )
    shift, change = 0.5 * (flat_before + flat_after), flat_after - flat_before
    loss = loss + np.sum(shift[..., 0, :] * change[..., 1, :] - change[..., 2, :], axis=-1)
    return loss if path.each_from_rest else np.cumsum(loss, axis=0)


@Quantity("path", "friction front", "m", key="front.m", column="tendon{tendon}_front_m",
          per=("tendon",), after="material_dissipation", kind=int)  # fmt: skip
def front_contact(path: EquilibriumPath) -> np.ndarray:
    """Contact up to which the friction of a tendon has turned from loading to unloading.

    Contacts are counted from 1 at the base (Gao 2017, eq. 26); one more than there are where all
    have turned.
    """
    return path.front[0]


@Quantity("path", "friction at the front", r"\eta", key="front.eta",
          column="tendon{tendon}_front_eta", per=("tendon",), after="front_contact")  # fmt: skip
def front_eta(path: EquilibriumPath) -> np.ndarray:
    """Friction of that contact over its largest, from 1 (loading) to -1 (unloading)."""
    return path.front[1]


@Quantity("path", "tendon work", "W", "N mm", key="tendon_work_Nmm",
          column="tendon{tendon}_work_Nmm", per=("tendon",),
          work_of=("tension", "stroke"))  # fmt: skip
def tendon_work(path: EquilibriumPath) -> np.ndarray:
    """Work done on a tendon at the base since the start of the path."""
    return _accumulated(path, *REGISTERED["tendon_work"].work_of)


@Quantity("path", "converged", key="converged", column="converged", kind=bool,
          note="A solved state beyond the limits of the friction law or of the strain modes "
          "counts as not converged.")  # fmt: skip
def converged(path: EquilibriumPath) -> np.ndarray:
    """True where the equilibrium was found."""
    return path.run.converged & believable(path.solver_quantity)


@Quantity("path", "reason", key="reason", column="reason", kind=str)
def reason(path: EquilibriumPath) -> list[str]:
    """Why the equilibrium was not found; empty where it was."""
    return [text for _, text in path.failures]


@Quantity("path", "code of the reason", key="reason_code", kind=str)
def reason_code(path: EquilibriumPath) -> list[str]:
    """Name of the `Failure` that stopped the solver; empty where the equilibrium was found."""
    return [failure.name if failure else "" for failure, _ in path.failures]


@Quantity("path", "stable", key="stable", column="stable", kind=bool)
def stable(path: EquilibriumPath) -> np.ndarray:
    """True where the equilibrium is stable with its sticking contacts held."""
    return path.run.stable(path.commands)


@Quantity("path", "smallest eigenvalue", r"\lambda_\mathrm{min}", "N mm",
          key="smallest_eigenvalue_Nmm")  # fmt: skip
def smallest_eigenvalue(path: EquilibriumPath) -> np.ndarray:
    """Smallest real part of an eigenvalue of the stiffness, sticking contacts held."""
    return path.stability[0]


@Quantity("path", "sign of the determinant")
def determinant_sign(path: EquilibriumPath) -> np.ndarray:
    """Sign of the determinant of that stiffness; +1 at every stable state, 0 without one answer.

    It is 0 where the strokes of inextensible tendons depend on each other and fix no tensions.
    """
    return path.stability[1]


@Quantity("path", "snap", per=("notch",), kind=int, after="determinant_sign",
          note="Found by the solver: on the way to this state the tension that holds the notch has "
          "passed an extremum. Where a stroke is commanded the way leads through the shapes "
          "between, and none is counted.")  # fmt: skip
def snap(path: EquilibriumPath) -> np.ndarray:
    """1 where a notch passed a limit point under tension and snapped shut, -1 open; 0 elsewhere."""
    under_tension = np.isnan(path.load.stroke).all(axis=1) & path.run.converged
    return np.where(under_tension[:, None], path.run.snapped, 0.0).astype(int)


@Quantity("path", "residual", "r", key="residual", column="residual")
def residual(path: EquilibriumPath) -> np.ndarray:
    """Largest scaled residual of the equations at the end of the iteration."""
    return path.run.residual


@Quantity("path", "iterations", key="iterations", column="iterations", kind=int)
def iterations(path: EquilibriumPath) -> np.ndarray:
    """Number of Newton iterations."""
    return path.run.iterations


def _accumulated(path: EquilibriumPath, force: str, length: str) -> np.ndarray:
    """Integrate a force over a length, from the state before the path on."""
    pairs = (_before_and_after(path, path.solver_quantity(name), name) for name in (force, length))
    work = work_of_steps(*pairs)
    return work if path.each_from_rest else np.cumsum(work, axis=0)


def work_of_steps(
    force: tuple[np.ndarray, np.ndarray], length: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the work of a force, before and after every step, by the trapezoid rule.

    A contact between two spans takes the drop of the tension from one to the other.
    """
    mean, change = 0.5 * (force[0] + force[1]), length[1] - length[0]
    if mean.shape[-1] > change.shape[-1]:
        mean = mean[..., :-1] - mean[..., 1:]
    return mean * change


def _before_and_after(
    path: EquilibriumPath, after: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return values before and after every step of a path."""
    first = path.run.before(name)[None]
    if path.each_from_rest:
        return np.broadcast_to(first, after.shape), after
    return np.concatenate([first, after[:-1]]), after


def friction_front(
    ratio: Float[np.ndarray, "s t contacts"], bound: Float[np.ndarray, "s t contacts"]
) -> tuple[Int[np.ndarray, "s t"], Float[np.ndarray, "s t"]]:
    """Return the contact that turns, and its friction over the largest (Gao 2017, eq. 26).

    Args:
        ratio: Log ratio of the tension at every contact, base to tip; NaN where there is none.
        bound: Its largest magnitude.

    Returns:
        m and eta of every tendon; see `EquilibriumPath.front`.
    """
    exists = ~np.isnan(ratio)
    rubs = exists & (bound > 0.0)
    # A contact without friction (a law may lay it all on one edge of a gap) is passed over, and
    # one that hardly turns its tendon. Where none does more, all have gone the same way.
    counts = rubs & (bound > _BOUND_TOLERANCE)
    turned = (ratio < 0.0) & (ratio <= _BOUND_TOLERANCE - bound)
    let_go = np.nansum(ratio, axis=-1, keepdims=True) < 0.0
    nothing = ~counts.any(axis=-1, keepdims=True)
    waits = np.where(nothing, rubs & ~let_go, counts & ~turned)
    every = np.where(rubs.any(axis=-1), exists.sum(axis=-1), 0)
    count = np.where(waits.any(axis=-1), waits.argmax(axis=-1), every)
    at_front = np.minimum(count, ratio.shape[-1] - 1)[..., None]
    at_contact, largest = (
        np.take_along_axis(value, at_front, axis=-1)[..., 0] for value in (ratio, bound)
    )
    holds = waits.any(axis=-1)
    # Friction over its largest at a corner is (1 - rho)/(1 + rho) over the same at the bound.
    part = np.tanh(0.5 * at_contact) / np.tanh(0.5 * np.where(holds, largest, 1.0))
    return count + 1, np.where(holds, part, np.nan)
