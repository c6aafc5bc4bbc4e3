"""What is timed inside one process: the loads and robots of the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import notchflex as nf
from notchflex._jax import jax

_HUNG = 0.05 * 9.81  # 50 g, N


@dataclass(frozen=True)
class Case:
    """One thing to time.

    Attributes:
        name: What it is; "per" says of what the time is.
        target: What is aimed at, multiples of LU135, or of the time of another case.
        make: Makes the function that is timed.
        per: How many solves or steps it does.
        of: Name of the case that the target is a multiple of; none for LU135.
    """

    name: str
    target: float | None
    make: Callable[[], Callable[[], object]]
    per: float = 1.0
    of: str = ""


def _wrist() -> nf.Robot:
    return nf.load_robot("pacheco2021-a")


def _links() -> nf.Robot:
    return nf.load_robot("gao2017")


def _solve(robot: Callable[[], nf.Robot], **load: Any) -> Callable[[], Callable[[], object]]:
    def make() -> Callable[[], object]:
        made = robot()
        return lambda: nf.solve(made, nf.Load(**load)).total_angle

    return make


def _follow(robot: Callable[[], nf.Robot], path: Callable[[], nf.LoadPath]) -> Any:
    def make() -> Callable[[], object]:
        made, loads = robot(), path()
        return lambda: nf.simulate(made, loads).total_angle

    return make


def _batch(robot: Callable[[], nf.Robot], highest: float, count: int, **tip: Any) -> Any:
    def make() -> Callable[[], object]:
        made, loads = robot(), nf.pull(0.0, highest, steps=count).loaded(**tip)
        return lambda: nf.solve_batch(made, loads)

    return make


def _thirty() -> nf.Robot:
    """Thirty notches of two directions, four tendons to the tip."""
    short = nf.load_robot("two-axis-wrist")
    notches = tuple(short.notches[number % short.number_of_notches] for number in range(30))
    tendons = (nf.Tendon(t.radius, t.direction_deg, end_body=30, path=t.path) for t in short.tendon)
    return short.replace(notch=notches, tendon=tuple(tendons))


def _arcs(count: int) -> Callable[[], nf.Robot]:
    def make() -> nf.Robot:
        notch = nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2, repeat=count)
        return _wrist().replace(notch=(notch,), tendon=(nf.Tendon(0.70),))

    return make


def _slopes(kind: str) -> Callable[[], Callable[[], object]]:
    """The function whose slopes are timed, or the slopes, on the robot with 27 links."""

    def make() -> Callable[[], object]:
        numbers = ["material.elastic_modulus", "friction.coefficient", "notch[1].strip_thickness"]
        bend = nf.differentiable(_links(), nf.pull(6.0, 6.0, steps=1), [*numbers, "tension"])

        def angle(values: dict[str, jax.Array]) -> jax.Array:
            return bend(values)["total_angle"][-1]

        start = bend.start
        pulled = jax.tree.map(np.zeros_like, start) | {"tension": np.ones((1, 1))}
        units = [jax.tree.map(np.zeros_like, start) | {name: np.ones(())} for name in numbers]
        three = jax.tree.map(lambda *rows: np.stack(rows), *units)

        def along(tangent: dict[str, jax.Array]) -> jax.Array:
            return jax.jvp(angle, (start,), (tangent,))[1]

        functions: dict[str, tuple[Callable[..., Any], Any]] = {
            "solve": (angle, start),
            "jvp": (along, pulled),
            "three": (jax.vmap(along), three),
            "reverse": (jax.grad(angle), start),
        }
        function, argument = functions[kind]
        compiled = jax.jit(function)
        return lambda: jax.block_until_ready(compiled(argument))

    return make


_FUNCTION = "links (Gao) as a JAX function"
_TIP = {"tip_force": (_HUNG, 0.0, 0.0)}
CASES = (
    Case("wrist, one solve", 0.7, _solve(_wrist, tension=2.0)),
    Case("wrist, one solve by stroke", 1.5, _solve(_wrist, stroke=1.0), of="wrist, one solve"),
    Case(
        "wrist, 31 steps up and 31 down, whole path",
        2.0,
        _follow(_wrist, lambda: nf.pull(0.0, 3.0, steps=31).release()),
    ),
    Case("wrist, batch of 10,000, per solve", 0.004, _batch(_wrist, 2.5, 10_000), 1e4),
    Case("links (Gao), 6 N", 2.0, _solve(_links, tension=6.0)),
    Case("links (Gao), 6 N and 50 g", 2.5, _solve(_links, tension=6.0, **_TIP)),
    Case(
        "links (Gao), 13 to 0 N after loading, per step",
        1.5,
        _follow(_links, lambda: nf.pull(0.0, 13.0, steps=14).release()),
        28.0,
    ),
    Case("links (Gao), batch of 1,000, per solve", 0.45, _batch(_links, 8.0, 1000), 1e3),
    Case(
        "links (Gao), batch of 1,000 with 50 g, per solve",
        0.5,
        _batch(_links, 8.0, 1000, **_TIP),
        1e3,
    ),
    Case(
        "30 notches in space, 4 tendons, tip force",
        5.0,
        _solve(_thirty, tension=[0.1, 0.05, 0.0, 0.02], tip_force=(0.002, 0.001, 0.0)),
    ),
    Case("100 arcs", None, _solve(_arcs(100), tension=0.02)),
    Case("300 arcs", 3.0**1.1, _solve(_arcs(300), tension=0.02), of="100 arcs"),
    Case("links (Gao) as a JAX function", None, _slopes("solve")),
    Case(
        "its slope along one direction (jvp)",
        1.6,
        _slopes("jvp"),
        of=_FUNCTION,
    ),
    Case("its slopes by three parameters", 2.5, _slopes("three"), of=_FUNCTION),
    Case("its gradient by all (reverse)", 3.0, _slopes("reverse"), of=_FUNCTION),
)
