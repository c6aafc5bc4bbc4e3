"""`notchflex new`: from calliper readings to a commented robot file."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from notchflex.cli.ask import Interview, Question, choice, reading, readings, whole
from notchflex.errors import InputError
from notchflex.results.files import check_output, write_text
from notchflex.robot import ArcNotch, Capstan, Linear, Robot, Superelastic, Tendon, Tube
from notchflex.robot.robot import MOST_NOTCHES
from notchflex.robot.writing import robot_text

TUBE = Group("Tube", sort_key=1)
NOTCHES = Group("Notches (one value for all, or one for each, base to tip)", sort_key=2)
TENDONS = Group("Tendons (one value for each)", sort_key=3)
MATERIAL = Group("Material and friction", sort_key=4)

ESTIMATES = {
    "--elastic-modulus": "estimate: Pacheco 2021, Table 3, laser-cut Nitinol",
    "--superelastic-modulus": "estimate: Pacheco 2021, Table 3, laser-cut Nitinol",
    "--transition-strain": "estimate: Pacheco 2021, Table 3, laser-cut Nitinol",
    "--friction": "estimate: Pacheco 2021, Table 3, Nitinol tendon on Nitinol tube",
    "--tendon-radius": "assumed: the tendon lies on the inner wall",
}
"""What is written beside a value that nobody measured."""

KEYS = {
    "--elastic-modulus": ("material", "elastic_modulus"),
    "--superelastic-modulus": ("material", "superelastic_modulus"),
    "--transition-strain": ("material", "transition_strain"),
    "--friction": ("friction", "coefficient"),
    "--tendon-radius": ("tendon", "radius"),
}

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
    yes: Annotated[
        bool, Parameter(name=("--yes", "-y"), negative=(), help="Take all defaults unasked.")
    ] = False,
) -> None:
    """Ask for the calliper readings of a wrist and write a commented robot file.

    Options answer questions beforehand; what is left is asked, or read line by line from a pipe.
    Every number may be a sum, such as `1.62-0.22` for a depth measured as what is left.
    """
    path = Path(name if name.endswith(".toml") else f"{name}.toml")
    if os.path.lexists(path):
        raise InputError(f"{path} is already there; choose another name, or remove it first.")
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
        },
        accept_defaults=yes,
    )
    robot = interviewed(interview, path.stem)
    text = _commented(robot_text(robot), interview.defaulted)
    if path.exists():
        raise InputError(f"{path} appeared while you answered; choose another name.")
    write_text(path, text)
    print(f"Wrote {path}. Look at it with: notchflex show {shlex.quote(str(path))}")


def interviewed(interview: Interview, name: str) -> Robot:
    """Return the robot that the answers describe.

    Args:
        interview: Where the answers come from.
        name: The title proposed.

    Raises:
        InputError: An answer that cannot be used.
    """
    ask = interview.ask
    title = ask(Question("--title", "Title", _title, default=name))
    tube = _ask_tube(interview)
    notches = _ask_notches(interview, tube)
    return Robot(
        name=title,
        tube=tube,
        notch=notches,
        tendon=_ask_tendons(interview, tube),
        material=_ask_material(interview),
        friction=Capstan(
            ask(
                Question(
                    "--friction",
                    "Friction coefficient between tendon and tube",
                    lambda text: reading(text, at_least=0),
                    default="0.13",
                )
            )
        ),
    )


def _ask_tube(interview: Interview) -> Tube:
    outer = interview.ask(
        Question(
            "--outer-diameter",
            "Outer diameter of the tube [mm]",
            lambda text: reading(text, above=0),
        )
    )
    inner = interview.ask(
        Question(
            "--inner-diameter",
            "Inner diameter [mm]",
            lambda text: reading(text, above=0, below=outer),
            hint=f"With a pin gauge, or from the wall: {outer:g}-2*wall.",
        )
    )
    base = interview.ask(
        Question(
            "--base-length",
            "Uncut length between the held end and the first notch [mm]",
            lambda text: reading(text, at_least=0),
            default="0",
        )
    )
    return Tube(outer_diameter=outer, inner_diameter=inner, base_length=base)


def _ask_notches(interview: Interview, tube: Tube) -> tuple[ArcNotch, ...]:
    cut = interview.ask(
        Question(
            "--cut",
            "Cut, on-axis or off-axis",
            lambda text: choice(text, ("on-axis", "off-axis")),
            hint="on-axis: a laser aimed at the axis leaves radial edges. off-axis: a saw or wire "
            "leaves one straight edge. It changes the stiffness by a third to a half.",
        )
    )
    count = interview.ask(
        Question(
            "--notches",
            "Number of notches",
            lambda text: whole(text, at_least=1, at_most=MOST_NOTCHES),
        )
    )
    each = "" if count == 1 else f"; one value, or {count} joined by commas, base to tip"
    depths = interview.ask(
        Question(
            "--depth",
            f"Depth of the cut [mm]{each}",
            lambda text: readings(text, count, above=0, below=tube.outer_diameter),
            hint="From the outer surface opposite the spine. If you measure what is left at the "
            f"spine, type {tube.outer_diameter:g}-left.",
        )
    )
    heights = interview.ask(
        Question(
            "--height",
            f"Height of the notch along the tube [mm]{each}",
            lambda text: readings(text, count, above=0),
        )
    )
    uncut = interview.ask(
        Question(
            "--uncut-length",
            f"Uncut length behind the notch, toward the tip [mm]{each}",
            lambda text: readings(text, count, at_least=0),
        )
    )
    directions = interview.ask(
        Question(
            "--direction",
            f"Direction toward which it bends [deg]{each}",
            lambda text: readings(text, count),
            default="0",
        )
    )
    bent = interview.ask(
        Question(
            "--precurvature",
            f"Angle of the notch when nothing pulls [deg]{each}",
            lambda text: readings(text, count),
            default="0",
        )
    )
    rows = list(zip(depths, heights, uncut, directions, bent, strict=True))
    return tuple(
        ArcNotch(
            cut=cut,
            depth=row[0],
            height=row[1],
            uncut_length=row[2],
            direction_deg=row[3],
            precurvature_deg=row[4],
            repeat=repeat,
        )
        for row, repeat in _runs(rows)
    )


def _ask_tendons(interview: Interview, tube: Tube) -> tuple[Tendon, ...]:
    radii = interview.ask(
        Question(
            "--tendon-radius",
            "Distance of the tendon from the tube axis [mm]; several tendons joined by commas",
            lambda text: [
                reading(part.strip(), above=0, at_most=tube.outer_radius)
                for part in text.split(",")
            ],
            default=f"{tube.inner_radius:g}",
        )
    )
    directions = interview.ask(
        Question(
            "--tendon-direction",
            "Side on which the tendon runs [deg]; 0 is where notches of direction 0 bend to",
            lambda text: readings(text, len(radii)),
            default="0" if len(radii) == 1 else None,
        )
    )
    return tuple(
        Tendon(radius=radius, direction_deg=direction)
        for radius, direction in zip(radii, directions, strict=True)
    )


def _ask_material(interview: Interview) -> Linear | Superelastic:
    ask = interview.ask
    kind = ask(
        Question(
            "--material",
            "Material, superelastic or linear",
            lambda text: choice(text, ("superelastic", "linear")),
            default="superelastic",
        )
    )
    modulus = ask(
        Question(
            "--elastic-modulus",
            "Elastic modulus [MPa]",
            lambda text: reading(text, above=0),
            default="10000" if kind == "superelastic" else None,
            hint="10000 is the value fitted to laser-cut Nitinol wrists (Pacheco 2021).",
        )
    )
    if kind == "linear":
        return Linear(elastic_modulus=modulus)
    return Superelastic(
        elastic_modulus=modulus,
        superelastic_modulus=ask(
            Question(
                "--superelastic-modulus",
                "Modulus of the superelastic branch [MPa]",
                lambda text: reading(text, above=0),
                default="3000",
            )
        ),
        transition_strain=ask(
            Question(
                "--transition-strain",
                "Strain where the superelastic branch begins",
                lambda text: reading(text, above=0, below=0.1),
                default="0.028",
            )
        ),
    )


def _runs(rows: list[tuple[float, ...]]) -> list[tuple[tuple[float, ...], int]]:
    """Gather equal neighbours: what a robot file writes with `repeat`."""
    runs: list[tuple[tuple[float, ...], int]] = []
    for row in rows:
        if runs and runs[-1][0] == row:
            runs[-1] = (row, runs[-1][1] + 1)
        else:
            runs.append((row, 1))
    return runs


def _title(text: str) -> str:
    if not text:
        raise InputError("give a title.")
    return text


def _commented(text: str, defaulted: set[str]) -> str:
    """Mark the values that nobody measured, and say what each key means only once."""
    marks = {KEYS[option]: ESTIMATES[option] for option in defaulted if option in KEYS}
    lines: list[str] = []
    section, told = "", set[tuple[str, str]]()
    for line in text.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        key = line.partition(" = ")[0]
        if (section, key) in told:  # what a key means is said once, not at every notch
            line = line.partition("  #")[0]
        told.add((section, key))
        if (section, key) in marks:
            line += f"{',' if '#' in line else '  #'} {marks[section, key]}"
        lines.append(line)
    return "\n".join(lines) + "\n"
