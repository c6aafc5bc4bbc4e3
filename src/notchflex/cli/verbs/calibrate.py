"""`notchflex calibrate`: from measurements to constants with confidence intervals."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_FOLDER,
    Bounds,
    Columns,
    DrawnOutputs,
    Folder,
    InPieces,
    converted,
    integer,
    low_high,
    named,
    number,
    once,
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
from notchflex.cli.terminal import BAD_INPUT, DONE
from notchflex.support import TendonCommand, load_columns, need, parse_number

if TYPE_CHECKING:
    from notchflex import Robot
    from notchflex.fit import Calibration, FitObjective

BEYOND = Group("Beyond the fit", sort_key=8)
_PAIR = "ROBOT=DATA.csv or LABEL=ROBOT=DATA.csv"
_BOUNDS = "NAME=LOW:HIGH, such as friction.coefficient=0:0.5; one of the two may be left out"
_PRIOR = "NAME=MEAN+-SD, such as material.elastic_modulus=10000+-500"
Prior = tuple[float, float]
Names = Annotated[tuple[str, ...], Parameter(metavar="NAME...")]


# Robots with their data

Source = tuple[str, str, str]
"""Label and name or file of a robot, and a file of its measurements."""


def _read_source(text: str) -> Source:
    words = [word.strip() for word in text.split("=")]
    if len(words) not in (2, 3) or not all(words):
        raise InputError.BAD_SYNTAX(f"give a robot with its data: {_PAIR}.")
    *label, robot, data = words
    (label,) = label or [robot_label(robot)]
    if ":" in label or os.sep in label:
        raise InputError.BAD_SYNTAX(f"a label must not contain `:` or `{os.sep}`; choose another.")
    if label in ("each", "offset", "factor"):
        raise InputError.CONFLICT(
            f"the label `{label}` has a meaning before names of constants; choose another."
        )
    return label, robot, data


def _gathered(sources: Sequence[Source]) -> tuple[dict[str, str], dict[str, list[str]]]:
    """Return by label the name or file of each robot, and its files of measurements."""
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
        data.setdefault(label, []).append(file)
        once(f"{label}:", data[label])
    return robots, data


def _changed(robots: Mapping[str, str], settings: Sequence[str]) -> dict[str, Robot]:
    """Load robots with the values of `--set`: of all, or of one whose label precedes."""
    of_robot: dict[str, list[str]] = {label: [] for label in robots}
    for text in settings:
        label, colon, rest = text.partition(":")
        of_one = colon and "=" not in label
        if of_one:
            _check_known(label, robots, f"--set {text}", "no robot of this fit is called that")
        for each in [label] if of_one else robots:
            of_robot[each].append(rest if of_one else text)
    return {label: chosen_robot(name, of_robot[label]) for label, name in robots.items()}


def _check_known(name: str, allowed: Iterable[str], source: str, problem: str) -> None:
    if name not in allowed:
        raise InputError.UNKNOWN_NAME(f"{source}: {problem}; allowed: {', '.join(allowed)}.")


# What is found, and what is made of it


def _read_prior(values: str) -> Prior:
    mean, sign, sd = re.sub(r"\+-", "±", values).partition("±")
    if not sign:
        raise InputError.BAD_SYNTAX(f"give {_PRIOR}.")
    return parse_number(mean, _PRIOR), parse_number(sd, _PRIOR)


@Parameter(name="*")
@dataclass(frozen=True)
class FitOptions:
    """What is found, and how.

    Attributes:
        fit: Constants to find, joined by commas: values of all robots; `LABEL:` before one for a
            single robot, `each:` for one in every robot, `notch[each].` in every notch;
            `offset:notch.depth` added to, `factor:notch.height` multiplying every such value;
            `notch.precurvature_deg/height`; `sensor.force_offset`, `sensor.force_factor`,
            `sensor.stroke_slack`.
        bounds: Limits in the unit, `NAME=LOW:HIGH`.
        prior: Prior in the unit, `NAME=MEAN+-SD`.
        priors: Let what is not fitted deviate within its tolerances; not with `each:` or other
            objectives.
        objective: Squared residuals over their noise, which alone give intervals; eq. 17 of
            Pacheco 2021; distances of points (Gao 2017, eq. 27).
        huber: Outliers beyond so many standard deviations count less; about 1.5.
        starts: Number of starting points.
        seed: Seed of the starting points.
    """

    fit: Names
    bounds: Annotated[tuple[tuple[str, Bounds], ...], named(_BOUNDS, low_high(_BOUNDS))] = ()
    prior: Annotated[tuple[tuple[str, Prior], ...], named(_PRIOR, _read_prior)] = ()
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
        once("--fit", names)
        limits, priors = dict(self.bounds), dict(self.prior)
        for option, pairs in {"--bounds": self.bounds, "--prior": self.prior}.items():
            once(option, (name for name, _ in pairs))
            for name, _ in pairs:
                _check_known(name, names, f"{option} {name}", "this constant is not fitted")
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
        leave_out: Also fit without each, and predict what was left out.
        photograph: With `--leave-out robot`: predict it again after its own constants (`each:`)
            were updated by one of its rows.
        next: Tensions [N] as in `simulate --tension`: which, measured next, narrows the intervals
            most.
        next_robot: Label of the robot of `--next`; the first if left out.
        narrow: Constant that `--next` is to narrow; all by default.
        posterior: Also sample the posterior (extra `bayes`).
        draws: Draws of each of its two chains.
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
            source = f"--next-robot {self.next_robot}"
            _check_known(self.next_robot, robots, source, "no robot of this fit is called that")
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
            help=f"{_PAIR}: a robot and its measurements, with columns as "
            "`notchflex.read_measurements` reads them. The same robot again adds data."
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
        output: Write the fitted robots (LABEL.toml) into this folder.
    """
    names, sources = _gathered(pairs)
    constants = search.constants()
    beyond.check(names, search.objective)
    inputs = [Path(file) for files in sources.values() for file in files]
    inputs += robot_files(*names.values())
    fitted = [f"{label}.toml" for label in names]
    outputs.check(inputs, folder=("--output", output, fitted))
    robots = _changed(names, settings)
    folder = pieces.chosen("calibration", inputs)
    candidates = None
    if beyond.next:
        robot = robots[beyond.next_robot or next(iter(robots))]
        candidates = load_columns(beyond.next, (), robot.number_of_tendons)

    with terminal.progress("loading the solver"):
        import notchflex.fit as fitting

    for name, *_ in constants:
        path_of_value = name.rpartition(":")[2]
        if path_of_value.startswith("sensor."):
            _check_known(path_of_value, fitting.SENSOR, f"--fit {name}", "no sensor has this")
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

    def show(fit: Calibration) -> None:
        print_calibration(fit)
        for key, document in analyses.items():
            _ANALYSES[key][1](document)

    outputs.write(fit, lambda fit: fitting.calibration_document(fit) | analyses, show)
    for problem in problems:
        terminal.error(problem)
    code = DONE
    if not fit.converged:
        code = terminal.failed(f"not converged: {fit.reason}. Try --starts or --bounds.")
    return BAD_INPUT if problems else code


