"""Sentences of messages, kept in one file: `pytest --update-wordings` writes it anew.

A test asserts what a message is about by an exit code or an error code, and its sentence here. A
better wording is then one command and a look at the difference of `wordings.json`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

FILE = Path(__file__).parent / "wordings.json"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes the sentences anew."""
    parser.addoption(
        "--update-wordings", action="store_true", help=f"write the sentences of {FILE.name} anew"
    )


@pytest.fixture
def wording(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """Compare a message with the one that is kept under a name, or keep it."""

    def compare(name: str, text: str) -> None:
        kept = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
        words = " ".join(text.split())
        if request.config.getoption("--update-wordings"):
            ordered = dict(sorted({**kept, name: words}.items()))
            document = json.dumps(ordered, indent=1, ensure_ascii=False)
            FILE.write_text(f"{document}\n", encoding="utf-8")
            return
        assert kept.get(name) == words, (
            "the message is another one than in tests/wordings.json; if it is better, run "
            "`pytest --update-wordings` and look at the difference"
        )

    return compare
