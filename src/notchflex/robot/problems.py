"""What only the whole robot can tell: parts that do not fit each other, values hardly meant."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from math import pi
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, cast

from pydantic import BeforeValidator, WithJsonSchema

from notchflex.errors import InputError, InputWarning
from notchflex.robot.kinds import Notch, Tendon, Tube, openings_along
from notchflex.robot.part import ProblemError, Problems, fields_in, unit_of, unknown_key
from notchflex.robot.value_names import SECTIONS, described_at, named_parts, numbers_at

if TYPE_CHECKING:
    from notchflex.robot.robot import Robot


# Tolerances of a robot: how far its values may lie from those of its file.

Deviation: TypeAlias = float | str
"""A number in the unit of the value, or a part of the value as text, such as "5 %"."""

_PERCENT = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?%")
_HOW = 'give a number in the unit of the value, or text such as "5 %"'


@dataclass(frozen=True)
class Tolerance:
    """How far one value of a robot may lie from the one in its file.

    Attributes:
        value: Name of the value, such as `notch.depth` or `notch[3].depth`.
        sd: Standard deviation of a normal distribution, cut off at `plus` and `minus` if given.
        plus: How far above the value it may lie; with `minus` and without `sd` the deviation is
            uniform.
        minus: How far below the value it may lie, as a positive number.
        per_notch: Whether every notch has a deviation of its own; else all have the same.
    """

    value: str
    sd: Deviation | None = None
    plus: Deviation | None = None
    minus: Deviation | None = None
    per_notch: bool = False

    @property
    def written(self) -> Any:
        """What stands in a robot file: the standard deviation alone, or a table."""
        keys = {key: getattr(self, key) for key in _KEYS}
        table = {key: said for key, said in keys.items() if said is not None and said is not False}
        return self.sd if list(table) == ["sd"] else table


_KEYS = tuple(field.name for field in fields(Tolerance))[1:]


def amount(deviation: Deviation | None, value: float) -> float:
    """Return a deviation in the unit of its value; infinite for None.

    Example:
        >>> amount("5 %", 40_000.0), amount(0.01, 1.4)
        (2000.0, 0.01)
    """
    if isinstance(deviation, str):
        return float(deviation.rstrip("% ")) / 100.0 * abs(value)
    return math.inf if deviation is None else deviation


def with_limits(tolerances: Sequence[Tolerance], path: str, value: float) -> str:
    """Return a value as a drawing has it, with its tolerance; a standard deviation counts twice.

    Example:
        >>> with_limits((Tolerance("notch.depth", sd=0.01),), "notch.depth", 1.4)
        '1.4 ±0.02'
    """
    text = f"{value:.6g}"
    for tolerance in tolerances:
        if tolerance.value == path:
            plus, minus = (
                2.0 * amount(tolerance.sd, value) if far is None else amount(far, value)
                for far in (tolerance.plus, tolerance.minus)
            )
            text += f" ±{plus:.3g}" if plus == minus else f" +{plus:.3g} −{minus:.3g}"
    return text


def read_tolerances(table: Any) -> Any:
    """Make tolerances of the table of a robot file, or leave those that are made."""
    if table is None:
        return ()
    if not isinstance(table, Mapping):
        if isinstance(table, Sequence):
            entries = tuple(cast("Sequence[Any]", table))
            if all(isinstance(entry, Tolerance) for entry in entries):
                return entries
        text = "is not a table; write [tolerance] and below it lines such as notch.depth = 0.01."
        raise ProblemError([("", text)])
    tolerances: dict[str, Tolerance] = {}
    problems: list[tuple[str, str]] = []
    for name, entry in _flat(cast("Mapping[str, Any]", table)):
        value = name.replace("[*]", "")
        if value in tolerances:
            problems.append((name, "is given twice; give it once."))
        keys: dict[str, Any] = dict(entry) if isinstance(entry, Mapping) else {"sd": entry}
        problems += [(name, text) for text in _entry_problems(name, keys)]
        tolerances[value] = Tolerance(value, **{key: keys[key] for key in _KEYS if key in keys})
    if problems:
        raise ProblemError(problems)
    return tuple(tolerances.values())


def _flat(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the names of values with their entries: TOML reads `a.b` as a table in a table."""
    for name, entry in table.items():
        if isinstance(entry, Mapping) and "." not in name:
            for key, value in cast("Mapping[str, Any]", entry).items():
                is_part = value and key in SECTIONS and isinstance(value, Mapping)
                own = value if is_part else {"": value}
                for last, one in cast("Mapping[str, Any]", own).items():
                    yield f"{name}.{key}.{last}".rstrip("."), one
        else:
            yield name, entry


