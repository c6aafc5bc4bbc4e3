"""Tests of residuals: patterns that noise does not make, and the constants that would explain them.

The fit at its minimum is a linear regression: rows are the measured numbers over their noise, the
deviations from the drawing and the priors; columns are the constants, these deviations and, where
two or more pulls were measured, a shift of each pull. All tests are of what this leaves, and so
count the numbers fitted. They take the noise from the residuals themselves, and hold for few rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import orth
from scipy.stats import f, norm

from notchflex import InputError
from notchflex.fit.calibration import Calibration
from notchflex.fit.constants import SENSOR, Unknown, numbers_set, unknowns
from notchflex.fit.measurements.measurements import NOTCH_ANGLES
from notchflex.fit.residuals import Samples, deviated
from notchflex.robot.part import unit_of
from notchflex.support import fields_of

# Probability below which noise does not make a pattern; of constants for all of them together.
_UNLIKELY = 0.01
# What remains of a column that the others nearly contain, as a part of it, is rounding.
_ROUNDING = 1e-4
# With fewer degrees of freedom nothing is tested.
_FEWEST = 5
# Of no effect on what is measured, or none before a notch is destroyed.
_NO_CANDIDATES = (
    "direction_deg", "uncut_length", "poisson_ratio", "density", "allowed_strain",
    "plastic_modulus", "plastic_strain", "plastic_exponent",
)  # fmt: skip


class Missing(NamedTuple):
    """A constant that was not fitted, and what a fit of it would gain.

    Attributes:
        name: Name of the constant.
        gain: By how much twice the misfit would fall, with the model linearised.
        share: The same as a part of twice the misfit.
        chance: Probability of such a gain if the constant is right as it is.
    """

    name: str
    gain: float
    share: float
    chance: float


@dataclass(frozen=True)
class ResidualTests:
    """Tests of the residuals of a fit.

    Attributes:
        runs: Probability that residuals of neighbouring loads are as alike (Moran's I of a
            regression, Cliff and Ord 1972); NaN if too few follow each other.
        notches: Probability of such a trend over the notches, and of its change with the load (F
            test); NaN if fewer than three notches were measured.
        missing: What fits of other constants would gain, the most likely one first (score tests,
            Rao 1948).
    """

    runs: float
    notches: float
    missing: tuple[Missing, ...]

    @cached_property
    def rejected(self) -> tuple[str, ...]:
        """Which of "runs", "notches" and "missing" noise does not explain."""
        chance = {"runs": self.runs, "notches": self.notches}
        if self.missing:
            chance["missing"] = len(self.missing) * self.missing[0].chance
        return tuple(name for name, value in chance.items() if value < _UNLIKELY)


def residual_tests(found: Calibration) -> ResidualTests | None:
    """Test the residuals of a fit; None if there are too few, or it is of no likelihood.

    Args:
        found: The fit.
    """
    if not found.is_likelihood or found.tells_no_noise:
        return None
    regression = _Regression.of(found)
    if regression.freedom < _FEWEST:
        return None
    residuals, noise = found.residuals, found.noise.deviation[:, None]
    of_notches = residuals.are(*NOTCH_ANGLES)
    part = np.where(of_notches, residuals.part, 0)
    notches = float("nan")
    if len(np.unique(part)) > 2:
        centred = np.where(of_notches, part - 0.5 * part.max(), 0.0)
        trend = np.stack([centred, centred * _load(found)], axis=1)
        notches = regression.chance(trend / noise)[-1]
    samples = found.problem.samples
    robots = {
        label: deviated(robot, label, found.drawing) for label, robot in samples.robots.items()
    }
    data = {label: samples.of_robot(label) for label in robots}
    as_found = Samples.of(robots, data, found.problem.unknowns, found.settings)
    tests = [
        Missing(one.name, *regression.chance(slopes[:, None] / noise))
        for one in _candidates(as_found)
        if (slopes := as_found.slopes_of(one, found.estimate)) is not None
    ]
    known = [test for test in tests if np.isfinite(test.chance)]
    known.sort(key=lambda test: test.chance)
    return ResidualTests(regression.runs(*_neighbours(found)), notches, tuple(known))


class _Regression(NamedTuple):
    """What a fit leaves, orthogonal to `basis`."""

    left: Float[np.ndarray, " n"]
    basis: Float[np.ndarray, "n q"]

    @classmethod
    def of(cls, calibration: Calibration) -> _Regression:
        residuals, noise = calibration.residuals, calibration.noise.deviation
        priors = [
            (number, value - one.prior[0], one.prior[1])
            for number, (one, value) in enumerate(
                zip(calibration.problem.varied, calibration.best.values, strict=True)
            )
            if one.prior is not None
        ]
        constants, off, sizes = np.reshape(priors, (-1, 3)).T
        groups = np.stack([residuals.pull, residuals.quantity])
        group = np.unique(groups, axis=1, return_inverse=True)[1].ravel()
        several = len(np.unique(residuals.pull)) > 1
        shifts = np.eye(group.max() + 1)[group] if several else np.zeros((len(group), 0))
        columns = np.concatenate([residuals.slopes, shifts], axis=1) / noise[:, None]
        below = np.eye(columns.shape[1])[constants.astype(int)] / sizes[:, None]
        most = calibration.huber or np.inf
        scaled = np.clip(residuals.values / noise, -most, most)
        basis = _orthonormal(np.concatenate([columns, below]))
        left = np.concatenate([np.where(np.isfinite(noise), scaled, 0.0), off / sizes])
        return cls(left - basis @ (basis.T @ left), basis)

    @property
    def freedom(self) -> int:
        rows = self.basis.any(axis=1) | (self.left != 0.0)
        return int(rows.sum()) - self.basis.shape[1]

    def chance(self, columns: Float[np.ndarray, "r c"]) -> tuple[float, float, float]:
        """Gain of more columns, as a part of all too, and its probability by chance (F test)."""
        more = np.pad(columns, ((0, len(self.left) - len(columns)), (0, 0)))
        rest = more
        for _ in range(2):  # once more for what rounding left
            rest = rest - self.basis @ (self.basis.T @ rest)
        size = np.linalg.norm(more, axis=0)
        basis = _orthonormal(rest[:, np.linalg.norm(rest, axis=0) > _ROUNDING * size])
        count, all_left = basis.shape[1], float(self.left @ self.left)
        if not count or not all_left:
            return 0.0, 0.0, float("nan")
        gain = float(np.sum((basis.T @ self.left) ** 2))
        freedom = self.freedom - count
        ratio = (gain / count) / (max(all_left - gain, 1e-300) / freedom)
        return gain, gain / all_left, float(f.sf(ratio, count, freedom))

    def runs(self, first: np.ndarray, second: np.ndarray) -> float:
        """Probability that neighbours are as alike by chance."""
        freedom, basis = self.freedom, self.basis
        if len(first) < _FEWEST or not self.left.any():
            return float("nan")
        alike = float(self.left[first] @ self.left[second]) / float(self.left @ self.left)
        beside = np.zeros_like(basis)  # neighbours of the rows of the basis
        np.add.at(beside, first, 0.5 * basis[second])
        np.add.at(beside, second, 0.5 * basis[first])
        within = basis.T @ beside
        trace = -float(np.trace(within))
        squares = 0.5 * len(first) - 2.0 * float(np.sum(beside**2)) + float(np.sum(within**2))
        variance = 2.0 * (freedom * squares - trace**2) / (freedom**2 * (freedom + 2.0))
        return float(norm.sf((alike - trace / freedom) / np.sqrt(variance)))


def _orthonormal(columns: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "n q"]:
    """Basis of what columns span."""
    size = np.linalg.norm(columns, axis=0)
    used = columns[:, size > 0.0] / size[size > 0.0]
    return orth(used, rcond=1e-9) if used.size else used


def _load(calibration: Calibration) -> Float[np.ndarray, " r"]:
    """The command of every measured number, 1 at the largest."""
    residuals, load = calibration.residuals, np.zeros(len(calibration.residuals))
    for number, sample in enumerate(calibration.problem.samples.every):
        command, of_sample = sample.measured.command, residuals.sample == number
        command = command / max(np.abs(command).max(), 1e-300)
        load[of_sample] = command[residuals.row[of_sample]]
    return load


def _neighbours(calibration: Calibration) -> tuple[np.ndarray, np.ndarray]:
    """Numbers whose loads follow each other in a pull: in its rows, or by load if from rest."""
    residuals = calibration.residuals
    from_rest = np.array(
        [sample.measured.from_rest for sample in calibration.problem.samples.every]
    )
    along = np.where(from_rest[residuals.sample], _load(calibration), residuals.row)
    series = (residuals.sample, residuals.quantity, residuals.part, residuals.pull)
    order = np.lexsort((along, *series))
    order = order[np.isfinite(calibration.noise.deviation[order])]
    labels = np.stack(series, axis=1)[order]
    follow = (labels[1:] == labels[:-1]).all(axis=1)
    return order[:-1][follow], order[1:][follow]


def _candidates(samples: Samples) -> list[Unknown]:
    """All constants that could be fitted besides."""
    robots = samples.robots
    names = ["tube.inner_diameter"]
    for robot in robots.values():
        for part, prefix, units in (
            *((notch, "offset:notch", ("mm", "deg")) for notch in robot.notch),
            (robot.material, "material", ("MPa", "")),
            (robot.friction, "friction", ("",)),
        ):
            for name, field in fields_of(type(part)).items():
                if unit_of(field) in units and name not in _NO_CANDIDATES:
                    names.append(f"{prefix}.{name}")
    fitted = numbers_set(robots, samples.unknowns)
    candidates: list[Unknown] = []
    for name in dict.fromkeys([*names, *SENSOR]):
        try:
            constant = unknowns(robots, name)
            if not fitted & numbers_set(robots, constant):
                candidates += constant
        except (InputError, ValueError):  # no number, 0, or not in all robots
            continue
    return candidates
