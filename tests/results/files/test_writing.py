"""Outputs are checked before they are needed, and are written whole or not at all."""

import os
import stat

import pytest

from notchflex.errors import ErrorCode
from notchflex.results.writing import (
    check_distinct,
    check_output,
    check_picture,
    replacing,
    write_text,
)
from refusals import refused


def test_nothing_is_made_by_checking(tmp_path):
    check_output(str(tmp_path / "new.json"), "--json")
    check_picture(str(tmp_path / "new.PNG"), "--plot")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("target", "code"),
    [
        ("missing/a.json", "FILE_UNWRITABLE"),
        (".", "FILE_UNWRITABLE"),
        ("", "MISSING_VALUE"),
        ("file/a.json", "FILE_UNWRITABLE"),
        ("a\0b", "FILE_UNWRITABLE"),
    ],
)
def test_targets_that_cannot_be_written(tmp_path, monkeypatch, wording, target, code):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("x")
    with refused(code, "--json") as problem:
        check_output(target, "--json")
    wording(f"output: {target!r}", str(problem.value))


@pytest.mark.parametrize(
    ("target", "named"), [("a", ".png"), ("a.gif", ".gif"), ("-", "standard output")]
)
def test_pictures_have_a_known_suffix(target, named):
    with refused("FILE_FORMAT", "--plot", named):
        check_picture(target, "--plot")


def test_picture_without_matplotlib_tells_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with refused(ErrorCode.MISSING_PACKAGE):
        check_picture(str(tmp_path / "a.png"), "--plot")


def test_read_only_files_and_folders(tmp_path, monkeypatch):
    file = tmp_path / "a.json"
    file.write_text("old")
    # Root may write everywhere, so the permission itself is asked for instead of taken away.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with refused(ErrorCode.FILE_UNWRITABLE):
        check_output(str(file), "--json")
    monkeypatch.undo()

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    with refused(ErrorCode.FILE_UNWRITABLE):
        check_output(str(tmp_path / "b.json"), "--json")


def test_inputs_are_not_replaced(tmp_path):
    source = tmp_path / "robot.toml"
    source.write_text("x")
    with refused(ErrorCode.CONFLICT):
        check_output(str(source), "--json", inputs=[source])


def test_two_options_do_not_share_a_file(tmp_path):
    check_distinct({"--json": "a", "--csv": None, "--plot": "b"})
    with refused(ErrorCode.CONFLICT):
        check_distinct({"--json": "-", "--csv": "-"})
    with refused(ErrorCode.CONFLICT):
        check_distinct({"--json": str(tmp_path / "a"), "--csv": f"{tmp_path}/./a"})


def test_failure_leaves_the_old_file_and_no_other(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("old")

    def half():
        with replacing(file) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        half()
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


def test_success_replaces_the_file_and_keeps_its_permissions(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("old")
    file.chmod(0o640)
    write_text(file, "new")
    assert file.read_text() == "new"
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert list(tmp_path.iterdir()) == [file]


def test_links_are_followed(tmp_path):
    real = tmp_path / "real.txt"
    real.write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to(real)
    write_text(link, "new")
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_devices_are_written_directly():
    write_text(os.devnull, "gone")
    assert not os.path.isfile(os.devnull)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_pipes_are_written_directly():
    reading, writing = os.pipe()
    write_text(f"/dev/fd/{writing}", "through")
    os.close(writing)
    assert os.read(reading, 100) == b"through"
    os.close(reading)
    with refused(ErrorCode.FILE_UNWRITABLE):
        write_text("/dev/full", "x")
