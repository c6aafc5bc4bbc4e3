"""Programs that a wheel carries: recorded once, then found without tracing."""

import os
import subprocess
import sys

import pytest

from notchflex.solver.programs import store

SOLVE = """
import notchflex as nf
from notchflex.solver.programs.compiled import Native
state = nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0))
print(Native.traced, Native.compiled, repr(float(state.total_angle)))
"""
FROM = """
from pathlib import Path
from notchflex.solver.programs import store
store.SHIPPED = Path({!r})
"""


def solved(code, **settings):
    command = [sys.executable, "-c", code]
    environment = {**os.environ, store.VARIABLE: "", **settings}
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return found.stdout.split()


def test_a_recorded_program_is_not_traced_again(tmp_path):
    empty = FROM.format(str(tmp_path / "none"))
    first = solved(empty + SOLVE, **{store.RECORD: str(tmp_path)})
    again = solved(FROM.format(str(tmp_path)) + SOLVE)
    assert first[:2] == ["1", "1"]
    assert again[:2] == ["0", "1"]
    assert again[2] == first[2]


def test_programs_of_other_code_are_not_taken(tmp_path, monkeypatch):
    monkeypatch.setenv(store.RECORD, str(tmp_path))
    monkeypatch.setattr(store, "SHIPPED", tmp_path)
    store.record("one", b"content")
    assert store.read_shipped("one") == b"content"
    monkeypatch.setattr(store, "code_digest", lambda: "another version")
    assert store.read_shipped("one") is None


@pytest.mark.parametrize("spoil", [lambda whole: whole[:-9], lambda whole: b"", lambda _: b"other"])
def test_spoilt_programs_are_not_taken(tmp_path, monkeypatch, spoil):
    monkeypatch.setenv(store.RECORD, str(tmp_path))
    monkeypatch.setattr(store, "SHIPPED", tmp_path)
    store.record("one", b"content" * 100)
    (file,) = tmp_path.iterdir()
    file.write_bytes(spoil(file.read_bytes()))
    assert store.read_shipped("one") is None


def test_an_installed_wheel_carries_the_programs_of_typical_calls():
    if not store.SHIPPED.is_dir():
        pytest.skip("the package is run from its source, not installed from a wheel")
    assert solved(SOLVE)[0] == "0"
