"""Options of `notchflex calibrate`: robots with their data, constants to find, further analyses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from cyclopts import Group, Parameter

from notchflex import InputError
from notchflex.cli.arguments.conversion import converted, low_high, named
from notchflex.cli.arguments.loads import tendon_command
from notchflex.support import TendonCommand, need, parse_number, parse_whole

if TYPE_CHECKING:
    from notchflex.fit import FitObjective
from notchflex.cli.arguments.data_sources import DataSources

BEYOND = Group("Beyond the fit", sort_key=8)
Names = Annotated[tuple[str, ...], Parameter(metavar="NAME...", negative=(), show_default=False)]


class ParameterSpec(NamedTuple):
    """A constant to find, with limits and prior (mean, standard deviation) where given."""

    name: str
    lower: float | None = None
    upper: float | None = None
    prior: tuple[float, float] | None = None


_BOUNDS = "NAME=LOW:HIGH, such as friction.coefficient=0:0.5; one of the two may be left out"
_PRIOR = "NAME=MEAN+-SD, such as material.elastic_modulus=10000+-500"


def _read_prior(values: str) -> tuple[float, float]:
    words = re.split(r"\+-|±", values)
    if len(words) != 2:
        raise InputError.BAD_SYNTAX(f"give {_PRIOR}.")
    return parse_number(words[0], _PRIOR), parse_number(words[1], _PRIOR)


@Parameter(name="*")
@dataclass(frozen=True)
class FitOptions:
    """What is found, and how."""

    fit: Annotated[
        Names,
        Parameter(
            help="Constants to find, joined by commas: values of the robot file, shared by all "
            "robots; `LABEL:` before one for a single robot, `each:` for one in every robot, "
            "`notch[each].` for one in every notch; `offset:notch.depth` added to, "
            "`factor:notch.height` multiplying every such value; `notch.precurvature_deg/height`; "
            "`sensor.force_offset`, `sensor.force_factor`, `sensor.stroke_slack`."
        ),
    ]
    bounds: Annotated[
        tuple[tuple[str, tuple[float | None, float | None]], ...],
        converted(
            partial(named, _BOUNDS, partial(low_high, _BOUNDS)), "NAME=LOW:HIGH", several=True
        ),
        Parameter(name="--bounds", help="Limits of a constant, `NAME=LOW:HIGH`, in its unit."),
    ] = ()
    prior: Annotated[
        tuple[tuple[str, tuple[float, float]], ...],
        converted(partial(named, _PRIOR, _read_prior), "NAME=MEAN+-SD", several=True),
        Parameter(name="--prior", help="Prior of a constant, `NAME=MEAN+-SD`, in its unit."),
    ] = ()
    priors: Annotated[
        bool,
        Parameter(
            negative="--no-priors",
            help="Whether what is not fitted may deviate from the file within its tolerances, or "
            "those that are assumed. Not with `each:`, nor with other objectives.",
        ),
    ] = True
    objective: Annotated[
        Literal["least-squares", "robot-errors", "distances"],
        Parameter(
            help="What is minimised: squared residuals over their noise; eq. 17 of Pacheco 2021; "
            "the sum of distances of points (Gao 2017, eq. 27). Only the first gives intervals."
        ),
    ] = "least-squares"
    huber: Annotated[
        float | None,
        converted(partial(parse_number, form="a number of standard deviations"), "SD"),
        Parameter(help="Outliers beyond so many standard deviations count less; about 1.5."),
    ] = None
    starts: Annotated[
        int, converted(parse_whole(1), "N"), Parameter(help="Number of starting points.")
    ] = 4
    seed: Annotated[
        int, converted(parse_whole(0), "N"), Parameter(help="Seed of the starting points.")
    ] = 0

    def __post_init__(self) -> None:
        """Check that the options belong together."""
        if self.huber is not None and self.objective != "least-squares":
            raise InputError.CONFLICT(
                f"--huber {self.huber:g} belongs to least-squares; leave out one of the two."
            )

    def constants(self) -> tuple[ParameterSpec, ...]:
        """Return the constants with their limits and priors."""
        names = [name.strip() for text in self.fit for name in text.split(",")]
        if not names or not all(names):
            raise InputError.MISSING_VALUE(
                "--fit needs names of constants joined by commas, such as "
                "friction.coefficient,material.elastic_modulus."
            )
        _once(names, "--fit")
        for option, values in (("--bounds", self.bounds), ("--prior", self.prior)):
            _once([name for name, _ in values], option)
            for name in (name for name, _ in values if name not in names):
                raise InputError.UNKNOWN_NAME(
                    f"{option} {name}: this constant is not fitted; --fit names {', '.join(names)}."
                )
        limits, priors = dict(self.bounds), dict(self.prior)
        return tuple(
            ParameterSpec(name, *limits.get(name, (None, None)), priors.get(name)) for name in names
        )

    def fit_objective(self) -> FitObjective:
        """Return the objective of the library."""
        from notchflex.fit import LeastSquares, SumOfDistances, SumOfRobotErrors

        if self.objective == "robot-errors":
            return SumOfRobotErrors()
        return SumOfDistances() if self.objective == "distances" else LeastSquares(self.huber)


def _once(names: Sequence[str], option: str) -> None:
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError.CONFLICT(f"{option} {twice} is given twice; give it once.")


@Parameter(name="*", group=BEYOND)
@dataclass(frozen=True)
class BeyondFit:
    """Further analyses of a finished fit."""

    leave_out: Annotated[
        Literal["pull", "robot"] | None,
        Parameter(help="Also fit without each pull or robot, and predict what was left out."),
    ] = None
    photograph: Annotated[
        bool,
        Parameter(
            negative=(),
            help="With `--leave-out robot`: update the constants that each robot has of its own "
            "(`each:`) by one row of the robot left out, and predict its other rows again.",
        ),
    ] = False
    next: Annotated[
        tuple[TendonCommand, ...],
        tendon_command("--next"),
        Parameter(
            name="--next",
            help="Candidates for the next measurement: tensions [N] as in `simulate --tension`. "
            "Shows which narrows the intervals most.",
        ),
    ] = ()
    next_robot: Annotated[
        str | None,
        Parameter(metavar="LABEL", help="Label of the robot of `--next`; the first if left out."),
    ] = None
    narrow: Annotated[
        Names, Parameter(help="Constant that `--next` is to narrow; all together if left out.")
    ] = ()
    posterior: Annotated[
        bool, Parameter(negative=(), help="Also sample the posterior (extra `bayes`).")
    ] = False
    draws: Annotated[
        int,
        converted(parse_whole(4), "N"),
        Parameter(help="Draws of each of the two chains of `--posterior`."),
    ] = 500

    def check(self, sources: DataSources, objective: str) -> None:
        """Check what could not be done after the fit, before the time for the fit is spent."""
        if (self.next_robot is not None or self.narrow) and not self.next:
            raise InputError.CONFLICT(
                "--next-robot and --narrow belong to --next; give candidates with it."
            )
        if self.next_robot is not None:
            sources.check_label(self.next_robot, f"--next-robot {self.next_robot}")
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
        if self.leave_out == "robot" and len(sources.robots) < 2:
            raise InputError.TOO_FEW_DATA(
                "--leave-out robot: there is only one robot; give two or more."
            )
