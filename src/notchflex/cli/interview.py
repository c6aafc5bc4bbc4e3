"""The questions of `notchflex new`: each a key of the robot file, as its schema describes it."""

from __future__ import annotations

import ast
import operator
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import cache
from itertools import groupby
from typing import Any, NamedTuple

from pydantic import Field as Limits
from pydantic import FiniteFloat, TypeAdapter, ValidationError, create_model

from notchflex import InputError, Nitinol, Robot, Tendon, TensileTest, Tube
from notchflex.robot.problems import MOST_NOTCHES
from notchflex.support import Friction, Material, Notch, kind_of, kinds_of

BACK = ("<", "back")
"""What a person types to be asked the previous question again."""

HEADER = (
    f"Enter takes the value in brackets. {BACK[0]} or {BACK[1]} goes back to the previous "
    "question, and Ctrl+C ends without writing anything. A number may be a sum, such as 1.62-0.22."
)

USUAL_KINDS = ("arc", "nitinol", "superelastic", "linear", "capstan")
"""Kinds of which only what is needed, or has an option, is asked; the usual kind first."""


class KeyNote(NamedTuple):
    """What the schema does not say of a key.

    Attributes:
        default: The answer taken when none is given; None for the default of the robot file.
        comment: What the file says of a value that nobody gave.
        hint: How to measure it.
    """

    default: str | None = None
    comment: str = ""
    hint: str = ""


_CODE = KeyNote(comment="estimate: code of Pacheco 2021, not given in the paper")
_TABLE = "estimate: Pacheco 2021, Table 3, laser-cut nitinol"
_FITTED = "10000 is the value fitted to laser-cut Nitinol wrists (Pacheco 2021)."
_ASSUMED = KeyNote(comment="assumed")
_CHECKED = "checked against finite elements"
_NITINOL = "estimate: usual for superelastic nitinol"
_STRAIN = KeyNote(
    "0.08",
    "estimate: what superelastic nitinol usually recovers",
    "Superelastic nitinol usually recovers 8 %: 0.08.",
)
_DENSITY = KeyNote("6450", "estimate: usual for nitinol; only gravity needs it")

NOTES = {
    "tube.inner_diameter": KeyNote(hint="With a pin gauge, or the outer diameter less two walls."),
    "rod.diameter": KeyNote(hint="The inner diameter of the tube is the hole that holds it."),
    "rod.inner_diameter": KeyNote(comment="assumed: a solid wire"),
    "rod.disk_mass": KeyNote(comment="assumed: of the material of the backbone"),
    "tube.base_length": KeyNote(comment="assumed: held at the first notch"),
    "notch.cut": KeyNote(hint="It changes the stiffness by a third to a half."),
    "notch.depth": KeyNote(
        hint="If you measure what is left at the spine, type the outer diameter less that."
    ),
    "notch.direction_deg": KeyNote(comment="assumed: toward x"),
    "notch.precurvature_deg": KeyNote(comment="assumed: straight"),
    "arc.ends": KeyNote("shell", _CHECKED),
    "strip.ends": KeyNote("elastic", _CHECKED),
    "u-link.ends": KeyNote("elastic", _CHECKED),
    "notch.depth_at": _ASSUMED,
    "notch.closing": _ASSUMED,
    "tendon.radius": KeyNote(comment="assumed: the tendon lies on the inner wall"),
    "tendon.direction_deg": KeyNote(
        comment="assumed: on the side of the cuts",
        hint="0 is where notches of direction 0 bend to.",
    ),
    "tendon.axial_stiffness": KeyNote(comment="assumed: inextensible"),
    "tendon.path": _ASSUMED,
    "tendon.free_length": KeyNote(comment="assumed; without effect on an inextensible tendon"),
    "nitinol.elastic_modulus": KeyNote(
        comment=f"{_NITINOL}, 30 to 65 GPa",
        hint="30000 to 57000 are usual for superelastic tubes.",
    ),
    "nitinol.plateau_stress": KeyNote(comment=f"{_NITINOL}, 250 to 520 MPa"),
    "material.upper_plateau": KeyNote(
        hint="Data sheets print it by ASTM F2516; without one the stress where the plateau begins "
        "is asked for."
    ),
    "nitinol.plateau_modulus": KeyNote(comment=f"{_NITINOL}, 2 to 9 GPa"),
    "nitinol.compression_ratio": KeyNote(comment="estimate: nitinol has 1 to 1.5"),
    "nitinol.density": _DENSITY,
    "nitinol.allowed_strain": _STRAIN,
    "superelastic.elastic_modulus": KeyNote("10000", _TABLE, _FITTED),
    "superelastic.superelastic_modulus": KeyNote("3000", _TABLE),
    "superelastic.transition_strain": KeyNote("0.028", _TABLE),
    "superelastic.plastic_strain": _CODE,
    "superelastic.plastic_modulus": _CODE,
    "superelastic.plastic_exponent": _CODE,
    "superelastic.density": _DENSITY,
    "superelastic.allowed_strain": _STRAIN,
    "linear.elastic_modulus": KeyNote(hint=_FITTED),
    "material.allowed_strain": KeyNote(
        hint="Where the material yields: yield strength over elastic modulus."
    ),
    "material.poisson_ratio": KeyNote(
        comment="estimate: usual for metals; without effect on bending in a plane"
    ),
    "capstan.coefficient": KeyNote(
        "0.18", "estimate: nitinol tendon on nitinol tube, 0.13 to 0.19"
    ),
    "friction.wrap": _ASSUMED,
}
"""By kind, or by section for all kinds, and key."""

