"""Full disks and killed processes: one sentence, old files whole, and nothing left behind."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest

import notchflex as nf
from notchflex import _replacing
from notchflex.robot import files, robot_text
from refusals import refused

WRITE = """
import sys
import notchflex as nf
path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=40))
nf.save_path(path, sys.argv[1])
"""
ENDLESS = """
import sys
import notchflex as nf
path = nf.read_path(sys.argv[1])
while True:
    nf.save_path(path, sys.argv[2])
"""
LIMITED = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
"""


@pytest.mark.parametrize("name", ["p.nc", "p.parquet"])
def test_a_file_that_does_not_fit_is_one_sentence(tmp_path, name):
    """A limit of the size of files stands for a full disk: writing fails in the middle."""
    pytest.importorskip("resource", reason="there is no limit of the size of files here")
    file = tmp_path / name
    file.write_bytes(b"old")
    code = WRITE.replace("nf.save_path", LIMITED + "nf.save_path")
    done = subprocess.run(
        [sys.executable, "-c", code, str(file)], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 1
    lines = done.stderr.strip().splitlines()
    assert lines[-1].startswith(f"notchflex.errors.InputError: {file} cannot be written: ")
    assert done.stderr.count("Traceback") == 1  # of the one exception, and none of HDF5's
    assert os.listdir(tmp_path) == [name]
    assert file.read_bytes() == b"old"


EXPORT = """
import sys
from notchflex.cli import run
sys.exit(run(["export", "pacheco2021-a", sys.argv[1], sys.argv[2]]))
"""


@pytest.mark.parametrize("suffix", ["pdf", "stl"])
def test_an_export_that_does_not_fit_is_one_sentence(tmp_path, suffix):
    pytest.importorskip("resource", reason="there is no limit of the size of files here")
    file = tmp_path / f"wrist.{suffix}"
    file.write_bytes(b"old")
    # The cache of the tests, which no user has, would not fit either.
    environment = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", LIMITED.replace("4096", "1024") + EXPORT, f"--{suffix}", str(file)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment,
    )
    assert done.returncode == 2
    told = "".join(done.stderr.split())  # a long sentence is broken
    assert told.startswith(f"Error:{file}cannotbewritten:")
    assert told.count(".") == str(file).count(".") + 1
    assert os.listdir(tmp_path) == [file.name]
    assert file.read_bytes() == b"old"


@pytest.mark.parametrize("times", [2, pytest.param(20, marks=pytest.mark.nightly)])
def test_what_killed_processes_leave_is_swept(wrist, tmp_path, times, monkeypatch):
    file, other, random_ = tmp_path / "p.json", tmp_path / "other" / "p.json", random.Random(3)
    other.parent.mkdir()
    for name, steps in ((file, 3), (other, 40)):
        nf.save_path(nf.simulate(wrist, nf.pull(0.0, 1.0, steps=steps)), name)
    for _ in range(times):
        writer = subprocess.Popen([sys.executable, "-c", ENDLESS, str(other), str(file)])
        until = time.monotonic() + 120
        changed = file.stat().st_mtime_ns
        while file.stat().st_mtime_ns == changed and time.monotonic() < until:
            time.sleep(0.01)
        time.sleep(random_.uniform(0.0, 0.02))
        writer.send_signal(signal.SIGKILL)
        writer.wait()
        assert len(nf.read_path(file)) in (3, 40)  # old or new, and whole
    monkeypatch.setattr(_replacing, "_swept", set())
    nf.save_path(nf.read_path(file), file)
    assert sorted(os.listdir(tmp_path)) == ["other", "p.json"]


def test_the_file_of_a_process_that_writes_is_kept(tmp_path, monkeypatch):
    if sys.platform == "win32":
        pytest.skip("open files cannot be removed there anyway")
    with _replacing.replacing(tmp_path / "a.txt") as temporary:
        monkeypatch.setattr(_replacing, "_swept", set())
        with _replacing.replacing(tmp_path / "b.txt") as other:
            other.write_text("b")
        temporary.write_text("a")
    assert sorted(os.listdir(tmp_path)) == ["a.txt", "b.txt"]


def test_a_file_without_an_end_is_not_read_for_ever():
    if not os.path.exists("/dev/zero"):
        pytest.skip("there is no /dev/zero here")
    with refused("FILE_UNREADABLE", "/dev/zero", "MB"):
        nf.load_robot("/dev/zero")


@pytest.fixture
def pipe(tmp_path):
    if not hasattr(os, "mkfifo"):
        pytest.skip("there are no named pipes here")
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "pipe"


def test_a_pipe_without_a_writer_is_refused(pipe, monkeypatch):
    monkeypatch.setattr(files, "_WRITER_COMES", 0.1)
    with refused("FILE_UNREADABLE", str(pipe), "no program writes"):
        nf.load_robot(pipe)
    with refused("FILE_UNREADABLE", str(pipe)):
        nf.State.load(pipe)
    with refused("FILE_UNREADABLE", str(pipe)):
        nf.measure(pipe, nf.load_robot("pacheco2021-a"))


@pytest.mark.parametrize("slow", [0.0, 0.5])
def test_a_pipe_with_a_writer_is_read(pipe, monkeypatch, slow):
    monkeypatch.setattr(files, "_WRITER_COMES", 0.2)
    wrist = nf.load_robot("pacheco2021-a")
    text = robot_text(wrist)

    def write():
        with pipe.open("w") as file:
            time.sleep(slow)
            file.write(text[:100])
            file.flush()
            time.sleep(slow)
            file.write(text[100:] + 100_000 * "#")

    writer = threading.Thread(target=write)
    writer.start()
    assert nf.load_robot(pipe) == wrist
    writer.join()


@pytest.mark.parametrize("name", ["a\0b", "a\x1b[31mb", "a\nb"])
def test_names_hold_no_control_characters(name):
    wrist = nf.load_robot("pacheco2021-a")
    with refused("INVALID_ROBOT", "name", "control characters"):
        wrist.replace(name=name)


def test_a_deviation_that_tells_nothing_is_refused():
    with refused("OUT_OF_RANGE", "stroke of SensorNoise"):
        nf.SensorNoise(stroke=1e155)