def _entry_problems(name: str, entry: dict[str, Any]) -> Iterator[str]:
    for key, value in entry.items():
        if key not in _KEYS:
            sentence = unknown_key(f"{name}.{key}", key, _KEYS)
            yield f"has a wrong key: {sentence}"
        elif key == "per_notch":
            if not isinstance(value, bool):
                yield f"has per_notch = {value!r}; write true or false."
        elif isinstance(value, str):
            if not _PERCENT.fullmatch(value):
                yield f'has the text "{value}"; {_HOW}.'
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            yield f"has {key} = {value!r}, which is not a number; {_HOW}."
        elif not 0.0 <= value < math.inf:
            yield f"has {key} = {value}; give a finite number of 0 or more, without a sign."
    if "sd" not in entry and not {"plus", "minus"} <= entry.keys():
        yield "has neither `sd` (standard deviation) nor both `plus` and `minus`; give one of them."


_DEVIATION = {
    "anyOf": [{"type": "number", "minimum": 0}, {"type": "string", "pattern": "^[0-9.]+ ?%$"}]
}
_ENTRY = {
    "anyOf": [
        *_DEVIATION["anyOf"],
        {
            "type": "object",
            "properties": {
                "sd": {**_DEVIATION, "description": "standard deviation"},
                "plus": {**_DEVIATION, "description": "how far above the value"},
                "minus": {**_DEVIATION, "description": "how far below the value, positive"},
                "per_notch": {"type": "boolean", "description": "each notch deviates by itself"},
            },
            "additionalProperties": False,
        },
        {"type": "object", "additionalProperties": True},  # `notch.depth` as a table in a table
    ]
}

Tolerances = Annotated[
    tuple[Tolerance, ...],
    BeforeValidator(read_tolerances),
    WithJsonSchema({"type": "object", "additionalProperties": _ENTRY}),
]
"""The `[tolerance]` table of a robot file."""


MOST_NOTCHES = 10_000

_OTHER_UNITS = {
    "mm": {"m": 1e3, "inch": 25.4, "um": 1e-3},
    "MPa": {"GPa": 1e3, "Pa": 1e-6, "kPa": 1e-3},
    "N": {"kN": 1e3, "mN": 1e-3},
    "N mm": {"mN mm": 1e-3},
    "g": {"mg": 1e-3},
    "m/s2": {"mm/s2": 1e-3},
    "rad": {"deg": pi / 180.0},
    "kg/m3": {"g/cm3": 1e3},
    "": {"%": 0.01},
}
"""Units that are taken for those of a robot file, and what converts them."""

_LEAST_DEPTH = 0.4
"""Part of the diameter that is cut at least: less hardly bends, and is rather what remains."""
_LEAST_CHANNEL = 0.12
"""Part of the outer diameter that a channel in the wall takes at least."""
_ON_SURFACE = 0.03
"""Part of the outer diameter by which a tendon on the inner surface may seem to be in the wall."""


def robot_problems(robot: "Robot") -> Problems:
    """Yield what is wrong with a robot: the name of a value, and a sentence about it."""
    number = robot.number_of_notches
    if number > MOST_NOTCHES:
        yield ("notch", f"makes {number} notches; at most {MOST_NOTCHES} are allowed.")
        return
    of_notches = list(_notch_problems(robot))
    yield from of_notches
    for i, tendon in enumerate(robot.tendon, start=1):
        for key, text in _tendon_problems(robot, tendon, bool(of_notches)):
            yield f"tendon[{i}].{key}", text
    yield from _drive_problems(robot)
    if not of_notches:
        yield from _tolerance_problems(robot)


