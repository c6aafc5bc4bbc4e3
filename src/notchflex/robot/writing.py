"""Writing robot files, with the comments of the file that a robot came from."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, cast

import tomlkit
from tomlkit.exceptions import ParseError

from notchflex._replacing import AnyPath, replacing
from notchflex.errors import InputError, RobotFileError
from notchflex.robot.files import read_text
from notchflex.robot.part import fields_of, unit_of
from notchflex.robot.problems import read_tolerances
from notchflex.robot.reading import robot_from_text
from notchflex.robot.robot import Robot, plain, source_of, to_table
from notchflex.robot.value_names import NamedPart, class_of, group_of, named_parts, parse_path

_HEADER = re.compile(
    r"""^((?:[ \t\r]*(?:\#.*)?\n)*)"""  # blank lines and comments above it
    r"""([ \t]*\[{1,2}[ \t]*["']?(\w+)["']?[ \t]*\]{1,2}[ \t\r]*(?:\#.*)?\n)""",
    re.MULTILINE,
)
_OPTIONAL = "tolerance", "fatigue", "drive", "drawing"
"""Tables that a robot file may have."""

_Notes = Mapping[str, str]


def save_robot(
    robot: Robot,
    path: AnyPath,
    template: AnyPath | None = None,
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
    source = None
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
    """Return the text of a robot file; a template of "" gives a fresh layout (see `save_robot`).

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
    # A template may be laid out in an unusual way; a fresh file is right, if bare.
    with suppress(InputError, ParseError):
        text = _rewritten(robot, template or _fresh(robot), notes)
        if robot_from_text(text) == robot:
            return text
    return _rewritten(robot, _fresh(robot), notes)


def _fresh(robot: Robot) -> str:
    """Lay out a new file, with the meaning and unit of every key as its comment."""
    lines = [
        "# A notchflex robot file. Lengths in mm, forces in N, moduli in MPa, angles in deg.",
        "",
        f"name = {tomlkit.item(robot.name).as_string()}",
    ]
    table = to_table(robot)
    for named in named_parts(robot):
        if named.section == "drawing" and "tolerance" in table:
            lines += ["", "[tolerance]", *_tolerance_lines(table["tolerance"])]
        if named.section not in table:
            continue
        lines += ["", f"[[{named.section}]]" if named.first else f"[{named.section}]"]
        fields = fields_of(type(named.part))
        for key, value in plain(named.part).items():
            comment = ", ".join(filter(None, (unit_of(fields[key]), fields[key].description)))
            line = f"{key} = {_written(value)}"
            lines.append(f"{line}  # {comment}" if comment else line)
    return "\n".join(lines) + "\n"


def _tolerance_lines(table: Mapping[str, Any]) -> list[str]:
    """Write tolerances, a name a line; TOML wants quotes around those with brackets."""
    names = ((f'"{name}"' if "[" in name else name, tolerance) for name, tolerance in table.items())
    return [f"{name} = {_written(tolerance)}" for name, tolerance in names]


def _written(value: Any) -> str:
    """Write a value; a table on one line."""
    item: Any = tomlkit.item(value)
    if isinstance(value, dict):
        item = tomlkit.inline_table()
        item.update(value)
    return item.as_string()


@dataclass
class _Block:
    """A piece of a template: comments above a header, the header, the lines below it."""

    name: str
    lead: str
    header: str
    body: str = ""

    def text(self, values: dict[str, Any], notes: _Notes) -> str:
        """Return the piece with other values, and what is to be said of them."""
        text = self.body
        if self.name == "tolerance":
            if read_tolerances(tomllib.loads(text)) != read_tolerances(values):
                text = "\n".join([*_tolerance_lines(values), ""])
        else:
            # Tables of a part of its own are inside it.
            body = tomlkit.parse(text.replace(f"[{self.name}.", "["))
            _update(body, values, self.name, notes)
            text = re.sub(r"(?m)^\[(tube|material)]", rf"[{self.name}.\1]", tomlkit.dumps(body))
        return self.lead + self.header + text


def _rewritten(robot: Robot, template: str, notes: _Notes) -> str:
    """Put the values of a robot into the text of a file."""
    old, new = to_table(robot_from_text(template)), to_table(robot)
    blocks: dict[str, list[_Block]] = {}
    for block in _split(template):
        blocks.setdefault(block.name, []).append(block)
    for name in _OPTIONAL:
        header = "[[drive]]" if name == "drive" else f"[{name}]"
        blocks.setdefault(name, [_Block(name, "\n", f"{header}\n")])
    # the head of the file: the name, and whatever is not under a header of its own
    new[""] = {name: table for name, table in new.items() if name not in blocks}
    texts: list[str] = []
    for name, pieces in blocks.items():
        tables = new.get(name, [])
        for block, first, table in _matched(pieces, old.get(name, tables), tables):
            named = NamedPart(name, first, table)
            targets = ((parse_path(path), note) for path, note in notes.items())
            of_keys = {target.key: note for target, note in targets if named.is_meant(target)}
            texts.append(block.text(table, of_keys))
    return "".join(texts)


def _split(template: str) -> list[_Block]:
    """Split a file at its headers; comments right above a header belong to it."""
    text = template if template.endswith("\n") else f"{template}\n"
    blocks, start = [_Block("", "", "")], 0
    for match in _HEADER.finditer(text):
        lead, header, name = match.groups()
        blocks[-1].body = text[start : match.start()]
        if match.start() == 0:  # the comment at the head of the file stays there
            head, blank, lead = lead.rpartition("\n\n")
            blocks[0].body = head + blank
        blocks.append(_Block(name, lead, header))
        start = match.end()
    blocks[-1].body = text[start:]
    return blocks


def _matched(
    blocks: list[_Block], old: Any, new: Any
) -> Iterator[tuple[_Block, int, dict[str, Any]]]:
    """Yield every new part, with the number of its first, and the piece that described it."""
    if not isinstance(new, list):
        yield blocks[0], 0, new
        return
    first, used = 1, None
    for table in cast("list[dict[str, Any]]", new):
        repeats = [former.get("repeat", 1) for former in old]
        block = blocks[group_of(min(first, sum(repeats)), repeats)[0] % len(blocks)]
        # a group of equal notches that was split: its comment stands once
        yield (replace(block, lead="\n") if block is used else block), first, table
        first, used = first + table.get("repeat", 1), block


def _update(table: Any, values: dict[str, Any], section: str, notes: _Notes) -> None:
    """Update a tomlkit table to the values of a part, changing only what differs."""
    fields = fields_of(class_of(section, values)) if section else {}
    defaults = {
        name: field.default
        for name, field in fields.items()
        if name != "kind" and not field.is_required()
    }
    for key in [key for key in table if key not in values and table[key] != defaults.get(key)]:
        del table[key]
    for key, value in values.items():
        if key not in table:
            if key in notes or key not in defaults or defaults[key] != value:
                table[key] = value
        elif isinstance(value, dict):
            _update(table[key], cast("dict[str, Any]", value), key, notes)
        elif isinstance(value, list):
            for item, part in zip(table[key], cast("list[Any]", value), strict=False):
                _update(item, part, key, notes)
        if key in table and not isinstance(value, dict | list):
            _set_value(table, key, value, notes.get(key))


# Comments beside the values of a robot file: from what a value changed, to what it was fitted.

FITTED_TO = "fitted by notchflex to"
"""Begins what a fit says of a value, behind the comment that stood there before."""

_COMMENT = re.compile(
    rf"(.*?)\s*(?:(?:;|#)\s*{FITTED_TO} .*?)?(?:\s*\(changed from (.*)\))?", re.DOTALL
)


def _set_value(table: Any, key: str, value: object, note: str | None) -> None:
    """Set a value, and say beside it from what it changed and to what it was fitted."""
    was, value = table[key], list(value) if isinstance(value, tuple) else value
    comment, changed = cast("re.Match[str]", _COMMENT.fullmatch(was.trivia.comment)).groups()
    if was != value:
        table[key] = value
        changed = changed or was.as_string()
        # Where no comment was, nothing speaks of the old value.
        if not was.trivia.comment or tomllib.loads(f"x = {changed}")["x"] == value:
            changed = None
    elif not note:
        return
    if note:
        comment = f"{comment}; " if comment.strip("# ") else "# "
        comment += f"{FITTED_TO} {note}"
    if changed:
        comment = f"{comment or '#'} (changed from {changed})"
    trivia = table[key].trivia
    if comment and not trivia.comment:
        trivia.comment_ws = "  "
    trivia.comment = comment
