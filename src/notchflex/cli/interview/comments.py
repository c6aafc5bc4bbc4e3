"""What a new robot file says of values that nobody measured."""

from __future__ import annotations

from collections.abc import Set

_PACHECO = "estimate: Pacheco 2021, Table 3, laser-cut nitinol"
_CODE = "estimate: code of Pacheco 2021, not given in the paper"

IF_DEFAULTED = {
    "--base-length": ("tube", "base_length", "assumed: held at the first notch"),
    "--direction": ("notch", "direction_deg", "assumed: toward x"),
    "--precurvature": ("notch", "precurvature_deg", "assumed: straight"),
    "--tendon-radius": ("tendon", "radius", "assumed: the tendon lies on the inner wall"),
    "--tendon-direction": ("tendon", "direction_deg", "assumed: on the side of the cuts"),
    "--elastic-modulus": ("material", "elastic_modulus", _PACHECO),
    "--superelastic-modulus": ("material", "superelastic_modulus", _PACHECO),
    "--transition-strain": ("material", "transition_strain", _PACHECO),
    "--friction": (
        "friction",
        "coefficient",
        "estimate: Pacheco 2021, Table 3, nitinol tendon on nitinol tube",
    ),
    "--allowed-strain": (
        "material",
        "allowed_strain",
        "estimate: what superelastic nitinol usually recovers",
    ),
}
"""Option to section, key and comment of the value that is taken where nothing is answered."""

NEVER_ASKED = {
    ("tendon", "axial_stiffness"): "assumed: inextensible",
    ("tendon", "path"): "assumed: the tendon follows the wall",
    ("tendon", "free_length"): "assumed; without effect on an inextensible tendon",
    ("material", "plastic_strain"): _CODE,
    ("material", "plastic_modulus"): _CODE,
    ("material", "plastic_exponent"): _CODE,
    ("material", "poisson_ratio"): "estimate: usual for metals; without effect on bending in a "
    "plane",
    ("material", "density"): "estimate: usual for nitinol; only gravity needs it",
    ("friction", "wrap"): "assumed",
}
"""Section and key to the comment of values that no question sets."""


def commented(text: str, defaulted: Set[str]) -> str:
    """Mark the values that nobody measured, and say what each key means only once.

    Args:
        text: A robot file in a fresh layout.
        defaulted: The options whose default was taken.
    """
    marks = dict(NEVER_ASKED)
    marks |= {
        (section, key): mark
        for option, (section, key, mark) in IF_DEFAULTED.items()
        if option in defaulted
    }
    lines: list[str] = []
    section, explained = "", set[tuple[str, str]]()
    for line in text.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        key = line.partition(" = ")[0]
        if line.startswith("#"):
            lines.append(line)
            continue
        value, _, meaning = line.partition("  # ")
        # What a key means is said once, not at every notch; what is an estimate, everywhere.
        words = [] if (section, key) in explained else [meaning]
        explained.add((section, key))
        words.append(marks.get((section, key), ""))
        comment = "; ".join(word for word in words if word)
        lines.append(f"{value}  # {comment}" if comment else value)
    return "\n".join(lines) + "\n"
