"""Loads on the command line: tensions and strokes of the tendons, and external loads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from notchflex import InputError
from notchflex.cli.arguments.conversion import converted, flag
from notchflex.support import (
    BodyForceOption,
    Vector,
    parse_number,
    parse_vector,
    read_body_force,
    read_command,
)

if TYPE_CHECKING:
    from notchflex import LoadPath

LOADS = Group(
    "External loads", sort_key=8, help="They act before the first step and stay as they are."
)


def tendon_command(option: str, *, negative: bool = False) -> Parameter:
    """Return the parameter of an option `SPEC` or `TENDON=SPEC` that may be given several times."""
    return converted(partial(read_command, option, negative), "SPEC", several=True)


def _xyz(what: str, text: str) -> Parameter:
    return converted(parse_vector(what), "X,Y,Z", help=text)


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
        converted(read_body_force, "BODY:X,Y,Z[@X,Y,Z]", several=True, name="--body-force"),
        Parameter(
            help="Force on a rigid body [N]: 0 is the base, 1 the body beyond the first notch. The "
            "point of application after @ [mm] is in the frame of the body; its origin if left "
            "out. May be given several times.",
        ),
    ] = ()
    tip_mass: Annotated[
        float | None,
        converted(
            partial(parse_number, form="a finite number of grams, 0 or more", least=0.0), "G"
        ),
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
        from notchflex import BodyForce

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