_UNASKED = ("ends", "stiffness_factor", "file")
"""Keys that are never asked for."""

_DECIMAL_COMMAS = " For decimal commas, separate numbers by semicolons, or write a point: 1.9."

Field = dict[str, Any]
"""What the schema says of a key: `description`, `unit`, `type`, `enum`, `default`, limits."""


@cache
def keys_of(kind: type) -> dict[str, Field]:
    """Return the keys of a part of a robot."""
    schema = TypeAdapter(kind).json_schema()
    return {
        key: {**field, **field.get("anyOf", [{}])[0]}
        for key, field in schema["properties"].items()
        if key not in ("kind", "repeat", "tube", "material")
    }


def note_of(section: str, kind: str, key: str) -> KeyNote:
    """Return what is noted of a key."""
    return NOTES.get(f"{kind}.{key}") or NOTES.get(f"{section}.{key}") or KeyNote()


class _GoBack(Exception):  # noqa: N818
    """A person wants to answer the previous question again: not an error."""


class Interview:
    """Takes answers from options first, then from a person or a pipe.

    Args:
        options: Option to its value on the command line; None where it was not given.
        accept_defaults: Take every default without asking.

    Attributes:
        unused: The options that answered no question.
        answered: Names of the values that somebody gave, as `notch.depth`.
    """

    def __init__(self, options: Mapping[str, str | None], *, accept_defaults: bool = False) -> None:
        self._options = options
        self.unused = {option for option, text in options.items() if text is not None}
        self.accept_defaults = accept_defaults
        self.answered: set[str] = set()
        self.person = sys.stdin is not None and sys.stdin.isatty()
        # What was typed so far, and how much of it has been asked for since the last way back.
        self._typed: list[str] = []
        self._asked = 0

    def conduct(self, name: str) -> Robot:
        """Return the robot that the answers describe; a person may go back between questions.

        Args:
            name: The title proposed.

        Raises:
            InputError: An answer that cannot be used and was not typed by a person, or none where
                one is needed.
        """
        while True:
            self.answered.clear()
            self._asked = 0
            try:
                return self._robot(name)
            except _GoBack:  # asked anew, but for what was typed before the last question
                if self._typed:
                    self._typed.pop()
                else:
                    _show("This is the first question.")

    def _robot(self, name: str) -> Robot:
        # A kind that does not exist is refused before anything is asked.
        for base in (Notch, Friction, Material):
            self._kind(base, asks=False)
        title = self._ask("--title", description="title", type="string", default=name)
        tube = Tube(**self._keys("tube", Tube, inner_diameter={"lt": "outer_diameter"}))
        notches = self._notches(tube)
        tendons = self._tendons(tube, notches)
        material = self._kind(Material)
        plastic = {"lt": 0.1}  # where the plastic branch begins
        make, given = self._made_by(material)
        values = self._keys("material", material, but=given, transition_strain=plastic)
        friction = self._kind(Friction, asks=self.person)
        of_friction = self._keys("friction", friction)
        return Robot(title, tube, notches, tendons, make(**values), friction(**of_friction))

    def _made_by(self, material: type) -> tuple[Any, list[str]]:
        """Return what makes a material of its keys, and those that a data sheet has given."""
        if material is Nitinol and self._options["--plateau-stress"] is None:
            (first, *more) = keys_of(TensileTest)
            values = self._keys("material", TensileTest, first)
            if values[first] is not None:
                self.answered |= {"material.plateau_stress", "material.unloading_stress"}
                test = TensileTest(**values, **self._keys("material", TensileTest, *more))
                return test.nitinol, ["plateau_stress"]
        return material, []

    def _notches(self, tube: Tube) -> tuple[Notch, ...]:
        """Ask for the number of notches, and for their keys: one value, or each its own."""
        kind = self._kind(Notch, asks=self.person)
        cut = self._keys("notch", kind, "cut")
        count = self._ask(
            "--notches", description="number of notches", type="integer", ge=1, le=MOST_NOTCHES
        )
        below = {"lt": tube.outer_diameter}
        rows = [cut | row for row in self._rows("notch", kind, count, depth=below, but=cut)]
        runs = [list(run) for _, run in groupby(enumerate(rows), key=lambda item: item[1])]
        return tuple(kind(**kind.further_on(run[0][1], run[0][0]), repeat=len(run)) for run in runs)

    def _tendons(self, tube: Tube, notches: tuple[Notch, ...]) -> tuple[Tendon, ...]:
        on_wall: Field = {"default": f"{tube.inner_radius:g}", "le": tube.outer_radius}
        if notches[0].is_round:  # the backbone fills the hole of its disks
            on_wall["default"] = ""
        radii = self._rows("tendon", Tendon, 0, "radius", radius=on_wall)
        side: Field = {"default": "0" if len(radii) == 1 else ""}
        more = self._rows("tendon", Tendon, len(radii), direction_deg=side, but=("radius",))
        tendons = [Tendon(**radius, **row) for radius, row in zip(radii, more, strict=True)]
        # Over a strip or a link there is no arc of the wall, and in finite elements the tendon of a
        # wrist spans its notches: such a tendon runs straight.
        straight = any(
            "path" in dict(notch.tendon_problems(tendons[0])) or notch.has_elastic_ends
            for notch in notches
        )
        if straight and "path" not in more[0]:
            tendons = [replace(tendon, path="straight") for tendon in tendons]
        return tuple(tendons)

    def _kind(self, base: type, *, asks: bool = True) -> type[Any]:
        """Ask for a kind of notch, material or friction; the usual one stands first.

        Args:
            base: What is of this kind.
            asks: Whether it is asked; else, without an option, it is the usual kind.
        """
        kinds, section = kinds_of(base), base.__name__.lower()
        option, text = {
            "notch": ("--kind", "kind of notch"),
            "friction": ("--friction-kind", "kind of friction"),
        }.get(section, ("--material", "material"))
        names = sorted(kinds, key=lambda kind: (*USUAL_KINDS, kind).index(kind))
        if not asks and self._options[option] is None:
            return kinds[names[0]]
        text = f"{text}, {' or '.join(names)}"
        return kinds[self._ask(option, description=text, enum=names, default=names[0])]

    def _option(self, section: str, key: str) -> str:
        """Return the option that answers for a key: one of its own, or `--set`."""
        name = key.removesuffix("_deg").replace("_", "-")
        if section == "tendon":
            name = f"tendon-{name}"
        elif (section, key) == ("friction", "coefficient"):
            name = "friction"
        elif section == "notch" and key in keys_of(Tube):  # a backbone has diameters too
            name = ""
        return f"--{name}" if f"--{name}" in self._options else f"--set {section}.{key}"

    def _rows(
        self, section: str, kind: type, count: int, *keys: str, **more: Any
    ) -> list[dict[str, Any]]:
        """Ask for keys of several parts of a kind; see `_keys`. Return those of each."""
        columns = self._keys(section, kind, *keys, count=count, **more)
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def _keys(
        self,
        section: str,
        kind: type,
        *keys: str,
        count: int | None = None,
        but: Collection[str] = (),
        **more: Field,
    ) -> dict[str, Any]:
        """Ask for keys of a part.

        Args:
            section: Its name in the file.
            kind: Its class.
            keys: The keys, as far as it has them; without any those that are usual.
            count: How many values each has: 0 for any number, None for one that is no list.
            but: Keys that are asked for elsewhere.
            **more: By key, what else than the schema says holds for it; a limit may be another key.
        """
        values: dict[str, Any] = {}
        for key, field in keys_of(kind).items():
            if key in but or (keys and key not in keys):
                continue
            note, option = note_of(section, kind_of(kind), key), self._option(section, key)
            default = field.get("default", "")
            default = "none" if default is None else f"{default}".removesuffix(".0")
            limits = {name: values.get(limit, limit) for name, limit in more.get(key, {}).items()}
            noted = {"hint": note.hint, "default": note.default or default, "count": count}
            question = {**field, **noted, **limits}
            is_usual = (
                "default" not in field
                or not option.startswith("--set")
                or kind_of(kind) not in ("", *USUAL_KINDS)
            )
            if (is_usual and key not in _UNASKED) or self._options.get(option) is not None:
                values[key] = self._ask(option, f"{section}.{key}", **question)
            elif note.default:
                values[key] = value_of(note.default, question)
        return values

    def _ask(self, option: str, name: str = "", **question: Any) -> Any:
        """Return the value of an answer; a person who errs is asked again.

        Args:
            option: The option that answers it.
            name: The value of the robot that is asked for.
            **question: What the schema says of it; `count` values; the `default` answer, a text
                that is empty where one is needed; and a `hint` how to measure it.
        """
        default = question.get("default", "")

        def read(answer: str) -> Any:
            if not answer and default:
                return value_of(default, question)
            try:
                value = value_of(answer, question)
            except InputError as problem:
                words = f"{option} {answer}: {problem}"
                if re.search(r"\d,\d", answer) and ";" not in answer:
                    words += _DECIMAL_COMMAS
                raise InputError(words, problem.code) from None
            self.answered.add(name)
            return value

        self.unused.discard(option)
        if (text := self._options.get(option)) is not None:
            return read(text.strip())
        if default and self.accept_defaults:
            return read("")
        self._asked += 1
        if self._asked <= len(self._typed):
            return read(self._typed[self._asked - 1])
        if self.person:
            for words in (HEADER if self._asked == 1 else "", question.get("hint", "")):
                _show(words)
        while True:
            answer = self._line(option, _words(question), default)
            if self.person and answer in BACK:
                raise _GoBack
            try:
                value = read(answer)
            except InputError as problem:
                if not self.person:
                    raise
                _show(str(problem))
                continue
            self._typed.append(answer)
            return value

    def _line(self, option: str, text: str, default: str) -> str:
        # A pipe needs no prompt, which would only be noise in a log.
        question = f"{text} ({default}):" if default else f"{text}:"
        *before, prompt = _lines(question) if self.person else [""]
        for line in before:
            print(line)
        try:
            return input(f"{prompt} " if prompt else "").strip()
        except UnicodeDecodeError:
            raise InputError.BAD_SYNTAX(
                f"{text}: the answer is not text in {sys.stdin.encoding}."
            ) from None
        except EOFError:
            if default:
                return ""
            raise InputError.MISSING_VALUE(
                f"No answer to: {text}. Give {option}, or a line of input."
            ) from None


