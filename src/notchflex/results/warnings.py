"""What a user should know about a result before trusting it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

MOMENT_ERROR = 0.01
"""A larger part of the bending moment than this that the strain modes miss is warned of."""


def path_warnings(path: EquilibriumPath) -> list[str]:
    """Return one sentence for each thing about a path that asks for care.

    Args:
        path: Solved path.

    Returns:
        Sentences on strains beyond what the material is allowed or its law is known for, and on
        unstable equilibria, and on strain modes that do not serve; none if there is nothing to
        say.
    """
    return [
        *_allowed_strain(path),
        *_plastic_strain(path),
        *_unstable(path),
        *_coarse(path),
    ]


def _allowed_strain(path: EquilibriumPath) -> Iterator[str]:
    allowed = path.robot.material.allowed_strain
    if allowed is None:
        return
    yield from _first_beyond(
        path,
        path.peak_strain,
        allowed,
        f"the peak strain passes the allowed strain of {100 * allowed:.3g} %",
        "the notch may be damaged there",
    )


def _plastic_strain(path: EquilibriumPath) -> Iterator[str]:
    limit = getattr(path.robot.material, "plastic_strain", None)
    if limit is None:
        return
    # The law is fitted in the outer strain of eq. 16, so that is what tells its branch.
    yield from _first_beyond(
        path,
        path.outer_strain,
        limit,
        f"the outer strain passes {100 * limit:.3g} %, where the plastic branch begins",
        "that branch is a guess, and a real notch would stay bent",
    )


def _first_beyond(
    path: EquilibriumPath, strain: NDArray[np.float64], limit: float, what: str, so: str
) -> Iterator[str]:
    size = np.where(np.asarray(path.converged)[:, None], np.abs(strain), -np.inf)
    beyond = size > limit
    if not beyond.any():
        return
    notches = np.flatnonzero(beyond.any(axis=0))
    step = int(np.flatnonzero(beyond.any(axis=1))[0])
    where = ", ".join(str(notch + 1) for notch in notches)
    plural = "es" if len(notches) > 1 else ""
    yield (
        f"{what} in notch{plural} {where}, first at step {step + 1} ({_load(path, step)}), "
        f"at most {100 * size.max():.3g} %: {so}."
    )


def _unstable(path: EquilibriumPath) -> Iterator[str]:
    bad = np.flatnonzero(np.asarray(path.converged) & ~np.asarray(path.stable))
    if len(bad):
        plural = "s are" if len(bad) > 1 else " is"
        yield (
            f"{len(bad)} step{plural} unstable, first step {bad[0] + 1} ({_load(path, bad[0])}): "
            "a real robot would snap to another shape."
        )


def _coarse(path: EquilibriumPath) -> Iterator[str]:
    error = np.where(np.asarray(path.converged), path.moment_error, -np.inf)
    if not (error > MOMENT_ERROR).any():
        return
    step = int(np.argmax(error))
    # Not at the head of the file: what only reads this table needs no solver.
    from notchflex.mechanics.flexure import MOST_REFINEMENT

    refinement = path.chain.refinement
    remedy = (
        f"simulate with --refinement {refinement + 1} (in Python refinement={refinement + 1}) "
        "and see what changes"
        if refinement < MOST_REFINEMENT
        else "there is no finer --refinement, so take the result with care"
    )
    yield (
        f"the strain modes miss the bending moment by up to {100 * error[step]:.2g} % of the "
        f"largest one, at step {step + 1} ({_load(path, step)}): {remedy}."
    )


def _load(path: EquilibriumPath, step: int) -> str:
    return ", ".join(f"{value:.4g}" for value in path.tension[step]) + " N"
