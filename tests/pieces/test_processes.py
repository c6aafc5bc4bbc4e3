"""Workers of this machine: processes that open no port, are replaced, and end with their parent."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
import tomlkit

import notchflex as nf
from swept import TABLE, digests, plan

MANY = {"piece": 16, "sampling": {"points": 400, "seed": 4}}

pytestmark = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs /proc of Linux")


def tree_of(process: int) -> list[int]:
    """The process and all below it."""
    parents: dict[int, int] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if fields[0] != "Z":
            parents[int(folder.name)] = int(fields[1])
    tree = [process]
    for one in tree:
        tree += [child for child, parent in parents.items() if parent == one]
    return tree


def command_of(process: int) -> bytes:
    """The command line of a process; empty once it is gone."""
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def listening(processes: list[int]) -> list[str]:
    """Addresses at which any of the processes takes connections: ports, and named sockets."""
    inodes: dict[str, str] = {}
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A":
                inodes[fields[9]] = fields[1]
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        fields = line.split()
        if len(fields) > 7:
            inodes[fields[6]] = fields[7]
    found: list[str] = []
    for one in processes:
        for handle in Path(f"/proc/{one}/fd").glob("*"):
            try:
                target = os.readlink(handle)
            except OSError:
                continue
            if target.startswith("socket:["):
                found += [inodes[target[8:-1]]] if target[8:-1] in inodes else []
    return found


def test_they_open_no_port_and_are_replaced(tmp_path):
    nf.sweep(plan(**MANY), tmp_path / "alone")
    before = set(tree_of(os.getpid()))
    seen, killed = [], []

    def look(*_: int) -> None:
        workers = [one for one in tree_of(os.getpid()) if one not in before]
        seen.extend(listening(workers))
        working = [one for one in workers if b"spawn_main" in command_of(one)]
        if not killed and len(working) == 2:
            killed.append(working[-1])
            os.kill(working[-1], signal.SIGKILL)

    own = listening([os.getpid()])
    nf.sweep(plan(**MANY), tmp_path / "two", workers=2, progress=look)
    assert killed
    assert not seen
    assert listening([os.getpid()]) == own
    assert digests(tmp_path / "two") == digests(tmp_path / "alone")


@pytest.mark.skipif(
    getattr(os, "getuid", lambda: 1)() != 0, reason="only root can try it as another user"
)
def test_another_user_cannot_reach_them(tmp_path):
    """Their pipes are behind /proc/PID/fd, which only their user may open."""
    nobody = 65534
    tries = 'echo ran; for one; do ls "/proc/$one/fd" >/dev/null 2>&1 && echo "$one"; done'
    before, told = set(tree_of(os.getpid())), []

    def look(*_: int) -> None:
        workers = [one for one in tree_of(os.getpid()) if one not in before]
        if workers and not told:
            command = ["/bin/sh", "-c", f"{tries}; true", "sh", *map(str, workers)]
            options = {"user": nobody, "group": nobody, "extra_groups": [], "cwd": "/"}
            told.append(subprocess.check_output(command, text=True, **options))

    nf.sweep(plan(**MANY), tmp_path / "two", workers=2, progress=look)
    assert told == ["ran\n"]
    written = [tmp_path / "two", *(tmp_path / "two").rglob("*")]
    assert not [one for one in written if one.stat().st_mode & stat.S_IWOTH]


@pytest.mark.nightly
def test_they_end_with_a_killed_parent(tmp_path):
    file = tmp_path / "plan.toml"
    file.write_text(tomlkit.dumps(TABLE | MANY | {"sampling": {"points": 40_000}}), "utf-8")
    command = [sys.executable, "-m", "notchflex", "sweep", str(file), "-o", "swept"]
    client = subprocess.Popen([*command, "--workers", "2"], cwd=tmp_path, stdout=subprocess.DEVNULL)
    pieces = tmp_path / "swept" / "pieces"
    while len(list(pieces.glob("piece-*"))) < 4:
        assert client.poll() is None
        time.sleep(0.05)
    workers = tree_of(client.pid)[1:]
    assert not listening([client.pid, *workers])
    client.kill()
    client.wait()
    until = time.monotonic() + 20
    while any(Path(f"/proc/{one}").exists() for one in workers):
        assert time.monotonic() < until
        time.sleep(0.1)
