"""How `notchflex new` asks for the usual parts, and its comments on values nobody measured."""

from __future__ import annotations

from collections.abc import Set
from typing import NamedTuple


class Wording(NamedTuple):
    """How a value of a part is asked for.

    Attributes:
        option: The option that answers it.
        text: What is asked, with its unit.
        default: The answer taken when none is given; None for the default of the robot file.
        hint: How to measure it; braces stand for values of the tube.
        comment: What the file says of the default.
        below: The value must be less, where the robot file has no such limit of its own.
    """

    option: str
    text: str
    default: str | None = None
    hint: str = ""
    comment: str = ""
    below: float | None = None


_PACHECO = "estimate: Pacheco 2021, Table 3, laser-cut nitinol"
_CODE = "estimate: code of Pacheco 2021, not given in the paper"
_MODULUS = Wording(
    "--elastic-modulus",
    "Elastic modulus [MPa]",
    hint="10000 is the value fitted to laser-cut Nitinol wrists (Pacheco 2021).",
    comment=_PACHECO,
)

WORDINGS: dict[tuple[str, str], dict[str, Wording]] = {
    ("tube", ""): {
        "outer_diameter": Wording("--outer-diameter", "Outer diameter of the tube [mm]"),
        "inner_diameter": Wording(
            "--inner-diameter",
            "Inner diameter [mm]",
            hint="With a pin gauge, or from the wall: {outer_diameter:g}-2*wall.",
        ),
        "base_length": Wording(
            "--base-length",
            "Uncut length between the held end and the first notch [mm]",
            comment="assumed: held at the first notch",
        ),
    },
    ("notch", "arc"): {
        "cut": Wording(
            "--cut",
            "Cut, on-axis or off-axis",
            hint="on-axis: a laser aimed at the axis leaves radial edges. off-axis: a saw or wire "
            "leaves one straight edge. It changes the stiffness by a third to a half.",
        ),
        "depth": Wording(
            "--depth",
            "Depth of the cut [mm]",
            hint="From the outer surface opposite the spine. If you measure what is left at the "
            "spine, type {outer_diameter:g}-left.",
        ),
        "height": Wording("--height", "Height of the notch along the tube [mm]"),
        "uncut_length": Wording(
            "--uncut-length", "Uncut length behind the notch, toward the tip [mm]"
        ),
        "direction_deg": Wording(
            "--direction", "Direction toward which it bends [deg]", comment="assumed: toward x"
        ),
        "precurvature_deg": Wording(
            "--precurvature",
            "Angle of the notch when nothing pulls [deg]",
            comment="assumed: straight",
        ),
    },
    ("tendon", ""): {
        "radius": Wording(
            "--tendon-radius",
            "Distance of the tendon from the tube axis [mm]; several tendons joined by commas",
            comment="assumed: the tendon lies on the inner wall",
        ),
        "direction_deg": Wording(
            "--tendon-direction",
            "Side on which the tendon runs [deg]; 0 is where notches of direction 0 bend to",
            comment="assumed: on the side of the cuts",
        ),
    },
    ("material", "nitinol"): {
        "elastic_modulus": Wording(
            "--elastic-modulus",
            "Elastic modulus [MPa]",
            default="42000",
            hint="30000 to 57000 are usual for superelastic tubes.",
            comment="estimate: usual for superelastic nitinol, 30 to 57 GPa",
        ),
        "plateau_stress": Wording(
            "--plateau-stress",
            "Stress where the plateau begins [MPa]",
            default="350",
            comment="estimate: usual for superelastic nitinol, 260 to 460 MPa",
        ),
        "plateau_modulus": Wording(
            "--plateau-modulus",
            "Slope of the plateau [MPa]",
            default="6000",
            comment="estimate: usual for superelastic nitinol, 3 to 9 GPa",
        ),
    },
    ("material", "superelastic"): {
        "elastic_modulus": _MODULUS._replace(default="10000"),
        "superelastic_modulus": Wording(
            "--superelastic-modulus",
            "Modulus of the superelastic branch [MPa]",
            default="3000",
            comment=_PACHECO,
        ),
        "transition_strain": Wording(
            "--transition-strain",
            "Strain where the superelastic branch begins",
            default="0.028",
            comment=_PACHECO,
            below=0.1,
        ),
    },
    ("material", "linear"): {"elastic_modulus": _MODULUS},
    ("material", ""): {
        "allowed_strain": Wording(
            "--allowed-strain",
            "Allowed strain, beyond which a simulation warns; none for no warning",
            comment="estimate: what superelastic nitinol usually recovers",
        ),
    },
    ("friction", "capstan"): {
        "coefficient": Wording(
            "--friction",
            "Friction coefficient between tendon and tube",
            default="0.18",
            comment="estimate: nitinol tendon on nitinol tube, 0.13 to 0.19",
        ),
    },
}
"""By section and kind ("" for parts of one kind, or for all kinds), the keys that are asked for."""

OPTIONS = {
    (section, key): wording.option
    for (section, _), keys in WORDINGS.items()
    for key, wording in keys.items()
    if key != "cut"
}
"""Section and key to the option that answers it; `--set SECTION.KEY=VALUE` answers the others."""

# By section, kind and key; by "" for kinds that have no wording of their own.
_DEFAULTS = {
    (section, which, key): (wording.option, wording.comment)
    for (section, kind), keys in WORDINGS.items()
    for key, wording in keys.items()
    for which in ("", kind)
}

_NEVER_ASKED = {
    ("tendon", "axial_stiffness"): "assumed: inextensible",
    ("notch", "ends"): "checked against finite elements",
    ("notch", "depth_at"): "assumed",
    ("notch", "closing"): "assumed",
    ("tendon", "path"): "assumed",
    ("tendon", "free_length"): "assumed; without effect on an inextensible tendon",
    ("material", "compression_ratio"): "estimate: nitinol has 1 to 1.5",
    ("material", "plastic_strain"): _CODE,
    ("material", "plastic_modulus"): _CODE,
    ("material", "plastic_exponent"): _CODE,
    ("material", "poisson_ratio"): "estimate: usual for metals; without effect on bending in a "
    "plane",
    ("material", "density"): "estimate: usual for nitinol; only gravity needs it",
    ("friction", "wrap"): "assumed",
}


def commented(text: str, defaulted: Set[str]) -> str:
    """Mark the values that nobody measured, and explain each key only once."""
    lines: list[str] = []
    section, kind, explained = "", "", set[tuple[str, str]]()
    for line in text.splitlines():
        if line.startswith("["):
            section, kind = line.strip("[]"), ""
        if line.startswith("#"):
            lines.append(line)
            continue
        value, _, meaning = line.partition("  # ")
        key, _, content = value.partition(" = ")
        kind = content.strip('"') if key == "kind" else kind
        place = section, key
        own = _DEFAULTS.get((section, kind, key)) or _DEFAULTS.get((section, "", key), ("", ""))
        mark = own[1] if own[0] in defaulted else _NEVER_ASKED.get(place, "")
        # A key is explained once, not at every notch; an estimate is marked everywhere.
        words = ["" if place in explained else meaning, mark]
        explained.add(place)
        comment = "; ".join(filter(None, words))
        lines.append(f"{value}  # {comment}" if comment else value)
    return "\n".join(lines) + "\n"