def _drive_problems(robot: "Robot") -> Problems:
    """Find spools of tendons that are not there, are driven twice, or cannot be stretched."""
    driven = set[int]()
    for i, drive in enumerate(robot.drive, start=1):
        for key in ("tendon", "antagonist"):
            name, number = f"drive[{i}].{key}", getattr(drive, key)
            if number > robot.number_of_tendons:
                yield name, f"is {number}, but the robot has {robot.number_of_tendons} tendons."
                continue
            if number in driven:
                yield name, f"is {number}, which a spool drives already; give each tendon once."
            driven.add(number)
            tendon = robot.tendon[number - 1]
            if tendon.sheath_length is None and math.isinf(tendon.axial_stiffness):
                yield (
                    name,
                    f"is {number}, which cannot be stretched: a pretension needs an elastic tendon "
                    f"(tendon[{number}].axial_stiffness [N]) or one in a sheath.",
                )


def _tolerance_problems(robot: "Robot") -> Problems:
    """Find tolerances of what the robot does not have, or in a wrong unit."""
    for tolerance in robot.tolerance:
        name = f"tolerance.{tolerance.value}"
        try:
            numbers = numbers_at(robot, tolerance.value)
        except InputError as error:
            yield name, f"is about no number of this robot: {error}"
            continue
        unit = described_at(robot, tolerance.value).unit
        if tolerance.per_notch and not tolerance.value.startswith("notch."):
            yield name, "has `per_notch`, which is for values of all notches."
        smallest = min(map(abs, numbers.values()))
        for key in ("sd", "plus", "minus") if unit in ("mm", "MPa") and smallest else ():
            size = getattr(tolerance, key)
            if size is not None and amount(size, smallest) >= smallest:
                yield (
                    name,
                    f"has {key} = {size}, as much as the value itself, {smallest:g} {unit}; "
                    f"give it in {unit}, or in percent as text.",
                )


def _notch_problems(robot: "Robot") -> Problems:
    """Check notches in their tube, and beside their neighbours."""
    last: Notch | None = None  # the notch right before the table
    row: list[tuple[str, str]] = []  # what a notch lacks its neighbours often lack too
    for named in named_parts(robot):
        if not isinstance(notch := named.part, Notch):
            continue
        if notch.tube and notch.tube.base_length:
            yield f"{named.name}.tube.base_length", "is for [tube]; leave it out."
        if notch.material and (notch.material.density is None) != (robot.material.density is None):
            yield (
                f"{named.name}.material.density",
                "is known of one material and not of the other; give the densities of both, or "
                "neither.",
            )
        for key, text in notch.problems(notch.tube or robot.tube):
            yield f"{named.name}.{key}", text
        if last and not row:
            row = [(f"{named.name}.{key}", text) for key, text in notch.row_problems(last)]
        last = notch.expanded()[-1]
    yield from row


def _tendon_problems(robot: "Robot", tendon: Tendon, on_notches: bool) -> Problems:
    """Check a tendon in the tube, and unless notches are wrong over them and in its last body."""
    number = robot.number_of_notches
    end = tendon.end_body or number
    for key in ("disk_radius", "disk_direction_deg"):
        given = getattr(tendon, key)
        if given is not None and len(given) != end <= number:
            yield (
                key,
                f"has {len(given)} values; give {end}, one for each disk from body 1 to the body "
                "in which the tendon ends.",
            )
    for radius, tube in zip(tendon.disk_radius or (), robot.tubes[1:], strict=False):
        if radius > tube.outer_radius:
            yield (
                "disk_radius",
                f"has {radius} mm, outside the disk; it must be at most the outer radius of its "
                f"tube, {tube.outer_radius} mm.",
            )
            break
    for tube in dict.fromkeys(robot.tubes[: end + 1]):
        yield from _place_problems(tube, tendon)
    if end > number:
        yield (
            "end_body",
            f"is {end}; the robot has the bodies 1 to {number}, one after each notch.",
        )
    elif not on_notches:
        problems: dict[tuple[str, str], None] = {}  # equal notches say the same
        for named in named_parts(robot):
            if isinstance(named.part, Notch) and named.first <= end:
                problems |= dict.fromkeys(named.part.tendon_problems(tendon))
                problems |= dict.fromkeys(_disk_problems(robot, named.part, tendon))
        yield from problems
        if problems or tendon.end_body is None:
            return
        bodies = [body for body, _ in openings_along(robot.notches, tendon.direction_deg)]
        if end not in bodies:
            near = [n for n in bodies if n < end][-1:] + [n for n in bodies if n > end][:1]
            yield (
                "end_body",
                f"is {end}, which has no wall on the tendon's side of the tube; the tendon runs "
                f"through the {'bodies' if len(near) > 1 else 'body'} "
                f"{' and '.join(map(str, near))} there.",
            )


