"""`notchflex calibrate`: from measurements to constants with confidence intervals."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from cyclopts import Group, Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_FOLDER,
    Columns,
    DrawnOutputs,
    Folder,
    InPieces,
    converted,
    integer,
    low_high,
    named,
    number,
    tendon_command,
)
from notchflex.cli.robots import (
    MeasuredAs,
    OnePath,
    Settings,
    chosen_robot,
    read_data,
    robot_files,
    robot_label,
)
from notchflex.cli.terminal import BAD_INPUT, DONE, NOT_CONVERGED
from notchflex.support import TendonCommand, load_columns, need, parse_number

if TYPE_CHECKING:
    from pathlib import Path

    from notchflex import LoadPath, Robot
    from notchflex.fit import (
        Calibration,
        FitObjective,
    )

BEYOND = Group("Beyond the fit", sort_key=8)
_PAIR = "ROBOT=DATA.csv or LABEL=ROBOT=DATA.csv"
_BOUNDS = "NAME=LOW:HIGH, such as friction.coefficient=0:0.5; one of the two may be left out"
_PRIOR = "NAME=MEAN+-SD, such as material.elastic_modulus=10000+-500"
_MOST_CANDIDATES = 16
"""More candidates for a measurement than that are thinned in the table."""

Bounds = tuple[float | None, float | None]
Prior = tuple[float, float]
Names = Annotated[tuple[str, ...], Parameter(metavar="NAME...")]


# Robots with their data

Source = tuple[str, str, str]
"""Label and name or file of a robot, and a file of its measurements."""


def _read_source(text: str) -> Source:
    words = [word.strip() for word in text.split("=")]
    if len(words) not in (2, 3) or not all(words):
        raise InputError.BAD_SYNTAX(f"give a robot with its data: {_PAIR}.")
    robot, data = words[-2:]
    label = words[0] if len(words) == 3 else robot_label(robot)
    if ":" in label or os.sep in label:
        raise InputError.BAD_SYNTAX(f"a label must not contain `:` or `{os.sep}`; choose another.")
    if label in ("each", "offset", "factor"):
        raise InputError.CONFLICT(
            f"the label `{label}` has a meaning before names of constants; choose another."
        )
    return label, robot, data


def gathered(sources: Sequence[Source]) -> tuple[dict[str, str], dict[str, list[str]]]:
    """Return by label the name or file of each robot, and its files of measurements.

    Example:
        >>> gathered([("a", "a.toml", "1.csv"), ("a", "a.toml", "2.csv")])
        ({'a': 'a.toml'}, {'a': ['1.csv', '2.csv']})
    """
    if not sources:
        raise InputError.MISSING_VALUE(f"Give a robot with its data: {_PAIR}.")
    robots: dict[str, str] = {}
    data: dict[str, list[str]] = {}
    for label, robot, file in sources:
        if robots.setdefault(label, robot) != robot:
            raise InputError.CONFLICT(
                f"{robots[label]} and {robot} are both called {label}; give one of them another "
                f"label: LABEL={robot}={file}."
            )
        files = data.setdefault(label, [])
        if file in files:
            raise InputError.CONFLICT(f"{file} is given twice for {label}; give it once.")
        files.append(file)
    return robots, data


def changed(robots: Mapping[str, str], settings: Sequence[str]) -> dict[str, Robot]:
    """Load robots with the values of `--set`: of all, or of one whose label precedes."""
    of_robot: dict[str, list[str]] = {label: [] for label in robots}
    for text in settings:
        label, colon, rest = text.partition(":")
        if colon and "=" not in label:
            _check_label(label, robots, f"--set {text}")
            of_robot[label].append(rest)
        else:
            for values in of_robot.values():
                values.append(text)
    return {label: chosen_robot(name, of_robot[label]) for label, name in robots.items()}


def _check_label(label: str, robots: Mapping[str, str], source: str) -> None:
    if label not in robots:
        raise InputError.UNKNOWN_NAME(
            f"{source}: no robot of this fit is called {label}; allowed: {', '.join(robots)}."
        )


# What is found, and what is made of it


def _read_prior(values: str) -> Prior:
    words = re.split(r"\+-|±", values)
    if len(words) != 2:
        raise InputError.BAD_SYNTAX(f"give {_PRIOR}.")
    return parse_number(words[0], _PRIOR), parse_number(words[1], _PRIOR)


@Parameter(name="*")
@dataclass(frozen=True)
class FitOptions:
    """What is found, and how.

    Attributes:
        fit: Constants to find, joined by commas: values of the robot file, of all robots; `LABEL:`
            before one for a single robot, `each:` for one in every robot, `notch[each].` in every
            notch; `offset:notch.depth` added to, `factor:notch.height` multiplying every such
            value; `notch.precurvature_deg/height`; `sensor.force_offset`, `sensor.force_factor`,
            `sensor.stroke_slack`.
        bounds: Limits in the unit, `NAME=LOW:HIGH`.
        prior: Prior in the unit, `NAME=MEAN+-SD`.
        priors: Whether what is not fitted may deviate within its tolerances, or assumed ones. Not
            with `each:`, nor with other objectives.
        objective: What is minimised: squared residuals over their noise, which alone gives
            intervals; eq. 17 of Pacheco 2021; distances of points (Gao 2017, eq. 27).
        huber: Outliers beyond so many standard deviations count less; about 1.5.
        starts: Number of starting points.
        seed: Seed of the starting points.
    """

    fit: Names
    bounds: Annotated[
        tuple[tuple[str, Bounds], ...],
        converted(partial(named, _BOUNDS, partial(low_high, _BOUNDS)), "SPEC", several=True),
    ] = ()
    prior: Annotated[
        tuple[tuple[str, Prior], ...],
        converted(partial(named, _PRIOR, _read_prior), "SPEC", several=True),
    ] = ()
    priors: Annotated[bool, Parameter(negative="--no-priors")] = True
    objective: Literal["least-squares", "robot-errors", "distances"] = "least-squares"
    huber: Annotated[float | None, number("a number of standard deviations", "SD")] = None
    starts: Annotated[int, integer(1)] = 4
    seed: Annotated[int, integer(0)] = 0

    def __post_init__(self) -> None:
        """Check that the options belong together."""
        if self.huber is not None and self.objective != "least-squares":
            raise InputError.CONFLICT(
                f"--huber {self.huber:g} belongs to least-squares; leave out one of the two."
            )

    def constants(self) -> list[tuple[str, float | None, float | None, Prior | None]]:
        """Return the constants with their limits and priors, as arguments of `fit.Constant`."""
        names = [name.strip() for text in self.fit for name in text.split(",")]
        if not names or not all(names):
            raise InputError.MISSING_VALUE(
                "--fit needs names of constants joined by commas, such as "
                "friction.coefficient,material.elastic_modulus."
            )
        limits, priors = dict(self.bounds), dict(self.prior)
        for option, given in (
            ("--fit", names),
            ("--bounds", [name for name, _ in self.bounds]),
            ("--prior", [name for name, _ in self.prior]),
        ):
            for name in given:
                if given.count(name) > 1:
                    raise InputError.CONFLICT(f"{option} {name} is given twice; give it once.")
                if name not in names:
                    raise InputError.UNKNOWN_NAME(
                        f"{option} {name}: this constant is not fitted; --fit names "
                        f"{', '.join(names)}."
                    )
        return [(name, *limits.get(name, (None, None)), priors.get(name)) for name in names]

    def fit_objective(self) -> FitObjective:
        """Return the objective of the library."""
        from notchflex.fit import LeastSquares, SumOfDistances, SumOfRobotErrors

        if self.objective == "robot-errors":
            return SumOfRobotErrors()
        return SumOfDistances() if self.objective == "distances" else LeastSquares(self.huber)


@Parameter(name="*", group=BEYOND)
@dataclass(frozen=True)
class BeyondFit:
    """Further analyses of a finished fit.

    Attributes:
        leave_out: Also fit without each pull or robot, and predict what was left out.
        photograph: With `--leave-out robot`: update its own constants (`each:`) by one row of the
            robot left out, and predict its other rows again.
        next: Candidates for the next measurement: tensions [N] as in `simulate --tension`. Shows
            which narrows the intervals most.
        next_robot: Label of the robot of `--next`; the first if left out.
        narrow: Constant that `--next` is to narrow; all together if left out.
        posterior: Also sample the posterior (extra `bayes`).
        draws: Draws of each of the two chains of `--posterior`.
    """

    leave_out: Literal["pull", "robot"] | None = None
    photograph: bool = False
    next: Annotated[tuple[TendonCommand, ...], tendon_command("--next")] = ()
    next_robot: Annotated[str | None, Parameter(metavar="LABEL")] = None
    narrow: Names = ()
    posterior: bool = False
    draws: Annotated[int, integer(4)] = 500

    def check(self, robots: Mapping[str, str], objective: str) -> None:
        """Check what could not be done after the fit, before the time for the fit is spent."""
        if (self.next_robot is not None or self.narrow) and not self.next:
            raise InputError.CONFLICT(
                "--next-robot and --narrow belong to --next; give candidates with it."
            )
        if self.next_robot is not None:
            _check_label(self.next_robot, robots, f"--next-robot {self.next_robot}")
        if self.posterior:
            if objective != "least-squares":
                raise InputError.CONFLICT(
                    f"--posterior needs least-squares: {objective} is not a likelihood. Leave out "
                    "one of the two."
                )
            need("numpyro", "bayes", "--posterior")
        if self.photograph and self.leave_out != "robot":
            raise InputError.CONFLICT(
                "--photograph belongs to --leave-out robot: it is of the robot left out."
            )
        if self.leave_out == "robot" and len(robots) < 2:
            raise InputError.TOO_FEW_DATA(
                "--leave-out robot: there is only one robot; give two or more."
            )


def calibrate(
    *pairs: Annotated[
        Source,
        converted(_read_source, "[LABEL=]ROBOT=DATA.csv", hyphen=False),
        Parameter(
            help=f"{_PAIR}: a robot (ready, or a file) and its measurements (the columns of "
            "`notchflex.read_measurements`). The same robot again adds data; a label "
            "distinguishes robots of one file."
        ),
    ],
    search: FitOptions,
    path: OnePath = None,
    measured: MeasuredAs = "ring",
    column: Columns = (),
    beyond: BeyondFit = BeyondFit(),
    settings: Settings = (),
    pieces: InPieces = NO_FOLDER,
    output: Folder = None,
    outputs: DrawnOutputs = DrawnOutputs(),
) -> int:
    """Find constants of robots from measurements, with confidence intervals.

    Prints every constant with its 95 % interval (profile likelihood; `open` where the data do not
    bound it), what the data cannot determine, and the errors of every notch beside their
    repeatability.

    Args:
        output: Write the fitted robots into this folder, LABEL.toml each, with their comments.
    """
    names, sources = gathered(pairs)
    constants = search.constants()
    beyond.check(names, search.objective)
    inputs: list[str | Path] = [file for files in sources.values() for file in files]
    inputs += robot_files(*names.values())
    fitted = [f"{label}.toml" for label in names]
    outputs.check(inputs, folder=("--output", output, fitted))
    robots = changed(names, settings)
    folder = pieces.chosen("calibration", inputs)
    candidates = None
    if beyond.next:
        from notchflex import LoadPath

        robot = robots[beyond.next_robot or next(iter(robots))]
        candidates = LoadPath(*load_columns(beyond.next, (), robot.number_of_tendons))

    with terminal.progress("loading the solver"):
        import notchflex.fit as fitting

    _check_sensor(name for name, *_ in constants)
    data = {
        label: [read_data(file, robots[label], path, measured, column) for file in files]
        for label, files in sources.items()
    }
    with terminal.progress("searching") as progress:
        fit = fitting.calibrate(
            robots,
            data,
            [fitting.Constant(*constant) for constant in constants],
            starts=search.starts,
            objective=search.fit_objective(),
            priors=search.priors,
            seed=search.seed,
            progress=progress,
            folder=folder,
        )
        analyses, problems = _analyse(fit, beyond, candidates, search.seed, progress)
    if output is not None:
        terminal.note_written(fitting.write_fitted(fit, output, inputs=inputs))
    _write(fit, analyses, outputs)
    for problem in problems:
        terminal.error(problem)
    if not fit.converged:
        terminal.error(f"not converged: {fit.reason}. Try --starts or --bounds.")
    return BAD_INPUT if problems else DONE if fit.converged else NOT_CONVERGED


def _check_sensor(names: Iterable[str]) -> None:
    """Refuse an unknown constant of the measurement, which is in no robot file."""
    from notchflex.fit import SENSOR

    for name in names:
        path = name.rpartition(":")[2]
        if path.startswith("sensor.") and path not in SENSOR:
            raise InputError.UNKNOWN_NAME(f"--fit {name}: give one of {', '.join(SENSOR)}.")


def _analyse(
    fit: Calibration,
    beyond: BeyondFit,
    candidates: LoadPath | None,
    seed: int,
    progress: terminal.Progress,
) -> tuple[dict[str, Any], list[str]]:
    """Make the analyses beyond the fit; one that fails must not lose the fit.

    Returns:
        The documents of the results by their keys, and what failed.
    """
    import notchflex.fit as fitting

    analyses: dict[str, tuple[str, Callable[..., Any], Callable[[Any], Any], dict[str, Any]]] = {}
    more: dict[str, Any] = {"seed": seed, "progress": progress}
    if by := beyond.leave_out:
        part = fitting.PHOTOGRAPH if beyond.photograph else None
        analyses["left_out"] = (
            "--leave-out", fitting.leave_out, fitting.left_out_document,
            {"by": by, "photograph": part, **more},
        )  # fmt: skip
    if candidates is not None:
        analyses["next_measurement"] = (
            "--next", fitting.next_measurement, fitting.next_measurement_document,
            {"candidates": candidates, "robot": beyond.next_robot, "narrow": beyond.narrow},
        )  # fmt: skip
    if beyond.posterior:
        analyses["posterior"] = (
            "--posterior", fitting.sample_posterior, fitting.posterior_document,
            {"draws": beyond.draws, **more},
        )  # fmt: skip
    documents: dict[str, Any] = {}
    problems: list[str] = []
    for key, (option, analysis, document, arguments) in analyses.items():
        try:
            documents[key] = document(analysis(fit, **arguments))
        except InputError as problem:
            problems.append(f"{option}: {problem}")
    return documents, problems


def _write(fit: Calibration, analyses: dict[str, Any], outputs: DrawnOutputs) -> None:
    printers = {
        "left_out": print_left_out,
        "next_measurement": print_next,
        "posterior": print_posterior,
    }

    def show() -> None:
        print_calibration(fit)
        for key, document in analyses.items():
            printers[key](document)

    def document() -> dict[str, Any]:
        from notchflex.fit import calibration_document

        return calibration_document(fit) | analyses

    outputs.write(document, show, picture=fit)


# Tables


def print_calibration(fit: Calibration) -> None:
    """Print constants, their intervals, problems found, and the errors of every part."""
    from notchflex.fit import NO_PROBLEMS, data_of, diagnose, errors_of_parts

    console = terminal.output()
    for label in fit.given:
        console.print(f"{label}: {', '.join(data_of(fit, label))}", soft_wrap=True)
    count, searches = fit.counted, len(fit.searches)
    words = f"{count} number{'s' * (count > 1)} measured"
    if totals := len(fit.residuals) - count:
        words += f" (and {totals} total angle{'s' * (totals > 1)}, the sum of the notches)"
    console.print(f"{words}; {searches} search{'es' if searches > 1 else ''}")
    chi = fit.reduced_chi_squared
    noise = f"; reduced chi squared {chi:.3g} (about 1: as noise)" if math.isfinite(chi) else ""
    console.print(f"{type(fit.problem.objective).__name__} {fit.cost:.6g}{noise}")
    if fit.drawing:
        names = ", ".join(f"{name} {sd:+.2g}" for name, sd in fit.deviations_of_drawing.items())
        console.print(f"Deviations within tolerances, in standard deviations: {names}.")
    console.print()
    rows: list[dict[str, Any]] = []
    for name, value in fit.values.items():
        row: dict[str, Any] = {"constant": name, "value": value, "unit": fit.units[name]}
        if interval := fit.intervals.get(name):
            row["95 % interval"] = (interval.lower, interval.upper)
        rows.append({**row, "deviation": fit.deviations[name]})
    forms = {"value": ".5g", "95 % interval": ".5g", "deviation": ".2g"}
    tables.show(tables.records(rows, **forms))
    console.print()
    for sentence in diagnose(fit) or (NO_PROBLEMS,):
        console.print(sentence)
    console.print()
    errors = [
        {
            "robot": part.robot,
            "measured": part.title,
            "rms error": part.error,
            "between repeats": part.repeats,
            "unit": part.unit,
        }
        for part in errors_of_parts(fit)
    ]
    tables.show(tables.records(errors))


def print_left_out(document: dict[str, Any]) -> None:
    """Print how well constants fitted without a part predict it."""
    errors: list[dict[str, Any]] = []
    constants: list[dict[str, Any]] = []
    updated: list[dict[str, Any]] = []
    for fold in document["folds"]:
        head, seen = {"left out": fold["left_out"]}, fold["photograph"] or {}
        unsolved: list[dict[str, Any]] = [{"quantity": "not solved"}]
        for error in fold["errors"] if fold["solved"] else unsolved:
            row = head | {"quantity": error["quantity"], "error": error.get("error")}
            unit = {"unit": error.get("unit", "")}
            errors.append(row | {"of fit to all": error.get("error_of_all")} | unit)
            if fold["before"]:
                after = {one["quantity"]: one["error"] for one in seen.get("errors", ())}
                row |= {"in 90 % band": error.get("inside_90")}
                row |= {"after photograph": after.get(error["quantity"])}
                updated.append(row | unit)
        for name, (mean, size) in fold["before"].items():
            value = seen.get("values", {}).get(name)
            row = {"constant": name, "before": f"{mean:.4g} ± {size:.2g}", "photograph": value}
            constants.append(head | row | {"width of total after / before": seen.get("gain")})
    console = terminal.output()
    console.print(f"\nFitted without each {document['by']}, and tried on it (root mean square):")
    tables.show(tables.records(errors))
    if constants:
        console.print("\nConstants of a robot left out, by prior and others, and by one row of it:")
        tables.show(tables.records(constants, photograph=".4g"))
        console.print()
        tables.show(tables.records(updated, **{"in 90 % band": ".0%"}))


def print_next(document: dict[str, Any]) -> None:
    """Print how much each candidate would narrow the intervals."""
    count = len(document["candidates"])
    shown = np.linspace(1, count, min(count, _MOST_CANDIDATES)).round().astype(int)
    rows: list[dict[str, Any]] = []
    for row in sorted({*shown.tolist(), document["best"]}):
        candidate = document["candidates"][row - 1]
        loads = {
            f"{key.partition('_')[0]} {tendon} {key.partition('_')[2]}": value
            for key, values in candidate["load"].items()
            for tendon, value in enumerate(values, start=1)
            if value is not None and math.isfinite(value)
        }
        gain = candidate["gain"] if candidate["converged"] else "not solved"
        best = "best" if row == document["best"] else ""
        rows.append({"candidate": row, **loads, "interval after / before": gain, " ": best})
    names = ", ".join(document["wanted"]) or "all constants together"
    terminal.output().print(f"\nNext measurement of {document['robot']}, to narrow {names}:")
    tables.show(tables.records(rows, **{"interval after / before": ".3f"}))


def print_posterior(document: dict[str, Any]) -> None:
    """Print mean, interval and convergence of the draws of every constant."""
    terminal.output().print(
        f"\nPosterior, {document['chains']} chains of {document['draws_per_chain']} draws, "
        f"{document['divergent']} divergent:"
    )
    forms = {"mean": ".5g", "interval_95": ".4g", "standard_deviation": ".2g"}
    tables.show(tables.records(document["constants"], **forms, effective_draws=".0f"))
