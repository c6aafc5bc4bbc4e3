"""Pages whose numbers are made by a script: each stands between two marks that do not show.

<!-- name -->7.8174<!-- / --> holds the number called `name`, or a whole table.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
_MARKED = re.compile(r"<!-- (?P<name>[\w.]+) -->(?P<value>.*?)<!-- / -->", re.DOTALL)


def marked(page: str) -> dict[str, list[str]]:
    """Return what stands between the marks of a page, by name."""
    found: dict[str, list[str]] = {}
    for match in _MARKED.finditer((FOLDER / page).read_text(encoding="utf-8")):
        found.setdefault(match["name"], []).append(match["value"])
    return found


def table(head: Iterable[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table in Markdown, with the line breaks that its marks need."""
    head = tuple(head)
    lines = (f"| {' | '.join(map(str, line))} |" for line in (head, ("---",) * len(head), *rows))
    return "\n\n" + re.sub(" +", " ", "\n".join(lines)) + "\n\n"


def percent(part: float, digits: int = 1) -> str:
    """Return a part in percent."""
    return f"{100.0 * part:.{digits}f} %"


def rewrite(page: str, numbers: Mapping[str, str]) -> None:
    """Put numbers between the marks of a page; marks of other names are left alone."""
    path = FOLDER / page
    text = _MARKED.sub(
        lambda match: (
            f"<!-- {match['name']} -->{numbers.get(match['name'], match['value'])}<!-- / -->"
        ),
        path.read_text(encoding="utf-8"),
    )
    path.write_text(text, encoding="utf-8")


def main(page: str, *makers: Callable[[], Mapping[str, str]]) -> None:
    """Rewrite a page with the numbers of every maker whose data are there."""
    for maker in makers:
        try:
            rewrite(page, maker())
        except FileNotFoundError as error:
            print(f"left as they are, {maker.__name__}: {error}", file=sys.stderr)
