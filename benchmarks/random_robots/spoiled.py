"""Spoil one quantity of a good result at a time: the checks must find every one.

python benchmarks/robustness.py spoiled
"""

from __future__ import annotations

from typing import Any

import numpy as np

import notchflex as nf

from .draws import Draw, with_neighbours
from .judge import wrong

ROBOT = nf.Robot(
    name="to be spoiled",
    tube=nf.Tube(1.62, 1.4, base_length=1.0),
    notch=(nf.ArcNotch("on-axis", depth=1.4, height=0.8, uncut_length=1.2, repeat=3),),
    tendon=(nf.Tendon(0.7, path="straight"),),
    material=nf.Linear(9000.0),
    friction=nf.Capstan(0.2, wrap="geometric"),
)
LOADS = tuple(
    nf.Load(tension=tension, tip_force=(0.02, 0.0, 0.01)) for tension in (0.0, 0.3, 2.6, 0.5)
)
SCALED = [
    "tension",
    "stroke",
    "notch_angle",
    "tip_position",
    "tip_rotation",
    "body_position",
    "body_rotation",
    "span_tension",
    "contact_log_ratio",
    "contact_slid",
    "contact_bound",
    "contact_turning",
    "base_force",
    "base_moment",
    "stored_energy",
]


class Spoiled:
    """A path, or a state of it, with some quantities replaced."""

    def __init__(self, path: Any, **other: np.ndarray) -> None:
        self._path, self._other = path, other

    def __getattr__(self, name: str) -> Any:
        return self._other[name] if name in self._other else getattr(self._path, name)

    def __getitem__(self, step: int) -> Any:
        return Spoiled(self._path[step], **{k: v[step] for k, v in self._other.items()})


def solved(robot: nf.Robot, loads: list[nf.Load]) -> list[nf.EquilibriumPath]:
    """Solve loads one after the other."""
    paths: list[nf.EquilibriumPath] = []
    for load in loads:
        state = paths[-1].state if paths else None
        paths.append(nf.simulate(robot, load, from_state=state).raise_if_failed())
    return paths


def findings(paths: list[Any], loads: list[nf.Load]) -> list[str]:
    """Tell what is found in the states of a path, of which the last ones are near one another."""
    found: list[str] = []
    for step, (load, path) in enumerate(zip(loads, paths, strict=True)):
        before = (loads[step - 1], paths[step - 1]) if step > len(LOADS) else None
        found += wrong(ROBOT, load, path, before)
    return found


def failed(seed: int, count: int) -> bool:
    """Spoil, tell, and return whether anything is missed; it needs no seed and no count."""
    loads = with_neighbours(Draw(0, 0, "", ROBOT, LOADS))
    paths = solved(ROBOT, loads)
    missed = findings(paths, loads)
    trials: list[tuple[str, str, Any]] = []
    for name in SCALED:
        more = 0.01 if name == "stored_energy" else 0.002
        trials.append((name, f"{more:.1%} too large", lambda good, more=more: good * (1.0 + more)))
        trials.append((name, "NaN", lambda good: good * np.nan))
    for name, value in (("gap", -0.01), ("contact_force", -0.1), ("contact_force", 0.1)):
        trials.append((name, f"is {value}", lambda good, value=value: good * 0.0 + value))
    for name, how, spoil in trials:
        spoiled = [
            Spoiled(path, **{name: spoil(np.array(getattr(path, name), dtype=float))})
            for path in paths
        ]
        found = findings(spoiled, loads)
        print(f"{name} {how}: {len(found)} found, {found[0] if found else 'NOT FOUND'}")
        missed += [] if found else [f"{name} {how}"]
    stiffer = ROBOT.replace(material=nf.Linear(9009.0))
    found = findings(solved(stiffer, loads), loads)
    print(f"modulus 0.1 % larger: {len(found)} found, {found[0] if found else 'NOT FOUND'}")
    missed += [] if found else ["modulus"]
    print("missed:", missed or "none")
    return bool(missed)
