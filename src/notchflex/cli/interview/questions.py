"""The questions of `notchflex new`, in their order, and the robot that the answers describe."""

from __future__ import annotations

import dataclasses

from notchflex.cli.interview.ask import Interview, Question
from notchflex.cli.interview.readings import choice, reading, readings, whole
from notchflex.errors import InputError
from notchflex.robot import ArcNotch, Capstan, Linear, Robot, Superelastic, Tendon, Tube
from notchflex.robot.robot import MOST_NOTCHES

ALLOWED_STRAIN = "0.08"
NITINOL_DENSITY = 6450.0  # kg/m3


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
    tendons = _ask_tendons(interview, tube)
    material = _ask_material(interview)
    coefficient = ask(
        Question(
            "--friction",
            "Friction coefficient between tendon and tube",
            lambda text: reading(text, at_least=0),
            default="0.13",
        )
    )
    return Robot(
        name=title,
        tube=tube,
        notch=notches,
        tendon=tendons,
        material=_with_allowed_strain(interview, material),
        friction=Capstan(coefficient),
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
        density=NITINOL_DENSITY,
    )


def _with_allowed_strain(
    interview: Interview, material: Linear | Superelastic
) -> Linear | Superelastic:
    """Ask last for the strain to warn of: what was piped before this was asked still fits."""
    superelastic = isinstance(material, Superelastic)
    allowed = interview.ask(
        Question(
            "--allowed-strain",
            "Allowed strain, beyond which a simulation warns; none for no warning",
            _strain,
            default=ALLOWED_STRAIN if superelastic else "none",
            hint="Superelastic nitinol usually recovers 8 %: 0.08."
            if superelastic
            else "Where the material yields: yield strength over elastic modulus.",
        )
    )
    return dataclasses.replace(material, allowed_strain=allowed)


def _strain(text: str) -> float | None:
    return None if text.lower() == "none" else reading(text, above=0, at_most=1)


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
        raise InputError.MISSING_VALUE("give a title.")
    return text
