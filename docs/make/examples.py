"""Writes docs/examples.md: every example with its question, its code and what it prints."""

from __future__ import annotations

import contextlib
import io
import re
import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "examples.md"
HEAD = """\
# Examples

Each script answers one question and runs on its own: `python examples/01_first_bend.py`. The tests
run all of them and compare every number with an independent calculation
(`tests/examples/test_examples.py`). `python docs/make/examples.py` writes this page.
"""


def section(file: Path) -> str:
    """Return what the page says about one example."""
    found = re.match(r'"""(.*?)"""\n\n(.*)', file.read_text(encoding="utf-8"), re.DOTALL)
    assert found, f"{file.name} begins with no question"
    question, code = found.groups()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        runpy.run_path(str(file))
    return (
        f"## {question}\n\n`examples/{file.name}`\n\n"
        f"```python\n{code}```\n\n```text\n{printed.getvalue()}```\n"
    )


if __name__ == "__main__":
    files = sorted((ROOT / "examples").glob("*.py"))
    PAGE.write_text("\n".join([HEAD, *map(section, files)]), encoding="utf-8")
