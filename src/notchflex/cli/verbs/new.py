"""`notchflex new`: from calliper readings to a commented robot file."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from notchflex.cli.interview.ask import Interview
from notchflex.cli.interview.comments import commented
from notchflex.cli.interview.questions import interviewed
from notchflex.errors import InputError
from notchflex.results.files.writing import check_output, write_text
from notchflex.robot.writing import robot_text

TUBE = Group("Tube", sort_key=1)
NOTCHES = Group("Notches (one value for all, or one for each, base to tip)", sort_key=2)
TENDONS = Group("Tendons (one value for each)", sort_key=3)
MATERIAL = Group("Material and friction", sort_key=4)

Answer = str | None


def _option(group: Group, text: str) -> Parameter:
    return Parameter(group=group, help=text, allow_leading_hyphen=True)


def new(
    name: Annotated[str, Parameter(help="Name of the file; `.toml` is added.")],
    /,
    *,
    title: Annotated[str | None, Parameter(help="What tables and pictures call the robot.")] = None,
    outer_diameter: Annotated[Answer, _option(TUBE, "Outer diameter [mm].")] = None,
    inner_diameter: Annotated[Answer, _option(TUBE, "Inner diameter [mm].")] = None,
    base_length: Annotated[
        Answer, _option(TUBE, "Uncut length between the held end and the first notch [mm].")
    ] = None,
    cut: Annotated[
        Answer, _option(NOTCHES, "`on-axis` (laser, radial edges) or `off-axis` (saw, straight).")
    ] = None,
    notches: Annotated[Answer, _option(NOTCHES, "Number of notches.")] = None,
    depth: Annotated[
        Answer, _option(NOTCHES, "Depth from the surface opposite the spine [mm].")
    ] = None,
    height: Annotated[Answer, _option(NOTCHES, "Height along the tube [mm].")] = None,
    uncut_length: Annotated[
        Answer, _option(NOTCHES, "Uncut length behind each notch, toward the tip [mm].")
    ] = None,
    direction: Annotated[
        Answer, _option(NOTCHES, "Side toward which each notch bends [deg]; 0 is x.")
    ] = None,
    precurvature: Annotated[
        Answer, _option(NOTCHES, "Angle of each notch when nothing pulls [deg].")
    ] = None,
    tendon_radius: Annotated[
        Answer, _option(TENDONS, "Distance of each tendon from the tube axis [mm].")
    ] = None,
    tendon_direction: Annotated[
        Answer, _option(TENDONS, "Side on which each tendon runs [deg]; 0 is x.")
    ] = None,
    material: Annotated[Answer, _option(MATERIAL, "`superelastic` or `linear`.")] = None,
    elastic_modulus: Annotated[Answer, _option(MATERIAL, "Elastic modulus [MPa].")] = None,
    superelastic_modulus: Annotated[
        Answer, _option(MATERIAL, "Modulus of the superelastic branch [MPa].")
    ] = None,
    transition_strain: Annotated[
        Answer, _option(MATERIAL, "Strain where the superelastic branch begins.")
    ] = None,
    friction: Annotated[
        Answer, _option(MATERIAL, "Friction coefficient between tendon and tube.")
    ] = None,
    allowed_strain: Annotated[
        Answer,
        _option(MATERIAL, "Strain beyond which a simulation warns; `none` for no warning."),
    ] = None,
    yes: Annotated[
        bool, Parameter(name=("--yes", "-y"), negative=(), help="Take all defaults unasked.")
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
    interview = Interview(
        {
            "--title": title,
            "--outer-diameter": outer_diameter,
            "--inner-diameter": inner_diameter,
            "--base-length": base_length,
            "--cut": cut,
            "--notches": notches,
            "--depth": depth,
            "--height": height,
            "--uncut-length": uncut_length,
            "--direction": direction,
            "--precurvature": precurvature,
            "--tendon-radius": tendon_radius,
            "--tendon-direction": tendon_direction,
            "--material": material,
            "--elastic-modulus": elastic_modulus,
            "--superelastic-modulus": superelastic_modulus,
            "--transition-strain": transition_strain,
            "--friction": friction,
            "--allowed-strain": allowed_strain,
        },
        accept_defaults=yes,
    )
    robot = interview.conduct(lambda interview: interviewed(interview, path.stem))
    text = commented(robot_text(robot), interview.defaulted)
    if path.exists():
        raise InputError.FILE_UNWRITABLE(
            f"{path} appeared while you answered; choose another name."
        )
    write_text(path, text)
    print(f"Wrote {path}. Look at it with: notchflex show {shlex.quote(str(path))}")
