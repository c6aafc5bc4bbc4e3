"""Calls of typical robots and loads: a wheel carries the programs that they need.

Usage: NOTCHFLEX_RECORD_PROGRAMS=FOLDER python packaging/typical_calls.py [PART/PARTS]
"""

import sys
from collections.abc import Callable

import notchflex as nf
from notchflex._jax import jax

WRIST, LINKS, STRIPS = map(nf.load_robot, ("pacheco2021-a", "gao2017", "liu2022"))
SIDEWAYS = {"tip_force": (0.0, 0.1, 0.0)}


def everything(robot: nf.Robot, **load: object) -> None:
    """A state and all that is reported of it."""
    state = nf.solve(robot, nf.Load(**load))  # pyright: ignore[reportArgumentType]
    state.to_dict()


def gradient() -> None:
    """Derivatives of an angle by a dimension and the tension."""
    bend = nf.differentiable(WRIST, nf.pull(1.0, 1.0, steps=1), ["notch.depth", "tension"])
    jax.grad(lambda numbers: bend(numbers)["total_angle"][-1])(bend.start)


def many_robots() -> None:
    """Robots that differ by a dimension."""
    nf.batch(WRIST, {"notch.depth": [1.4] * 256}, nf.Load(tension=1.0))


# In an order in which the two parts, every other call each, take about as long as each other.
CALLS: list[Callable[[], object]] = [
    lambda: nf.tip_response(WRIST, [nf.Load(tension=1.0)]),
    lambda: everything(WRIST, tension=2.0, **SIDEWAYS),
    gradient,
    lambda: everything(LINKS, tension=6.0, tip_mass=50.0),
    lambda: everything(LINKS, tension=6.0),
    lambda: everything(LINKS, stroke=1.0),
    lambda: everything(STRIPS, tension=1.0),
    lambda: nf.solve_batch(LINKS, nf.pull(0.0, 6.0, steps=3)),
    lambda: everything(WRIST, tension=2.0, tip_mass=1.0),
    lambda: nf.solve_batch(WRIST, nf.pull(0.0, 2.0, steps=3)),
    lambda: everything(WRIST, tension=2.0),
    lambda: everything(WRIST, stroke=1.0),
    lambda: nf.closing(WRIST),
    many_robots,
]


def main() -> None:
    """Make the calls of one part of the list."""
    part, parts = map(int, (sys.argv[1] if len(sys.argv) > 1 else "1/1").split("/"))
    for call in CALLS[part - 1 :: parts]:
        call()


if __name__ == "__main__":
    main()
