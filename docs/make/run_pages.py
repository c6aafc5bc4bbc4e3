"""Runs what the pages show: code, commands, files, and puts what they print below them.

`python docs/make/run_pages.py [PAGE.md ...]` rewrites pages; the tests run them and compare.

In a page, Python blocks go on from each other. A line of a `sh` block that begins with `notchflex`
is run; other commands (pip, git) are not. A block with a title is written to that file. A `text`
block right behind code or commands holds what they print. All of it happens in an empty folder.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from notchflex.cli import run

DOCS = Path(__file__).resolve().parents[1]
# Examples and the notebook are run, and written, by themselves; calibrate.md by its own test.
BY_THEMSELVES = ("examples.md", "calibrate.md", "notebook.md")
PAGES = tuple(sorted(page.name for page in DOCS.glob("*.md") if page.name not in BY_THEMSELVES))
BLOCK = re.compile(
    r'^```(?P<kind>\w+)(?: title="(?P<title>[^"]+)")?\n(?P<body>.*?)^```\n'
    r"(?P<shown>\n```text\n(?P<text>.*?)^```\n)?",
    re.DOTALL | re.MULTILINE,
)


def with_output(text: str) -> str:
    """Run the blocks of a page and return it with what they print now.

    Raises:
        RuntimeError: A command fails, or a block prints what the page does not show.
    """
    names: dict[str, object] = {}

    def replaced(match: re.Match[str]) -> str:
        body, kind = match["body"], match["kind"]
        if match["title"]:
            Path(match["title"]).write_text(body, encoding="utf-8")
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            if kind == "python":
                exec(compile(body, "page", "exec"), names)
            elif kind == "sh":
                commands(body)
        block = match[0][: match.start("shown") - match.start()] if match["shown"] else match[0]
        if not match["shown"]:
            if printed.getvalue() and kind == "python":
                raise RuntimeError(f"this prints, but the page does not show it:\n{body}")
            return block
        return f"{block}\n```text\n{printed.getvalue()}```\n"

    with empty_folder():
        return BLOCK.sub(replaced, text)


def commands(body: str) -> None:
    """Run the lines of a block that call notchflex."""
    for line in body.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] != ["notchflex"]:
            continue
        code = run(words[1:])
        if code != 0:
            raise RuntimeError(f"{line} ended with {code}")


@contextlib.contextmanager
def empty_folder() -> Iterator[None]:
    """Work in a folder that is gone afterwards, where tables are as wide as in any pipe."""
    before, columns = Path.cwd(), os.environ.pop("COLUMNS", None)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)
            if columns is not None:
                os.environ["COLUMNS"] = columns


if __name__ == "__main__":
    for name in sys.argv[1:] or PAGES:
        page = DOCS / name
        old = page.read_text(encoding="utf-8")
        new = with_output(old)
        if new != old:
            page.write_text(new, encoding="utf-8")
            print(f"{name} is changed")