def _disk_problems(robot: "Robot", notch: Notch, tendon: Tendon) -> Problems:
    """Find holes of disks where there are none, and a bend that a curved law does not know."""
    if tendon.holes is None and not notch.is_round:
        return
    key = "disk_direction_deg" if tendon.disk_radius is None else "disk_radius"
    _, sides = tendon.holes or ((), (tendon.direction_deg,))
    if not notch.is_round:
        yield (
            key,
            f'is for gaps of kind = "rod"; leave it out over a notch of kind = "{notch.kind}".',
        )
    elif (kind := (notch.material or robot.material).kind) != "linear" and any(
        abs(math.sin(math.radians(side - notch.direction_deg))) > 1e-9 for side in sides
    ):
        yield (
            key if tendon.disk_direction_deg else "direction_deg",
            f'leaves the plane of the gaps, {notch.direction_deg} deg; a "{kind}" '
            "backbone bends by its law in that plane and linearly out of it. Give the gaps the "
            'direction_deg of the tendons, or use material.kind = "linear".',
        )


def _place_problems(tube: Tube, tendon: Tendon) -> Problems:
    """Check where a tendon lies in a tube."""
    if tendon.radius > tube.outer_radius:
        yield (
            "radius",
            f"is {tendon.radius} mm, outside the wall; it must be at most the outer "
            f"radius, {tube.outer_radius} mm.",
        )
    if tendon.diameter is not None:
        inside, outside = (tendon.radius + sign * tendon.diameter / 2 for sign in (-1, 1))
        lumen, surface = tube.inner_radius * (1 + 1e-9), tube.outer_radius * (1 + 1e-9)
        if outside > lumen and (outside > surface or inside < tube.inner_radius * (1 - 1e-9)):
            yield (
                "diameter",
                f"is {tendon.diameter} mm; at a radius of {tendon.radius} mm the tendon reaches "
                f"from {inside:.6g} to {outside:.6g} mm, neither all in the lumen (to "
                f"{tube.inner_radius:.6g} mm) nor all in the wall (to {tube.outer_radius:.6g} mm); "
                "in the lumen its radius is at most "
                f"{tube.inner_radius - tendon.diameter / 2:.6g} mm.",
            )


_Unusual: TypeAlias = tuple[str, float, tuple[float, float], float | None]
"""A value that is hardly meant: its name, its value, the usual limits, and what may be meant."""


def robot_warnings(robot: "Robot") -> Iterator[InputWarning]:
    """Yield a warning for each value that was probably not meant; lengths in metres are one."""
    by_unit: dict[tuple[str, str], list[_Unusual]] = {}
    for named in named_parts(robot):
        for key, field in fields_in(named.part).items():
            usual = (field.json_schema_extra or {}).get("usual")
            value = usual and attrgetter(key)(named.part)
            if usual and value is not None and not usual[0] <= value <= usual[1]:
                other, meant = _meant(value, usual, unit_of(field))
                unusual = (f"{named.name}.{key}", value, usual, meant)
                by_unit.setdefault((unit_of(field), other), []).append(unusual)
    for (unit, other), values in by_unit.items():
        yield _outside(values, unit, other)
    parts = ((f"{named.name}.", named.part) for named in named_parts(robot))
    for name, part in (*parts, ("", robot)):
        material = getattr(part, "material", None)
        used_at = getattr(material, "used_at", None)
        yield from too_cold(material, f"{name}material.temperature", used_at)
    if not by_unit:
        yield from _narrow_channels(robot)
        yield from _remaining_depths(robot)


