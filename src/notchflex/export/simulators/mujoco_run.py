"""Run an exported model in MuJoCo and compare it with the chain."""

from __future__ import annotations

import importlib.util
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.export.simulators.joint_model import JointModel

_FIRST_WITH_YIELD = 4
_LEVELS = 24  # up, and as many down
_RAMP = 200  # time steps from level to level: faster, and inertia carries hinges too far
_HOLD, _MAX_HOLDS = 100, 60  # time steps between looks whether all stands still, and how many
_STILL = 1e-4  # of the largest angle of a hinge so far, in 1 s


def has_mujoco() -> bool:
    """Tell whether MuJoCo is installed, in a version whose springs yield."""
    if importlib.util.find_spec("mujoco") is None:
        return False
    return int(import_module("mujoco").__version__.split(".")[0]) >= _FIRST_WITH_YIELD


@dataclass(frozen=True)
class SimulatorError:
    """Error of the exported model over loading and unloading of one tendon.

    Attributes:
        tendon: The tendon, counted from 1.
        largest_tension: End of the range, N.
        total_angle: Largest error of the total angle, as a part of its range; a notch that turns
            to the other side adds to it too.
        notch_angle: Largest error of any notch, as a part of the largest range of a notch.
        tip_position: Largest distance between the tips, as a part of the way of the tip.
        loop_area: Error of the area between loading and unloading, total angle over tension, as a
            part of the area; NaN where there is none.
    """

    tendon: int
    largest_tension: float
    total_angle: float
    notch_angle: float
    tip_position: float
    loop_area: float

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers by name, with units, None for NaN."""
        names = {"largest_tension": "largest_tension_N"}
        pairs = asdict(self).items()
        return {names.get(name, name): None if one != one else one for name, one in pairs}


def run_mujoco(
    text: str, tendon: int, tension: Float[np.ndarray, " s"], notches: int
) -> tuple[Float[np.ndarray, "s n"], Float[np.ndarray, "s 3"]]:
    """Pull one tendon of an MJCF model through levels of tension, each until it stands still.

    Args:
        text: The MJCF file.
        tendon: Which tendon, from 0.
        tension: The levels, N.
        notches: Number of notches.

    Returns:
        Angles of the hinges, rad, and positions of the tip, mm.
    """
    mujoco: Any = import_module("mujoco")  # it has no types
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    # One joint coordinate and one velocity a hinge.
    at = [int(model.joint(f"notch_{j + 1}").qposadr[0]) for j in range(notches)]
    site = model.site("tip").id
    angle, tip, before, largest = [], [], 0.0, 0.0
    for level in tension:
        for control in np.linspace(before, level, _RAMP):
            data.ctrl[tendon] = control
            mujoco.mj_step(model, data)
        for _ in range(_MAX_HOLDS):
            mujoco.mj_step(model, data, _HOLD)
            largest = max(largest, float(np.abs(data.qpos[at]).max()))
            if np.abs(data.qvel[at]).max() <= _STILL * largest:
                break
        before = level
        angle.append(data.qpos[at].copy())
        tip.append(1e3 * data.site_xpos[site])
    return np.array(angle), np.array(tip)


def measure_errors(model: JointModel, text: str) -> list[SimulatorError]:
    """Run an exported file and return its errors against the chain, one entry per tendon."""
    errors: list[SimulatorError] = []
    for one in model.pulls:
        levels = np.unique(np.linspace(0, len(one.tension) // 2 - 1, _LEVELS).round().astype(int))
        rows = np.concatenate([levels, len(one.tension) - 1 - levels[::-1]])
        tension, known = one.tension[rows], one.angle[rows]
        angle, tip = run_mujoco(text, one.tendon, tension, len(model.springs))
        # Notches that open to opposite sides turn to both: each counts the way that it turns.
        way = np.sign(one.angle[len(one.angle) // 2])
        off = np.abs(angle - known).max() / np.ptp(one.angle, axis=0).max()
        total, own = known @ way, angle @ way
        area, own_area = np.abs(np.trapezoid([total, own], tension)).tolist()  # of the loops, N rad
        has_loop = area > 1e-9 * model.top * np.ptp(total)
        away = np.linalg.norm(tip - one.tip[rows], axis=1).max()
        error = SimulatorError(
            tendon=one.tendon + 1,
            largest_tension=model.top,
            total_angle=float(np.abs(own - total).max() / np.ptp(total)),
            notch_angle=float(off),
            tip_position=float(away / np.linalg.norm(one.tip - one.tip[0], axis=1).max()),
            loop_area=abs(own_area / area - 1.0) if has_loop else float("nan"),
        )
        errors.append(error)
    return errors
