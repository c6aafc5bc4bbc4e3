"""The questions of `notchflex new`, in their order, and the robot that the answers describe."""

from __future__ import annotations

import dataclasses
import typing
from collections import Counter
from collections.abc import Callable, Container, Iterable
from itertools import groupby
from typing import Any, TypeVar

from notchflex.cli.interview.ask import Interview, Question
from notchflex.cli.interview.readings import choice, reading, readings, whole
from notchflex.cli.interview.wordings import OPTIONS, WORDINGS
from notchflex.errors import InputError
from notchflex.robot import Nitinol, Robot, Superelastic, Tendon, Tube
from notchflex.robot.fields import fields_of, is_list, kind_of
from notchflex.robot.kinds import Friction, Material, Notch, kinds_of
from notchflex.robot.problems import MOST_NOTCHES

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
    unasked = ("kind", "repeat", "ends")
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
                reading(part.strip(), above=0, at_most=tube.outer_radius)
                for part in text.split(",")
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
        unit = (field.json_schema_extra or {}).get("unit")
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
            return each(tuple(reading(one.strip()) for one in text.split(",")))
        return reading(text, **bounds) if count is None else readings(text, count, **bounds)

    return read, False


def _title(text: str) -> str:
    if not text:
        raise InputError.MISSING_VALUE("give a title.")
    return text