def too_cold(material: Any, name: str, temperature: Any) -> Iterator[InputWarning]:
    """Warn of a temperature below the austenite finish, where both are known."""
    finish: Any = getattr(material, "austenite_finish", None)
    if None not in (finish, temperature) and temperature < finish:
        text = (
            f"`{name}` is {_shown(temperature, 'deg C')}, below the austenite finish, "
            f"{_shown(finish, 'deg C')}: the material is not superelastic there, and no number of "
            "this robot is right."
        )
        yield InputWarning(text, name, temperature, None)


def unlikely(name: str, value: float, usual: tuple[float, float], unit: str) -> InputWarning:
    """Ask about a value outside its usual limits."""
    other, meant = _meant(value, usual, unit)
    return _outside([(name, value, usual, meant)], unit, other)


def _meant(value: float, usual: tuple[float, float], unit: str) -> tuple[str, float | None]:
    """Return the unit in which a value is usual, and the value; "" and None where none is near."""
    for other, factor in _OTHER_UNITS[unit].items():
        if usual[0] <= value * factor <= usual[1]:
            return other, value * factor
    return "", None


def _outside(values: list[_Unusual], unit: str, other: str) -> InputWarning:
    """Word the values of one unit that may all have been typed in one other unit."""
    (name, value, (low, high), meant), *more = values
    names = [f"`{unusual[0]}`" for unusual in more[:2]]
    names += [f"{len(more) - 2} more"] * (len(more) > 2)
    also = f" (so {'is' if len(more) == 1 else 'are'} {' and '.join(names)})" if more else ""
    question = f"did you mean {_shown(meant, unit)} ({_shown(value, other)})?" if meant else ""
    text = (
        f"`{name}` is {_shown(value, unit)}, outside the usual {_shown(low, '')} to "
        f"{_shown(high, unit)}{also}; {question or 'is that what you mean?'}"
    )
    return InputWarning(text, name, value, meant)


def _narrow_channels(robot: "Robot") -> Iterator[InputWarning]:
    """Ask about tendons, of unknown diameter, where the wall has no room for a channel."""
    inner, outer = robot.tube.inner_radius, robot.tube.outer_radius
    for i, tendon in enumerate(robot.tendon, start=1):
        depth = tendon.radius - inner
        room = 2.0 * min(depth, outer - tendon.radius)
        is_inside = depth > 2.0 * _ON_SURFACE * outer and room < 2.0 * _LEAST_CHANNEL * outer
        if is_inside and tendon.diameter is None:
            name = f"tendon[{i}].radius"
            text = (
                f"`{name}` is {_shown(tendon.radius, 'mm')}, inside the wall, where a channel has "
                f"{_shown(room, 'mm')}; did you mean a tendon in the lumen, at most "
                f"{_shown(inner, 'mm')}? One in the wall has a `diameter`."
            )
            yield InputWarning(text, name, tendon.radius, inner)


def _remaining_depths(robot: "Robot") -> Iterator[InputWarning]:
    """Ask whether the depth of the first shallow notch is what remains of the tube."""
    diameter = robot.tube.outer_diameter
    for named in named_parts(robot):
        cut = named.part.spine_cut if isinstance(named.part, Notch) else None
        if cut is not None and cut[0] < _LEAST_DEPTH * diameter:
            name, remains = f"{named.name}.depth", diameter - cut[0]
            text = (
                f"`{name}` is {_shown(cut[0], 'mm')}, a shallow cut of a tube of "
                f"{_shown(diameter, 'mm')}; did you mean {_shown(remains, 'mm')}, if "
                f"{_shown(cut[0], 'mm')} is what remains?"
            )
            yield InputWarning(text, name, cut[0], remains)
            return


def _shown(value: float, unit: str) -> str:
    return f"{value:,.6g} {unit}".rstrip()
