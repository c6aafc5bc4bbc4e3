"""The posterior of a fit's constants by sampling (NUTS), with the likelihood of the fit itself.

Hoffman and Gelman 2014. The sampler sees the model through its misfit and slope alone, in the
units of the fit's own spread, so that its steps are of one size in every direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex._extras import need
from notchflex._jax import jax, jnp
from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import LEVEL
from notchflex.fit.estimation.problem import Progress

LEAST_DRAWS = 4
"""Fewer draws of a chain tell nothing of how unlike its halves are."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of the constants.

    Attributes:
        names: The constants.
        draws: Draws by chains, draws and constants, in the units of the robot file.
        effective: How many independent draws they are worth, by constant.
        unlike: How unlike the chains are (split R-hat, 1 where they agree), by constant.
        divergent: How many steps the sampler could not follow; more than a few are too many.
    """

    names: tuple[str, ...]
    draws: Float[np.ndarray, "c d k"]
    effective: dict[str, float]
    unlike: dict[str, float]
    divergent: int

    @property
    def means(self) -> dict[str, float]:
        """Mean of every constant."""
        return dict(zip(self.names, self.draws.mean(axis=(0, 1)).tolist(), strict=True))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of every constant."""
        return dict(zip(self.names, self.draws.std(axis=(0, 1)).tolist(), strict=True))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Where the middle 95 % of the draws of every constant lie."""
        tail = 50.0 * (1.0 - LEVEL)
        ends = np.percentile(self.draws, [tail, 100.0 - tail], axis=(0, 1))
        every = zip(self.names, *ends.tolist(), strict=True)
        return {name: (lower, upper) for name, lower, upper in every}


def sample_posterior(
    found: Calibration,
    *,
    draws: int = 500,
    warm_up: int = 100,
    chains: int = 2,
    seed: int = 0,
    progress: Progress | None = None,
) -> Posterior:
    """Draw constants as probable as the measurements make them.

    Every value within the constants' limits is taken for equally probable beforehand, but for
    their priors. Where the model misses more than noise explains, the misfit counts less, as it
    does in the fit's intervals; where whole pulls differ by more than their rows do, the draws are
    spread about the fit by as much (the adjustment of Shaby 2014).

    Args:
        found: A fit by `LeastSquares`.
        draws: Draws of each chain.
        warm_up: Steps before them, to find the sampler's own step.
        chains: How many chains, one after the other.
        seed: Of the draws.
        progress: Called with what is done, how much of it, and how much there is.

    Returns:
        The draws, and how far to trust them.

    Raises:
        InputError: The objective is no likelihood, the numbers are not above 0, or numpyro is not
            installed (extra `bayes`).
    """
    if not found.problem.objective.is_likelihood:
        raise InputError.UNSUPPORTED(
            "a posterior needs LeastSquares(); other objectives are no likelihoods"
        )
    if draws < LEAST_DRAWS or chains < 1 or warm_up < 0:
        raise InputError.OUT_OF_RANGE(
            f"draws must be {LEAST_DRAWS} or more (the chain's halves are compared), chains 1 or "
            f"more, warm_up 0 or more; got {draws}, {chains} and {warm_up}"
        )
    need("numpyro", "bayes", "a posterior")
    from numpyro import diagnostics, infer

    target = _Target(found)
    # The target has about unit spread in every direction: there is no mass matrix to be found, and
    # a few steps of this size go from one side to the other.
    kernel = infer.NUTS(
        potential_fn=target.potential, step_size=0.7, adapt_mass_matrix=False, max_tree_depth=4
    )
    every: list[np.ndarray] = []
    divergent = 0
    for chain in range(chains):
        sampler = infer.MCMC(
            kernel, num_warmup=warm_up, num_samples=draws, num_chains=1, progress_bar=False
        )
        key = jax.random.PRNGKey(seed + chain)
        start = 0.5 * jax.random.normal(key, (len(found.names),))
        sampler.run(key, init_params=start, extra_fields=("diverging",))
        every.append(np.stack([target.spread(np.asarray(one)) for one in sampler.get_samples()]))
        divergent += int(np.sum(sampler.get_extra_fields()["diverging"]))
        if progress is not None:
            progress("drawing", chain + 1, chains)
    told = np.stack(every)
    effective = {
        name: float(diagnostics.effective_sample_size(told[..., number]))
        for number, name in enumerate(found.names)
    }
    unlike = {
        name: float(diagnostics.split_gelman_rubin(told[..., number]))
        for number, name in enumerate(found.names)
    }
    return Posterior(found.names, told, effective, unlike, divergent)


class _Target:
    """Minus the logarithm of the posterior, in the units of the fit's own spread."""

    def __init__(self, found: Calibration) -> None:
        if found.tells_no_noise:
            raise InputError.TOO_FEW_DATA(
                "nothing tells the noise: as many constants were fitted as numbers measured; "
                "measure more, or give standard deviations"
            )
        covariance = found.covariance_by_rows
        self._wider = found.by_pulls.wider
        if not np.isfinite(covariance).all():
            raise InputError.TOO_FEW_DATA(
                "the data cannot tell some of the constants; fit only the others"
            )
        self._problem, self._best = found.problem, found.best.values
        self._spread = np.linalg.cholesky(covariance)
        self._temper = found.widened**2
        shape = jax.ShapeDtypeStruct((1 + len(self._best),), float)

        @jax.custom_vjp
        def potential(place: jax.Array) -> jax.Array:
            return jax.pure_callback(self._at, shape, place, vmap_method="sequential")[0]

        def forward(place: jax.Array) -> tuple[jax.Array, jax.Array]:
            both = jax.pure_callback(self._at, shape, place, vmap_method="sequential")
            return both[0], both[1:]

        def backward(slope: jax.Array, cotangent: jax.Array) -> tuple[jax.Array]:
            return (jnp.where(jnp.isfinite(slope), slope, 0.0) * cotangent,)

        potential.defvjp(forward, backward)
        self.potential = potential

    def values(self, place: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Constants at a place of the sampler."""
        return self._best + self._spread @ place

    def spread(self, place: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Constants of a draw, farther from the fit where whole pulls say so."""
        values = self._best + self._wider * (self._spread @ place)
        return np.clip(values, self._problem.lower, self._problem.upper)

    def _at(self, place: np.ndarray) -> np.ndarray:
        values = self.values(np.asarray(place, float))
        inside = (values >= self._problem.lower).all() and (values <= self._problem.upper).all()
        cost = self._problem(values) if inside else None
        if cost is None:
            return np.concatenate([[np.inf], np.zeros(len(values))])
        return np.concatenate([[cost.value], self._spread.T @ cost.gradient]) / self._temper


__all__ = ["LEAST_DRAWS", "Posterior", "sample_posterior"]
