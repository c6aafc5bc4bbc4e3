"""Verbs about robot files: `robots` lists, `schema` describes, and `new` writes them."""

from __future__ import annotations

import json
import os
import shlex
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from notchflex import InputError, InputWarning, json_schema, list_robots
from notchflex.cli import tables
from notchflex.cli.options import exclude
from notchflex.cli.robots import warn_unlikely
from notchflex.support import check_output, read_text, robot_text, write_document, write_text

TUBE = Group("Tube", sort_key=1)
NOTCHES = Group("Notches (one value for all, or one for each, base to tip)", sort_key=2)
TENDONS = Group("Tendons (one value for each)", sort_key=3)
MATERIAL = Group("Material and friction", sort_key=4)

_PACKAGE = Path(__file__).parents[2]
TEMPLATES = {
    "--design": ("designing", "design file", "notchflex design {} -o FOLDER"),
    "--tolerance": ("tolerancing", "file of tolerances", "notchflex tolerance ROBOT {}"),
    "--sweep": ("sweeping", "plan file", "notchflex sweep {} -o FOLDER"),
}
"""By option the folder of a commented file, what it is, and the command that reads it."""

_SECTIONS = ("notch", "tendon", "material", "friction")


def robots() -> None:
    """List the robots that come with the program."""
    names = list_robots()
    tables.show({"robot": names, "what_it_is": names.values()}, colour="cyan")


def schema(*, design: bool = False, sweep: bool = False) -> None:
    """Print the JSON Schema of robot files, of design files or of plan files.

    Args:
        design: The schema of design files instead.
        sweep: The schema of plan files of sweeps instead.
    """
    if design and sweep:
        raise exclude("--design", "--sweep")
    if sweep:
        from notchflex.sweeping import plan_schema

        document = plan_schema()
    elif design:
        from notchflex.designing import design_schema

        document = design_schema()
    else:
        document = json_schema()
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    write_document(text + "\n")


_Answer = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
OfTube = Annotated[_Answer, Parameter(group=TUBE)]
OfNotches = Annotated[_Answer, Parameter(group=NOTCHES)]
OfTendons = Annotated[_Answer, Parameter(group=TENDONS)]
OfMaterial = Annotated[_Answer, Parameter(group=MATERIAL)]


@Parameter(name="*")
@dataclass(frozen=True)
class Answers:
    """Answers given as options; None for what is to be asked.

    Attributes:
        title: What tables and pictures call the robot.
        outer_diameter: Outer diameter [mm].
        inner_diameter: Inner diameter [mm].
        base_length: Uncut length between the held end and the first notch [mm].
        kind: Kind of notch: `arc`, or another that `notchflex schema` lists.
        cut: `on-axis` (laser, radial edges) or `off-axis` (saw, straight).
        notches: Number of notches.
        depth: Depth from the surface opposite the spine [mm].
        height: Height along the tube [mm].
        uncut_length: Uncut length behind each notch, toward the tip [mm].
        direction: Side toward which each notch bends [deg]; 0 is x.
        precurvature: Angle of each notch when nothing pulls [deg].
        tendon_radius: Distance of each tendon from the tube axis [mm].
        tendon_direction: Side on which each tendon runs [deg]; 0 is x.
        material: `nitinol`, `superelastic`, `linear`, or another kind.
        elastic_modulus: Elastic modulus [MPa].
        upper_plateau: Upper plateau of a data sheet of nitinol, at 3 % strain [MPa].
        lower_plateau: Lower plateau, at 2.5 % strain unloading from 6 % [MPa].
        test_temperature: Temperature at which they were measured [deg C].
        plateau_stress: Stress where the plateau of nitinol begins [MPa], instead.
        plateau_modulus: Slope of that plateau [MPa].
        superelastic_modulus: Modulus of the superelastic branch [MPa].
        transition_strain: Strain where the superelastic branch begins.
        friction: Friction coefficient between tendon and tube.
        allowed_strain: Strain beyond which a simulation warns; `none` for no warning.
        friction_kind: Kind of friction: `capstan`, or another.
    """

    title: str | None = None
    outer_diameter: OfTube = None
    inner_diameter: OfTube = None
    base_length: OfTube = None
    kind: OfNotches = None
    cut: OfNotches = None
    notches: OfNotches = None
    depth: OfNotches = None
    height: OfNotches = None
    uncut_length: OfNotches = None
    direction: OfNotches = None
    precurvature: OfNotches = None
    tendon_radius: OfTendons = None
    tendon_direction: OfTendons = None
    material: OfMaterial = None
    elastic_modulus: OfMaterial = None
    upper_plateau: OfMaterial = None
    lower_plateau: OfMaterial = None
    test_temperature: OfMaterial = None
    plateau_stress: OfMaterial = None
    plateau_modulus: OfMaterial = None
    superelastic_modulus: OfMaterial = None
    transition_strain: OfMaterial = None
    friction: OfMaterial = None
    allowed_strain: OfMaterial = None
    friction_kind: OfMaterial = None


def new(
    name: str,
    /,
    *,
    answers: Answers = Answers(),
    set_: Annotated[tuple[str, ...], Parameter(name="--set")] = (),
    yes: Annotated[bool, Parameter(name=("--yes", "-y"))] = False,
    design: bool = False,
    tolerance: bool = False,
    sweep: bool = False,
) -> None:
    """Ask for the calliper readings of a wrist and write a commented robot file.

    Options answer questions beforehand; what is left is asked, or read line by line from a pipe.
    Every number may be a sum, such as `1.62-0.22` for a depth measured as what is left. Typing `<`
    or `back` goes back to the previous question. Values that nobody measured are marked as
    estimates in the file.

    Args:
        name: Name of the file; `.toml` is added.
        set_: Any other key of a part: `notch.slot_radius=0.275`, `friction.wrap=geometric`.
        yes: Take all defaults unasked.
        design: Write a commented design file for `notchflex design` instead; asks nothing.
        tolerance: Write a commented file of tolerances for `notchflex tolerance`; asks nothing.
        sweep: Write a commented plan file for `notchflex sweep` instead; asks nothing.
    """
    path = Path(name if name.endswith(".toml") else f"{name}.toml")
    if os.path.lexists(path):
        raise InputError.FILE_UNWRITABLE(
            f"{path} is already there; choose another name, or remove it first."
        )
    check_output(str(path), "NAME")
    wanted = zip(TEMPLATES.items(), (design, tolerance, sweep), strict=True)
    chosen = [template for template, is_wanted in wanted if is_wanted]
    if chosen:
        option, (folder, words, command) = chosen[0]
        if set_ or answers != Answers() or len(chosen) > 1:
            raise InputError.CONFLICT(
                f"{option} takes no other options: edit the {words} that it writes."
            )
        text = read_text(_PACKAGE / folder / "template.toml", words)
        following = f"Edit it, then run: {command}"
    else:
        from notchflex.cli.interview import Interview, commented

        values = dict(map(_setting, set_))
        options = {f"--{key.replace('_', '-')}": answer for key, answer in vars(answers).items()}
        interview = Interview(values | options, accept_defaults=yes)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputWarning)
            robot = interview.conduct(path.stem)
        warn_unlikely(robot)
        for option in sorted(interview.unused):
            raise InputError.UNKNOWN_NAME(
                f"{option}: no part of this robot asks for it: it is one of another kind, or an "
                "option that it goes with is missing or stands in its place."
            )
        text = commented(robot_text(robot), interview.answered)
        following = "Look at it with: notchflex show {}"
    write_text(path, text)
    print(f"Wrote {path}. {following.format(shlex.quote(str(path)))}")


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
