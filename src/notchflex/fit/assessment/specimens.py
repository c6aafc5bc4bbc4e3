"""Constants of one specimen: prior from other specimens, update by one photograph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.fit import by_label, fitted
from notchflex.fit.estimation.objective import LeastSquares
from notchflex.fit.estimation.problem import FitProblem
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.constant import Constant
from notchflex.fit.model.constants import RobotNumber, Unknown, unknowns
from notchflex.fit.model.residuals import ANGLES
from notchflex.fit.model.samples import Samples
from notchflex.robot import Robot

_ANGLES = [OBSERVED.index(name) for name in ANGLES]


@dataclass(frozen=True, eq=False)
class Specimen:
    """A robot of a fitted kind whose own constants follow from few rows measured of it.

    Attributes:
        found: The fit of its own constants to these rows and to what was known before.
        before: Mean and standard deviation of each constant as known before.
        gain: Width of its total angle at these rows after over before; 1 gains nothing.
    """

    found: Calibration
    before: dict[str, tuple[float, float]]
    gain: float

    @property
    def values(self) -> dict[str, float]:
        """Its own constants."""
        return self.found.values

    @property
    def robot(self) -> Robot:
        """The robot with the constants of all and its own; without those of the sensor."""
        return next(iter(self.found.robots.values()))


def update_specimen(
    found: Calibration,
    robot: Robot,
    measured: Measurements,
    constants: str | Sequence[str | Constant] = "sensor.force_factor",
) -> Specimen:
    """Find the constants of one more specimen from few rows, such as one photograph.

    The constants that all robots of `found` share stay as fitted. Of its own constants the prior
    is known (that of `found`, or of a `Constant` given here), and how the other specimens scatter
    about it; the noise is what `found` misses of its measurements.

    Args:
        found: A fit of other robots of the kind, some of whose constants are `each:` robot's.
        robot: The robot as drawn.
        measured: What was measured of it, one row or more.
        constants: Its own constants, by name without a label.

    Returns:
        Its constants, with their intervals after the update.

    Raises:
        InputError: Nothing is known of a constant before, or the model has no solution.

    Example:
        >>> from notchflex import load_robot, pull
        >>> from notchflex.fit import Constant, calibrate, simulate_measurements
        >>> wrist, noise = load_robot("pacheco2021-a"), {"notch_angle": 0.01}
        >>> seen = simulate_measurements(wrist, pull(0.2, 1.4, steps=7), deviation=noise)
        >>> found = calibrate(wrist, seen, "friction.coefficient", starts=1, intervals=False)
        >>> own = Constant("sensor.force_factor", prior=(1.0, 0.05))
        >>> photograph = simulate_measurements(wrist, pull(1.2, 1.2, steps=1), deviation=noise)
        >>> update_specimen(found, wrist, photograph, own).gain < 0.5
        True
    """
    ((label, robot),) = by_label(robot).items()
    if not isinstance(measured, Measurements):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            "a photograph is Measurements of one row or more; `measurements.taken([row])` takes one"
        )
    names = (constants,) if isinstance(constants, str | Constant) else constants
    given = [one if isinstance(one, Constant) else Constant(one) for one in names]
    own = [
        replace(one, prior=prior_of(one, found))
        for one in unknowns({label: robot}, [_with_prior(one, found) for one in given])
    ]
    return updated(found, label, robot, measured, own)


def _with_prior(constant: Constant, calibration: Calibration) -> Constant:
    """The constant with the prior that the fit has for it, if it has none itself."""
    priors = (one.prior for one in calibration.problem.unknowns if one.path == constant.name)
    return constant if constant.prior else replace(constant, prior=next(priors, None))


def updated(
    calibration: Calibration,
    label: str,
    robot: Robot,
    measured: Measurements,
    own: Sequence[Unknown],
) -> Specimen:
    """Fit constants of a specimen, which have priors, to rows; the shared ones stay as found."""
    shared = [(one.of(label, robot), value) for one, value in _values(calibration) if one.shared]
    # A shared constant sets numbers that those of the specimen leave as they are.
    held = [
        RobotNumber(one.label, one.path, one.base + one.slope * value, 0.0)
        for unknown, value in shared
        for one in unknown.sets
    ]
    twice = {one[:2] for one in held} & {one[:2] for each in own for one in each.sets}
    if not own or twice:
        raise InputError.CONFLICT(
            f"{sorted(twice)[0][1] if twice else 'no constant'} is of one specimen, and all the "
            "others have it in common; name constants such as sensor.force_factor"
        )
    constants = (replace(own[0], sets=(*own[0].sets, *held)), *own[1:])
    rows = replace(measured, deviation=_missed(calibration, measured))
    samples = Samples.of({label: robot}, {label: [rows]}, constants, calibration.settings)
    again = fitted({label: robot}, FitProblem(samples, LeastSquares()), 1, 0, intervals=False)
    before = {one.name: one.prior for one in own if one.prior is not None}
    prior = np.diag([size**2 for _, size in before.values()])
    total = np.isin(again.residuals.quantity, _ANGLES)
    slopes = np.stack(
        [
            again.residuals.slopes[total & (again.residuals.row == row)].sum(axis=0)
            for row in range(len(measured))
        ]
    )
    after, earlier = (
        np.sqrt(np.einsum("ri,ij,rj->", slopes, one, slopes)) for one in (again.covariance, prior)
    )
    return Specimen(again, before, float(after / earlier) if earlier else 1.0)


def _missed(calibration: Calibration, measured: Measurements) -> dict[str, np.ndarray]:
    """Residuals of a fit by quantity (root mean square), as deviations for another robot."""
    sizes = calibration.residuals.root_mean_squares()
    return {
        name: np.full(values.shape, sizes[name])
        for name, values in measured.observed.items()
        if name in sizes
    } | {name: values for name, values in measured.deviation.items() if name not in sizes}


def _values(calibration: Calibration) -> list[tuple[Unknown, float]]:
    return list(zip(calibration.problem.unknowns, calibration.best.values.tolist(), strict=True))


def prior_of(unknown: Unknown, calibration: Calibration) -> tuple[float, float]:
    """Return mean and standard deviation of a constant of one more specimen.

    The prior counts as one specimen: the variance is the mean of its own and of the squared
    distances of the fitted specimens from its mean, each with the variance of its estimate. Without
    a prior mean and variance are those of the fitted specimens.

    Raises:
        InputError: There is no prior, and fewer than two fitted specimens.
    """
    of_specimens = [one.path == unknown.path and one.each for one in calibration.problem.unknowns]
    values, variance = (
        calibration.best.values[of_specimens],
        np.diag(calibration.covariance)[of_specimens],
    )
    if unknown.prior is not None:
        mean, size = unknown.prior
        squares = (values - mean) ** 2 + np.where(np.isfinite(variance), variance, size**2)
        return mean, float(np.sqrt(np.mean(np.append(squares, size**2))))
    if len(values) < 2:
        raise InputError.MISSING_VALUE(
            f"nothing is known of `{unknown.name}` before it is measured; give a prior, or fit "
            f"`each:{unknown.path}` to two robots or more"
        )
    return float(np.mean(values)), float(np.std(values, ddof=1))
