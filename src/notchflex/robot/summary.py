"""The summary of a robot: what `repr` and a notebook show of it."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from notchflex._summary import Summary, short
from notchflex.robot.fields import fields_of, is_list

if TYPE_CHECKING:
    from notchflex.robot.robot import Robot

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
