"""Workers of dask: the bytes of one process, though workers, scheduler or client are killed."""

from __future__ import annotations

import os
import pickle
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import tomlkit

import notchflex as nf
from notchflex.pieces import run as connection
from notchflex.pieces.folder import versions
from notchflex.pieces.run import _connected, _on_cluster, _work
from notchflex.sweeping.sweep import SweepTask
from swept import TABLE, digests, plan

pytest.importorskip("distributed")
pytestmark = pytest.mark.nightly

MANY: dict[str, Any] = {"piece": 16, "sampling": {"points": 4000, "seed": 4}}
Start = Callable[..., "subprocess.Popen[bytes]"]


@pytest.fixture(scope="module")
def many(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sweep") / "many"
    nf.sweep(plan(**MANY), folder)
    return folder


@pytest.fixture
def start(tmp_path) -> Iterator[Start]:
    """Start Python processes; all are killed at the end."""
    started: list[subprocess.Popen[bytes]] = []

    def runner(*arguments: str) -> subprocess.Popen[bytes]:
        with open(tmp_path / "log", "ab") as log:
            one = subprocess.Popen(
                [sys.executable, "-m", *arguments], cwd=tmp_path, stdout=log, stderr=log
            )
        started.append(one)
        return one

    yield runner
    for one in started:
        one.kill()
        one.wait()


def cluster(start: Start, *first: str) -> tuple[str, list[subprocess.Popen[bytes]]]:
    """Start a scheduler and two workers as the documentation does, on the loopback."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    address = f"tcp://127.0.0.1:{port}"
    scheduler = start("dask", "scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
    worker = ("dask", "worker", address, "--nthreads", "1", "--no-dashboard")
    return address, [scheduler, start(*worker, *first), start(*worker, "--no-nanny")]


def test_a_real_scheduler_with_two_workers(many, tmp_path, start):
    """One worker is killed on the way, then the scheduler; threads do what is left."""
    address, (scheduler, _, worker) = cluster(start)
    seen: list[int] = []

    def kill(done: int, *_: int) -> None:
        seen.append(done)
        if len(seen) == 40:
            worker.send_signal(signal.SIGKILL)
        if len(seen) == 200:
            scheduler.send_signal(signal.SIGKILL)

    with pytest.raises(nf.InputError) as caught:
        nf.sweep(plan(**MANY), tmp_path / "swept", scheduler=address, progress=kill)
    assert caught.value.code.name == "NO_CONNECTION"
    assert len(seen) >= 200
    assert not nf.read_sweep(tmp_path / "swept").finished
    nf.sweep(plan(**MANY), tmp_path / "swept")
    assert digests(tmp_path / "swept") == digests(many)


def test_a_piece_handed_over_while_the_scheduler_dies(tmp_path, start):
    """dask would wait 20 s for a new scheduler, and may then wait for ever."""
    address, (scheduler, *_) = cluster(start)
    (tmp_path / "pieces").mkdir()
    task = SweepTask(plan(**MANY), nf.load_robot("pacheco2021-a"))
    work = partial(_work, pickle.dumps(task), versions(), str(tmp_path))
    died: list[float] = []

    def pieces(client: Any) -> Iterator[int]:
        yield from range(12)
        scheduler.send_signal(signal.SIGKILL)
        died.append(time.monotonic())
        while client.status == "running":
            time.sleep(0.01)
        yield 12

    def run() -> None:
        with _connected(address) as client:
            list(_on_cluster(client, work, pieces(client)))

    with pytest.raises(nf.InputError) as caught:
        run()
    assert caught.value.code.name == "NO_CONNECTION"
    assert time.monotonic() - died[0] < 15


@pytest.mark.parametrize("victims", ["workers", "frozen scheduler"])
def test_no_answer_for_long(many, tmp_path, start, monkeypatch, victims):
    """All workers are killed, or the scheduler answers no more, and nothing closes."""
    address, (scheduler, *workers) = cluster(start, "--no-nanny")
    died: list[float] = []

    def stop(*_: int) -> None:
        if not died:
            died.append(time.monotonic())
            # Not before: on a busy machine the first piece takes longer than this.
            for name, seconds in (("_ALONE", 2.0), ("_ANSWER", 3.0)):
                monkeypatch.setattr(connection, name, seconds)
            for one in workers if victims == "workers" else [scheduler]:
                one.send_signal(signal.SIGKILL if victims == "workers" else signal.SIGSTOP)

    with pytest.raises(nf.InputError) as caught:
        nf.sweep(plan(**MANY), tmp_path / "swept", scheduler=address, progress=stop)
    assert caught.value.code.name == "NO_CONNECTION"
    assert time.monotonic() - died[0] < 40
    nf.sweep(plan(**MANY), tmp_path / "swept")
    assert digests(tmp_path / "swept") == digests(many)


def test_workers_of_this_machine_and_a_killed_client(many, tmp_path, start):
    """The first client is stopped and killed; four workers do what is left."""
    folder = tmp_path / "swept"
    file = tmp_path / "plan.toml"
    file.write_text(tomlkit.dumps(TABLE | MANY), encoding="utf-8")
    client = start("notchflex", "sweep", str(file), "-o", str(folder))
    while len(list((folder / "pieces").glob("piece-*"))) < 20:
        assert client.poll() is None
        time.sleep(0.05)
    os.kill(client.pid, signal.SIGSTOP)
    with pytest.raises(nf.InputError) as caught:  # two clients at once
        nf.sweep(plan(**MANY), folder)
    assert caught.value.code.name == "CONFLICT"
    os.kill(client.pid, signal.SIGKILL)
    client.wait()
    nf.sweep(plan(**MANY), folder, workers=4)
    assert digests(folder) == digests(many)
