"""Loads on the command line: tensions and strokes of the tendons, and external loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, NamedTuple

from cyclopts import Group, Parameter

from notchflex.cli.arguments.conversion import (
    Vector,
    converted,
    flag,
    number,
    parse_spec,
    vector,
)
from notchflex.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from notchflex.loads import LoadPath

LOADS = Group(
    "External loads", sort_key=8, help="They act before the first step and stay as they are."
)
_BODY = "BODY:X,Y,Z or BODY:X,Y,Z@X,Y,Z, such as 3:0,0.1,0 or 3:0,0.1,0@0.8,0,0.5"
_DIGITS = 9
"""More digits than any number of a body has."""


class TendonCommand(NamedTuple):
    """One `--tension` or `--stroke`: `source` as typed, tendon from 1 if named, its steps."""

    source: str
    tendon: int | None
    steps: list[float]


def tendon_command(option: str, *, negative: bool = False) -> Parameter:
    """Return the parameter of an option `SPEC` or `TENDON=SPEC` that may be given several times."""
    return converted(partial(_read_command, option, negative), "SPEC", several=True)


def _read_command(option: str, negative: bool, text: str) -> TendonCommand:
    name, equals, spec = text.rpartition("=")
    if equals and not name.strip().lstrip("-").isdecimal():
        raise InputError.BAD_SYNTAX(f"{name!r} is not a tendon; give its number, counted from 1.")
    steps = parse_spec(spec)
    if not negative and min(steps) < 0:
        least = next(step for step in steps if step < 0)
        raise InputError.OUT_OF_RANGE(f"got {least:g} N; a tendon only pulls, so give 0 N or more.")
    return TendonCommand(f"{option} {text}", int(name) if equals else None, steps)


def load_columns(
    tension: Sequence[TendonCommand], stroke: Sequence[TendonCommand], tendons: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the commanded tensions and strokes of every step.

    A single value holds for all steps; longer columns must have one length.

    Returns:
        Tensions [N] and strokes [mm], each (S, tendons), NaN where not commanded.
    """
    import numpy as np

    if not (tension or stroke):
        raise InputError.MISSING_VALUE(
            "Give a load: --tension SPEC or --stroke SPEC, for example --tension 2."
        )
    longest = max((*tension, *stroke), key=lambda command: len(command.steps))
    tables = np.full((2, len(longest.steps), tendons), np.nan)
    commanded: dict[int, str] = {}
    for table, commands in zip(tables, (tension, stroke), strict=True):
        for command in commands:
            index = _tendon_index(command, tendons)
            if index in commanded:
                raise InputError.CONFLICT(
                    f"{command.source}: tendon {index + 1} already has {commanded[index]}; "
                    "give each tendon one tension or one stroke."
                )
            if len(command.steps) not in (1, len(longest.steps)):
                raise InputError.WRONG_SHAPE(
                    f"{command.source} has {len(command.steps)} steps and {longest.source} has "
                    f"{len(longest.steps)}; give equal numbers of steps, or a single value for all."
                )
            commanded[index] = command.source
            table[:, index] = command.steps
    return tables[0], tables[1]


def _tendon_index(command: TendonCommand, tendons: int) -> int:
    """Return the tendon of a command, counted from 0."""
    has = "1 tendon" if tendons == 1 else f"{tendons} tendons"
    if command.tendon is None and tendons > 1:
        option, _, text = command.source.partition(" ")
        raise InputError.MISSING_VALUE(
            f"{command.source}: the robot has {has}; say which one, for example {option} 1={text}."
        )
    number = 1 if command.tendon is None else command.tendon
    if not 1 <= number <= tendons:
        raise InputError.UNKNOWN_NAME(
            f"{command.source}: there is no tendon {number}; the robot has {has}."
        )
    return number - 1


class BodyForceOption(NamedTuple):
    """One `--body-force`: number of the body, force [N], and its point [mm] if given."""

    body: int
    force: Vector
    point: Vector | None


