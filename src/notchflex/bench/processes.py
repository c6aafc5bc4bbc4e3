"""What is timed in processes of its own: the first call, a whole command, memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass

from notchflex.errors import InputError
from notchflex.solver.programs.store import VARIABLE

_FIRST = """
import time
import notchflex as nf
robot = nf.load_robot({robot!r})
nf.solve  # the import is not part of the call
started = time.perf_counter()
nf.solve(robot, nf.Load(tension=1.0)).total_angle
print(time.perf_counter() - started)
"""
# On Linux the usage that `getrusage` tells of a process begins with what the one before it had that
# it was started from, so the peak is read from the process itself there.
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


@dataclass(frozen=True)
class Process:
    """Something that is measured in a process of its own.

    Attributes:
        name: What it is.
        target: What is aimed at, in its unit.
        unit: "s", or "MiB" for memory.
        measure: Measures it.
    """

    name: str
    target: float
    unit: str
    measure: Callable[[], float]


def _first_call(robot: str) -> Callable[[], float]:
    return lambda: _python(_FIRST.format(robot=robot))


def _second_command() -> float:
    """Whole process of a command whose compiled programs are kept from the first time."""
    with tempfile.TemporaryDirectory() as folder:
        environment = _environment() | {"XDG_CACHE_HOME": folder, "LOCALAPPDATA": folder}
        command = [sys.executable, "-m", "notchflex", "simulate", "pacheco2021-a"]
        command += ["--tension", "0:3:31,3:0:31"]
        subprocess.run(command, env=environment, capture_output=True)
        started = time.perf_counter()
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        taken = time.perf_counter() - started
    if done.returncode:
        raise InputError.PROCESS_FAILED(
            f"`notchflex simulate pacheco2021-a` failed: {done.stderr.strip()}"
        )
    return taken


def _environment() -> dict[str, str]:
    """This process's, without a compile cache that would make the first time a second one."""
    return {key: value for key, value in os.environ.items() if not key.startswith("JAX_COMP")}


def _python(code: str) -> float:
    with tempfile.TemporaryDirectory() as folder:  # no programs are kept there yet
        environment = _environment() | {VARIABLE: folder}
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise InputError.PROCESS_FAILED(f"a measuring process failed: {done.stderr.strip()[-500:]}")
    return float(done.stdout)


PROCESSES = (
    Process("first call, wrist, nothing compiled", 1.5, "s", _first_call("pacheco2021-a")),
    Process("first call, links (Gao), nothing compiled", 5.0, "s", _first_call("gao2017")),
    Process("simulate pacheco2021-a, second time, whole process", 3.0, "s", _second_command),
    Process("memory, batch of 100,000 wrist paths", 2048.0, "MiB", lambda: _python(_MEMORY)),
)
