"""MJCF files that `notchflex export` writes, run by MuJoCo, against the chain.

    python mujoco_loops.py

Prints, for the first tendon, the errors that each file states, and the error of the total angle
over loops inside the range, which nothing was fitted to; then those of wrist A with a force on its
tip.
"""

from __future__ import annotations

import time
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np

import notchflex as nf
from notchflex.export.joints import JointModel, joint_model, turned
from notchflex.export.simulators import measure_errors, mjcf, run_mujoco

ROBOTS = {
    "pacheco2021-a": None,
    "pacheco2021-b": None,
    "pacheco2021-c": None,
    "pacheco2021-a-specimen": None,
    "gao2017": 13.0,
    "york2015": None,
    "liu2022": 9.0,
    "two-axis-wrist": 3.0,
}


def inner_error(model: JointModel, text: str) -> float:
    """Error of the total angle over two reversals within the range, as a part of its range."""
    ends = model.top * np.array([0.0, 0.7, 0.3, 0.9, 0.2, 0.6])
    levels = np.concatenate([np.linspace(a, b, 9) for a, b in pairwise(ends)])
    path = nf.simulate(model.robot, [nf.Load(tension=float(level)) for level in levels])
    known = (path.notch_angle - path.notch_angle[0]).sum(axis=1)
    found = run_mujoco(text, 0, levels, len(model.springs))[0].sum(axis=1)
    return float(np.abs(found - known).max() / np.ptp(turned(model.pulls[0]).sum(axis=1)))


def with_tip_force(force: float) -> str:
    """Pull wrist A with a constant force (N) on its tip, along x; compare total angle and area."""
    mujoco: Any = import_module("mujoco")
    robot = nf.load_robot("pacheco2021-a")
    model = mujoco.MjModel.from_xml_string(mjcf(joint_model(robot, 2.35)))
    data = mujoco.MjData(model)
    body, site = model.body("body_5").id, model.site("tip").id
    levels = np.concatenate([np.linspace(0.0, 1.6, 17), np.linspace(1.6, 0.0, 17)])
    angle, before = [], 0.0
    for level in levels.tolist():
        for control in [*np.linspace(before, level, 200), *[level] * 2000]:
            data.ctrl[0] = control
            data.qfrc_applied[:] = 0.0
            at, along = data.site_xpos[site], np.array([force, 0.0, 0.0])
            mujoco.mj_applyFT(model, data, along, np.zeros(3), at, body, data.qfrc_applied)
            mujoco.mj_step(model, data)
        before = level
        angle.append(data.qpos[:5].sum())
    loads = [nf.Load(tension=level, tip_force=(force, 0.0, 0.0)) for level in levels.tolist()]
    known = nf.simulate(robot, loads).total_angle
    error = np.abs(np.array(angle) - known).max() / np.ptp(known)
    area = np.trapezoid(angle, levels) / np.trapezoid(known, levels)
    alone = np.degrees(known[0])
    return f"{force} N ({alone:.1f} deg alone): total {error:.1%}, loop area {area - 1.0:+.1%}"


def main() -> None:
    """Print the table."""
    print("robot, largest tension N, total, notch, tip, loop area, inner loops, fit s, run s")
    for name, top in ROBOTS.items():
        start = time.perf_counter()
        model = joint_model(nf.load_robot(name), top)
        text = mjcf(model)
        fitted = time.perf_counter()
        error = measure_errors(model, text)[0]
        run = time.perf_counter()
        numbers = list(error.values())[2:]
        print(
            f"{name}, {model.top:.3g},",
            ", ".join(f"{one:.2%}" for one in (*numbers, inner_error(model, text))),
            f", {fitted - start:.1f}, {run - fitted:.1f}",
            flush=True,
        )
    for force in (0.0, 0.02, 0.05, -0.05):
        print(f"wrist A, tip force {with_tip_force(force)}", flush=True)


if __name__ == "__main__":
    main()
