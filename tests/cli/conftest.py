"""Running the command line inside this process, in an empty folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from notchflex.cli import app, run
from notchflex.errors import InputError

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
def refused(call, tmp_path, monkeypatch, wording) -> Callable[..., str]:
    """Run a command that must be refused with an error of a code; its message is a kept one."""
    codes: list[str] = []
    execute = app.execute

    def recorded(tokens: Sequence[str]) -> int:
        try:
            return execute(tokens)
        except InputError as problem:
            codes.append(problem.code.name)
            raise

    monkeypatch.setattr(app, "execute", recorded)

    def runner(wanted: str, *arguments: str, name: str | None = None) -> str:
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        code, out, err = call(*arguments)
        assert code == 2, err
        assert codes.pop() == wanted
        assert out == ""
        assert err.startswith("Error: ")
        assert err.count("Error: ") == 1
        assert "Traceback" not in err
        after = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        assert after == before
        short = [part if len(part) < 100 else f"{part[:9]}...{part[-9:]}" for part in arguments]
        wording(name or " ".join(part or "''" for part in short), err.removeprefix("Error: "))
        return err

    return runner