def _words(question: Field) -> str:
    """Return what is asked, with its unit."""
    text, count = question["description"], question.get("count")
    text = text[:1].upper() + text[1:]
    text += f" [{question['unit']}]" if "unit" in question else ""
    if count == 0:
        text += "; several joined by commas"
    elif count and count > 1 and "enum" not in question:
        text += f"; one value, or {count} joined by commas, in their order"
    return text


def commented(text: str, answered: Collection[str]) -> str:
    """Mark the values that nobody measured, and explain each key only once."""
    lines: list[str] = []
    section, kind, explained = "", "", set[str]()
    for line in text.splitlines():
        if line.startswith("["):
            section, kind = line.strip("[]"), ""
        value, _, meaning = line.partition("  # ")
        key, _, content = value.partition(" = ")
        kind = content.strip('"') if key == "kind" else kind
        name = f"{section}.{key}"
        mark = "" if name in answered else note_of(section, kind, key).comment
        # A key is explained once, not at every notch; an estimate is marked everywhere.
        words = ["" if name in explained else meaning, mark]
        explained.add(name)
        comment = "; ".join(filter(None, words))
        lines.append(f"{value}  # {comment}" if comment else value)
    return "\n".join(lines) + "\n"


def _show(text: str) -> None:
    for line in _lines(text, "  "):
        print(line)


