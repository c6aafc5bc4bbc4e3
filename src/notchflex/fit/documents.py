"""What a fit found as JSON documents."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from notchflex import __version__
from notchflex.fit.assessment.diagnosis import diagnose
from notchflex.fit.assessment.errors_of_parts import edge, errors_of_parts
from notchflex.fit.assessment.folds import LeftOut
from notchflex.fit.assessment.next_measurement import NextMeasurement
from notchflex.fit.assessment.posterior import Posterior
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.objective import LeastSquares, SumOfDistances, SumOfRobotErrors
from notchflex.fit.measurements.measurements import OBSERVED
from notchflex.results.files.json import plain
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.robot.robot import to_table

# An objective's value is a sum of these; half a chi squared has no unit.
_UNIT_OF_COST: dict[type, str] = {SumOfRobotErrors: "deg", SumOfDistances: "mm"}


def calibration_document(found: Calibration) -> dict[str, Any]:
    """Return a fit as a document for `notchflex.results.files.json.write_json`.

    Args:
        found: The fit.

    Returns:
        `converged`, `reason`, `objective`, `cost`, `numbers_measured` (`numbers_counted` without
        totals that are sums of the notches), `reduced_chi_squared`, `constants` (each with value,
        unit, 95 % interval and whether it is by rows or by whole pulls, standard deviations,
        limits), `correlation`, `verdict` (the sentences of `diagnose`), `noise`,
        `errors` (root mean squares of every notch, beside the repeats), `searches`, `solves` (rows
        that were solved) and `robots` (their data, and their descriptions with the constants that
        were found). Constants are in the units of the robot file; None stands where there is no
        number, also for an open end of an interval.
    """
    objective = found.problem.objective
    told: dict[str, Any] = {"name": type(objective).__name__}
    if isinstance(objective, LeastSquares):
        told["huber"] = objective.huber
    return {
        **_head(),
        "converged": found.converged,
        "reason": found.reason,
        "objective": told,
        "cost": found.cost,
        "cost_unit": _UNIT_OF_COST.get(type(objective), ""),
        "numbers_measured": len(found.residuals),
        "numbers_counted": found.counted,
        "degrees_of_freedom": found.freedom,
        "reduced_chi_squared": _finite(found.reduced_chi_squared),
        "intervals_widened_by": found.widened,
        "constants": _constants(found),
        "correlation": [[_finite(one) for one in row] for row in found.correlation],
        "verdict": list(diagnose(found)),
        "noise": _noise(found),
        "errors": [
            {
                "robot": one.robot,
                "quantity": one.quantity,
                "part": one.part or None,
                "unit": one.unit,
                "rmse": one.error,
                "repeats": _finite(one.repeats),
                "count": one.count,
            }
            for one in errors_of_parts(found)
        ],
        "searches": [
            {
                "values": dict(zip(found.names, one.values.tolist(), strict=True)),
                "cost": None if one.cost is None else one.cost.value,
                "converged": one.converged,
                "reason": one.reason,
                "iterations": one.iterations,
                "calls": one.calls,
            }
            for one in found.searches
        ],
        "solves": found.solves,
        "robots": {
            label: {"data": data_of(found, label), "robot": plain(to_table(robot))}
            for label, robot in found.robots.items()
        },
    }


def left_out_document(left_out: LeftOut) -> dict[str, Any]:
    """Return fits without each part as a document.

    Args:
        left_out: The fits.

    Returns:
        `by`, the `constants` of the fit to everything, and `folds`: what was left out, the
        constants found without it, and root-mean-square errors on it by quantity, `error` of
        those constants and `error_of_all` of those that were fitted to everything.
    """
    return {
        **_head(),
        "by": left_out.by,
        "constants": left_out.whole.values,
        "folds": [
            {
                "left_out": fold.label,
                "solved": fold.converged,
                "search_converged": fold.found.converged,
                "constants": fold.found.values,
                "errors": [
                    {
                        "quantity": name,
                        "unit": edge(name)[1],
                        "error": error * edge(name)[2],
                        "error_of_all": fold.errors_of_all.get(name, math.nan) * edge(name)[2],
                    }
                    for name, error in fold.errors.items()
                ],
            }
            for fold in left_out.folds
        ],
    }


def next_measurement_document(told: NextMeasurement) -> dict[str, Any]:
    """Return what candidates for the next measurement would tell as a document.

    Args:
        told: The candidates, weighed.

    Returns:
        `robot`, `wanted` (constants to be narrowed, empty for all together), `best` (number of the
        best candidate, from 1) and `candidates`: the load, `narrower` (width of every constant's
        interval after it over that before), `volume` (of all together) and `gain` (of what is
        wanted). None stands where a candidate has no solution.
    """
    tension, stroke = QUANTITIES["commanded_tension"], QUANTITIES["commanded_stroke"]
    rows = zip(told.loads.tension, told.loads.stroke, told.narrower, strict=True)
    return {
        **_head(),
        "robot": told.label,
        "wanted": list(told.wanted),
        "best": told.best + 1,
        "candidates": [
            {
                "load": {
                    tension.key.rpartition(".")[2]: pulled,
                    stroke.key.rpartition(".")[2]: drawn,
                },
                "converged": bool(told.converged[number]),
                "narrower": dict(zip(told.names, narrower.tolist(), strict=True)),
                "volume": told.volume[number],
                "gain": told.gain[number],
            }
            for number, (pulled, drawn, narrower) in enumerate(rows)
        ],
    }


def posterior_document(drawn: Posterior, *, draws: bool = False) -> dict[str, Any]:
    """Return a posterior as a document.

    Args:
        drawn: The draws.
        draws: Whether to tell every draw too.

    Returns:
        `constants` (mean, standard deviation, the middle 95 %, how many independent draws they are
        worth, how unlike the chains are), `chains`, `draws_per_chain`, `divergent`, and `draws` if
        wanted: by constant, chains by draws.
    """
    chains, count, _ = drawn.draws.shape
    document: dict[str, Any] = {
        **_head(),
        "chains": chains,
        "draws_per_chain": count,
        "divergent": drawn.divergent,
        "constants": [
            {
                "name": name,
                "mean": drawn.means[name],
                "standard_deviation": drawn.deviations[name],
                "interval_95": list(drawn.intervals[name]),
                "effective_draws": _finite(drawn.effective[name]),
                "split_r_hat": _finite(drawn.unlike[name]),
            }
            for name in drawn.names
        ],
    }
    if draws:
        document["draws"] = {
            name: drawn.draws[..., number] for number, name in enumerate(drawn.names)
        }
    return document


def data_of(found: Calibration, label: str) -> list[str]:
    """Where the measurements of a robot came from."""
    every = (one.measured.source for one in found.problem.samples.every if one.label == label)
    return list(dict.fromkeys(every))


def _head() -> dict[str, Any]:
    return {"program": "notchflex", "version": __version__}


def _constants(found: Calibration) -> list[dict[str, Any]]:
    by_pulls = np.sqrt(np.diag(found.by_pulls.covariance))
    by_rows = np.sqrt(np.diag(found.covariance_by_rows))
    rows: list[dict[str, Any]] = []
    for number, unknown in enumerate(found.problem.unknowns):
        interval = found.intervals.get(unknown.name)
        rows.append(
            {
                "name": unknown.name,
                "value": found.values[unknown.name],
                "unit": unknown.unit,
                "robots": list(dict.fromkeys(label for label, _ in unknown.sets)),
                "interval_95": None if interval is None else [interval.lower, interval.upper],
                "interval_reason": "" if interval is None else interval.reason,
                "standard_deviation": _finite(found.deviations[unknown.name]),
                "standard_deviation_by_pulls": _finite(by_pulls[number]),
                "standard_deviation_by_rows": _finite(by_rows[number]),
                "interval_by": "pulls" if found.by_pulls.wider[number] > 1.0 else "rows",
                "pulls": int(found.by_pulls.pulls[number]),
                "before": unknown.start,
                "limits": [_finite(unknown.lower), _finite(unknown.upper)],
                "prior": None if unknown.prior is None else list(unknown.prior),
            }
        )
    return rows


def _noise(found: Calibration) -> list[dict[str, Any]]:
    """Noise of every quantity of every file: where it was known from, root mean square."""
    rows: list[dict[str, Any]] = []
    residuals = found.residuals
    for number, sample in enumerate(found.problem.samples.every):
        for name in sample.measured.observed:
            own = (residuals.sample == number) & (residuals.quantity == OBSERVED.index(name))
            if not own.any():
                continue
            _, unit, scale = edge(name)
            size = float(np.sqrt(np.mean(found.noise.deviation[own] ** 2)))
            rows.append(
                {
                    "robot": sample.label,
                    "data": sample.measured.source,
                    "quantity": name,
                    "unit": unit,
                    "standard_deviation": size * scale,
                    "known_from": found.noise.source[number, name],
                }
            )
    return rows


def _finite(value: float) -> float | None:
    """A number, or None where there is none: of what is not known at all."""
    return float(value) if math.isfinite(value) else None


__all__ = [
    "calibration_document",
    "data_of",
    "left_out_document",
    "next_measurement_document",
    "posterior_document",
]
