"""Description of a robot."""

import dataclasses
import datetime
import functools
import math
import unicodedata
import warnings
from collections.abc import Iterable, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, overload

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from notchflex import __version__
from notchflex._summary import Summary, short
from notchflex.errors import InputError, InputWarning
from notchflex.robot.kinds import (
    Friction,
    Material,
    Notch,
    Tendon,
    Tube,
    one_of,
)
from notchflex.robot.part import (
    ProblemError,
    fields_of,
    is_list,
    is_unsaid,
    part,
    sentences,
)
from notchflex.robot.problems import (
    Tolerances,
    robot_problems,
    robot_warnings,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from notchflex._plot import Picture

    AnyNotch: TypeAlias = Notch
    AnyMaterial: TypeAlias = Material
    AnyFriction: TypeAlias = Friction
else:
    AnyNotch, AnyMaterial, AnyFriction = one_of(Notch), one_of(Material), one_of(Friction)


def _as_text(value: object) -> object:
    """Take a date or a number as its text: TOML needs no quotes round `2026-11-26` or `3`."""
    plain = isinstance(value, datetime.date | int) and not isinstance(value, bool)
    return str(value) if plain else value


def _printable(value: str) -> str:
    """Refuse control characters, which files and terminals take for something else."""
    if any(unicodedata.category(letter) == "Cc" for letter in value):
        raise PydanticCustomError("control_character", "control characters are not allowed")
    return value


_PRINTABLE = AfterValidator(_printable)
_Entry: TypeAlias = (
    Annotated[str, Field(strict=True, max_length=60), BeforeValidator(_as_text), _PRINTABLE] | None
)
"""An entry of a title block."""


@part(kw_only=True)
class Drawing:
    """What the title block of a drawing says; entries that are None stay empty or have a default.

    Args:
        part: Name or number of the part; by default the name of the robot.
        revision: Its revision.
        material: The material, as a workshop orders it; by default the kind of the model.
        finish: The finish of its surface.
        drawn: Who has drawn it.
        date: The date.

    Raises:
        InputError: A value is no text, or has more than 60 letters.

    Example:
        >>> Drawing(part="W-12", revision="B").revision
        'B'
    """

    part: Annotated[_Entry, Field(description="name or number of the part")] = None
    revision: Annotated[_Entry, Field(description="revision")] = None
    material: Annotated[_Entry, Field(description="material, as it is ordered")] = None
    finish: Annotated[_Entry, Field(description="finish of the surface")] = None
    drawn: Annotated[_Entry, Field(description="who has drawn it")] = None
    date: Annotated[_Entry, Field(description="date")] = None


@part
class Robot:
    """A notched tube with its tendons, as in a robot file; immutable.

    Args:
        name: Name of the robot in tables and pictures.
        tube: The tube before it is cut.
        notch: The notches from base to tip; one entry may stand for several equal ones (`repeat`).
        tendon: The tendons.
        material: The material of the tube.
        friction: The friction between tendon and tube.
        tolerance: How far values may lie from these, by name, such as `{"notch.depth": 0.01}`;
            see `notchflex.uncertain`.
        drawing: What the title block of its drawing says.

    Raises:
        InputError: A value is not allowed; the message names it as `--set` does.

    Example:
        >>> from notchflex.robot import ArcNotch, Capstan, Linear, Robot, Tendon, Tube
        >>> wrist = Robot(
        ...     name="one notch",
        ...     tube=Tube(1.62, 1.40),
        ...     notch=(ArcNotch("on-axis", depth=1.4, height=0.8, uncut_length=1.2),),
        ...     tendon=(Tendon(0.70),),
        ...     material=Linear(7510.0),
        ...     friction=Capstan(0.05),
        ... )
        >>> wrist.with_value("notch[1].depth", 1.3).notch[0].depth
        1.3
    """

    name: Annotated[
        str, Field(strict=True, min_length=1, description="name of the robot"), _PRINTABLE
    ]
    tube: Tube
    notch: Annotated[tuple[AnyNotch, ...], Field(min_length=1)]
    tendon: Annotated[tuple[Tendon, ...], Field(min_length=1)]
    material: AnyMaterial
    friction: AnyFriction
    tolerance: Annotated[
        Tolerances, Field(description="how far values may lie from these, by name")
    ] = ()
    drawing: Annotated[Drawing, Field(description="what the title block of a drawing says")] = (
        Drawing()
    )

    @model_validator(mode="after")
    def _parts_fit(self) -> "Robot":
        problems = list(robot_problems(self))
        if problems:
            raise ProblemError(problems)
        return self

    @functools.cached_property
    def _hash(self) -> int:
        return hash(tuple(getattr(self, one.name) for one in dataclasses.fields(self)))

    def __hash__(self) -> int:
        """Return the hash of all values, cached: robots are keys at every solve."""
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the hash, which differs between processes, and the warnings."""
        left_out = "_hash", "warnings"
        return {name: value for name, value in vars(self).items() if name not in left_out}

    def __repr__(self) -> str:
        """Return a summary of a few lines."""
        return robot_summary(self).text

    def _repr_html_(self) -> str:

        return robot_summary(self).html

    @overload
    def plot(self) -> "Picture": ...
    @overload
    def plot(self, *, ax: "Axes") -> "Axes": ...
    def plot(self, *, ax: "Axes | None" = None) -> "Picture | Axes":
        """Draw the robot without loads; see `notchflex.plot`.

        Args:
            ax: Axes of matplotlib to draw into.

        Returns:
            The picture, which a notebook shows; the axes if some were given.

        Raises:
            InputError: matplotlib is not installed.
        """
        from notchflex._plot import plot

        return plot(self, ax=ax)

    @functools.cached_property
    def notches(self) -> tuple[Notch, ...]:
        """Every notch from base to tip, each with `repeat` 1."""
        return tuple(single for notch in self.notch for single in notch.expanded())

    @functools.cached_property
    def warnings(self) -> tuple[InputWarning, ...]:
        """Values that are allowed and were probably not meant, such as a modulus in GPa."""
        return tuple(robot_warnings(self))

    def citations(self) -> tuple[str, ...]:
        """Return what to cite: notchflex, and the papers whose models the parts are.

        Example:
            >>> from notchflex import load_robot
            >>> [one.partition(":")[0] for one in load_robot("liu2022").citations()]
            ['notchflex 0.1.0', 'Liu et al.', 'Gao et al.']
        """
        parts = (*self.notch, self.material, self.friction)
        papers = dict.fromkeys(paper for one in parts for paper in one.papers)
        return (f"notchflex {__version__}: statics of tendon-driven notched-tube robots", *papers)

    @property
    def number_of_notches(self) -> int:
        """Number of notches, with repeated ones counted each."""
        return sum(notch.repeat for notch in self.notch)

    @property
    def number_of_tendons(self) -> int:
        """Number of tendons."""
        return len(self.tendon)

    def replace(self, **parts: Any) -> "Robot":
        """Return a copy with other parts, such as `material=Linear(7510.0)`.

        Args:
            parts: New values for any of `name`, `tube`, `notch`, `tendon`, `material`, `friction`,
                `tolerance` and `drawing`.

        Raises:
            InputError: A value is not allowed, or there is no such part.
        """
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return remember_source(from_table(values | parts), source_of(self))

    def with_value(self, path: str, value: object) -> "Robot":
        """Return a copy with one value changed.

        Args:
            path: The name of the value: `material.elastic_modulus`, `notch[2].depth` (the second
                notch from the base), `notch.depth` or `notch[*].depth` (every notch),
                `tendon[1].radius`, `friction.kind` and so on.
            value: The new value, in the units of the robot file (mm, N, MPa, deg).

        Changing a kind (`material.kind`) keeps the keys that both kinds share and drops the others;
        `notchflex.robot.set_values` tells which. A value that was probably not meant gives an
        `InputWarning`, which `warnings` of the copy keeps.

        Raises:
            InputError: There is no such value, or the new one is not allowed.
        """
        changed = self.with_values({path: value})
        if changed.warnings and not self.warnings:
            warn_unlikely(changed)
        return changed

    def with_values(self, values: Mapping[str, object] | Iterable[tuple[str, object]]) -> "Robot":
        """Return a copy with several values changed at once; their order does not matter.

        Args:
            values: New values by path, as for `with_value`.

        Raises:
            InputError: There is no such value, or a new one is not allowed.
        """
        from notchflex.robot.value_names import set_values

        return set_values(self, values).robot


def to_table(robot: Robot) -> dict[str, Any]:
    """Convert a robot to the plain table of its file: dicts, lists, numbers and text."""
    optional = {
        "tolerance": {one.value: one.written for one in robot.tolerance},
        "drawing": _part_table(robot.drawing),
    }
    return {
        "name": robot.name,
        "tube": _part_table(robot.tube),
        "notch": [_part_table(notch) for notch in robot.notch],
        "tendon": [_part_table(tendon) for tendon in robot.tendon],
        "material": _part_table(robot.material),
        "friction": _part_table(robot.friction),
        **{name: table for name, table in optional.items() if table},
    }


def from_table(table: Mapping[str, Any]) -> Robot:
    """Make a robot from the plain table that a file holds.

    Args:
        table: As returned by `to_table` or read from TOML.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.
    """
    validator: Any = getattr(Robot, "__pydantic_validator__")  # noqa: B009
    try:
        return validator.validate_python(dict(table))
    except ValidationError as error:
        raise InputError.INVALID_ROBOT(
            "\n".join(sentences(error, Robot, _repeats(table)))
        ) from None


def warn_unlikely(robot: Robot) -> None:
    """Give the warnings of a robot as Python warnings, to the caller of the caller."""
    for warning in robot.warnings:
        warnings.warn(warning, stacklevel=3)


def source_of(robot: Robot) -> str | None:
    """Return the text of the file that a robot was read from, where there was one."""
    return getattr(robot, "_source", None)


def remember_source(robot: Robot, text: str | None) -> Robot:
    """Store the text of a robot's file with it, so that its comments survive a rewrite.

    It is not a field: two robots with the same values are equal whatever their files say.
    """
    object.__setattr__(robot, "_source", text)
    return robot


def _part_table(value: object) -> dict[str, Any]:
    """List the values of a part that are said."""
    values = {name: getattr(value, name) for name in fields_of(type(value))}
    return {name: one for name, one in values.items() if not is_unsaid(name, one)}


def _repeats(table: Mapping[str, Any]) -> list[int]:
    """Read `repeat` of every notch of a table that may hold anything."""
    notches = table.get("notch")
    repeated = [
        one.get("repeat", 1) if isinstance(one, Mapping) else 1
        for one in (notches if isinstance(notches, list) else [])
    ]
    return [one if isinstance(one, int) and one > 0 else 1 for one in repeated]


# The JSON Schema of robot files, for editors that check and complete them.

# pydantic's words for bounds, which it leaves as they are behind a check of our own
_BOUNDS = {
    "gt": "exclusiveMinimum",
    "ge": "minimum",
    "lt": "exclusiveMaximum",
    "le": "maximum",
}


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a robot file (draft 2020-12).

    Returns:
        The schema; every number has its unit under `unit`.  It holds nothing that JSON lacks: an
        infinite default is left out and stated in the description.

    Example:
        >>> sorted(json_schema()["required"])
        ['friction', 'material', 'name', 'notch', 'tendon', 'tube']
    """
    return schema_of(
        Robot, "notchflex robot file", "A tendon-driven notched tube, in mm, N, MPa and deg."
    )


def schema_of(cls: type, title: str, description: str) -> dict[str, Any]:
    """Return the JSON Schema of a file that a part describes.

    Args:
        cls: The part.
        title: What the file is called.
        description: What it holds.
    """
    schema = TypeAdapter(cls).json_schema()
    for one in [schema, *schema["$defs"].values()]:
        _tidy(one)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": title,
        "description": description,
    }


