"""The posterior of a fit's constants by sampling (NUTS), with the likelihood of the fit itself.

Hoffman and Gelman 2014. The sampler sees the model through its misfit and gradient alone, in the
units of the fit's own spread, so that its steps are of one size in every direction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from notchflex import InputError
from notchflex._jax import jax, jnp
from notchflex.fit.calibration import LEVEL, Calibration
from notchflex.fit.search import Progress
from notchflex.support import Displayed, Summary, frame, need, short

if TYPE_CHECKING:
    from xarray import Dataset

MIN_DRAWS = 4
"""With fewer draws the halves of a chain cannot be compared."""


@dataclass(frozen=True, eq=False, repr=False)
class Posterior(Displayed):
    """Draws of the constants.

    Attributes:
        names: The constants.
        draws: Draws by chains, draws and constants, in the units of the robot file.
        effective: Number of independent draws they are worth, by constant.
        r_hat: Split R-hat, 1 if the chains agree, by constant.
        divergent: Number of divergent steps of the sampler; more than a few are too many.
    """

    names: tuple[str, ...]
    draws: Float[np.ndarray, "c d k"]
    effective: dict[str, float]
    r_hat: dict[str, float]
    divergent: int

    def _summary(self) -> Summary:
        chains, draws, _ = self.draws.shape
        rows = [
            (name, f"{short(self.means[name])}, 95 % in [{short(low)}; {short(high)}]")
            for name, (low, high) in self.intervals.items()
        ]
        rows.append(("divergent steps", str(self.divergent)))
        return Summary(f"Posterior of {chains} chains of {draws} draws", rows)

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
        """Interval of the middle 95 % of the draws of every constant."""
        tail = 50.0 * (1.0 - LEVEL)
        lower, upper = np.percentile(self.draws, [tail, 100.0 - tail], axis=(0, 1)).tolist()
        return dict(zip(self.names, zip(lower, upper, strict=True), strict=True))

    def to_xarray(self) -> Dataset:
        """Return the draws with the axes `chain` and `draw`, as ArviZ takes them.

        `arviz.summary(posterior.to_xarray())` is its table; its plots take the same.

        Raises:
            InputError: xarray is not installed.
        """
        need("xarray", "data", "to_xarray")
        import xarray

        return xarray.Dataset(
            {name: (("chain", "draw"), self.draws[..., i]) for i, name in enumerate(self.names)},
            coords={"chain": range(len(self.draws)), "draw": range(self.draws.shape[1])},
            attrs={"divergent": self.divergent},
        )

    def to_dataframe(self, library: str = "polars") -> Any:
        """Return a row for each draw: chain and draw, from 0, and the constants.

        Args:
            library: "polars" or "pandas".

        Raises:
            InputError: The library is not installed, or there is no such library.
        """
        chain, draw = np.indices(self.draws.shape[:2])
        constants = dict(zip(self.names, np.moveaxis(self.draws, -1, 0), strict=True))
        columns = {"chain": chain, "draw": draw, **constants}
        return frame({name: one.ravel() for name, one in columns.items()}, library)


def sample_posterior(
    found: Calibration,
    *,
    draws: int = 500,
    warm_up: int = 100,
    chains: int = 2,
    seed: int = 0,
    progress: Progress | None = None,
) -> Posterior:
    """Draw constants from their posterior.

    The prior is uniform within the constants' limits, but for priors that were given. What deviates
    from the drawing follows the constants as it most likely does (Laplace). If the model misses
    more than noise explains, the misfit counts less, as in the fit's intervals; if whole pulls
    differ by more than their rows do, the draws are spread about the fit by as much (the adjustment
    of Shaby 2014).

    Args:
        found: A fit by `LeastSquares`.
        draws: Draws of each chain.
        warm_up: Steps before them, which adapt the step size.
        chains: Number of chains, one after the other.
        seed: Seed of the draws.
        progress: Called with the name of the task, how much of it is done, and how much there is.

    Raises:
        InputError: The objective is not a likelihood, the data are too few, a number is too small,
            or numpyro is not installed (extra `bayes`).
    """
    _check(found)
    if draws < MIN_DRAWS or chains < 1 or warm_up < 0:
        raise InputError.OUT_OF_RANGE(
            f"draws must be {MIN_DRAWS} or more (the chain's halves are compared), chains 1 or "
            f"more, warm_up 0 or more; got {draws}, {chains} and {warm_up}"
        )
    need("numpyro", "bayes", "a posterior")
    from numpyro import diagnostics, infer

    # The target has about unit spread in every direction: no mass matrix has to be adapted, and a
    # few steps of this size go from one side to the other.
    kernel = infer.NUTS(
        potential_fn=_potential(found),
        step_size=0.7,
        adapt_mass_matrix=False,
        max_tree_depth=4,
    )
    positions: list[np.ndarray] = []
    divergent = 0
    for chain in range(chains):
        sampler = infer.MCMC(
            kernel, num_warmup=warm_up, num_samples=draws, num_chains=1, progress_bar=False
        )
        key = jax.random.PRNGKey(seed + chain)
        start = 0.5 * jax.random.normal(key, (len(found.names),))
        sampler.run(key, init_params=start, extra_fields=("diverging",))
        positions.append(np.asarray(sampler.get_samples()))
        divergent += int(np.sum(sampler.get_extra_fields()["diverging"]))
        if progress is not None:
            progress("drawing", chain + 1, chains)
    # Farther from the fit if whole pulls differ.
    moved = np.stack(positions) @ _spread(found)[: len(found.names)].T
    limits = [(unknown.lower, unknown.upper) for unknown in found.problem.unknowns]
    values = np.clip(found.estimate + found.by_pulls.wider * moved, *np.transpose(limits))
    effective, r_hat = (
        {name: float(of(values[..., number])) for number, name in enumerate(found.names)}
        for of in (diagnostics.effective_sample_size, diagnostics.split_gelman_rubin)
    )
    return Posterior(found.names, values, effective, r_hat, divergent)


def _check(calibration: Calibration) -> None:
    if not calibration.is_likelihood:
        raise InputError.UNSUPPORTED(
            "a posterior needs LeastSquares(); other objectives are not likelihoods"
        )
    if calibration.tells_no_noise:
        raise InputError.TOO_FEW_DATA(
            "the noise is unknown: as many constants were fitted as numbers measured; "
            "measure more, or give standard deviations"
        )
    if not np.isfinite(calibration.covariance_by_rows).all():
        raise InputError.TOO_FEW_DATA(
            "the data do not determine some of the constants; fit only the others"
        )


def _spread(calibration: Calibration) -> Float[np.ndarray, "n k"]:
    """Root of the covariance of the constants; what deviates from the drawing follows them."""
    root = np.linalg.cholesky(calibration.covariance_by_rows)
    return np.linalg.solve(root, calibration.covariance_of_all[: len(root)]).T


def _potential(calibration: Calibration) -> Callable[[jax.Array], jax.Array]:
    """Minus the logarithm of the posterior, in the units of the fit's own spread."""
    problem, best = calibration.problem, calibration.best.values
    spread, count = _spread(calibration), len(calibration.names)
    shape, temper = jax.ShapeDtypeStruct((1 + count,), float), calibration.widened**2

    def value_and_gradient(position: np.ndarray) -> np.ndarray:
        values = best + spread @ np.asarray(position, float)
        inside = (values >= problem.lower).all() and (values <= problem.upper).all()
        cost = problem(values) if inside else None
        if cost is None:
            return np.concatenate([[np.inf], np.zeros(count)])
        # The likeliest deviations are a step of Newton's method away.
        gradient, curvature = cost.gradient, cost.curvature
        columns = np.column_stack([curvature[count:, :count], gradient[count:]])
        follow = np.linalg.solve(curvature[count:, count:], columns).T @ gradient[count:]
        slopes = spread[:count].T @ (gradient[:count] - follow[:-1])
        return np.concatenate([[cost.value - 0.5 * follow[-1]], slopes]) / temper

    def forward(position: jax.Array) -> tuple[jax.Array, jax.Array]:
        both = jax.pure_callback(value_and_gradient, shape, position, vmap_method="sequential")
        return both[0], both[1:]

    def backward(gradient: jax.Array, cotangent: jax.Array) -> tuple[jax.Array]:
        return (jnp.where(jnp.isfinite(gradient), gradient, 0.0) * cotangent,)

    potential = jax.custom_vjp(lambda position: forward(position)[0])
    potential.defvjp(forward, backward)
    return potential