def _analyse(
    fit: Calibration,
    beyond: BeyondFit,
    candidates: tuple[Any, Any] | None,
    seed: int,
    progress: terminal.Progress,
) -> tuple[dict[str, Any], list[str]]:
    """Make the analyses beyond the fit; one that fails must not lose the fit.

    Returns:
        The documents of the results by their keys, and what failed.
    """
    import notchflex.fit as fitting
    from notchflex import LoadPath

    analyses: dict[str, Callable[[], dict[str, Any]]] = {}
    if beyond.leave_out is not None:
        part = fitting.PHOTOGRAPH if beyond.photograph else None
        analyses["left_out"] = lambda: fitting.left_out_document(
            fitting.leave_out(
                fit, by=beyond.leave_out or "pull", photograph=part, seed=seed, progress=progress
            )
        )
    if candidates is not None:
        analyses["next_measurement"] = lambda: fitting.next_measurement_document(
            fitting.next_measurement(
                fit, LoadPath(*candidates), robot=beyond.next_robot, narrow=beyond.narrow
            )
        )
    if beyond.posterior:
        analyses["posterior"] = lambda: fitting.posterior_document(
            fitting.sample_posterior(fit, draws=beyond.draws, seed=seed, progress=progress)
        )
    documents: dict[str, Any] = {}
    problems: list[str] = []
    for key, analysis in analyses.items():
        try:
            documents[key] = analysis()
        except InputError as problem:
            problems.append(f"{_ANALYSES[key][0]}: {problem}")
    return documents, problems


