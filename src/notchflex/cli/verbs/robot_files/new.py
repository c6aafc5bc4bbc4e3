"""`notchflex new`: from calliper readings to a commented robot file."""

from __future__ import annotations

import os
import shlex
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

from cyclopts import Group, Parameter

from notchflex import InputError, InputWarning
from notchflex.cli.arguments.conversion import flag
from notchflex.cli.arguments.robots import warn_unlikely
from notchflex.cli.interview.ask import Interview
from notchflex.cli.interview.questions import commented, interviewed
from notchflex.support import check_output, read_text, robot_text, write_text

TUBE = Group("Tube", sort_key=1)
NOTCHES = Group("Notches (one value for all, or one for each, base to tip)", sort_key=2)
TENDONS = Group("Tendons (one value for each)", sort_key=3)
MATERIAL = Group("Material and friction", sort_key=4)


class Template(NamedTuple):
    """A commented file that is written unasked."""

    file: str
    kind: str
    command: str


_PACKAGE = Path(__file__).parents[3]
TEMPLATES = {
    "--design": Template("designing/template.toml", "design file", "notchflex design {} -o FOLDER"),
    "--tolerance": Template(
        "tolerancing/template.toml", "file of tolerances", "notchflex tolerance ROBOT {}"
    ),
    "--sweep": Template("sweeping/template.toml", "plan file", "notchflex sweep {} -o FOLDER"),
}

_SECTIONS = ("notch", "tendon", "material", "friction")


def _option(group: Group, text: str) -> Parameter:
    return Parameter(group=group, help=text, allow_leading_hyphen=True)


@Parameter(name="*")
@dataclass(frozen=True)
class Answers:
    """Answers given as options; None for what is to be asked."""

    title: Annotated[str | None, Parameter(help="What tables and pictures call the robot.")] = None
    outer_diameter: Annotated[str | None, _option(TUBE, "Outer diameter [mm].")] = None
    inner_diameter: Annotated[str | None, _option(TUBE, "Inner diameter [mm].")] = None
    base_length: Annotated[
        str | None, _option(TUBE, "Uncut length between the held end and the first notch [mm].")
    ] = None
    kind: Annotated[
        str | None,
        _option(NOTCHES, "Kind of notch: `arc`, or another that `notchflex schema` lists."),
    ] = None
    cut: Annotated[
        str | None,
        _option(NOTCHES, "`on-axis` (laser, radial edges) or `off-axis` (saw, straight)."),
    ] = None
    notches: Annotated[str | None, _option(NOTCHES, "Number of notches.")] = None
    depth: Annotated[
        str | None, _option(NOTCHES, "Depth from the surface opposite the spine [mm].")
    ] = None
    height: Annotated[str | None, _option(NOTCHES, "Height along the tube [mm].")] = None
    uncut_length: Annotated[
        str | None, _option(NOTCHES, "Uncut length behind each notch, toward the tip [mm].")
    ] = None
    direction: Annotated[
        str | None, _option(NOTCHES, "Side toward which each notch bends [deg]; 0 is x.")
    ] = None
    precurvature: Annotated[
        str | None, _option(NOTCHES, "Angle of each notch when nothing pulls [deg].")
    ] = None
    tendon_radius: Annotated[
        str | None, _option(TENDONS, "Distance of each tendon from the tube axis [mm].")
    ] = None
    tendon_direction: Annotated[
        str | None, _option(TENDONS, "Side on which each tendon runs [deg]; 0 is x.")
    ] = None
    material: Annotated[
        str | None, _option(MATERIAL, "`nitinol`, `superelastic`, `linear`, or another kind.")
    ] = None
    elastic_modulus: Annotated[str | None, _option(MATERIAL, "Elastic modulus [MPa].")] = None
    plateau_stress: Annotated[
        str | None, _option(MATERIAL, "Stress where the plateau of nitinol begins [MPa].")
    ] = None
    plateau_modulus: Annotated[str | None, _option(MATERIAL, "Slope of that plateau [MPa].")] = None
    superelastic_modulus: Annotated[
        str | None, _option(MATERIAL, "Modulus of the superelastic branch [MPa].")
    ] = None
    transition_strain: Annotated[
        str | None, _option(MATERIAL, "Strain where the superelastic branch begins.")
    ] = None
    friction: Annotated[
        str | None, _option(MATERIAL, "Friction coefficient between tendon and tube.")
    ] = None
    allowed_strain: Annotated[
        str | None,
        _option(MATERIAL, "Strain beyond which a simulation warns; `none` for no warning."),
    ] = None
    friction_kind: Annotated[
        str | None, _option(MATERIAL, "Kind of friction: `capstan`, or another.")
    ] = None