def _tidy(model: dict[str, Any]) -> None:
    """Make the schema of a class say what a file must hold."""
    # the rest of a docstring speaks of Python
    model["description"] = str(model.get("description", "")).partition("\n")[0]
    properties: dict[str, dict[str, Any]] = model["properties"]
    for value in properties.values():
        value.pop("title", None)
        default = value.get("default")
        if default in (None, []) or (isinstance(default, float) and math.isinf(default)):
            value.pop("default", None)  # TOML has no null: such a key is left out
        choices = [one for one in value.get("anyOf", ()) if one != {"type": "null"}]
        if len(choices) == 1:
            del value["anyOf"]
            value.update(choices[0])
        for ours, theirs in _BOUNDS.items():
            if ours in value:
                value[theirs] = value.pop(ours)
    if "kind" in properties:  # it has a default in Python, but a file must name it
        model["required"] = ["kind", *model.get("required", [])]
        properties["kind"].pop("default", None)


# The summary of a robot: what `repr` and a notebook show of it.

MOST = 4
"""Different values of one key that are listed; of more, their range."""

# A longer row goes on below.
_WIDTH = 145

_HINT = ".plot() draws it; .with_value(...) returns a changed copy"


def robot_summary(robot: Robot) -> Summary:
    """Summarise a robot: its tube, notches, tendons, material and friction."""
    kinds: dict[str, list[Any]] = {}
    for notch in robot.notches:
        kinds.setdefault(getattr(notch, "kind"), []).append(notch)  # noqa: B009
    rows = [("tube", _words([robot.tube]))]
    rows += [("notches", f"{len(same)} {kind}: {_words(same)}") for kind, same in kinds.items()]
    rows.append(("tendons", f"{len(robot.tendon)}: {_words(robot.tendon)}"))
    for name in ("material", "friction"):
        part = getattr(robot, name)
        rows.append((name, ", ".join(one for one in (part.kind, _words([part])) if one)))
    lines = [
        (name if number == 0 else "", line)
        for name, words in rows
        for number, line in enumerate(wrap(words, _WIDTH) or [""])
    ]
    return Summary(f"Robot {robot.name}", lines, _HINT)


def _words(parts: Sequence[Any]) -> str:
    """Return the values of parts of one kind that are not their defaults."""
    words: list[str] = []
    for name, field in fields_of(type(parts[0])).items():
        values = list(dict.fromkeys(getattr(part, name) for part in parts))
        if name in ("kind", "repeat") or values in ([None], [field.default]):
            continue
        extra = field.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
        title = name.removesuffix(f"_{unit}").replace("_", " ")
        shown = " and ".join(_curve(one) for one in values if one) if is_list(field) else ""
        words.append(f"{title} {shown or _values(values)} {unit}".strip())
    return ", ".join(words)


def _curve(values: Sequence[float]) -> str:
    return f"{short(values[0])} to {short(values[-1])} ({len(values)} values)"


def _values(values: Sequence[Any]) -> str:
    numbers = all(isinstance(one, (int, float)) for one in values)
    if numbers and len(values) > MOST:
        return f"{short(min(values))} to {short(max(values))}"
    return "/".join(short(one) if isinstance(one, float) else str(one) for one in values)
