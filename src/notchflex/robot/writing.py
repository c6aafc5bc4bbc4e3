"""Writing robot files, with the comments of the file that a robot came from."""

import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, cast

import tomlkit
from tomlkit.exceptions import ParseError

from notchflex._replacing import replacing
from notchflex.errors import InputError, RobotFileError
from notchflex.robot.part import (
    fields_of,
    is_unsaid,
)
from notchflex.robot.problems import read_tolerances
from notchflex.robot.reading import (
    read_text,
    robot_from_text,
)
from notchflex.robot.robot import (
    Robot,
    source_of,
    to_table,
)
from notchflex.robot.value_names import defaults_of

_HEADER = re.compile(r"""\s*\[{1,2}\s*["']?(\w+)["']?\s*\]{1,2}\s*(#.*)?""")
_NUMBERED = re.compile(r"(\w+)(?:\[(\*|\d+)\])?\.(\w+)")
_OPTIONAL = "tolerance", "drawing"
"""Tables that a robot file may have."""

_Notes = Mapping[str, str]


def save_robot(
    robot: Robot,
    path: str | os.PathLike[str],
    template: str | os.PathLike[str] | None = None,
    *,
    fitted: Mapping[str, str] | None = None,
) -> None:
    """Write a robot file in mm, N, MPa and deg.

    Comments are kept.  Where a value with a comment has changed, its comment goes on with
    "(changed from ...)", because a source given there speaks of the old value.

    Args:
        robot: The robot to write.
        path: The file to write; one that is there is replaced.
        template: The file whose comments and order are kept; None takes the file that the robot
            was read from, or a fresh layout with the meaning and unit of every key.
        fitted: Of fitted values, by the names that `Robot.with_value` takes, to what and how
            well: each is written beside its value.

    Raises:
        RobotFileError: The template cannot be read, or the file cannot be written.

    Example:
        >>> from notchflex.robot import load_robot
        >>> softer = load_robot("pacheco2021-a").with_value("material.elastic_modulus", 9_500.0)
        >>> save_robot(softer, "softer.toml")  # doctest: +SKIP
    """
    source: str | None = None
    if template is not None:
        source = read_text(template, "robot file", error_class=RobotFileError)
    try:
        with replacing(path) as temporary:
            temporary.write_text(robot_text(robot, source, fitted), encoding="utf-8", newline="\n")
    except InputError as error:
        raise RobotFileError.FILE_UNWRITABLE(str(error)) from None


def robot_text(
    robot: Robot, template: str | None = None, fitted: Mapping[str, str] | None = None
) -> str:
    """Return the text of a robot file.

    Args:
        robot: The robot to write.
        template: Text of a robot file whose comments and order are kept; None takes that of the
            robot's file, and "" a fresh layout.
        fitted: As for `save_robot`.

    Example:
        >>> from notchflex.robot import load_robot
        >>> softer = load_robot("pacheco2021-a").with_value("friction.coefficient", 0.12)
        >>> notes = {"friction.coefficient": "a.csv: 0.1 to 0.14"}
        >>> text = robot_text(softer, "", notes)
        >>> text.splitlines()[-2]
        'coefficient = 0.12  # coefficient of friction; fitted by notchflex to a.csv: 0.1 to 0.14'
    """
    notes = fitted or {}
    template = source_of(robot) if template is None else template
    if template:
        try:
            text = _rewritten(robot, template, notes)
            if robot_from_text(text) == robot:
                return text
        except (InputError, ParseError):
            pass  # a template laid out in an unusual way; a fresh file is right, if bare
    return _fresh(robot, notes)


def _notes_of(notes: _Notes, section: str, first: int, count: int) -> dict[str, str]:
    """Return the notes of the keys of a part; for notches or tendons from `first` (from 1) on."""
    by_key: dict[str, str] = {}
    for path, note in notes.items():
        match = _NUMBERED.fullmatch(path.strip())
        if match is None or match[1] != section:
            continue
        if match[2] in (None, "*") or first <= int(match[2]) < first + count:
            by_key[match[3]] = note
    return by_key