def _read_body_force(text: str) -> BodyForceOption:
    body, colon, rest = text.partition(":")
    force, at, point = rest.partition("@")
    if not colon or not body.strip().isdecimal() or len(body) > _DIGITS:
        raise InputError.BAD_SYNTAX(f"give {_BODY}.")

    def read(words: str, what: str) -> Vector:
        try:
            return vector(what)(words)
        except InputError as problem:
            message = f"{words!r} is not three finite {what}; give {_BODY}."
            raise InputError(message, problem.code) from None

    where = read(point, "coordinates in mm") if at else None
    return BodyForceOption(int(body), read(force, "forces in N"), where)


def _xyz(what: str, text: str) -> Parameter:
    return converted(vector(what), "X,Y,Z", help=text)


@Parameter(name="*", group=LOADS)
@dataclass(frozen=True)
class ExternalLoads:
    """Loads that act on all steps, beside the tendons."""

    tip_force: Annotated[
        Vector | None, _xyz("forces in N", "Force X,Y,Z at the tip [N], in the world.")
    ] = None
    tip_moment: Annotated[
        Vector | None, _xyz("moments in N mm", "Moment X,Y,Z at the tip [N mm], in the world.")
    ] = None
    tip_point: Annotated[
        Vector | None,
        _xyz(
            "coordinates in mm",
            "Where the tip force acts and the tip mass hangs: X,Y,Z from the tip [mm], in the "
            "frame of the tip.",
        ),
    ] = None
    body_force: Annotated[
        tuple[BodyForceOption, ...],
        converted(_read_body_force, "BODY:X,Y,Z[@X,Y,Z]", several=True, name="--body-force"),
        Parameter(
            help="Force on a rigid body [N]: 0 is the base, 1 the body beyond the first notch. The "
            "point of application after @ [mm] is in the frame of the body; its origin if left "
            "out. May be given several times.",
        ),
    ] = ()
    tip_mass: Annotated[
        float | None,
        converted(partial(number, form="a finite number of grams, 0 or more", least=0.0), "G"),
        Parameter(help="Mass that hangs at the tip [g]; along 0,0,-9.81 without --gravity."),
    ] = None
    gravity: Annotated[
        Vector | None,
        _xyz(
            "accelerations in m/s2",
            "Gravity X,Y,Z in the world [m/s2]; the robot's own weight counts where "
            "material.density is known.",
        ),
    ] = None
    following: Annotated[
        bool,
        flag("Forces and moments turn with the body they act on, and are given in its frame."),
    ] = False

    def __post_init__(self) -> None:
        """Refuse an option that has no effect without another one."""
        if self.following and not (self.tip_force or self.tip_moment or self.body_force):
            raise InputError.CONFLICT(
                "--following: nothing turns; give --tip-force, --tip-moment or --body-force."
            )
        if self.tip_point and self.tip_force is None and self.tip_mass is None:
            point = ",".join(f"{value:g}" for value in self.tip_point)
            raise InputError.CONFLICT(
                f"--tip-point {point}: nothing acts there; give --tip-force or --tip-mass."
            )

    def __bool__(self) -> bool:
        """Whether any option was given."""
        return self != ExternalLoads()

    def on(self, path: LoadPath) -> LoadPath:
        """Return the path with these loads on all its steps."""
        from notchflex.loads import BodyForce

        of_tip = {
            name: value
            for name in ("tip_force", "tip_moment", "tip_point", "tip_mass", "gravity")
            if (value := getattr(self, name)) is not None
        }
        forces = [
            BodyForce(body, force, point=point or (0.0, 0.0, 0.0), following=self.following)
            for body, force, point in self.body_force
        ]
        turns = self.following and bool(self.tip_force or self.tip_moment)
        return path.loaded(**of_tip, body_forces=forces or None, following=turns)
