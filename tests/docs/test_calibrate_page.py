"""docs/calibrate.md: its table, its command and its Python give what the page shows."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import notchflex as nf
from notchflex.cli import run

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "calibrate.md").read_text("utf-8")


def block(kind: str) -> str:
    """The only block of its kind on the page."""
    (text,) = re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)
    return text


def words(text: str) -> list[list[str]]:
    """Words of every line: a table of the page needs no spaces at its end."""
    return [line.split() for line in text.splitlines()]


def test_page_does_what_it_shows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("pulls.csv").write_text(block("csv"))
    command, _, shown = block("console").removeprefix("$ notchflex ").partition("\n")
    assert run(shlex.split(command)) == 0
    assert words(capsys.readouterr().out) == words(shown)
    written = Path("fitted/wrist.toml").read_text(encoding="utf-8").splitlines()
    for line in block("toml").splitlines():
        key, _, rest = line.partition(" = ")
        value, _, comment = rest.partition("  # ")
        mine = next(one for one in written if one.startswith(f"{key} = "))
        assert mine.endswith(f"  # {comment}")
        found = float(mine.split()[2])
        assert f"{found:.8g}" == value
    exec(compile(block("python"), "calibrate.md", "exec"), {})
    assert capsys.readouterr().out == block("text")
    assert nf.load_robot("fitted-too/Pacheco 2021, wrist A.toml").friction.coefficient != 0.13