# Tables


def print_calibration(fit: Calibration) -> None:
    """Print constants, their intervals, problems found, and the errors of every part."""
    from notchflex.fit import NO_PROBLEMS, calibration_document

    document = calibration_document(fit)
    for label, robot in document["robots"].items():
        terminal.line(f"{label}: {', '.join(robot['data'])}")
    count, searches = document["numbers_counted"], len(document["searches"])
    words = f"{count} number{'s' * (count > 1)} measured"
    if totals := document["numbers_measured"] - count:
        words += f" (and {totals} total angle{'s' * (totals > 1)}, the sum of the notches)"
    terminal.line(f"{words}; {searches} search{'es' if searches > 1 else ''}")
    chi = document["reduced_chi_squared"]
    noise = "" if chi is None else f"; reduced chi squared {chi:.3g} (about 1: as noise)"
    terminal.line(f"{document['objective']['name']} {fit.cost:.6g}{noise}")
    if fit.drawing:
        names = ", ".join(f"{name} {sd:+.2g}" for name, sd in fit.deviations_of_drawing.items())
        terminal.show(f"Deviations within tolerances, in standard deviations: {names}.")
    terminal.line("")
    tables.show(
        document["constants"],
        "name value unit interval_95 standard_deviation",
        {"value": ".5g", "interval_95": ".5g", "standard_deviation": ".2g"},
    )
    terminal.show("", *(document["verdict"] or (NO_PROBLEMS,)), "")
    tables.show(document["errors"], "robot quantity part rmse repeats unit")


def _print_left_out(document: dict[str, Any]) -> None:
    """Print how well constants fitted without a part predict it."""
    errors: list[dict[str, Any]] = []
    constants: list[dict[str, Any]] = []
    for fold in document["folds"]:
        head, seen = {"left_out": fold["left_out"]}, fold["photograph"] or {}
        after = {one["quantity"]: one["error"] for one in seen.get("errors", ())}
        unsolved: list[dict[str, Any]] = [{"quantity": "not solved"}]
        for error in fold["errors"] if fold["solved"] else unsolved:
            errors.append(head | error | {"after_photograph": after.get(error["quantity"])})
        for name, (mean, size) in fold["before"].items():
            row = {"constant": name, "before": f"{mean:.4g} ± {size:.2g}"}
            row |= {"photograph": seen.get("values", {}).get(name)}
            constants.append(head | row | {"width_of_total_after_/_before": seen.get("gain")})
    terminal.line(f"\nFitted without each {document['by']}, and tried on it (root mean square):")
    keys = "left_out quantity error error_of_all inside_90 after_photograph unit"
    tables.show(errors, keys, {"inside_90": ".0%"})
    if constants:
        terminal.line("\nConstants of a robot left out, by prior and others, and by one row of it:")
        tables.show(constants, forms={"photograph": ".4g"})


def _print_next(document: dict[str, Any]) -> None:
    """Print how much each candidate would narrow the intervals."""
    rows: list[dict[str, Any]] = []
    for row, candidate in enumerate(document["candidates"], start=1):
        loads = {
            f"{key.partition('_')[0]}_{tendon}_{key.partition('_')[2]}": value
            for key, values in candidate["load"].items()
            for tendon, value in enumerate(values, start=1)
        }
        gain = candidate["gain"] if candidate["converged"] else "not solved"
        rows.append({"candidate": row, **loads, "interval_after_/_before": gain})
    names = ", ".join(document["wanted"]) or "all constants together"
    terminal.line(f"\nNext measurement of {document['robot']}, to narrow {names}:")
    tables.show(rows, forms={"interval_after_/_before": ".3f"}, most=60)
    terminal.line(f"best: candidate {document['best']}")


def _print_posterior(document: dict[str, Any]) -> None:
    """Print mean, interval and convergence of the draws of every constant."""
    terminal.line(
        f"\nPosterior, {document['chains']} chains of {document['draws_per_chain']} draws, "
        f"{document['divergent']} divergent:"
    )
    forms = {"mean": ".5g", "interval_95": ".4g", "standard_deviation": ".2g"}
    tables.show(document["constants"], forms=forms | {"effective_draws": ".0f"})


_ANALYSES = {
    "left_out": ("--leave-out", _print_left_out),
    "next_measurement": ("--next", _print_next),
    "posterior": ("--posterior", _print_posterior),
}
