"""The cases of `notchflex bench`: robots and loads in this process, and whole processes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np

import notchflex as nf
from notchflex import InputError
from notchflex._jax import jax
from notchflex.solver.programs.store import VARIABLE

Run = Callable[[], object]


class Case(NamedTuple):
    """One thing to measure.

    Attributes:
        name: What it is; "per" names what the time is of.
        target: Target, in the unit, or in multiples of the time of another case; None for none.
        make: Makes the function that is timed; with a unit of s or MiB it measures by itself.
        per: Number of solves or steps that the function does.
        of: Name of the case that the target is a multiple of.
        unit: "LU135", or "s" and "MiB" for what is measured in a process of its own.
    """

    name: str
    target: float | None
    make: Callable[[], Any]
    per: float = 1.0
    of: str = ""
    unit: str = "LU135"


_wrist = partial(nf.load_robot, "pacheco2021-a")
_links = partial(nf.load_robot, "gao2017")


def _thirty() -> nf.Robot:
    """Return a robot with thirty notches of two directions and four tendons to the tip."""
    short = nf.load_robot("two-axis-wrist")
    notches = tuple(short.notches[number % short.number_of_notches] for number in range(30))
    tendons = (nf.Tendon(t.radius, t.direction_deg, end_body=30, path=t.path) for t in short.tendon)
    return short.replace(notch=notches, tendon=tuple(tendons))


def _arcs(count: int) -> nf.Robot:
    notch = nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2, repeat=count)
    return _wrist().replace(notch=(notch,), tendon=(nf.Tendon(0.70),))


def _solve(robot: Callable[[], nf.Robot], **load: Any) -> Callable[[], Run]:
    def make() -> Run:
        made = robot()
        return lambda: nf.solve(made, nf.Load(**load)).total_angle

    return make


def _follow(robot: Callable[[], nf.Robot], highest: float, steps: int) -> Callable[[], Run]:
    """Time loading and unloading."""

    def make() -> Run:
        made, loads = robot(), nf.pull(0.0, highest, steps=steps).release()
        return lambda: nf.simulate(made, loads).total_angle

    return make


def _batch(robot: Callable[[], nf.Robot], highest: float, count: int, **tip: Any) -> Any:
    return lambda: partial(
        nf.solve_batch, robot(), nf.pull(0.0, highest, steps=count).loaded(**tip)
    )


def _derivative(kind: str) -> Callable[[], Run]:
    """Time a function of the robot with 27 links, or derivatives of it, under other tensions."""

    def make() -> Run:
        numbers = ["material.elastic_modulus", "friction.coefficient", "notch[1].strip_thickness"]
        bend = nf.differentiable(_links(), nf.pull(6.0, 6.0, steps=1), [*numbers, "tension"])

        def angle(values: dict[str, jax.Array]) -> jax.Array:
            return bend(values)["total_angle"][-1]

        def along(tangent: dict[str, jax.Array], values: dict[str, jax.Array]) -> jax.Array:
            return jax.jvp(angle, (values,), (tangent,))[1]

        start = bend.start
        pulled = jax.tree.map(np.zeros_like, start) | {"tension": np.ones((1, 1))}
        units = [jax.tree.map(np.zeros_like, start) | {name: np.ones(())} for name in numbers]
        three = jax.tree.map(lambda *rows: np.stack(rows), *units)
        functions: dict[str, Callable[..., Any]] = {
            "value": angle,
            "jvp": partial(along, pulled),
            "three": lambda values: jax.vmap(along, in_axes=(0, None))(three, values),
            "reverse": jax.grad(angle),
        }
        # The last result is kept, so no tension may follow itself.
        changing = cycle(start | {"tension": start["tension"] + more} for more in (0.0, 0.01))
        return _next(jax.jit(functions[kind]), changing)

    return make


def _by_dimensions(kind: str) -> Callable[[], Run]:
    """Time a function of 27 dimensions, or its value and gradient, at ever other dimensions."""

    def make() -> Run:
        names = [f"notch[{number}].strip_thickness" for number in range(1, 28)]
        bend = nf.differentiable(_links(), nf.pull(6.0, 6.0, steps=1), names)

        def angle(values: dict[str, jax.Array]) -> jax.Array:
            return bend(values)["total_angle"][-1]

        random = np.random.default_rng(0)

        def changing() -> Iterator[dict[str, Any]]:
            while True:
                yield {name: 0.7 + 1e-3 * random.uniform(-1.0, 1.0) for name in names}

        function = {"value": angle, "reverse": jax.value_and_grad(angle)}[kind]
        return _next(jax.jit(function), changing())

    return make


def _next(function: Callable[[Any], Any], arguments: Iterator[Any]) -> Run:
    return lambda: jax.block_until_ready(function(next(arguments)))


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


_FUNCTION = "links (Gao) as a JAX function"
_DIMENSIONS = "links (Gao) as a function of 27 dimensions, new ones"
_TIP = {"tip_force": (0.05 * 9.81, 0.0, 0.0)}  # 50 g, N
_FOUR: dict[str, Any] = {"tension": [0.1, 0.05, 0.0, 0.02], "tip_force": (0.002, 0.001, 0.0)}
# fmt: off
CASES: tuple[Case, ...] = (
    Case("wrist, one solve", 0.7, _solve(_wrist, tension=2.0)),
    Case("wrist, one solve by stroke", 1.5, _solve(_wrist, stroke=1.0), of="wrist, one solve"),
    Case("wrist, 31 steps up and 31 down, whole path", 2.0, _follow(_wrist, 3.0, 31)),
    Case("wrist, batch of 10,000, per solve", 0.004, _batch(_wrist, 2.5, 10_000), 1e4),
    Case("links (Gao), 6 N", 2.0, _solve(_links, tension=6.0)),
    Case("links (Gao), 6 N and 50 g", 2.5, _solve(_links, tension=6.0, **_TIP)),
    Case("links (Gao), 13 to 0 N after loading, per step", 1.5, _follow(_links, 13.0, 14), 28.0),
    Case("links (Gao), batch of 1,000, per solve", 0.45, _batch(_links, 8.0, 1000), 1e3),
    Case("links (Gao), batch of 1,000 with 50 g, per solve", 0.5,
         _batch(_links, 8.0, 1000, **_TIP), 1e3),
    Case("30 notches in space, 4 tendons, tip force", 5.0, _solve(_thirty, **_FOUR)),
    Case("100 arcs", None, _solve(partial(_arcs, 100), tension=0.02)),
    Case("300 arcs", 3.0**1.1, _solve(partial(_arcs, 300), tension=0.02), of="100 arcs"),
    Case(_FUNCTION, None, _derivative("value")),
    Case("its slope along one direction (jvp)", 1.6, _derivative("jvp"), of=_FUNCTION),
    Case("its slopes by three parameters", 2.5, _derivative("three"), of=_FUNCTION),
    Case("its gradient by all (reverse)", 3.0, _derivative("reverse"), of=_FUNCTION),
    Case(_DIMENSIONS, None, _by_dimensions("value")),
    Case("its value and gradient by all 27", 3.0, _by_dimensions("reverse"), of=_DIMENSIONS),
    Case("first call, wrist, nothing compiled", 1.5,
         partial(first_call, "pacheco2021-a"), unit="s"),
    Case("first call, links (Gao), nothing compiled", 5.0,
         partial(first_call, "gao2017"), unit="s"),
    Case("simulate pacheco2021-a, second time, whole process", 3.0,
         second_command, unit="s"),
    Case("memory, batch of 100,000 wrist paths", 2048.0, memory, unit="MiB"),
)
# fmt: on
