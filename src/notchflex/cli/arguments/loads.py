"""External loads on the command line: forces, moments, a hung mass and gravity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from notchflex.cli.arguments.spec import parse_vector
from notchflex.errors import InputError

if TYPE_CHECKING:
    from notchflex.loads import BodyForce, LoadPath

LOADS = Group(
    "External loads", sort_key=8, help="They act before the first step and stay as they are."
)
_OPTION = Parameter(group=LOADS, allow_leading_hyphen=True)
_BODY = "BODY:X,Y,Z or BODY:X,Y,Z@X,Y,Z, such as 3:0,0.1,0 or 3:0,0.1,0@0.8,0,0.5"

TipForce = Annotated[
    str | None, _OPTION, Parameter(help="Force X,Y,Z at the tip [N], in the world.")
]
TipMoment = Annotated[
    str | None, _OPTION, Parameter(help="Moment X,Y,Z at the tip [N mm], in the world.")
]
TipPoint = Annotated[
    str | None,
    _OPTION,
    Parameter(
        help="Where the tip force acts and the tip mass hangs: X,Y,Z from the tip [mm], in the "
        "frame of the tip.",
    ),
]
BodyForces = Annotated[
    tuple[str, ...],
    _OPTION,
    Parameter(
        name="--body-force",
        negative=(),
        show_default=False,
        help="Force on a rigid body, BODY:X,Y,Z[@X,Y,Z] [N, mm]: 0 is the base, 1 the body beyond "
        "the first notch; the point after @ is in the frame of the body, and its origin if left "
        "out. May be given several times.",
    ),
]
TipMass = Annotated[
    str | None,
    _OPTION,
    Parameter(help="Mass that hangs at the tip [g]; along 0,0,-9.81 without --gravity."),
]
Gravity = Annotated[
    str | None,
    _OPTION,
    Parameter(
        help="Gravity X,Y,Z in the world [m/s2]; the robot's own weight counts where "
        "material.density is known.",
    ),
]
Following = Annotated[
    bool,
    Parameter(
        group=LOADS,
        negative=(),
        show_default=False,
        help="Forces and moments turn with the body they act on, and are given in its frame.",
    ),
]

# More digits than any number of a body has.
_DIGITS = 9


def parse_loads(
    *,
    tip_force: str | None = None,
    tip_moment: str | None = None,
    tip_point: str | None = None,
    body_force: Sequence[str] = (),
    tip_mass: str | None = None,
    gravity: str | None = None,
    following: bool = False,
) -> dict[str, Any]:
    """Return what the options say, as plain numbers: the solver is not yet loaded.

    Args:
        tip_force: What `--tip-force` was given; this and the others None where left out.
        tip_moment: The same of `--tip-moment`.
        tip_point: The same of `--tip-point`.
        body_force: All that `--body-force` was given.
        tip_mass: The same of `--tip-mass`.
        gravity: The same of `--gravity`.
        following: Whether `--following` was given.

    Returns:
        The arguments of `LoadPath.loaded` that were given; each of `body_forces` is a dict of
        the arguments of `BodyForce`.

    Raises:
        InputError: Not of the form told, or options that only serve another one that is missing.

    Example:
        >>> parse_loads(tip_force="0,0.1,0", following=True)
        {'tip_force': [0.0, 0.1, 0.0], 'following': True}
    """
    acting = bool(tip_force or tip_moment)
    if following and not acting and not body_force:
        raise InputError.NO_DATA(
            "--following: nothing turns; give --tip-force, --tip-moment or others."
        )
    if tip_point is not None and not tip_force and not tip_mass:
        raise InputError.NO_DATA(
            f"--tip-point {tip_point}: nothing acts there; give a --tip-force too."
        )
    vectors = (
        ("tip_force", "--tip-force", tip_force, "forces in N"),
        ("tip_moment", "--tip-moment", tip_moment, "moments in N mm"),
        ("tip_point", "--tip-point", tip_point, "coordinates in mm"),
        ("gravity", "--gravity", gravity, "accelerations in m/s2"),
    )
    loads: dict[str, Any] = {
        name: parse_vector(text, option, what).tolist()
        for name, option, text, what in vectors
        if text is not None
    }
    if tip_mass is not None:
        loads["tip_mass"] = _mass(tip_mass)
    if body_force:
        loads["body_forces"] = [parse_body_force(text, following) for text in body_force]
    if following and acting:
        loads["following"] = True
    return loads


def parse_body_force(text: str, following: bool = False) -> dict[str, Any]:
    """Return the arguments of `BodyForce` that a `BODY:X,Y,Z[@X,Y,Z]` stands for.

    Raises:
        InputError: Not of this form.

    Example:
        >>> parse_body_force("3:0,0.1,0@0.8,0,0.5")["point"]
        [0.8, 0.0, 0.5]
    """
    option = "--body-force"
    body, colon, rest = text.partition(":")
    force, at, point = rest.partition("@")
    if not colon or not body.strip().isdecimal() or len(body) > _DIGITS:
        raise InputError.BAD_SYNTAX(f"{option} {text}: give {_BODY}.")
    loads: dict[str, Any] = {"body": int(body)}
    for name, given, what, words in (
        ("force", True, "forces in N", force),
        ("point", bool(at), "coordinates in mm", point),
    ):
        if given:
            try:
                loads[name] = parse_vector(words, option, what).tolist()
            except InputError:
                raise InputError.BAD_SYNTAX(
                    f"{option} {text}: {words!r} is no three finite {what}; give {_BODY}."
                ) from None
    return loads | ({"following": True} if following else {})


def put_on(path: LoadPath, loads: dict[str, Any]) -> LoadPath:
    """Return the path with the loads of `parse_loads` on all its steps."""
    from notchflex.loads import BodyForce

    forces: list[BodyForce] = [BodyForce(**one) for one in loads.get("body_forces", ())]
    loads = {name: value for name, value in loads.items() if name != "body_forces"}
    return path.loaded(**loads, body_forces=forces or None)


def _mass(text: str) -> float:
    try:
        mass = float(text)
    except ValueError:
        mass = -1.0
    if not 0.0 <= mass < float("inf"):
        raise InputError.NOT_FINITE(f"--tip-mass {text}: give a finite number of grams, 0 or more.")
    return mass
