"""Sweeps: throughput beside the bare batch, memory, growth; and what kills of processes leave.

`python benchmarks/sweeps.py throughput 1e8 --workers 2` solves so many wrists (two variables, code
and two quantities: five columns), and before it fewer, to show the growth; the bare batch solves
the same wrists in pieces of 1e6 and keeps nothing. The folder (32 bytes a row at most) is deleted
after each size; `TMPDIR` says where it is. `--processor` compares the time of processors,
where others work on the same machine.

`python benchmarks/sweeps.py kills 30` starts a scheduler of dask, two workers and a client on the
loopback, and kills one of them (SIGKILL) at random times, so many in all. What was killed is
started again. Each finished folder is compared with that of an undisturbed run, byte by byte.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import notchflex as nf
from notchflex.sweeping.sweep import numbers_between

OUTPUTS = ("total_angle", "tip_position", "converged")
CHUNK = 1_000_000


def plan(rows: int) -> nf.SweepPlan:
    """Return the plan: depth and height of the notches of wrist A, under 1 N."""
    table: dict[str, Any] = {
        "robot": "pacheco2021-a",
        "variable": [
            {"value": "notch.depth", "lower": 1.36, "upper": 1.42},
            {"value": "notch.height", "lower": 0.8, "upper": 1.2},
        ],
        "sampling": {"points": rows},
        "load": {"pulled": {"tension": 1.0}},
        "keep": [{"quantity": "total_angle"}, {"quantity": "tip_position", "axis": "x"}],
    }
    return nf.SweepPlan(**table)


def spent() -> float:
    """Return the processor time of this process and of its children that have ended, s."""
    both = (resource.getrusage(one) for one in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in both)


def bare(rows: int, cores: int, clock: Any) -> float:
    """Return the time of the batch alone, s."""
    chosen, robot = plan(rows), nf.load_robot("pacheco2021-a")
    taken = 0.0
    for start in range(-CHUNK, rows, CHUNK):  # the first is not counted: it prepares
        numbers = numbers_between(chosen, max(start, 0), min(max(start, 0) + CHUNK, rows))
        begun = clock()
        nf.batch(robot, numbers, nf.Load(tension=1.0), outputs=OUTPUTS, cores=cores)
        taken += (clock() - begun) if start >= 0 else 0.0
    return taken


def throughput(rows: int, workers: int, clock: Any) -> None:
    """Print a table of the time of sweeps of growing size."""
    base = bare(min(rows, 4 * CHUNK), workers, clock) / min(rows, 4 * CHUNK)
    print(f"bare batch on {workers} cores: {1e6 * base:.3f} µs a row")
    print(
        "rows  time [s]  more for each further row [µs]  part of the bare throughput  "
        "MiB a worker  GB"
    )
    sizes = [CHUNK * 10**power for power in range(4) if CHUNK * 10**power < rows]
    before: tuple[int, float] | None = None
    for size in [*sizes, rows]:
        with tempfile.TemporaryDirectory() as folder:
            marks: list[tuple[int, float]] = []
            begun = clock()
            nf.sweep(
                plan(size),
                folder,
                workers=workers,
                progress=lambda done, *_, marks=marks: marks.append((done, clock())),
            )
            taken = clock() - begun
            disk = sum(one.stat().st_size for one in Path(folder).rglob("*") if one.is_file())
            per_row = taken / size
            if before is not None:  # without the start of processes, which takes the same time
                per_row = (taken - before[1]) / (size - before[0])
            before = size, taken
            if len(marks) > 2 * workers and clock is time.monotonic:
                # Between the first pieces and the last: without the start of processes.
                (first, then), (last, now) = marks[workers - 1], marks[-1]
                per_row = (now - then) / (last - first)
            most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
            print(
                f"{size:.0e}  {taken:.1f}  {1e6 * per_row:.3f}  {base / per_row:.3f}  {most:.0f}  "
                f"{disk / 1e9:.3f}",
                flush=True,
            )


def digests(folder: Path) -> dict[str, str]:
    """Return a digest of every file below a folder."""
    files = sorted(one for one in folder.rglob("*") if one.is_file())
    return {
        str(one.relative_to(folder)): hashlib.sha256(one.read_bytes()).hexdigest() for one in files
    }


class Cluster:
    """A scheduler, two workers and a client on the loopback, each a process of its own."""

    def __init__(self, file: Path, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.file, self.folder = file, folder
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        for name in ("scheduler", "worker 1", "worker 2", "client"):
            self.start(name)

    def start(self, name: str) -> None:
        """Start one of them."""
        address = f"tcp://127.0.0.1:{self.port}"
        command = {
            "scheduler": ["-m", "dask", "scheduler", "--host", "127.0.0.1", "--port"],
            "worker": ["-m", "dask", "worker", address, "--nthreads", "1", "--no-nanny"],
            "client": [
                "-X",
                "faulthandler",
                "-m",
                "notchflex",
                "sweep",
                str(self.file),
                "-o",
                str(self.folder),
            ],
        }[name.split()[0]]
        more = {
            "scheduler": [str(self.port), "--no-dashboard"],
            "worker": ["--no-dashboard", "--death-timeout", "20"],
            "client": ["--scheduler", address, "--quiet"],
        }[name.split()[0]]
        log = open(self.folder.parent / f"{name}.log", "ab")  # noqa: SIM115
        self.processes[name] = subprocess.Popen(
            [sys.executable, *command, *more], stdout=log, stderr=log, cwd=self.folder.parent
        )

    def kill(self, name: str) -> None:
        """Kill one of them, and start it again; with the scheduler all end."""
        self.processes[name].send_signal(signal.SIGKILL)
        self.processes[name].wait()
        if name == "scheduler":
            begun = time.monotonic()
            try:
                code = self.processes["client"].wait(timeout=180)
            except subprocess.TimeoutExpired:
                self.processes["client"].send_signal(signal.SIGABRT)  # where its threads wait
                self.processes["client"].wait()
                print((self.folder.parent / "client.log").read_text()[-8000:], flush=True)
                raise
            taken = time.monotonic() - begun
            print(f"  the client ended with code {code} after {taken:.1f} s", flush=True)
            self.explain(code)
            self.stop()
            for one in ("scheduler", "worker 1", "worker 2"):
                self.start(one)
        self.start("client" if name == "scheduler" else name)

    def explain(self, code: int) -> None:
        """Print what the client said if it neither finished nor refused."""
        if code not in (0, 2):
            print((self.folder.parent / "client.log").read_text()[-8000:], flush=True)

    def stop(self) -> None:
        """End all of them."""
        for one in self.processes.values():
            if one.poll() is None:
                one.kill()
            one.wait()


def kills(count: int, rows: int, seed: int) -> None:
    """Kill processes at random times; print what happened."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "plan.toml"
        file.write_text(TEXT.format(rows=rows), encoding="utf-8")
        begun = time.monotonic()
        nf.sweep(file, Path(place) / "undisturbed")
        wanted = digests(Path(place) / "undisturbed")
        print(f"{len(wanted)} files in {time.monotonic() - begun:.1f} s", flush=True)
        done = rounds = wrong = 0
        while done < count:
            folder = Path(place) / f"killed-{rounds}"
            cluster = Cluster(file, folder)
            try:
                while done < count:
                    wait = rng.uniform(0.5, 12.0)
                    try:
                        code = cluster.processes["client"].wait(timeout=wait)
                    except subprocess.TimeoutExpired:
                        victim = rng.choice(list(cluster.processes))
                        print(f"kill {done + 1}: {victim} after {wait:.1f} s", flush=True)
                        cluster.kill(victim)
                        done += 1
                        continue
                    if code == 0:
                        break
                    print(f"  the client ended with code {code}", flush=True)
                    cluster.explain(code)
                    cluster.start("client")
                code = cluster.processes["client"].wait(timeout=600)
                while code:  # refused, such as by a worker's death: called again
                    cluster.start("client")
                    code = cluster.processes["client"].wait(timeout=600)
            finally:
                cluster.stop()
            found = digests(folder)
            same = found == wanted
            for name in sorted({*found, *wanted}):
                if found.get(name) != wanted.get(name):
                    print(f"  {name}: {found.get(name)} for {wanted.get(name)}", flush=True)
            wrong += not same
            print(f"round {rounds + 1}: {'identical' if same else 'DIFFERENT'}", flush=True)
            rounds += 1
            shutil.rmtree(folder)
        print(f"{done} kills in {rounds} rounds, {wrong} folders that differ")
    sys.exit(bool(wrong))


TEXT = """robot = "pacheco2021-a"
piece = 16384
variable = [
  {{value = "notch.depth", lower = 1.36, upper = 1.42}},
  {{value = "notch.height", lower = 0.8, upper = 1.2}},
]
keep = [{{quantity = "total_angle", upper = 90}}, {{quantity = "peak_strain"}}]
[sampling]
points = {rows}
[load.pulled]
tension = "0:1:3"
"""


def main() -> None:
    """Read the arguments."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["throughput", "kills"])
    parser.add_argument("count", type=float, help="rows, or kills")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--processor", action="store_true", help="time of processors")
    parser.add_argument("--rows", type=float, default=2e6, help="rows of the sweep that is killed")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    if given.what == "kills":
        kills(int(given.count), int(given.rows), given.seed)
    else:
        clock = spent if given.processor else time.monotonic
        throughput(int(given.count), given.workers, clock)


if __name__ == "__main__":
    main()