def _fresh(robot: Robot, notes: _Notes) -> str:
    """Lay out a new file, with the meaning and unit of every key as its comment."""
    lines = [
        "# A notchflex robot file. Lengths in mm, forces in N, moduli in MPa, angles in deg.",
        "",
    ]
    for key, value in to_table(robot).items():
        if key == "name":
            lines += [f"name = {tomlkit.item(value).as_string()}"]
            continue
        if key == "tolerance":
            lines += ["", f"[{key}]", *_tolerance_lines(value)]
            continue
        parts = getattr(robot, key)
        first = 1
        for one in parts if isinstance(parts, tuple) else (parts,):
            header = f"[[{key}]]" if isinstance(parts, tuple) else f"[{key}]"
            count = getattr(one, "repeat", 1)
            lines += ["", header, *_fresh_part(one, _notes_of(notes, key, first, count))]
            first += count
    return "\n".join(lines) + "\n"


def _tolerance_lines(table: Mapping[str, Any]) -> list[str]:
    """Write tolerances, a name a line; TOML wants quotes around one with brackets."""
    lines: list[str] = []
    for name, one in table.items():
        item: Any = tomlkit.inline_table() if isinstance(one, dict) else tomlkit.item(one)
        if isinstance(one, dict):
            item.update(one)
        lines.append(f'"{name}"' if "[" in name else name)
        lines[-1] += f" = {item.as_string()}"
    return lines


def _fresh_part(part: Any, notes: _Notes) -> list[str]:
    lines: list[str] = []
    for key, record in fields_of(type(part)).items():
        value = getattr(part, key)
        if is_unsaid(key, value):
            continue
        unit = (record.json_schema_extra or {}).get("unit", "")
        comment = ", ".join(word for word in (unit, record.description or "") if word)
        if key in notes:
            comment = "; ".join(word for word in (comment, f"{FITTED_TO} {notes[key]}") if word)
        line = f"{key} = {tomlkit.item(value).as_string()}"
        lines.append(f"{line}  # {comment}" if comment else line)
    return lines


@dataclass(frozen=True)
class _Block:
    """A piece of a template: comments above a header, the header, the lines below it."""

    name: str
    lead: list[str]
    header: str
    body: list[str] = field(default_factory=list[str])

    def text(self, values: dict[str, Any], notes: _Notes) -> str:
        """Return the piece with other values, and what is to be said of them."""
        text = "".join(self.body)
        if self.name == "tolerance":
            if read_tolerances(tomllib.loads(text)) != read_tolerances(values):
                text = "\n".join([*_tolerance_lines(values), ""])
            return "".join(self.lead) + self.header + text
        body = tomlkit.parse(text)
        _update(body, values, self.name, notes)
        return "".join(self.lead) + self.header + tomlkit.dumps(body)


def _rewritten(robot: Robot, template: str, notes: _Notes) -> str:
    """Put the values of a robot into the text of a file."""
    old = to_table(robot_from_text(template))
    new = to_table(robot)
    blocks = _split(template)
    rewritten: list[tuple[_Block, dict[str, Any]]] = []
    done: set[str] = set()
    for block in blocks:
        if block.name in ("notch", "tendon"):
            if block.name not in done:
                done.add(block.name)
                mine = [one for one in blocks if one.name == block.name]
                rewritten += _matched(mine, old[block.name], new[block.name])
        elif block.name in new:
            rewritten.append((block, new[block.name]))
        elif block.name:  # a robot without a table that its file has
            continue
        else:  # the head of the file: the name, and whatever is not under a header of its own
            headed = {one.name for one in blocks}
            rewritten.append(
                (block, {k: v for k, v in new.items() if k not in (*headed, *_OPTIONAL)})
            )
    for name in _OPTIONAL:
        if name in new and all(block.name != name for block in blocks):
            rewritten.append((_Block(name, ["\n"], f"[{name}]\n"), new[name]))
    texts: list[str] = []
    first = {"notch": 1, "tendon": 1}
    for block, table in rewritten:
        start, count = first.get(block.name, 1), table.get("repeat", 1)
        first[block.name] = start + count
        texts.append(block.text(table, _notes_of(notes, block.name, start, count)))
    return "".join(texts)


