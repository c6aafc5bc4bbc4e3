"""Fits as text, as JSON documents and as robot files that say where each value comes from.

Constants are in the units of the robot file. None marks a missing number, also an open end
of an interval.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from notchflex import InputError, __version__
from notchflex.fit.assessment.diagnosis import NO_PROBLEMS, diagnose, with_unit
from notchflex.fit.assessment.errors_of_parts import edge, errors_of_parts
from notchflex.fit.assessment.folds import Fold, LeftOut
from notchflex.fit.assessment.next_measurement import NextMeasurement
from notchflex.fit.assessment.posterior import Posterior
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import Interval
from notchflex.fit.estimation.objective import LeastSquares, SumOfDistances, SumOfRobotErrors
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.residuals import SENSOR
from notchflex.support import (
    QUANTITIES,
    check_folder,
    plain,
    robot_text,
    source_of,
    to_table,
    unwritable,
    write_text,
)

HEAD = {"program": "notchflex", "version": __version__}
# An objective's value is a sum of these; half a chi squared has no unit.
_UNIT_OF_COST: dict[type, str] = {SumOfRobotErrors: "deg", SumOfDistances: "mm"}


def calibration_document(found: Calibration) -> dict[str, Any]:
    """Return a fit as a document.

    Args:
        found: The fit.

    Returns:
        `converged`, `reason`, `objective`, `cost`, `numbers_measured` (`numbers_counted` without
        totals that are sums of the notches), `reduced_chi_squared`, `log_likelihood`, `aic`, `bic`,
        `constants` (each with value, unit, 95 % interval and whether it is by rows or by whole
        pulls, standard deviations, limits), `correlation`, `verdict` (the sentences of
        `diagnose`), `trusted` and `tests` (probabilities of the patterns of the residuals, and
        what other constants would gain),
        `deviations_of_drawing` (in standard deviations of the tolerances), `noise`, `errors` (root
        mean squares of every notch, beside the repeats), `searches`, `solves` (number of rows
        solved) and `robots` (their data, and their descriptions with the fitted constants).
    """
    objective = found.problem.objective
    huber = {"huber": objective.huber} if isinstance(objective, LeastSquares) else {}
    return {
        **HEAD,
        "converged": found.converged,
        "reason": found.reason,
        "objective": {"name": type(objective).__name__, **huber},
        "cost": found.cost,
        "cost_unit": _UNIT_OF_COST.get(type(objective), ""),
        "numbers_measured": len(found.residuals),
        "numbers_counted": found.counted,
        "degrees_of_freedom": found.freedom,
        "reduced_chi_squared": _finite(found.reduced_chi_squared),
        "log_likelihood": _finite(found.log_likelihood),
        "aic": _finite(found.aic),
        "bic": _finite(found.bic),
        "intervals_widened_by": found.widened,
        "constants": _constants(found),
        "correlation": [[_finite(one) for one in row] for row in found.correlation],
        "verdict": list(diagnose(found)),
        "trusted": found.trusted,
        "tests": _tests(found),
        "deviations_of_drawing": found.deviations_of_drawing,
        "noise": _noise(found),
        "errors": _errors(found),
        "searches": [
            {
                **one._asdict(),
                "values": dict(zip(found.names, one.values.tolist(), strict=True)),
                "cost": None if one.cost is None else one.cost.value,
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
        those constants and `error_of_all` of those that were fitted to everything, and
        `inside_90`, the share of the numbers in the 90 % interval of the prediction; `before`, what
        is known of constants that the robot left out has of its own (mean, standard deviation),
        and of its `photograph`: row, values, gain and errors.
    """
    return {
        **HEAD,
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
                        "inside_90": fold.share_inside().get(name),
                    }
                    for name, error in fold.errors.items()
                ],
                "before": {name: list(sizes) for name, sizes in fold.before.items()},
                "photograph": _photograph(fold),
            }
            for fold in left_out.folds
        ],
    }


def _photograph(fold: Fold) -> dict[str, Any] | None:
    if fold.specimen is None:
        return None
    return {
        "row": fold.row + 1,
        "values": fold.specimen.values,
        "gain": fold.specimen.gain,
        "errors": [
            {"quantity": name, "unit": edge(name)[1], "error": error * edge(name)[2]}
            for name, error in fold.errors_updated.items()
        ],
    }


