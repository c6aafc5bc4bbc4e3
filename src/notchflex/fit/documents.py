"""Fits as text, as JSON documents and as robot files that say where each value comes from.

Constants are in the units of the robot file. None marks a missing number, also an open end
of an interval.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from notchflex import InputError, __version__
from notchflex.fit.calibration import Calibration, Interval
from notchflex.fit.constants import SENSOR, Unknown
from notchflex.fit.diagnosis import NO_PROBLEMS, diagnose, edge, errors_of_parts, with_unit
from notchflex.fit.folds import LeftOut
from notchflex.fit.next_measurement import NextMeasurement
from notchflex.fit.objective import LeastSquares, SumOfDistances, SumOfRobotErrors
from notchflex.fit.posterior import Posterior
from notchflex.support import (
    AnyPath,
    check_folder,
    plain,
    robot_text,
    source_of,
    to_table,
    unwritable,
    write_text,
)

# An objective's value is a sum of these; half a chi squared has no unit.
_UNIT_OF_COST: dict[type, str] = {SumOfRobotErrors: "deg", SumOfDistances: "mm"}
# More files than that are not named, but counted.
_FILES = 3


def _document(content: Mapping[str, Any]) -> dict[str, Any]:
    """A document with its head, of plain values; None instead of NaN and infinity."""
    return {"program": "notchflex", "version": __version__, **_finite(content)}


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    value = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
    objective, tests = found.problem.objective, found.tests
    huber = {"huber": objective.huber} if isinstance(objective, LeastSquares) else {}
    same = ("converged", "reason", "cost", "reduced_chi_squared", "log_likelihood", "aic", "bic")
    same += ("correlation", "trusted", "deviations_of_drawing", "solves")
    return _document(
        {
            **{name: getattr(found, name) for name in same},
            "objective": {"name": type(objective).__name__, **huber},
            "cost_unit": _UNIT_OF_COST.get(type(objective), ""),
            "numbers_measured": len(found.residuals),
            "numbers_counted": found.counted,
            "degrees_of_freedom": found.freedom,
            "intervals_widened_by": found.widened,
            "constants": _constants(found),
            "verdict": diagnose(found),
            "tests": tests
            and {
                **{name: getattr(tests, name) for name in ("runs", "notches", "rejected")},
                "missing": [test._asdict() for test in tests.missing],
            },
            "noise": _noise(found),
            "errors": [
                {
                    **{name: value for name, value in asdict(one).items() if name not in _NOT_TOLD},
                    "part": one.part or None,
                    "rmse": one.error,
                }
                for one in errors_of_parts(found)
            ],
            "searches": [
                {
                    **search._asdict(),
                    "values": dict(zip(found.names, search.values, strict=True)),
                    "cost": search.cost and search.cost.value,
                }
                for search in found.searches
            ],
            "robots": {
                label: {"data": data_of(found, label), "robot": plain(to_table(robot))}
                for label, robot in found.robots.items()
            },
        }
    )


_NOT_TOLD = ("title", "error")


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
    return _document(
        {
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
                            **error,
                            "error_of_all": _in_unit(name, fold.errors_of_all.get(name, math.nan)),
                            "inside_90": fold.share_inside().get(name),
                        }
                        for name, error in _errors(fold.errors).items()
                    ],
                    "before": fold.before,
                    "photograph": fold.specimen
                    and {
                        "row": fold.row + 1,
                        "values": fold.specimen.values,
                        "gain": fold.specimen.gain,
                        "errors": [*_errors(fold.errors_updated).values()],
                    },
                }
                for fold in left_out.folds
            ],
        }
    )


def _in_unit(quantity: str, value: float) -> float:
    return value * edge(quantity)[2]


def _errors(errors: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    return {
        name: {"quantity": name, "unit": edge(name)[1], "error": _in_unit(name, error)}
        for name, error in errors.items()
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
    return _document(
        {
            "robot": ranked.label,
            "wanted": ranked.wanted,
            "best": ranked.best + 1,
            "candidates": [
                {
                    "load": {"tension_N": tension, "stroke_mm": stroke},
                    "converged": ranked.converged[number],
                    "narrower": dict(zip(ranked.names, ranked.narrower[number], strict=True)),
                    "volume": ranked.volume[number],
                    "gain": ranked.gain[number],
                }
                for number, (tension, stroke) in enumerate(
                    zip(ranked.loads.tension, ranked.loads.stroke, strict=True)
                )
            ],
        }
    )


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
    values = {name: drawn.draws[..., number] for number, name in enumerate(drawn.names)}
    return _document(
        {
            "chains": drawn.draws.shape[0],
            "draws_per_chain": drawn.draws.shape[1],
            "divergent": drawn.divergent,
            "constants": [
                {
                    "name": name,
                    "mean": drawn.means[name],
                    "standard_deviation": drawn.deviations[name],
                    "interval_95": drawn.intervals[name],
                    "effective_draws": drawn.effective[name],
                    "split_r_hat": drawn.r_hat[name],
                }
                for name in drawn.names
            ],
            **({"draws": values} if draws else {}),
        }
    )


def data_of(calibration: Calibration, label: str) -> list[str]:
    """Return the sources of the measurements of a robot."""
    sources = (table.source for table in calibration.problem.samples.of_robot(label))
    return list(dict.fromkeys(sources))


def _constants(fit: Calibration) -> list[dict[str, Any]]:
    by_pulls, by_rows = (
        np.sqrt(np.diag(one)) for one in (fit.by_pulls.covariance, fit.covariance_by_rows)
    )
    no_interval = Interval(None, None, np.zeros((0, 2)))
    return [
        {
            "name": name,
            "value": fit.values[name],
            "unit": unknown.unit,
            "robots": list(dict.fromkeys(number.label for number in unknown.sets)),
            "interval_95": [interval.lower, interval.upper] if name in fit.intervals else None,
            "interval_reason": interval.reason,
            "standard_deviation": fit.deviations[name],
            "standard_deviation_by_pulls": by_pulls[number],
            "standard_deviation_by_rows": by_rows[number],
            "interval_by": "pulls" if fit.by_pulls.counts[number] else "rows",
            "pulls": fit.by_pulls.pulls[number],
            "before": unknown.start,
            "limits": [unknown.lower, unknown.upper],
            "prior": unknown.prior,
        }
        for number, (name, unknown) in enumerate(zip(fit.names, fit.problem.unknowns, strict=True))
        for interval in [fit.intervals.get(name, no_interval)]
    ]


def _noise(fit: Calibration) -> list[dict[str, Any]]:
    """Source and root mean square of the noise of every quantity of every file."""
    samples, deviation = fit.problem.samples.every, fit.noise.deviation
    return [
        {
            "robot": samples[number].label,
            "data": samples[number].measured.source,
            "quantity": name,
            "unit": edge(name)[1],
            "standard_deviation": plain(_in_unit(name, np.sqrt(np.mean(deviation[mine] ** 2)))),
            "known_from": source,
        }
        for (number, name), source in fit.noise.source.items()
        if (mine := fit.residuals.of(number, name)).any()
    ]


def summary(fit: Calibration) -> str:
    """Return constants with intervals and units, root-mean-square errors and the diagnosis."""
    state = "converged" if fit.converged else f"not converged: {fit.reason}"
    state += "" if fit.trusted else ", not trusted"
    lines = [f"{', '.join(fit.given)}: {fit.counted} numbers measured, {state}"]
    width = max(map(len, fit.names))
    for name, value in fit.values.items():
        ends = ""
        if (interval := fit.intervals.get(name)) is not None:
            both = (interval.lower, interval.upper)
            ends = " to ".join("open" if end is None else f"{end:.5g}" for end in both)
            ends = f"  95 %: {ends} {fit.units[name]}".rstrip()
        lines.append(f"  {name:<{width}}  {with_unit(value, fit.units[name])}{ends}")
    errors = [
        f"{edge(name)[0]} {_in_unit(name, error):.3g} {edge(name)[1]}"
        for name, error in fit.residuals.root_mean_squares().items()
    ]
    lines.append(f"  rms error: {', '.join(errors)}")
    return "\n".join([*lines, *(diagnose(fit) or (NO_PROBLEMS,))])


def write_fitted(
    found: Calibration, folder: AnyPath, *, inputs: Iterable[str | Path] = ()
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
        try:
            text = target.read_text(encoding="utf-8-sig")
        except (OSError, ValueError):
            continue
        if text == source_of(found.given[label]):
            raise InputError.CONFLICT(
                f"{target}: this would replace the file that {label} was read from; choose "
                "another folder."
            )
    with unwritable(f"the folder {folder} cannot be made"):
        Path(folder).mkdir(exist_ok=True)
    for label, target in targets.items():
        notes = {
            number.path: _note(found, unknown)
            for unknown in (*found.problem.unknowns, *found.drawing)
            for number in unknown.only_of([label]).sets
            if number.path not in SENSOR
        }
        write_text(target, robot_text(found.robots[label], fitted=notes))
    return files


def _note(fit: Calibration, unknown: Unknown) -> str:
    """The comment beside a fitted value: the data, and how far to trust it."""
    labels = dict.fromkeys(number.label for number in unknown.sets)
    sources = [Path(source).name for label in labels for source in data_of(fit, label)]
    files = list(dict.fromkeys(" ".join(source.split()) for source in sources))
    if len(files) > _FILES:
        files = [*files[: _FILES - 1], f"{len(files) - _FILES + 1} more files"]
    trouble = "" if fit.converged else "; the search did not settle"
    trouble += "" if fit.trusted else "; not trusted"
    if unknown in fit.drawing:
        told = f"{unknown.start:+.2g} standard deviations of its tolerance"
    else:
        told = _trust(fit, unknown)
        if unknown.path != unknown.sets[0].path:
            value = with_unit(fit.values[unknown.name], unknown.unit)
            told = f"`{unknown.path}` = {value}, {told}"
    return f"{', '.join(files)}: {told}{trouble}"


def _trust(fit: Calibration, unknown: Unknown) -> str:
    interval, unit = fit.intervals.get(unknown.name), unknown.unit
    if interval is None:
        size = fit.deviations[unknown.name]
        known = math.isfinite(size)
        return f"standard deviation {size:.2g} {unit}".strip() if known else "no interval"
    if fit.tells_no_noise:
        return f"no interval: {interval.reason}"
    ends = [f"{end:.5g}" for end in (interval.lower, interval.upper) if end is not None]
    if not ends:
        return "any value fits"
    word = "at most " if interval.lower is None else "at least " if interval.upper is None else ""
    number = fit.number_of(unknown.name)
    pulls = f", by {fit.by_pulls.pulls[number]} whole pulls" * int(fit.by_pulls.counts[number])
    return f"{word}{' to '.join(ends)} {unit}".strip() + f" (95 %{pulls})"
