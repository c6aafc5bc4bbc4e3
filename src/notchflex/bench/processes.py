"""Measurements in processes of their own: a first call, a whole command, memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from notchflex.errors import InputError
from notchflex.solver.programs.store import VARIABLE

_FIRST = """
import sys, time
import notchflex as nf
robot = nf.load_robot(sys.argv[1])
nf.solve  # the import is not part of the call
started = time.perf_counter()
nf.solve(robot, nf.Load(tension=1.0)).total_angle
print(time.perf_counter() - started)
"""
# On Linux `getrusage` of a process starts from the peak of its parent, so the peak is read from
# /proc there.
_MEMORY = """
import pathlib, resource
import notchflex as nf
robot = nf.load_robot("pacheco2021-a")
ups = [1.0 + 1e-5 * row for row in range(100_000)]
# Three steps each: up, further up, and back.
loads = [nf.pull(0.5, up, steps=2).then(nf.pull(0.7, 0.7, steps=1)) for up in ups]
found = nf.simulate_batch(robot, loads, outputs=("total_angle", "converged"))
assert found["converged"].all()
status = pathlib.Path("/proc/self/status")
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
if status.exists():
    peak = int(status.read_text().split("VmHWM:")[1].split()[0])
print(peak / 1024)
"""


def first_call(robot: str) -> float:
    """Return the time of the first solve of a process where nothing is compiled yet, s."""
    return float(_run(["-c", _FIRST, robot]))


def second_command() -> float:
    """Return the time of a whole command whose compiled programs are kept from the first, s."""
    command = ["-m", "notchflex", "simulate", "pacheco2021-a", "--tension", "0:3:31,3:0:31"]
    with tempfile.TemporaryDirectory() as folder:
        cache = {"XDG_CACHE_HOME": folder, "LOCALAPPDATA": folder}
        _run(command, cache)
        started = time.perf_counter()
        _run(command, cache)
        return time.perf_counter() - started


def memory() -> float:
    """Return the peak memory of a process that solves 100,000 paths, MiB."""
    return float(_run(["-c", _MEMORY]))


def _run(arguments: list[str], cache: dict[str, str] | None = None) -> str:
    """Run Python, with a new folder of compiled programs unless one is given; return its output."""
    inherited = {key: value for key, value in os.environ.items() if not key.startswith("JAX_COMP")}
    with tempfile.TemporaryDirectory() as new:
        environment = inherited | (cache or {VARIABLE: new})
        command = [sys.executable, *arguments]
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise InputError.PROCESS_FAILED(f"a measuring process failed: {done.stderr.strip()[-500:]}")
    return done.stdout
