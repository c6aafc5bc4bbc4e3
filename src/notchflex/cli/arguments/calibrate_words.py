"""What `notchflex calibrate` is given: robots with their data, constants, what goes together."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from notchflex._extras import need
from notchflex.cli.arguments.options import chosen_robot
from notchflex.errors import InputError
from notchflex.robot import Robot

PAIR = "ROBOT=DATA.csv or LABEL=ROBOT=DATA.csv"


class Given(NamedTuple):
    """Robots by label: the name or file of each, and its files of measurements."""

    robot: dict[str, str]
    data: dict[str, list[str]]


class Wanted(NamedTuple):
    """A constant as it was asked for, with limits and prior where given."""

    name: str
    lower: float | None = None
    upper: float | None = None
    prior: tuple[float, float] | None = None


def parse_pairs(texts: Sequence[str]) -> Given:
    """Read `ROBOT=DATA.csv` and `LABEL=ROBOT=DATA.csv`; a label that comes again has more data.

    Without a label a robot is called after its name or its file.

    Raises:
        InputError: Not of this form, or one label for two robots.

    Example:
        >>> parse_pairs(["my-wrist.toml=a.csv", "my-wrist.toml=b.csv"])
        Given(robot={'my-wrist': 'my-wrist.toml'}, data={'my-wrist': ['a.csv', 'b.csv']})
    """
    given = Given({}, {})
    if not texts:
        raise InputError.MISSING_VALUE(f"Give a robot with its data: {PAIR}.")
    for text in texts:
        words = [word.strip() for word in text.split("=")]
        if len(words) not in (2, 3) or not all(words):
            raise InputError.BAD_SYNTAX(f"`{text}` is no robot with its data; give {PAIR}.")
        robot, data = words[-2:]
        label = words[0] if len(words) == 3 else _label(robot)
        if ":" in label or os.sep in label:
            raise InputError.BAD_SYNTAX(
                f"`{text}`: a label must not hold `:` or `{os.sep}`; choose another."
            )
        if given.robot.setdefault(label, robot) != robot:
            raise InputError.CONFLICT(
                f"{given.robot[label]} and {robot} are both called {label}; give one of them "
                f"another label: LABEL={robot}={data}."
            )
        if label == "each":
            raise InputError.CONFLICT(
                f"`{text}`: no robot can be called each, which stands for every robot; choose "
                "another label."
            )
        own = given.data.setdefault(label, [])
        if data in own:
            raise InputError.CONFLICT(f"{data} is given twice for {label}; give it once.")
        own.append(data)
    return given


def parse_fit(
    texts: Sequence[str], bounds: Sequence[str] = (), priors: Sequence[str] = ()
) -> tuple[Wanted, ...]:
    """Read `--fit`, `--bounds` and `--prior`.

    Raises:
        InputError: No constant, one that is named twice, or limits or a prior that cannot be read
            or are of a constant that is not fitted.

    Example:
        >>> parse_fit(["friction.coefficient"], ["friction.coefficient=0:0.5"])
        (Wanted(name='friction.coefficient', lower=0.0, upper=0.5, prior=None),)
    """
    names = [name.strip() for text in texts for name in text.split(",")]
    if not names or not all(names):
        raise InputError.MISSING_VALUE(
            "--fit needs names of constants joined by commas, such as "
            "friction.coefficient,material.elastic_modulus."
        )
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError.CONFLICT(f"--fit {twice} is given twice; give it once.")
    limits = dict(_bounds(text, names) for text in _once(bounds, "--bounds"))
    known = dict(_prior(text, names) for text in _once(priors, "--prior"))
    return tuple(Wanted(name, *limits.get(name, (None, None)), known.get(name)) for name in names)


def robots_of(given: Given, settings: Sequence[str]) -> dict[str, Robot]:
    """Load the robots, with the values of `--set`: of all, or of one where its label is before.

    Raises:
        InputError: A robot or a value that there is not.
    """
    own: dict[str, list[str]] = {label: [] for label in given.robot}
    for text in settings:
        label, colon, rest = text.partition(":")
        named = colon and "=" not in label
        if named and label not in own:
            raise InputError.UNKNOWN_NAME(
                f"--set {text}: no robot of this fit is called {label}; there are {', '.join(own)}."
            )
        for one in [label] if named else own:
            own[one].append(rest if named else text)
    return {label: chosen_robot(name, own[label]) for label, name in given.robot.items()}


def check_options(
    objective: str,
    huber: float | None,
    starts: int,
    seed: int,
    next_: tuple[str, ...],
    next_robot: str | None,
    narrow: tuple[str, ...],
    given: Given,
) -> None:
    """Refuse what does not go together before anything is loaded."""
    if huber is not None and objective != "least-squares":
        raise InputError.CONFLICT(
            f"--huber {huber:g} belongs to least-squares; leave out one of the two."
        )
    for option, number, least in (("--starts", starts, 1), ("--seed", seed, 0)):
        if number < least:
            raise InputError.OUT_OF_RANGE(f"{option} {number}: give {least} or more.")
    if (next_robot is not None or narrow) and not next_:
        raise InputError.CONFLICT(
            "--next-robot and --narrow belong to --next; give candidates with it."
        )
    if next_robot is not None and next_robot not in given.robot:
        raise InputError.UNKNOWN_NAME(
            f"--next-robot {next_robot}: no robot of this fit is called so; there are "
            f"{', '.join(given.robot)}."
        )


def check_beyond(
    objective: str, posterior: bool, draws: int, leave_out: str | None, given: Given
) -> None:
    """Refuse what could not be done after the fit before the time for it is spent."""
    if posterior and objective != "least-squares":
        raise InputError.CONFLICT(
            f"--posterior needs least-squares: {objective} is no likelihood. Leave out one of the "
            "two."
        )
    if posterior:
        need("numpyro", "bayes", "--posterior")
    if draws < 4:
        raise InputError.OUT_OF_RANGE(f"--draws {draws}: give 4 or more.")
    if leave_out == "robot" and len(given.robot) < 2:
        raise InputError.TOO_FEW_DATA(
            "--leave-out robot: there is only one robot; give two or more."
        )


def check_sensor(names: list[str]) -> None:
    """Tell a wrong name of a constant of the measurement, which is in no robot file."""
    from notchflex.fit.model.rows import SENSOR

    for name in names:
        path = name.rpartition(":")[2]
        if path.startswith("sensor.") and path not in SENSOR:
            raise InputError.UNKNOWN_NAME(f"--fit {name}: there are {' and '.join(SENSOR)}.")


def _label(robot: str) -> str:
    path = Path(robot)
    return path.stem if path.suffix == ".toml" else path.name


def _once(texts: Sequence[str], option: str) -> Sequence[str]:
    names = [text.partition("=")[0].strip() for text in texts]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError.CONFLICT(f"{option} of {twice} is given twice; give it once.")
    return texts


def _bounds(text: str, names: Sequence[str]) -> tuple[str, tuple[float | None, float | None]]:
    form = "NAME=LOW:HIGH, such as friction.coefficient=0:0.5; one of the two may be left out"
    name, values = _of_constant(text, names, "--bounds", form)
    low, colon, high = values.partition(":")
    if not colon or not (low.strip() or high.strip()):
        raise InputError.BAD_SYNTAX(f"--bounds {text}: give {form}.")
    lower, upper = (
        _number(word, text, "--bounds", form) if word.strip() else None for word in (low, high)
    )
    return name, (lower, upper)


def _prior(text: str, names: Sequence[str]) -> tuple[str, tuple[float, float]]:
    form = "NAME=MEAN+-SD, such as material.elastic_modulus=10000+-500"
    name, values = _of_constant(text, names, "--prior", form)
    words = re.split(r"\+-|±", values)
    if len(words) != 2:
        raise InputError.BAD_SYNTAX(f"--prior {text}: give {form}.")
    mean, deviation = (_number(word, text, "--prior", form) for word in words)
    return name, (mean, deviation)


def _of_constant(text: str, names: Sequence[str], option: str, form: str) -> tuple[str, str]:
    name, equals, values = (word.strip() for word in text.partition("="))
    if not (name and equals and values):
        raise InputError.BAD_SYNTAX(f"{option} {text}: give {form}.")
    if name not in names:
        raise InputError.UNKNOWN_NAME(
            f"{option} {text}: {name} is not fitted; --fit names {', '.join(names)}."
        )
    return name, values


def _number(word: str, text: str, option: str, form: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError.BAD_SYNTAX(
            f"{option} {text}: {word.strip()!r} is no finite number; give {form}."
        )
    return value