def next_measurement_document(ranked: NextMeasurement) -> dict[str, Any]:
    """Return candidates for the next measurement as a document.

    Args:
        ranked: The candidates.

    Returns:
        `robot`, `wanted` (constants to be narrowed, empty for all together), `best` (number of the
        best candidate, from 1) and `candidates`: the load, `narrower` (width of every constant's
        interval after it over that before), `volume` (of all together) and `gain` (of what is
        wanted), None if a candidate has no solution.
    """
    keys = [QUANTITIES[f"commanded_{name}"].key for name in ("tension", "stroke")]
    tension, stroke = (key.rpartition(".")[2] for key in keys)
    return {
        **HEAD,
        "robot": ranked.label,
        "wanted": list(ranked.wanted),
        "best": ranked.best + 1,
        "candidates": [
            {
                "load": {
                    tension: ranked.loads.tension[number],
                    stroke: ranked.loads.stroke[number],
                },
                "converged": bool(ranked.converged[number]),
                "narrower": dict(zip(ranked.names, narrower.tolist(), strict=True)),
                "volume": ranked.volume[number],
                "gain": ranked.gain[number],
            }
            for number, narrower in enumerate(ranked.narrower)
        ],
    }


def posterior_document(drawn: Posterior, *, draws: bool = False) -> dict[str, Any]:
    """Return a posterior as a document.

    Args:
        drawn: The draws.
        draws: Whether to include every draw.

    Returns:
        `constants` (mean, standard deviation, middle 95 %, effective number of draws, split
        R-hat), `chains`, `draws_per_chain`, `divergent`, and `draws` if wanted: by constant,
        chains by draws.
    """
    chains, count, _ = drawn.draws.shape
    every = {name: drawn.draws[..., number] for number, name in enumerate(drawn.names)}
    return {
        **HEAD,
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
                "split_r_hat": _finite(drawn.r_hat[name]),
            }
            for name in drawn.names
        ],
        **({"draws": every} if draws else {}),
    }


def data_of(calibration: Calibration, label: str) -> list[str]:
    """Return the sources of the measurements of a robot."""
    sources = (one.source for one in calibration.problem.samples.of_robot(label))
    return list(dict.fromkeys(sources))


def _constants(calibration: Calibration) -> list[dict[str, Any]]:
    by_pulls = np.sqrt(np.diag(calibration.by_pulls.covariance))
    by_rows = np.sqrt(np.diag(calibration.covariance_by_rows))
    rows: list[dict[str, Any]] = []
    for number, unknown in enumerate(calibration.problem.unknowns):
        interval = calibration.intervals.get(unknown.name)
        rows.append(
            {
                "name": unknown.name,
                "value": calibration.values[unknown.name],
                "unit": unknown.unit,
                "robots": list(dict.fromkeys(one.label for one in unknown.sets)),
                "interval_95": None if interval is None else [interval.lower, interval.upper],
                "interval_reason": "" if interval is None else interval.reason,
                "standard_deviation": _finite(calibration.deviations[unknown.name]),
                "standard_deviation_by_pulls": _finite(by_pulls[number]),
                "standard_deviation_by_rows": _finite(by_rows[number]),
                "interval_by": "pulls" if calibration.by_pulls.counts[number] else "rows",
                "pulls": int(calibration.by_pulls.pulls[number]),
                "before": unknown.start,
                "limits": [_finite(unknown.lower), _finite(unknown.upper)],
                "prior": None if unknown.prior is None else list(unknown.prior),
            }
        )
    return rows


def _tests(calibration: Calibration) -> dict[str, Any] | None:
    tests = calibration.tests
    if tests is None:
        return None
    return {
        "runs": _finite(tests.runs),
        "notches": _finite(tests.notches),
        "rejected": list(tests.rejected),
        "missing": [one._asdict() for one in tests.missing],
    }


def _noise(calibration: Calibration) -> list[dict[str, Any]]:
    """Source and root mean square of the noise of every quantity of every file."""
    rows: list[dict[str, Any]] = []
    for number, sample in enumerate(calibration.problem.samples.every):
        for name in sample.measured.observed:
            deviation = calibration.noise.deviation[calibration.residuals.of(number, name)]
            if not len(deviation):
                continue
            _, unit, scale = edge(name)
            rows.append(
                {
                    "robot": sample.label,
                    "data": sample.measured.source,
                    "quantity": name,
                    "unit": unit,
                    "standard_deviation": float(np.sqrt(np.mean(deviation**2))) * scale,
                    "known_from": calibration.noise.source[number, name],
                }
            )
    return rows


def _errors(calibration: Calibration) -> list[dict[str, Any]]:
    return [
        {
            "robot": one.robot,
            "quantity": one.quantity,
            "part": one.part or None,
            "unit": one.unit,
            "rmse": one.error,
            "repeats": _finite(one.repeats),
            "count": one.count,
        }
        for one in errors_of_parts(calibration)
    ]


def _finite(value: float) -> float | None:
    """A number; None instead of NaN and infinity."""
    return float(value) if math.isfinite(value) else None


