"""The questions of `notchflex new`, in their order and words, and the robot that they describe."""

from __future__ import annotations

import dataclasses
import typing
from collections import Counter
from collections.abc import Callable, Container, Iterable, Set
from itertools import groupby
from typing import Any, NamedTuple, TypeVar

from notchflex import InputError, Nitinol, Robot, Superelastic, Tendon, Tube
from notchflex.cli.interview.ask import (
    Interview,
    Question,
    choice,
    reading,
    readings,
    separated,
    whole,
)
from notchflex.robot.part import unit_of
from notchflex.robot.problems import MOST_NOTCHES
from notchflex.support import Friction, Material, Notch, fields_of, is_list, kind_of, kinds_of


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
            comment="estimate: usual for superelastic nitinol, 30 to 65 GPa",
        ),
        "plateau_stress": Wording(
            "--plateau-stress",
            "Stress where the plateau begins [MPa]",
            default="350",
            comment="estimate: usual for superelastic nitinol, 250 to 520 MPa",
        ),
        "plateau_modulus": Wording(
            "--plateau-modulus",
            "Slope of the plateau [MPa]",
            default="6000",
            comment="estimate: usual for superelastic nitinol, 2 to 9 GPa",
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


ALLOWED_STRAIN = "0.08"
NITINOL_DENSITY = 6450.0  # kg/m3
_NITINOL = (Nitinol, Superelastic)

T = TypeVar("T")

_BOUNDS = {"gt": "above", "ge": "at_least", "lt": "below", "le": "at_most"}


def interviewed(interview: Interview, name: str) -> Robot:
    """Return the robot that the answers describe.

    Args:
        interview: Where the answers come from.
        name: The title proposed.

    Raises:
        InputError: An answer that cannot be used.
    """
    # A kind that does not exist is refused before anything is asked.
    for option, base in (
        ("--kind", Notch),
        ("--friction-kind", Friction),
        ("--material", Material),
    ):
        if interview.answers.get(option) is not None:
            _ask_kind(interview, option, base)
    title = interview.ask(Question("--title", "Title", _title, default=name))
    outer = _ask(interview, "tube", Tube, "outer_diameter")
    inner = _ask(interview, "tube", Tube, "inner_diameter", below=outer, outer_diameter=outer)
    tube = Tube(outer, inner, _ask(interview, "tube", Tube, "base_length"))
    notches = _ask_notches(interview, tube)
    tendons = _ask_tendons(interview, tube, notches)
    material_kind = _ask_kind(interview, "--material", Material, "Material, ")
    material = _ask_part(interview, "material", material_kind)
    friction_kind = _usual_or_asked(interview, "--friction-kind", Friction, "Kind of friction, ")
    friction = _ask_part(interview, "friction", friction_kind)
    # Asked last, so that pipes written before this question still fit.
    material = dataclasses.replace(material, allowed_strain=_ask_strain(interview, material))
    return Robot(title, tube, notches, tendons, material, friction)


def _ask_kind(interview: Interview, option: str, base: type[T], text: str = "") -> type[T]:
    """Ask for a kind of notch, material or friction; the usual one stands first."""
    kinds = kinds_of(base)
    usual = _usual(interview, kinds)
    names = tuple(dict.fromkeys((usual, *kinds)))
    question = f"{text}{' or '.join(names)}"
    return kinds[interview.ask(Question(option, question, lambda said: choice(said, names), usual))]


def _usual_or_asked(interview: Interview, option: str, base: type[T], text: str) -> type[T]:
    """Ask a person for a kind; a pipe that gives no option means the usual one."""
    if interview.person or interview.answers.get(option) is not None:
        return _ask_kind(interview, option, base, text)
    kinds = kinds_of(base)
    return kinds[_usual(interview, kinds)]


def _usual(interview: Interview, kinds: Container[str]) -> str:
    """Return the first kind that has wordings, or one of whose own options was given."""
    worded = {kind: keys for (_, kind), keys in WORDINGS.items() if kind in kinds}
    counts = Counter(wording.option for keys in worded.values() for wording in keys.values())
    for kind, keys in worded.items():
        own = (one.option for one in keys.values() if counts[one.option] == 1)
        if any(interview.answers.get(option) is not None for option in own):
            return kind
    return next(iter(worded))


def _ask_part(interview: Interview, section: str, kind: type[T]) -> T:
    """Ask for the keys of a part: those that have a wording, or all where none has."""
    worded = WORDINGS.get((section, kind_of(kind)))
    keys = worded or [
        key for key in fields_of(kind) if key not in ("kind", "repeat", "allowed_strain")
    ]
    values: dict[str, Any] = {}
    if worded:
        values = interview.set_values(section, but=(*keys, "allowed_strain"))
        if issubclass(kind, _NITINOL):
            values = {"density": NITINOL_DENSITY, **values}
    values |= {key: _ask(interview, section, kind, key) for key in keys}
    return kind(**values)


def _ask_notches(interview: Interview, tube: Tube) -> tuple[Notch, ...]:
    """Ask for the number of notches of a kind, and for their keys: one value, or one for each."""
    kind = _usual_or_asked(interview, "--kind", Notch, "Kind of notch, ")
    worded = WORDINGS.get(("notch", kind_of(kind)))
    unasked = ("kind", "repeat", "ends", "stiffness_factor")
    keys = list(worded or (key for key in fields_of(kind) if key not in unasked))
    same = {"cut": _ask(interview, "notch", kind, "cut")} if "cut" in keys else {}
    count: int = interview.ask(
        Question(
            "--notches",
            "Number of notches",
            lambda text: whole(text, at_least=1, at_most=MOST_NOTCHES),
        )
    )
    # From the drawing, unless set otherwise: the papers' kind of ends stands first.
    ends = fields_of(kind).get("ends")
    further = {} if ends is None else {"ends": typing.get_args(ends.annotation)[-1]}
    further |= interview.set_values("notch", but=tuple(keys))
    columns: dict[str, list[Any]] = {
        key: [value] * count for key, value in (same | further).items()
    }
    for key in (key for key in keys if key not in same):
        limits = {"below": tube.outer_diameter} if key == "depth" else {}
        columns[key] = _ask(
            interview, "notch", kind, key, count, outer_diameter=tube.outer_diameter, **limits
        )
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    runs = [list(run) for _, run in groupby(enumerate(rows), key=lambda item: item[1])]
    return tuple(kind(**kind.further_on(run[0][1], run[0][0]), repeat=len(run)) for run in runs)


def _ask_tendons(
    interview: Interview, tube: Tube, notches: tuple[Notch, ...]
) -> tuple[Tendon, ...]:
    radius, direction = WORDINGS["tendon", ""].values()
    radii: list[float] = interview.ask(
        Question(
            radius.option,
            radius.text,
            lambda text: [
                reading(part, above=0, at_most=tube.outer_radius) for part in separated(text)
            ],
            default=f"{tube.inner_radius:g}",
        )
    )
    directions: list[float] = interview.ask(
        Question(
            direction.option,
            direction.text,
            lambda text: readings(text, len(radii)),
            default="0" if len(radii) == 1 else None,
        )
    )
    further = interview.set_values("tendon", but=("radius", "direction_deg"))
    tendons = [
        Tendon(radius, direction, **further)
        for radius, direction in zip(radii, directions, strict=True)
    ]
    # Over a strip or a link there is no arc of the wall, and in finite elements the tendon of a
    # wrist spans its notches: such a tendon runs straight.
    straight = any(
        "path" in dict(one.tendon_problems(tendons[0])) or one.has_elastic_ends for one in notches
    )
    if straight and "path" not in further:
        tendons = [dataclasses.replace(tendon, path="straight") for tendon in tendons]
    return tuple(tendons)


def _ask_strain(interview: Interview, material: Material) -> float | None:
    """Ask for the strain to warn of."""
    superelastic = isinstance(material, _NITINOL)
    wording = WORDINGS["material", ""]["allowed_strain"]
    hint = "Where the material yields: yield strength over elastic modulus."
    return interview.ask(
        Question(
            wording.option,
            wording.text,
            lambda text: None if text.lower() == "none" else reading(text, above=0, at_most=1),
            default=ALLOWED_STRAIN if superelastic else "none",
            hint="Superelastic nitinol usually recovers 8 %: 0.08." if superelastic else hint,
        )
    )


def _ask(
    interview: Interview,
    section: str,
    kind: type,
    key: str,
    count: int | None = None,
    *,
    outer_diameter: float = 0.0,
    **limits: float,
) -> Any:
    """Ask for a key of a part: a value, or a list with one for each of `count` notches."""
    field = fields_of(kind)[key]
    wording = WORDINGS.get((section, kind_of(kind)), {}).get(key)
    if wording is not None and wording.below is not None:
        limits["below"] = wording.below
    read, is_choice = _reader(field, count, limits)
    default = None
    if not field.is_required():
        default = "none" if field.default is None else f"{field.default}".removesuffix(".0")
    if wording is None:
        unit = unit_of(field)
        text = f"{section}.{key}, {field.description}" + (f" [{unit}]" if unit else "")
        option = OPTIONS.get((section, key), f"--set {section}.{key}")
        return interview.ask(Question(option, text, read, default))
    several = count is not None and count > 1 and not is_choice
    each = f"; one value, or {count} joined by commas, base to tip" if several else ""
    hint = wording.hint.format(outer_diameter=outer_diameter)
    default = wording.default or default
    return interview.ask(Question(wording.option, wording.text + each, read, default, hint))


def _reader(
    field: Any, count: int | None, limits: dict[str, float]
) -> tuple[Callable[[str], Any], bool]:
    """Return what reads an answer for a field, and whether it is a choice of words."""
    choices = typing.get_args(field.annotation)

    def each(value: Any) -> Any:
        return value if count is None else [value] * count

    if typing.get_origin(field.annotation) is typing.Literal:
        return lambda text: each(choice(text, choices)), True
    constraints: Iterable[Any] = field.metadata
    bounds: dict[str, float] = {
        word: getattr(one, name)
        for one in constraints
        for name, word in _BOUNDS.items()
        if getattr(one, name, None) is not None
    } | limits
    for limit, other in (("above", "at_least"), ("below", "at_most")):
        if limit in bounds:  # the other one then is only the limit of the unit
            bounds.pop(other, None)

    def read(text: str) -> Any:
        if type(None) in choices and text.lower() == "none":
            return each(None)
        if is_list(field):
            return each(tuple(map(reading, separated(text))))
        return reading(text, **bounds) if count is None else readings(text, count, **bounds)

    return read, False


def _title(text: str) -> str:
    if not text:
        raise InputError.MISSING_VALUE("give a title.")
    return text