def _lines(text: str, indent: str = "") -> list[str]:
    """Break a text at its words for the width of the terminal, with room for the answer."""
    width = max(30, shutil.get_terminal_size((80, 24)).columns - 12)
    return textwrap.wrap(
        text,
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def value_of(text: str, field: Field) -> Any:
    """Return the value that an answer stands for, or a list of `count` values (0: any number).

    Raises:
        InputError: The answer is not what the schema allows.
    """
    count = field.get("count")
    if count is not None:
        parts = [text] if field.get("type") == "array" else separated(text)
        if count and len(parts) not in (1, count):
            raise InputError.WRONG_SHAPE(
                f"got {len(parts)} numbers; give one for all, or {count} joined by commas, in "
                "their order."
            )
        values = [value_of(part, {**field, "count": None}) for part in parts]
        return values * count if len(parts) == 1 < count else values
    if text.lower() == "none" and "anyOf" in field:
        return None
    if "enum" in field:
        return choice(text, field["enum"])
    if field["type"] == "array":
        return tuple(reading(part, field["items"]) for part in separated(text))
    return text if field["type"] == "string" else reading(text, field)


_OPERATIONS: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def reading(text: str, field: Field) -> float:
    """Return a typed number, with a decimal point or comma; sums such as `1.62-0.22` are evaluated.

    Args:
        text: A number, or numbers joined by + - * /.
        field: What the schema says of it: `gt`, `ge`, `lt`, `le` are its limits.

    Raises:
        InputError: Not a number, not finite, or outside its limits.

    Example:
        >>> round(reading("1.62-0.22", {"gt": 0, "lt": 1.62}), 9)
        1.4
    """
    try:
        plain = re.sub(r"(?<=\d),(?=\d)", ".", text).replace("−", "-")
        value = _evaluate(ast.parse(plain, mode="eval").body)
    except (ValueError, SyntaxError, ZeroDivisionError, OverflowError, RecursionError, MemoryError):
        raise InputError.NOT_A_NUMBER(
            f"got {_got(text)}; give a number such as 1.62, or a sum: 1.62-0.22."
        ) from None
    kind: Any = int if field.get("type") == "integer" else FiniteFloat
    names = [name for name in ("gt", "ge", "lt", "le") if name in field]
    # Beside a strict limit the other is only that of the unit.
    limits = {name: field[name] for name in names if name[1] == "t" or f"{name[0]}t" not in names}
    try:
        value = vars(create_model("Answer", value=(kind, Limits(**limits)))(value=value))["value"]
    except ValidationError as problem:
        words = problem.errors()[0]["msg"].removeprefix("Input ")
        raise InputError.OUT_OF_RANGE(f"got {value:g}; it {words}.") from None
    # Nobody reads callipers to a nanometre; this drops the noise of 1.62-0.22.
    return round(value, 9)


def separated(text: str) -> list[str]:
    """Split numbers at semicolons where there are some, so that commas may be decimal, or commas.

    Example:
        >>> separated("1,36; 1,39"), separated("1.36, 1.39")
        (['1,36', '1,39'], ['1.36', '1.39'])
    """
    return [part.strip() for part in text.split(";" if ";" in text else ",")]


def choice(text: str, allowed: Collection[str]) -> str:
    """Return one of the allowed words; its beginning is enough.

    Raises:
        InputError: Not one of them, or the beginning of several.
    """
    matches = [word for word in allowed if word == text] or [
        word for word in allowed if text and word.startswith(text.lower())
    ]
    if len(matches) != 1:
        raise InputError.UNKNOWN_NAME(f"got {_got(text)}; give {' or '.join(allowed)}.")
    return matches[0]


def _got(text: str) -> str:
    return repr(text) if text else "nothing"


def _evaluate(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_evaluate(operand)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _evaluate(operand)
        case ast.BinOp(left=left, op=operation, right=right) if type(operation) in _OPERATIONS:
            return _OPERATIONS[type(operation)](_evaluate(left), _evaluate(right))
        case _:
            raise ValueError("not a sum of numbers")