def _split(template: str) -> list[_Block]:
    """Split a file at its headers; comments right above a header belong to it."""
    blocks = [_Block("", [], "")]
    for line in template.splitlines(keepends=True):
        line = line if line.endswith("\n") else line + "\n"
        match = _HEADER.fullmatch(line.rstrip("\n"))
        if not match:
            blocks[-1].body.append(line)
            continue
        lead: list[str] = []
        body = blocks[-1].body
        while body and (not body[-1].strip() or body[-1].lstrip().startswith("#")):
            lead.insert(0, body.pop())
        if not body and not blocks[-1].name:  # the comment at the head of the file stays there
            cut = next((i for i in range(len(lead), 0, -1) if not lead[i - 1].strip()), 0)
            body.extend(lead[:cut])
            lead = lead[cut:]
        blocks.append(_Block(match[1], lead, line))
    return blocks


def _matched(
    blocks: list[_Block], old: list[dict[str, Any]], new: list[dict[str, Any]]
) -> list[tuple[_Block, dict[str, Any]]]:
    """Give every new notch or tendon the piece of the file that described it, or the last one."""
    owner = [i for i, one in enumerate(old) for _ in range(one.get("repeat", 1))]
    result: list[tuple[_Block, dict[str, Any]]] = []
    first, used = 0, -1
    for table in new:
        position = owner[min(first, len(owner) - 1)]
        block = blocks[position]
        # a group of equal notches that was split: its comment stands once
        result.append((replace(block, lead=["\n"]) if position == used else block, table))
        used = position
        first += table.get("repeat", 1)
    return result


def _update(table: Any, values: dict[str, Any], section: str, notes: _Notes) -> None:
    """Update a tomlkit table to the given values, changing only what differs."""
    defaults = defaults_of(section, values) if section else {}
    for key in [key for key in table if key not in values and table[key] != defaults.get(key)]:
        del table[key]
    for key, value in values.items():
        if key not in table:
            if key in notes or key not in defaults or defaults[key] != value:
                table[key] = value
        elif isinstance(value, dict):
            _update(table[key], cast("dict[str, Any]", value), key, notes)
        elif isinstance(value, list):
            for item, one in zip(table[key], cast("list[Any]", value), strict=False):
                _update(item, one, key, notes)
        elif table[key] != value:
            set_value(table, key, value)
        if key in notes and key in table:
            add_note(table[key], notes[key])


# Comments beside the values of a robot file: from what a value changed, to what it was fitted.

FITTED_TO = "fitted by notchflex to"
"""Begins what a fit says of a value, behind the comment that stood there before."""

_CHANGED = re.compile(r"\s*\(changed from (.*)\)$")
_FITTED = re.compile(rf"(?:;|#)\s*{FITTED_TO} .*$")


def set_value(table: Any, key: str, value: object) -> None:
    """Set a value, and note the old one in a comment."""
    was, comment = table[key].as_string(), table[key].trivia.comment
    table[key] = value
    if not comment:
        return
    changed = _CHANGED.search(comment)
    if changed:
        comment, was = comment[: changed.start()], changed[1]
    # What a fit said of the value is not true of another.
    comment = _FITTED.sub("", comment).rstrip()
    same = tomllib.loads(f"x = {was}")["x"] == value
    if not same:
        comment = f"{comment or '#'} (changed from {was})"
    _put(table[key], comment)


def add_note(item: Any, note: str) -> None:
    """Add to what a value was fitted, between its comment and what it was changed from."""
    comment = item.trivia.comment
    changed = _CHANGED.search(comment)
    if changed:
        comment = comment[: changed.start()]
    comment = _FITTED.sub("", comment).rstrip()
    comment = f"{comment}; {FITTED_TO} {note}" if comment.strip("# ") else f"# {FITTED_TO} {note}"
    _put(item, comment + (changed[0] if changed else ""))


def _put(item: Any, comment: str) -> None:
    """Put a comment beside a value, two blanks behind it where there was none."""
    if comment and not item.trivia.comment:
        item.trivia.comment_ws = "  "
    item.trivia.comment = comment