def summary(calibration: Calibration) -> str:
    """Return constants with intervals and units, root-mean-square errors and the diagnosis."""
    state = "converged" if calibration.converged else f"not converged: {calibration.reason}"
    state += "" if calibration.trusted else ", not trusted"
    lines = [f"{', '.join(calibration.given)}: {calibration.counted} numbers measured, {state}"]
    width = max(map(len, calibration.names))
    for name, value in calibration.values.items():
        unit, interval = calibration.units[name], calibration.intervals.get(name)
        ends = "" if interval is None else f"  95 %: {_ends(interval, unit)}"
        lines.append(f"  {name:<{width}}  {with_unit(value, unit)}{ends}")
    errors = [
        f"{edge(name)[0]} {error * edge(name)[2]:.3g} {edge(name)[1]}"
        for name, error in calibration.residuals.root_mean_squares().items()
    ]
    lines.append(f"  rms error: {', '.join(errors)}")
    return "\n".join([*lines, *(diagnose(calibration) or (NO_PROBLEMS,))])


def _ends(interval: Interval, unit: str) -> str:
    ends = ("open" if end is None else f"{end:.5g}" for end in (interval.lower, interval.upper))
    return f"{' to '.join(ends)} {unit}".strip()


# More files than that are not named, but counted.
_FILES = 3


def write_fitted(
    found: Calibration, folder: str | os.PathLike[str], *, inputs: Iterable[str | Path] = ()
) -> tuple[Path, ...]:
    """Write every fitted robot as a robot file, named after its label.

    Comments of the file that the robot was read from are kept. A comment beside each fitted value
    names the data and the 95 % interval. Constants of the measurement (`sensor.`) are not written.

    Args:
        found: The fit.
        folder: Folder of the files; made if it is missing. Files of the same names are replaced.
        inputs: Files that must not be replaced.

    Returns:
        The files.

    Raises:
        InputError: A file cannot be written, is one of `inputs`, or is the very file that the
            robot was read from.

    Example:
        >>> write_fitted(found, "fitted")  # doctest: +SKIP
        (PosixPath('fitted/my-wrist.toml'),)
    """
    names = [f"{label}.toml" for label in found.given]
    files = check_folder(str(folder), names, "the folder of fitted robots", inputs=inputs)
    targets = dict(zip(found.given, files, strict=True))
    for label, target in targets.items():
        if target.exists() and _text(target) == source_of(found.given[label]):
            raise InputError.CONFLICT(
                f"{target}: this would replace the file that {label} was read from; choose "
                "another folder."
            )
    with unwritable(f"the folder {folder} cannot be made"):
        Path(folder).mkdir(exist_ok=True)
    for label, target in targets.items():
        robot = found.robots[label]
        notes = {
            one.path: _note(found, unknown)
            for unknown in (*found.problem.unknowns, *found.drawing)
            for one in unknown.sets
            if one.label == label and one.path not in SENSOR
        }
        write_text(target, robot_text(robot, fitted=notes))
    return files


def _note(calibration: Calibration, unknown: Unknown) -> str:
    """The comment beside a fitted value: the data, and how far to trust it."""
    trouble = "" if calibration.converged else "; the search did not settle"
    trouble += "" if calibration.trusted else "; not trusted"
    files = _files(calibration, unknown)
    if unknown in calibration.drawing:
        return f"{files}: {unknown.start:+.2g} standard deviations of its tolerance{trouble}"
    value = with_unit(calibration.values[unknown.name], unknown.unit)
    rule = "" if unknown.path == unknown.sets[0].path else f"`{unknown.path}` = {value}, "
    return f"{files}: {rule}{_trust(calibration, unknown)}{trouble}"


def _files(calibration: Calibration, unknown: Unknown) -> str:
    """Names of the files that a constant follows from."""
    labels = dict.fromkeys(one.label for one in unknown.sets)
    files = [Path(one).name for label in labels for one in data_of(calibration, label)]
    files = list(dict.fromkeys(" ".join(one.split()) for one in files))
    if len(files) > _FILES:
        files = [*files[: _FILES - 1], f"{len(files) - _FILES + 1} more files"]
    return ", ".join(files)


def _trust(calibration: Calibration, unknown: Unknown) -> str:
    interval, unit = calibration.intervals.get(unknown.name), unknown.unit
    if interval is None:
        size = calibration.deviations[unknown.name]
        return f"standard deviation {size:.2g} {unit}".strip() if isfinite(size) else "no interval"
    low, high = interval.lower, interval.upper
    if calibration.tells_no_noise:
        return f"no interval: {interval.reason}"
    if low is None and high is None:
        return "any value fits"
    if low is not None and high is not None:
        ends = f"{low:.5g} to {high:.5g}"
    else:
        ends = f"at most {high:.5g}" if low is None else f"at least {low:.5g}"
    number = calibration.names.index(unknown.name)
    pulls = int(calibration.by_pulls.pulls[number])
    by_pulls = f", by {pulls} whole pulls" if calibration.by_pulls.counts[number] else ""
    return f"{ends} {unit}".strip() + f" (95 %{by_pulls})"


def _text(target: Path) -> str | None:
    try:
        return target.read_text(encoding="utf-8-sig")
    except (OSError, ValueError):
        return None
