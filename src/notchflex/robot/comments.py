"""Comments beside the values of a robot file: from what a value changed, to what it was fitted."""

import re
import tomllib
from typing import Any

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
