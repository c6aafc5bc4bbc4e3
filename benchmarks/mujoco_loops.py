"""MJCF files that `notchflex export` writes, run by MuJoCo, against the chain.

    python benchmarks/mujoco_loops.py

Prints, for the first tendon, the errors that each file states, and the error of the total angle
over loops inside the range, which nothing was fitted to; then those of wrist A with a force on its
tip.
"""

from __future__ import annotations

from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
from harness import options, show, timed

import notchflex as nf
from notchflex.export.joints import JointModel, joint_model, turned
from notchflex.export.simulators import measure_errors, mjcf, run_mujoco

LARGEST = {
    "pacheco2021-a": None,
    "pacheco2021-b": None,
    "pacheco2021-c": None,
    "pacheco2021-a-specimen": None,
    "gao2017": 13.0,
    "york2015": None,
    "liu2022": 9.0,
    "two-axis-wrist": 3.0,
}
"""Largest tension, N; None leaves it to the export."""


def inner_error(model: JointModel, text: str) -> float:
    """Error of the total angle over two reversals within the range, as a part of its range."""
    ends = model.top * np.array([0.0, 0.7, 0.3, 0.9, 0.2, 0.6])
    levels = np.concatenate([np.linspace(a, b, 9) for a, b in pairwise(ends)])
    path = nf.simulate(model.robot, [nf.Load(tension=float(level)) for level in levels])
    angle = (path.notch_angle - path.notch_angle[0]).sum(axis=1)
    ran = run_mujoco(text, 0, levels, len(model.springs))[0].sum(axis=1)
    return float(np.abs(ran - angle).max() / np.ptp(turned(model.pulls[0]).sum(axis=1)))


def loop_errors(name: str) -> dict[str, object]:
    """Fit, run and compare a robot."""
    with timed() as fitting:
        model = joint_model(nf.load_robot(name), LARGEST[name])
        text = mjcf(model)
    with timed() as running:
        errors = list(measure_errors(model, text)[0].values())[2:]
    heads = ("total", "notch", "tip", "loop area", "inner loops")
    percent = (f"{error:.2%}" for error in (*errors, inner_error(model, text)))
    return {
        "robot": name,
        "largest, N": f"{model.top:.3g}",
        **dict(zip(heads, percent, strict=True)),
        "fit, s": fitting["wall"],
        "run, s": running["wall"],
    }


def with_tip_force(force: float) -> dict[str, object]:
    """Pull wrist A with a constant force (N) on its tip, along x; compare total angle and area."""
    mujoco: Any = import_module("mujoco")
    robot = nf.load_robot("pacheco2021-a")
    model = mujoco.MjModel.from_xml_string(mjcf(joint_model(robot, 2.35)))
    data = mujoco.MjData(model)
    body, site = model.body("body_5").id, model.site("tip").id
    levels = np.concatenate([np.linspace(0.0, 1.6, 17), np.linspace(1.6, 0.0, 17)])
    angle, before, across = [], 0.0, np.array([force, 0.0, 0.0])
    for level in levels.tolist():
        for control in [*np.linspace(before, level, 200), *[level] * 2000]:
            data.ctrl[0] = control
            data.qfrc_applied[:] = 0.0
            tip = data.site_xpos[site]
            mujoco.mj_applyFT(model, data, across, np.zeros(3), tip, body, data.qfrc_applied)
            mujoco.mj_step(model, data)
        before = level
        angle.append(data.qpos[:5].sum())
    loads = [nf.Load(tension=level, tip_force=tuple(across)) for level in levels.tolist()]
    chain = nf.simulate(robot, loads).total_angle
    area = np.trapezoid(angle, levels) / np.trapezoid(chain, levels)
    return {
        "force on the tip of wrist A, N": force,
        "alone, deg": float(np.degrees(chain[0])),
        "total": f"{np.abs(np.array(angle) - chain).max() / np.ptp(chain):.1%}",
        "loop area": f"{area - 1.0:+.1%}",
    }


if __name__ == "__main__":
    show(loop_errors(name) for name in options(__doc__, LARGEST).cases)
    show(map(with_tip_force, (0.0, 0.02, 0.05, -0.05)))