def new(
    name: Annotated[str, Parameter(help="Name of the file; `.toml` is added.")],
    /,
    *,
    answers: Answers = Answers(),
    set_: Annotated[
        list[str] | None,
        Parameter(
            name="--set",
            negative=(),
            help="Any other key of a part: `notch.slot_radius=0.275`, `friction.wrap=geometric`.",
        ),
    ] = None,
    yes: Annotated[bool, flag("Take all defaults unasked.", name=("--yes", "-y"))] = False,
    design: Annotated[
        bool, flag("Write a commented design file for `notchflex design` instead; asks nothing.")
    ] = False,
    tolerance: Annotated[
        bool,
        flag("Write a commented file of tolerances for `notchflex tolerance`; asks nothing."),
    ] = False,
    sweep: Annotated[
        bool, flag("Write a commented plan file for `notchflex sweep` instead; asks nothing.")
    ] = False,
) -> None:
    """Ask for the calliper readings of a wrist and write a commented robot file.

    Options answer questions beforehand; what is left is asked, or read line by line from a pipe.
    Every number may be a sum, such as `1.62-0.22` for a depth measured as what is left. Typing `<`
    or `back` goes back to the previous question. Values that nobody measured are marked as
    estimates in the file.
    """
    path = Path(name if name.endswith(".toml") else f"{name}.toml")
    if os.path.lexists(path):
        raise InputError.FILE_UNWRITABLE(
            f"{path} is already there; choose another name, or remove it first."
        )
    check_output(str(path), "NAME")
    chosen = [
        option
        for option, asked in (("--design", design), ("--tolerance", tolerance), ("--sweep", sweep))
        if asked
    ]
    if chosen:
        template = TEMPLATES[chosen[0]]
        if set_ or answers != Answers() or len(chosen) > 1:
            raise InputError.CONFLICT(
                f"{chosen[0]} takes no other options: edit the {template.kind} that it writes."
            )
        _write_template(template, path)
        return
    settings = dict(map(_setting, set_ or ()))
    options = {f"--{key.replace('_', '-')}": answer for key, answer in vars(answers).items()}
    interview = Interview(settings | options, accept_defaults=yes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        robot = interview.conduct(lambda interview: interviewed(interview, path.stem))
    warn_unlikely(robot)
    if unused := [option for option in settings if option not in interview.used]:
        raise InputError.UNKNOWN_NAME(
            f"{unused[0]}: no part of this robot asks for it, or another option does."
        )
    text = commented(robot_text(robot), interview.defaulted)
    if path.exists():
        raise InputError.FILE_UNWRITABLE(
            f"{path} appeared while you answered; choose another name."
        )
    write_text(path, text)
    print(f"Wrote {path}. Look at it with: notchflex show {shlex.quote(str(path))}")


def _write_template(template: Template, path: Path) -> None:
    write_text(path, read_text(_PACKAGE / template.file, template.kind))
    command = template.command.format(shlex.quote(str(path)))
    print(f"Wrote {path}. Edit it, then run: {command}")


def _setting(text: str) -> tuple[str, str]:
    """Return option and answer of one `--set`."""
    key, _, value = text.partition("=")
    section, _, name = key.partition(".")
    if not (name and value) or section not in _SECTIONS:
        raise InputError.BAD_SYNTAX(
            f"--set {text}: write it like notch.slot_radius=0.275, with one of "
            f"{', '.join(_SECTIONS)}."
        )
    return f"--set {key.strip()}", value.strip()
