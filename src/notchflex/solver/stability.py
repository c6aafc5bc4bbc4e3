"""Is an equilibrium stable? It is where every eigenvalue of its stiffness has a positive real part.

Friction makes the stiffness unsymmetric. Where its symmetric part is positive definite the
eigenvalues have positive real parts; that is told at a fraction of their cost. The converse does
not hold (a stuck contact adds the product of two different vectors), so elsewhere the eigenvalues
themselves are found.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from notchflex.loads.command import Command
from notchflex.solver.continuation import SolverState
from notchflex.solver.held_stiffness import held_stiffness
from notchflex.solver.programs.prepare import PreparedChain


def stable(
    prepared: PreparedChain, commands: Command, solved: SolverState
) -> Bool[np.ndarray, " s"]:
    """Whether every state is stable, contacts that stick held."""
    told: list[bool] = []
    for stiffness, signs in held_stiffness(prepared, commands, solved):
        told += [
            sign > 0.0 and bool(_positive_definite(one) or _smallest(one) > 0.0)
            for one, sign in zip(stiffness, signs, strict=True)
        ]
    return np.array(told, bool)


def stability(
    prepared: PreparedChain, commands: Command, solved: SolverState
) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, " s"]]:
    """Smallest real part of the stiffness's eigenvalues and sign of the determinant, by state."""
    smallest: list[float] = []
    signs: list[float] = []
    for stiffness, sign in held_stiffness(prepared, commands, solved):
        smallest += [_smallest(one) for one in stiffness]
        signs += sign.tolist()
    return np.array(smallest), np.array(signs)


def _positive_definite(stiffness: Float[np.ndarray, "m m"]) -> bool:
    """Whether the symmetric part is positive definite."""
    try:
        np.linalg.cholesky(stiffness + stiffness.T)
    except np.linalg.LinAlgError:
        return False
    return True


def _smallest(stiffness: Float[np.ndarray, "m m"]) -> float:
    """Smallest real part of the eigenvalues; NaN where the state is none."""
    if not np.isfinite(stiffness).all():
        return float("nan")
    return float(np.real(np.linalg.eigvals(stiffness)).min())


__all__ = ["stability", "stable"]
