"""Description of a robot."""

import functools
import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeAlias, cast, overload

from pydantic import Field, TypeAdapter, ValidationError

from notchflex import __version__
from notchflex._summary import MOST, Summary, short
from notchflex.errors import InputError, InputWarning
from notchflex.robot.fatigue import Fatigue
from notchflex.robot.kinds import (
    PRINTABLE,
    AnyMaterial,
    Drawing,
    Drive,
    Friction,
    Material,
    Notch,
    Tendon,
    Tube,
    any_kind_of,
)
from notchflex.robot.part import Problems, fields_of, is_unsaid, own_parts, part, sentences, unit_of
from notchflex.robot.problems import Tolerances, robot_problems, robot_warnings
from notchflex.robot.value_names import change_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from notchflex._plot import Picture
    from notchflex.analysis.geometry import Geometry

    AnyNotch: TypeAlias = Notch
    AnyFriction: TypeAlias = Friction
else:
    AnyNotch, AnyFriction = any_kind_of(Notch), any_kind_of(Friction)


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
        fatigue: The limit line that its strain cycles are compared with.
        drawing: What the title block of its drawing says.
        drive: Spools that drive two tendons each; see `notchflex.spool_path`.

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
        str, Field(strict=True, min_length=1, description="name of the robot"), PRINTABLE
    ]
    tube: Tube
    notch: Annotated[tuple[AnyNotch, ...], Field(min_length=1)]
    tendon: Annotated[tuple[Tendon, ...], Field(min_length=1)]
    material: AnyMaterial
    friction: AnyFriction
    tolerance: Annotated[
        Tolerances, Field(description="how far values may lie from these, by name")
    ] = ()
    fatigue: Annotated[Fatigue, Field(description="limit line of its strain cycles")] = Fatigue()
    drawing: Annotated[Drawing, Field(description="what the title block of a drawing says")] = (
        Drawing()
    )
    drive: Annotated[tuple[Drive, ...], Field(description="spools of two tendons each")] = ()

    def conflicts(self) -> Problems:
        """Find parts that do not fit each other."""
        return robot_problems(self)

    @functools.cached_property
    def _hash(self) -> int:
        return hash(tuple(getattr(self, name) for name in fields_of(Robot)))

    def __hash__(self) -> int:
        """Return the hash of all values, cached: robots are keys at every solve."""
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without what is derived; a hash differs between processes."""
        left_out = "_hash", "geometry", "warnings", "tubes", "materials"
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
    def tubes(self) -> tuple[Tube, ...]:
        """The tube of every body, base first."""
        return (self.tube, *(notch.tube or self.tube for notch in self.notches))

    @functools.cached_property
    def materials(self) -> tuple[Material, ...]:
        """The material of every body, base first."""
        return (self.material, *(notch.material or self.material for notch in self.notches))

    @property
    def densities(self) -> tuple[float, ...] | None:
        """The density of every body [kg/m3]; None where none is known."""
        known = tuple(each.density for each in self.materials if each.density is not None)
        return known or None

    @functools.cached_property
    def geometry(self) -> "Geometry":
        """Its bodies, cuts, walls, closing angles and masses, without loads."""
        from notchflex.analysis.geometry import Geometry

        return Geometry(self)

    @functools.cached_property
    def warnings(self) -> tuple[InputWarning, ...]:
        """Values that are allowed and were probably not meant, such as a modulus in GPa."""
        return tuple(robot_warnings(self))

    def citations(self) -> tuple[str, ...]:
        """Return what to cite: notchflex, and the papers whose models the parts are.

        Example:
            >>> from notchflex import load_robot
            >>> [paper.partition(":")[0] for paper in load_robot("liu2022").citations()]
            ['notchflex 0.1.0', 'Liu et al.', 'Gao et al.']
        """
        parts = (*self.notch, *self.materials, self.friction)
        papers = dict.fromkeys(paper for part in parts for paper in part.papers)
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
                `tolerance`, `fatigue`, `drawing` and `drive`.

        Raises:
            InputError: A value is not allowed, or there is no such part.
        """
        values = {name: getattr(self, name) for name in fields_of(Robot)}
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
        return set_values(self, values).robot


class Changed(NamedTuple):
    """A robot with new values, and the keys that a change of kind dropped."""

    robot: Robot
    dropped: tuple[str, ...]


