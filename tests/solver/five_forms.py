"""Robots of five forms, and what a process finds for them in some order.

Run as a program, `python five_forms.py FORMS COUNT SEED`, it solves COUNT robots of some forms
("13") in the order of a seed, and prints a digest of the results of each.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

import notchflex as nf

Random = np.random.Generator


def arcs(count: int, cut: str, turned: tuple[float, ...] = (0.0,)) -> Callable[..., nf.Robot]:
    """Return a maker of wrists: some tendons end early, some have no friction, some notches turn.

    Few of each, because every one is another program, which takes seconds to compile.
    """

    def make(random: Random) -> nf.Robot:
        depth, turn = random.uniform(1.30, 1.42, count), random.choice(turned)
        return nf.load_robot("pacheco2021-a").replace(
            notch=tuple(
                nf.ArcNotch(cut, d, 0.8, uncut_length=0.6, direction_deg=direction)
                for d, direction in zip(depth, [*[0.0] * (count - 1), turn], strict=True)
            ),
            tendon=(nf.Tendon(0.7, 0.0, end_body=int(random.choice([2, count]))),),
            friction=nf.Capstan(random.choice([0.0, 0.1, 0.2])),
        )

    return make


def u_links(random: Random) -> nf.Robot:
    """Return a chain of three U-links without friction."""
    link = nf.load_robot("gao2017").notch[0]
    turned = float(random.choice([0.0, 36.0]))
    sides = [("away", "toward", "away"), ("toward", "away", "toward")][random.integers(2)]
    links = tuple(
        replace(
            link, repeat=1, strip_length=random.uniform(1.8, 2.2), direction_deg=turned,
            proximal_slot=slot,
        )
        for slot in sides
    )  # fmt: skip
    tendon = (nf.Tendon(2.4, turned, path="straight"),)
    return nf.load_robot("gao2017").replace(notch=links, tendon=tendon, friction=nf.Frictionless())


def ready(name: str) -> Callable[..., nf.Robot]:
    """Return a maker of a ready robot with another modulus."""

    def make(random: Random) -> nf.Robot:
        robot = nf.load_robot(name)
        modulus = random.uniform(0.9, 1.1) * robot.material.elastic_modulus
        return robot.with_value("material.elastic_modulus", modulus)

    return make


FORMS = (
    arcs(5, "on-axis"), arcs(4, "off-axis", (0.0, 30.0)), ready("two-axis-wrist"), u_links,
    ready("liu2022"),
)  # fmt: skip


def digest(number: int) -> str:
    """Return a digest of what a path and a batch answer for robot `number`."""
    random = np.random.default_rng(number)
    robot = FORMS[number % len(FORMS)](random)
    sideways = {"tip_force": (0.01, 0.002, -0.01)} if number % 4 == 1 else {}
    loads = [nf.Load(tension=float(t), **sideways) for t in random.uniform(0.0, 1.0, 3)]
    path, row = nf.simulate(robot, loads), nf.solve_batch(robot, loads)
    results = [path.tip_position, path.total_angle, path.span_tension, path.converged]
    results += [row[name] for name in sorted(row)]
    return hashlib.sha256(b"".join(np.asarray(r).tobytes() for r in results)).hexdigest()[:16]


def main(forms: str, count: int, seed: int) -> None:
    """Print the digest of every robot, solved in the order of a seed."""
    numbers = [n for n in range(len(FORMS) * count) if str(n % len(FORMS)) in forms][:count]
    digests = {n: digest(n) for n in np.random.default_rng(seed).permutation(numbers).tolist()}
    print("\n".join(f"{n} {digests[n]}" for n in numbers))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
