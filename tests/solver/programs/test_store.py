"""The folder of compiled programs: private, verified and bounded in size."""

import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest

import notchflex
from notchflex.solver.programs import store

posix = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owner and mode here")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "kept"))
    store._checked.cache_clear()
    store.write("one", b"first")
    found = store.program_folder()
    assert found is not None
    return found


def only_file(folder):
    (file,) = folder.iterdir()
    return file


def test_what_is_written_is_read_back_and_nothing_else(folder):
    assert store.read("one") == b"first"
    assert store.read("two") is None
    store.write("one", b"second")
    assert store.read("one") == b"second"
    assert store.usage() == (1, 32 + len(b"second"))


@pytest.mark.parametrize("spoil", [lambda whole: whole[:-1], lambda whole: b"", lambda w: w + b"x"])
def test_spoilt_files_are_not_taken(folder, spoil):
    file = only_file(folder)
    file.write_bytes(spoil(file.read_bytes()))
    assert store.read("one") is None


@posix
@pytest.mark.parametrize("mode", [0o620, 0o602, 0o666])
def test_files_that_others_can_write_are_not_taken(folder, mode):
    only_file(folder).chmod(mode)
    assert store.read("one") is None


@posix
def test_links_are_not_followed(folder, tmp_path):
    file = only_file(folder)
    other = tmp_path / "elsewhere"
    file.rename(other)
    file.symlink_to(other)
    assert store.read("one") is None


@posix
@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777])
def test_a_folder_that_others_can_write_is_refused_with_the_remedy(folder, mode):
    folder.chmod(mode)
    assert store.read("one") is None  # also where it was private before
    store._checked.cache_clear()
    with pytest.warns(UserWarning, match=store.VARIABLE):
        assert store.program_folder() is None
    assert store.read("one") is None


@posix
def test_a_linked_folder_is_not_used(folder, tmp_path):
    other = tmp_path / "other"
    folder.rename(other)
    folder.symlink_to(other, target_is_directory=True)
    store._checked.cache_clear()
    assert store.read("one") is None
    assert store.program_folder() is None


@posix
def test_files_of_another_user_are_not_taken(folder, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert store.read("one") is None


@posix
def test_the_folder_is_made_private_whatever_the_mask(tmp_path, monkeypatch):
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "made"))
    before = os.umask(0)
    try:
        store.write("one", b"first")
        made = store.program_folder()
    finally:
        os.umask(before)
    assert made is not None
    assert made.stat().st_mode & 0o777 == 0o700
    assert only_file(made).stat().st_mode & 0o777 == 0o600


def test_programs_not_used_for_longest_are_removed_beyond_a_size(folder, monkeypatch):
    content = b"x" * 1000
    for number, name in enumerate(("a", "b", "c")):
        store.write(name, content)
        os.utime(folder / store._name(name), (number, number))
    assert store.read("a") == content  # used now
    monkeypatch.setattr(store, "MAX_BYTES", 2200)
    store.write("one", b"first")
    assert store.read("a") == content
    assert store.read("b") is None
    assert store.usage().size <= 2200


def test_clearing_removes_all_and_tells_what_was_there(folder):
    store.write("two", b"second")
    assert store.clear().programs == 2
    assert store.usage() == (0, 0)


def test_an_empty_choice_keeps_nothing(monkeypatch):
    monkeypatch.setenv(store.VARIABLE, "")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        store.write("one", b"first")
    assert store.read("one") is None
    monkeypatch.setenv(store.VARIABLE, "gs://somewhere")
    assert store.chosen_folder() is None


def test_other_code_finds_nothing(folder, monkeypatch):
    monkeypatch.setattr(store, "made_from", lambda: "another version")
    assert store.read("one") is None


def test_a_second_python_process_compiles_nothing(tmp_path):
    code = """
import notchflex as nf
from notchflex.solver.programs.compiled import Native
state = nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0))
print(Native.compiled, repr(float(state.total_angle)))
"""
    own = {**os.environ, store.VARIABLE: str(tmp_path)}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", code], env=own, capture_output=True, text=True, check=True
        ).stdout.split()
        for _ in range(2)
    )
    assert int(first[0]) == 1
    assert int(second[0]) == 0
    assert first[1] == second[1]


def test_programs_are_found_by_the_code_of_mechanics_and_compiler(monkeypatch, tmp_path):
    digest = store.code_digest.__wrapped__
    before = digest()
    assert before == digest()
    (tmp_path / "compiler.py").write_text("changed = True\n")
    changed = SimpleNamespace(submodule_search_locations=[str(tmp_path)])
    with monkeypatch.context() as patch:
        patch.setattr(store, "find_spec", lambda name: changed if name == "lanewise" else None)
        assert digest() != before
    (tmp_path / "solver").mkdir()
    (tmp_path / "solver" / "newton.py").write_text("changed = True\n")
    monkeypatch.setattr(store, "PACKAGE", tmp_path)
    assert digest() != before


def test_folders_with_programs_are_those_of_the_digest():
    source = Path(notchflex.__file__).parent
    defining = {
        file.relative_to(source).parts[0]
        for file in source.rglob("*.py")
        if "import Native" in file.read_text(encoding="utf-8")
    }
    assert defining <= store._COMPILED