def set_values(
    robot: Robot, values: Mapping[str, object] | Iterable[tuple[str, object]]
) -> Changed:
    """Set values of a robot by their names (see `Robot.with_value`); all are set, then checked."""
    table = to_table(robot)
    dropped = change_table(table, values)
    return Changed(remember_source(from_table(table), source_of(robot)), dropped)


def to_table(robot: Robot) -> dict[str, Any]:
    """Convert a robot to the plain table of its file: dicts, lists, numbers and text."""
    tables = {name: plain(getattr(robot, name)) for name in fields_of(Robot)}
    tables["tolerance"] = {tolerance.value: tolerance.written for tolerance in robot.tolerance}
    return {name: table for name, table in tables.items() if table}


def plain(value: Any) -> Any:
    """Convert a part, parts, or a name to what stands in a file: the values that are said."""
    if isinstance(value, tuple):
        return [plain(part) for part in cast("tuple[Any, ...]", value)]
    if isinstance(value, str):
        return value
    values = {name: getattr(value, name) for name in fields_of(type(value))}
    return {
        name: plain(said) if name in own_parts(type(value)) and said else said
        for name, said in values.items()
        if not is_unsaid(name, said)
    }


def from_table(table: Mapping[str, Any]) -> Robot:
    """Make a robot from the plain table that a file holds, or from its parts."""
    validator: Any = getattr(Robot, "__pydantic_validator__")  # noqa: B009
    try:
        return validator.validate_python(dict(table))
    except ValidationError as error:
        repeats = list(_repeats(table.get("notch")))
        raise InputError.INVALID_ROBOT("\n".join(sentences(error, Robot, repeats))) from None


def _repeats(notches: Any) -> Iterator[int]:
    """Read how many notches each of `notch` stands for, which may be anything."""
    for notch in notches if isinstance(notches, list | tuple) else ():
        is_table = isinstance(notch, Mapping)
        repeat = notch.get("repeat", 1) if is_table else getattr(notch, "repeat", 1)
        yield repeat if isinstance(repeat, int) and repeat > 0 else 1


def warn_unlikely(robot: Robot) -> None:
    """Give the warnings of a robot as Python warnings, to the caller of the caller."""
    for warning in robot.warnings:
        warnings.warn(warning, stacklevel=3)


def source_of(robot: Robot) -> str | None:
    """Return the text of the file that a robot was read from, where there was one."""
    return getattr(robot, "_source", None)


def remember_source(robot: Robot, text: str | None) -> Robot:
    """Store the text of a robot's file with it, so that its comments survive a rewrite."""
    vars(robot)["_source"] = text
    return robot


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
    """Return the JSON Schema, with a title and a description, of a file that a part describes."""
    schema = TypeAdapter(cls).json_schema()
    for model in [schema, *schema["$defs"].values()]:
        _tidy(model)
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
        choices = [choice for choice in value.get("anyOf", ()) if choice != {"type": "null"}]
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

# A longer row goes on below.
_WIDTH = 145

_HINT = ".plot() draws it; .with_value(...) returns a changed copy"


def robot_summary(robot: Robot) -> Summary:
    """Summarise a robot: its tube, notches, tendons, material and friction."""
    kinds: dict[str, list[Notch]] = {}
    for notch in robot.notches:
        kinds.setdefault(notch.kind, []).append(notch)
    rows = [("tube", _words([robot.tube]))]
    rows += [("notches", f"{len(same)} {kind}: {_words(same)}") for kind, same in kinds.items()]
    rows.append(("tendons", f"{len(robot.tendon)}: {_words(robot.tendon)}"))
    for name in ("material", "friction"):
        part = getattr(robot, name)
        rows.append((name, ", ".join(filter(None, (part.kind, _words([part]))))))
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
        unit = unit_of(field)
        title = name.removesuffix(f"_{unit}").replace("_", " ")
        words.append(f"{title} {_values(values)} {unit}".strip())
    return ", ".join(words)


def _values(values: Sequence[Any]) -> str:
    if any(isinstance(value, tuple) for value in values):
        return " and ".join(
            f"{short(value[0])} to {short(value[-1])} ({len(value)} values)"
            for value in values
            if value
        )
    numbers = all(isinstance(value, (int, float)) for value in values)
    if numbers and len(values) > MOST:
        return f"{short(min(values))} to {short(max(values))}"
    texts = (_words([value]) if is_dataclass(value) else str(value) for value in values)
    pairs = zip(values, texts, strict=True)
    return "/".join(short(value) if isinstance(value, float) else text for value, text in pairs)
