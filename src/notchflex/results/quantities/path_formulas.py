"""Quantities of a path that follow from what the solver returned, each by its formula.

What has no formula here is returned by the solver (`Shape` and `Quantities`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.results.quantities.front import friction_front
from notchflex.results.reason import why_not
from notchflex.solver.derived.quantities import believable

if TYPE_CHECKING:  # for the type only: a path evaluates these
    from notchflex.results.path import EquilibriumPath

FORMULAS: dict[str, Callable[[EquilibriumPath], Any]] = {}
"""Formulas by the name of the quantity; a path evaluates each once."""

_Formula = Callable[["EquilibriumPath"], Any]


def _formula(function: _Formula) -> _Formula:
    """Register a formula under the name of its function."""
    FORMULAS[function.__name__] = function
    return function


@_formula
def commanded_tension(path: EquilibriumPath) -> Float[np.ndarray, "s t"]:
    """Return the tensions of the load path."""
    return path.load.tension


@_formula
def commanded_stroke(path: EquilibriumPath) -> Float[np.ndarray, "s t"]:
    """Return the strokes of the load path."""
    return path.load.stroke


@_formula
def total_chord_angle(path: EquilibriumPath) -> Float[np.ndarray, " s"]:
    """Sum the chord angles (Liu 2022)."""
    return path.chord_angle.sum(axis=-1)


@_formula
def body_position(path: EquilibriumPath) -> Float[np.ndarray, "s bodies 3"]:
    """Turn the positions from the frame of the base into the world."""
    return _in_world(path, "body_position")


@_formula
def body_rotation(path: EquilibriumPath) -> Float[np.ndarray, "s bodies 3 3"]:
    """Turn the rotations from the frame of the base into the world."""
    turn, rotation = path.base_to_world, path.solver_quantity("body_rotation")
    return rotation if turn is None else turn @ rotation


@_formula
def tip_position(path: EquilibriumPath) -> Float[np.ndarray, "s 3"]:
    """Turn the tip from the frame of the base into the world."""
    return _in_world(path, "tip_position")


@_formula
def tip_rotation(path: EquilibriumPath) -> Float[np.ndarray, "s 3 3"]:
    """Return the rotation of the last body."""
    return path.body_rotation[..., -1, :, :]


@_formula
def base_force(path: EquilibriumPath) -> Float[np.ndarray, "s 3"]:
    """Turn the force from the frame of the base into the world."""
    return _in_world(path, "base_force")


@_formula
def base_moment(path: EquilibriumPath) -> Float[np.ndarray, "s 3"]:
    """Turn the moment from the frame of the base into the world."""
    return _in_world(path, "base_moment")


@_formula
def closed(path: EquilibriumPath) -> Bool[np.ndarray, "s n"]:
    """Compare contact force and gap: one of them is zero, but for rounding."""
    return path.contact_force > path.gap * np.asarray(path.chain.lip_stiffness)


@_formula
def front(path: EquilibriumPath) -> tuple[Int[np.ndarray, "s t"], Float[np.ndarray, "s t"]]:
    """Find the friction front along every tendon."""
    return friction_front(path.contact_log_ratio, path.contact_bound)


@_formula
def front_contact(path: EquilibriumPath) -> Int[np.ndarray, "s t"]:
    """Return contact m of the front."""
    return path.front[0]


@_formula
def front_eta(path: EquilibriumPath) -> Float[np.ndarray, "s t"]:
    """Return eta of the front."""
    return path.front[1]


@_formula
def tendon_work(path: EquilibriumPath) -> Float[np.ndarray, "s t"]:
    """Integrate the tension over the stroke."""
    return _accumulated(path, "tension", "stroke")


@_formula
def dissipation(path: EquilibriumPath) -> Float[np.ndarray, "s t contacts"]:
    """Integrate the tension drop at every contact over the slid length."""
    return _accumulated(path, "span_tension", "contact_slid")


@_formula
def converged(path: EquilibriumPath) -> Bool[np.ndarray, " s"]:
    """Return which steps were solved within the limits of friction law and strain modes."""
    names = ("friction_holds", "moment_error", "bend_possible")
    limits = (path.solver_quantity(name) for name in names)
    return np.asarray(path.run.converged) & believable(*limits)


@_formula
def residual(path: EquilibriumPath) -> Float[np.ndarray, " s"]:
    """Return the largest imbalance of the last attempt, scaled to an angle; NaN if not tried."""
    return np.asarray(path.run.residual)


@_formula
def iterations(path: EquilibriumPath) -> Int[np.ndarray, " s"]:
    """Return the number of Newton iterations."""
    return np.asarray(path.run.iterations)


@_formula
def reason(path: EquilibriumPath) -> list[str]:
    """Say why a step did not converge."""
    return [why_not(path, step) for step in range(len(path))]


@_formula
def smallest_eigenvalue(path: EquilibriumPath) -> Float[np.ndarray, " s"]:
    """Return the eigenvalue of the stiffness with the smallest real part."""
    return path.stability[0]


@_formula
def determinant_sign(path: EquilibriumPath) -> Float[np.ndarray, " s"]:
    """Return the sign of the determinant of the stiffness."""
    return path.stability[1]


@_formula
def stable(path: EquilibriumPath) -> Bool[np.ndarray, " s"]:
    """Test whether every eigenvalue of the stiffness has a positive real part."""
    return path.run.stable(path.commands)


def _in_world(path: EquilibriumPath, name: str) -> np.ndarray:
    """Turn vectors, as last axis, from the frame of the base into the world."""
    turn, vectors = path.base_to_world, path.solver_quantity(name)
    return vectors if turn is None else vectors @ turn.T


def _accumulated(path: EquilibriumPath, force: str, length: str) -> np.ndarray:
    """Integrate a force over a length by the trapezoid rule, from the state before the path on."""
    pairs: list[tuple[np.ndarray, ...]] = []
    for name in (force, length):
        after, first = path.solver_quantity(name), path.run.before(name)[None]
        earlier = np.broadcast_to(first, after.shape)
        if not path.each_from_rest:
            earlier = np.concatenate([first, after[:-1]])
        pairs.append((earlier, after))
    if force == "span_tension":  # what a contact takes is the drop from span to span
        pairs[0] = tuple(value[..., :-1] - value[..., 1:] for value in pairs[0])
    (force_before, force_after), (length_before, length_after) = pairs
    work = 0.5 * (force_before + force_after) * (length_after - length_before)
    return work if path.each_from_rest else np.cumsum(work, axis=0)


__all__ = ["FORMULAS"]
