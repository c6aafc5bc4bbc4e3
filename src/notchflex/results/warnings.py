"""Warnings on the validity of a result."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from notchflex.errors import Failure
from notchflex.mechanics.chain import unchecked_dimensions

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

MOMENT_ERROR = 0.01
"""Relative error of the bending moment of the strain modes above which a path has a warning."""


def path_warnings(path: EquilibriumPath) -> list[str]:
    """Return one sentence for each reason to doubt a path.

    Args:
        path: Solved path.

    Returns:
        Sentences on dimensions outside the range that was checked, on strains beyond what the
        material is allowed or its law is known for, on unstable equilibria, and on too few strain
        modes; none if there is nothing to warn of.
    """
    outside = unchecked_dimensions(path.robot)
    return [*outside, *_snaps(path), *_strains(path), *_unstable(path), *_coarse(path)]


def _snaps(path: EquilibriumPath) -> Iterator[str]:
    """Warn of notches that pass a limit point under tension."""
    for what, side in (("snaps shut", 1), ("snaps open", -1)):
        steps, notches = np.nonzero(path.snap == side)
        if len(steps):
            names = ", ".join(str(notch + 1) for notch in dict.fromkeys(notches.tolist()))
            yield (
                f"notch {names} {what}, first at step {steps[0] + 1} "
                f"({_load(path, int(steps[0]))}): it passes a limit point, where it softens as it "
                "closes, so that no shape between is in equilibrium under this tension; prescribe "
                "the stroke to pass through the shapes between."
            )


def _strains(path: EquilibriumPath) -> Iterator[str]:
    material = path.robot.material
    # The law is fitted in the outer strain of eq. 16, which therefore selects its branch.
    for strain, limit, what, so in (
        (
            "peak strain",
            material.allowed_strain,
            "the allowed strain of {:.3g} %",
            "the notch may be damaged there",
        ),
        (
            "outer strain",
            getattr(material, "plastic_strain", None),
            "{:.3g} %, where the plastic branch begins,",
            "that branch is a guess, and a real notch would stay bent",
        ),
    ):
        if limit is None:
            continue
        values = getattr(path, strain.replace(" ", "_"))
        size = np.where(np.asarray(path.converged)[:, None], np.abs(values), -np.inf)
        beyond = size > limit
        if not beyond.any():
            continue
        notches = [str(notch + 1) for notch in np.flatnonzero(beyond.any(axis=0))]
        step = int(np.flatnonzero(beyond.any(axis=1))[0])
        yield (
            f"the {strain} passes {what.format(100 * limit)} in notch"
            f"{'es' if len(notches) > 1 else ''} {', '.join(notches)}, first at step {step + 1} "
            f"({_load(path, step)}), at most {100 * size.max():.3g} %: {so}."
        )


def _unstable(path: EquilibriumPath) -> Iterator[str]:
    bad = np.flatnonzero(np.asarray(path.converged) & ~np.asarray(path.stable))
    fixed = path.determinant_sign[bad] != 0.0 if len(bad) else np.zeros(0, bool)
    snaps, many = "a real robot would snap to another shape", Failure.INDETERMINATE_TENSIONS
    for steps, what, why in (
        (bad[fixed], "unstable", snaps),
        (bad[~fixed], "not determined", f"{many.text}; {many.remedy}"),
    ):
        if len(steps):
            plural = "s are" if len(steps) > 1 else " is"
            first = f"first step {steps[0] + 1} ({_load(path, steps[0])})"
            yield f"{len(steps)} step{plural} {what}, {first}: {why}."


def _coarse(path: EquilibriumPath) -> Iterator[str]:
    error = np.where(np.asarray(path.converged), path.moment_error, -np.inf)
    if not (error > MOMENT_ERROR).any():
        return
    step = int(np.argmax(error))
    # Not at the head of the file: what only reads this table needs no solver.
    from notchflex.mechanics.flexure import MAX_REFINEMENT

    refinement = path.chain.refinement
    remedy = (
        f"simulate with --refinement {refinement + 1} (in Python refinement={refinement + 1}) "
        "and see what changes"
        if refinement < MAX_REFINEMENT
        else "there is no finer --refinement, so take the result with care"
    )
    yield (
        f"the strain modes miss the bending moment by up to {100 * error[step]:.2g} % of the "
        f"largest one, at step {step + 1} ({_load(path, step)}): {remedy}."
    )


def _load(path: EquilibriumPath, step: int) -> str:
    return ", ".join(f"{value:.4g}" for value in path.tension[step]) + " N"
