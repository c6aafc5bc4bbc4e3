"""Run an exported model in MuJoCo and compare it with the chain."""

from __future__ import annotations

import importlib.util
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.export.joints import STEPS, JointModel, turned

_FIRST_WITH_YIELD = 4
_LEVELS = 24  # up, and as many down
_RAMP = 200  # time steps from level to level: faster, and inertia carries hinges too far
_HOLD, _MAX_HOLDS = 100, 60  # time steps between looks whether all stands still, and how many
_STILL = 1e-4  # of the largest angle of a hinge so far, in 1 s
_NO_LOOP = 1e-9  # of tension times angle; a loop with less area is none


def has_mujoco() -> bool:
    """Tell whether MuJoCo is installed, in a version whose springs yield."""
    if importlib.util.find_spec("mujoco") is None:
        return False
    return int(import_module("mujoco").__version__.split(".")[0]) >= _FIRST_WITH_YIELD


def run_mujoco(
    text: str, tendon: int, tension: NDArray[np.float64], notches: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pull one tendon of an MJCF model through levels of tension, each until it stands still.

    Args:
        text: The MJCF file.
        tendon: Which tendon, from 0.
        tension: The levels, N, (s,).
        notches: Number of notches, n.

    Returns:
        Angles of the hinges, rad, (s, n), and positions of the tip, mm, (s, 3).
    """
    mujoco: Any = import_module("mujoco")  # it has no types
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    # One joint coordinate and one velocity a hinge.
    joints = [int(model.joint(f"notch_{j + 1}").qposadr[0]) for j in range(notches)]
    angle, tip, before, largest = [], [], 0.0, 0.0
    for level in tension:
        for control in np.linspace(before, level, _RAMP):
            data.ctrl[tendon] = control
            mujoco.mj_step(model, data)
        for _ in range(_MAX_HOLDS):
            mujoco.mj_step(model, data, _HOLD)
            largest = max(largest, float(np.abs(data.qpos[joints]).max()))
            if np.abs(data.qvel[joints]).max() <= _STILL * largest:
                break
        before = level
        angle.append(data.qpos[joints].copy())
        tip.append(1e3 * data.site("tip").xpos)
    return np.array(angle), np.array(tip)


def measure_errors(model: JointModel, text: str) -> list[dict[str, Any]]:
    """Run an exported file over loading and unloading of each tendon, against the chain.

    Returns:
        Of each tendon its number, from 1, and the end of its range; the largest error of the total
        angle (a notch that turns to the other side adds to it too) as a part of its range, of any
        notch as a part of the largest range of a notch, and of the tip as a part of its way; and
        that of the area between loading and unloading, total angle over tension, as a part of the
        area, None where there is none.
    """
    errors: list[dict[str, Any]] = []
    levels = np.unique(np.linspace(0, STEPS - 1, _LEVELS).round().astype(int))
    rows = np.concatenate([levels, 2 * STEPS - 1 - levels[::-1]])
    for tendon, path in enumerate(model.pulls):
        chain, tips, tension = turned(path), path.tip_position, path.commanded_tension[rows, tendon]
        angle, tip = run_mujoco(text, tendon, tension, len(model.springs))
        # Notches that open to opposite sides turn to both: each counts the way that it turns.
        way = np.sign(chain[STEPS])
        total, known = angle @ way, chain[rows] @ way
        area, known_area = np.abs(np.trapezoid([total, known], tension)).tolist()  # N rad
        has_loop = known_area > _NO_LOOP * model.top * np.ptp(known)
        away, ways = (np.linalg.norm(x, axis=1).max() for x in (tip - tips[rows], tips - tips[0]))
        off = np.abs(angle - chain[rows]).max() / np.ptp(chain, axis=0).max()
        errors.append(
            {
                "tendon": tendon + 1,
                "largest_tension_N": model.top,
                "total_angle": float(np.abs(total - known).max() / np.ptp(known)),
                "notch_angle": float(off),
                "tip_position": float(away / ways),
                "loop_area": abs(area / known_area - 1.0) if has_loop else None,
            }
        )
    return errors
