"""Running the command line inside this process, in an empty folder."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from notchflex.cli import run

Outcome = tuple[int, str, str]


@pytest.fixture
def call(tmp_path, monkeypatch, capsys) -> Callable[..., Outcome]:
    """Run a command; return its exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def runner(*arguments: str) -> Outcome:
        code = run(list(arguments))
        return (code, *capsys.readouterr())

    return runner


@pytest.fixture
def refused(call, tmp_path, wording) -> Callable[..., str]:
    """Run a command that must be refused, and compare its message with the one that is kept."""

    def runner(*arguments: str, name: str | None = None) -> str:
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        code, out, err = call(*arguments)
        assert code == 2, err
        assert out == ""
        assert err.startswith("Error: ")
        assert err.count("Error: ") == 1
        assert "Traceback" not in err
        after = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        assert after == before
        short = [part if len(part) < 100 else f"{part[:9]}..." for part in arguments]
        wording(name or " ".join(part or "''" for part in short), err.removeprefix("Error: "))
        return err

    return runner
