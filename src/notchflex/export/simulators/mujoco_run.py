"""Run an exported model in MuJoCo and compare it with the chain."""

from __future__ import annotations

import importlib.util
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.export.simulators.joint_model import JointModel
from notchflex.export.simulators.samples import PullSamples

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
        total_angle: Largest error of the total angle, as a part of its range.
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
        named = {
            "largest_tension_N" if k == "largest_tension" else k: v for k, v in asdict(self).items()
        }
        return {name: None if value != value else value for name, value in named.items()}


@dataclass(frozen=True)
class SimulatedPull:
    """Simulated loading and unloading of one tendon: s levels.

    Attributes:
        tension: Tension, N.
        angle: Angles of the hinges, rad.
        tip: Tip position, mm.
    """

    tension: Float[np.ndarray, " s"]
    angle: Float[np.ndarray, "s n"]
    tip: Float[np.ndarray, "s 3"]


def run_mujoco(
    text: str, tendon: int, tension: Float[np.ndarray, " s"], notches: int
) -> SimulatedPull:
    """Pull one tendon of an MJCF model through levels of tension, each until it stands still.

    Args:
        text: The MJCF file.
        tendon: Which tendon, from 0.
        tension: The levels, N.
        notches: Number of notches.
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
    return SimulatedPull(np.asarray(tension), np.array(angle), np.array(tip))


def measure_errors(model: JointModel, text: str) -> list[SimulatorError]:
    """Run an exported file and return its errors against the chain, one entry per tendon."""
    errors: list[SimulatorError] = []
    for one in model.pulls:
        levels = np.unique(np.linspace(0, len(one.tension) // 2 - 1, _LEVELS).round().astype(int))
        rows = np.concatenate([levels, len(one.tension) - 1 - levels[::-1]])
        pull = run_mujoco(text, one.tendon, one.tension[rows], len(model.springs))
        errors.append(_compare(model, one, rows, pull))
    return errors


def _compare(
    model: JointModel, one: PullSamples, rows: np.ndarray, pull: SimulatedPull
) -> SimulatorError:
    total, own = one.angle[rows].sum(axis=1), pull.angle.sum(axis=1)
    moved = np.linalg.norm(one.tip - one.tip[0], axis=1).max()
    area, own_area = loop_area(pull.tension, total), loop_area(pull.tension, own)
    least = 1e-9 * model.top * np.ptp(total)
    return SimulatorError(
        tendon=one.tendon + 1,
        largest_tension=model.top,
        total_angle=float(np.abs(own - total).max() / np.ptp(total)),
        notch_angle=float(
            np.abs(pull.angle - one.angle[rows]).max() / np.ptp(one.angle, axis=0).max()
        ),
        tip_position=float(np.linalg.norm(pull.tip - one.tip[rows], axis=1).max() / moved),
        loop_area=float(abs(own_area / area - 1.0)) if abs(area) > least else float("nan"),
    )


def loop_area(tension: Float[np.ndarray, " s"], angle: Float[np.ndarray, " s"]) -> float:
    """Return the area between the two branches of a loop, N rad."""
    return float(abs(np.trapezoid(angle, tension)))
