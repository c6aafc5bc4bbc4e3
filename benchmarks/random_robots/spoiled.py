"""Spoil one quantity of a good result, or one number of a robot, at a time: all must be found.

python benchmarks/robustness.py spoiled
"""

from __future__ import annotations

from typing import Any

import numpy as np

import notchflex as nf
from notchflex.robot import Fatigue

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
OTHERS: dict[str, object] = {"material.elastic_modulus": 9009.0}
# Disks, a table and arc notches of a material of their own; a tendon behind a sheath.
MIXED = nf.Robot(
    name="of many parts",
    tube=nf.Tube(1.62, 1.4, base_length=1.0),
    notch=(
        nf.RodGap(2.0, 0.4, uncut_length=0.5, disk_mass=0.3, repeat=2),
        nf.TableNotch(
            1.0,
            angle_deg=(6.0, 20.0),
            moment=(0.5, 1.0),
            stiffness=(20.0, 5.0, 9.0, 40.0, 40.0, 90.0),
            axis_offset=0.2,
            closing_angle_deg=18.0,
            uncut_length=0.8,
        ),
        nf.ArcNotch(
            "on-axis",
            depth=1.4,
            height=0.8,
            uncut_length=1.2,
            repeat=2,
            tube=nf.Tube(1.7, 1.45),
            material=nf.Nitinol(
                9000.0,
                60.0,
                900.0,
                unloading_stress=30.0,
                temperature=30.0,
                reference_temperature=22.0,
                plateau_slope=0.5,
                density=6450.0,
            ),
        ),
    ),
    tendon=(
        nf.Tendon(
            0.7,
            path="straight",
            sheath_length=300.0,
            sheath_friction=0.1,
            sheath_bend_deg=120.0,
            sheath_wire_stiffness=900.0,
            backlash=0.03,
        ),
        nf.Tendon(0.6, 180.0, 2, 500.0, path="straight", disk_radius=(0.5, 0.4)),
    ),
    material=nf.Linear(6000.0, density=6450.0),
    friction=nf.Capstan(0.1, wrap="geometric"),
    fatigue=Fatigue(line="cao2020", corner_radius=0.05),
)
MIXED_LOADS = tuple(
    nf.Load(tension=(tension, 0.3), gravity=(3.0, 0.0, -9.0), tip_force=(0.02, 0.0, 0.01))
    for tension in (0.0, 0.5, 1.5, 0.1)
)
MIXED_OTHERS: dict[str, object] = {
    "material.elastic_modulus": 6006.0,
    "notch[1].diameter": 0.4004,
    "notch[2].length": 2.001,
    "notch[2].disk_mass": 0.31,
    "notch[3].axis_offset": 0.201,
    "notch[3].moment": (0.5, 1.001),
    "notch[3].closing_angle_deg": 18.02,
    "notch[4].material.plateau_stress": 60.1,
    "notch[4].material.unloading_stress": 30.5,
    "notch[4].material.plateau_slope": 0.51,
    "notch[4].material.temperature": 30.2,
    "notch[4].tube.outer_diameter": 1.701,
    "tendon[1].sheath_friction": 0.1001,
    "tendon[1].sheath_bend_deg": 120.1,
    "tendon[1].sheath_wire_stiffness": 901.0,
    "tendon[1].backlash": 0.0301,
    "tendon[2].disk_radius": (0.501, 0.4),
    "tendon[2].axial_stiffness": 501.0,
    "fatigue.corner_radius": 0.0501,
    "fatigue.line": "pelton2003",
}
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
OF_PARTS = ["base_tension", "base_stroke", "stroke", "fatigue_margin"]


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


def findings(robot: nf.Robot, paths: list[Any], loads: list[nf.Load], first: int) -> list[str]:
    """Tell what is found in the states of a path, of which those from `first` on are neighbours."""
    found: list[str] = []
    for step, (load, path) in enumerate(zip(loads, paths, strict=True)):
        before = (loads[step - 1], paths[step - 1]) if step > first else None
        found += wrong(robot, load, path, before)
    return found


def missed(
    robot: nf.Robot, loads: tuple[nf.Load, ...], names: list[str], others: dict[str, object]
) -> list[str]:
    """Spoil quantities of a robot's states, and solve robots with other numbers; tell the missed.

    Args:
        robot: The robot.
        loads: Its loads.
        names: Quantities of its states, which are made larger and NaN.
        others: Numbers of robots whose states are taken for those of this one.
    """
    every, first = with_neighbours(Draw(0, 0, "", robot, loads)), len(loads)
    paths = solved(robot, every)
    missing = findings(robot, paths, every, first)
    trials: list[tuple[str, str, Any]] = []
    for name in names:
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
        found = findings(robot, spoiled, every, first)
        print(f"{name} {how}: {len(found)} found, {found[0] if found else 'NOT FOUND'}")
        missing += [] if found else [f"{name} {how}"]
    for name, value in others.items():
        found = findings(robot, solved(robot.with_value(name, value), every), every, first)
        print(f"{name} {value}: {len(found)} found, {found[0] if found else 'NOT FOUND'}")
        missing += [] if found else [name]
    return missing


def failed(seed: int, count: int) -> bool:
    """Spoil, tell, and return whether anything is missed; it needs no seed and no count."""
    missing = missed(ROBOT, LOADS, SCALED, OTHERS)
    missing += missed(MIXED, MIXED_LOADS, OF_PARTS, MIXED_OTHERS)
    print("missed:", missing or "none")
    return bool(missing)
