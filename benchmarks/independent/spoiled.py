"""Spoil one quantity of a good result at a time: the checks must find every one."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from build import make_loads, make_robot
from generator import Case
from judge_draw import check_neighbours, check_state, with_neighbours

import notchflex as nf

CASE = Case(
    {
        "name": "to be spoiled",
        "tube": {"outer_diameter": 1.62, "inner_diameter": 1.4, "base_length": 1.0},
        "notch": [
            {"kind": "arc", "cut": "on-axis", "depth": 1.4, "height": 0.8, "uncut_length": 1.2}
            | {"direction_deg": 0.0, "repeat": 3}
        ],
        "tendon": [{"radius": 0.7, "direction_deg": 0.0, "path": "straight"}],
        "material": {"kind": "linear", "elastic_modulus": 9000.0},
        "friction": {"kind": "capstan", "coefficient": 0.2, "wrap": "geometric"},
    },
    [
        {"tension": [tension], "stroke": [None], "tip_force": np.array([0.02, 0.0, 0.01])}
        for tension in (0.0, 0.3, 2.6, 0.5)
    ],
    planar=True,
)


class Spoiled:
    """A path with some quantities replaced."""

    def __init__(self, path: Any, **other: np.ndarray) -> None:
        self._path, self._other = path, other

    def __getattr__(self, name: str) -> Any:
        return self._other[name] if name in self._other else getattr(self._path, name)

    def __len__(self) -> int:
        return len(self._path)

    def __getitem__(self, step: int) -> Any:
        return Spoiled(self._path[step], **{k: v[step] for k, v in self._other.items()})


def findings(path: Any, tables: list[dict[str, Any]]) -> set[str]:
    """Return the names of all that is found."""
    found = [f for step in range(len(path)) for f in check_state(CASE.robot, path, tables, step)]
    check_neighbours(CASE, tables, path, found)
    return {what for what, *_ in found}


def main() -> None:
    """Spoil and tell."""
    tables = with_neighbours(CASE, np.random.default_rng(0))
    path = nf.simulate(make_robot(CASE.robot), make_loads(tables)).raise_if_failed()
    missed = [f"found in a good result: {name}" for name in findings(path, tables)]
    names = "tension stroke notch_angle tip_position tip_rotation body_position body_rotation "
    names += "span_tension contact_log_ratio contact_slid contact_bound contact_turning base_force "
    names += "base_moment stored_energy"
    for name in names.split():
        good = np.array(getattr(path, name), dtype=float)
        more = 0.01 if name == "stored_energy" else 0.002
        found = findings(Spoiled(path, **{name: good * (1 + more)}), tables)
        print(f"{name} {more:.1%} too large: {', '.join(sorted(found)) or 'NOT FOUND'}")
        missed += [] if found else [name]
        found = findings(Spoiled(path, **{name: good * np.nan}), tables)
        missed += [] if found else [f"{name} NaN"]
    for name, value in (("gap", -0.01), ("contact_force", -0.1), ("contact_force", 0.1)):
        wrong = np.array(getattr(path, name)) * 0 + value
        found = findings(Spoiled(path, **{name: wrong}), tables)
        print(f"{name} {value}: {', '.join(sorted(found)) or 'NOT FOUND'}")
        missed += [] if found else [name]
    softer = {**CASE.robot, "material": {"kind": "linear", "elastic_modulus": 9009.0}}
    other = nf.simulate(make_robot(softer), make_loads(tables))
    found = findings(other, tables)
    print(f"modulus 0.1 % larger: {', '.join(sorted(found)) or 'NOT FOUND'}")
    missed += [] if found else ["modulus"]
    print("missed:", missed or "none")
    sys.exit(bool(missed))


if __name__ == "__main__":
    main()
