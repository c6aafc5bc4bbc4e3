"""A path as the statics return it, made from closed formulas: results and pictures need no solver.

The angles are those of five equal notches that grow in proportion to the tension and stop at their
closing angle; unloading lags behind. It is no physics, only numbers of the right shapes
and sizes.
"""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from notchflex import Equilibrium, bodies_from_angles, load_robot, tip_from_angles
from notchflex.loads.load import NOTHING
from notchflex.mechanics.chain import assemble

CENTROID = 0.6865  # mm, of the section of wrist A
CLOSING = np.radians(30.63)


@dataclass
class FakePath:
    """Has the attributes that results and pictures read, S steps."""

    robot: Any
    columns: dict[str, Any] = field(default_factory=dict)

    def __getattr__(self, name: str) -> Any:
        columns = self.__dict__.get("columns", {})
        if name in columns:
            return columns[name]
        raise AttributeError(name)

    @property
    def load(self) -> Any:
        """The external loads."""
        return SimpleNamespace(external=self.external)

    @property
    def chain(self) -> Any:
        """The real chain: pictures and tables take the bodies and contacts from it."""
        return assemble(self.robot)

    @property
    def run(self) -> Any:
        """The modes of the notches, which a notch that bends in an arc has one of."""
        modes = np.zeros((len(self), *np.shape(self.chain.stiffness)))
        modes[..., 0] = self.notch_angle
        unknowns = SimpleNamespace(modes=modes)
        return SimpleNamespace(solved=SimpleNamespace(point=SimpleNamespace(unknowns=unknowns)))

    def __getitem__(self, step: int) -> Any:
        return Equilibrium(self, step)

    def quantity(self, name: str) -> Any:
        """The values of every step, as `EquilibriumPath` has them."""
        return self.columns[name]

    @property
    def front(self) -> Any:
        """The friction front, as `EquilibriumPath` has it."""
        return self.front_contact, self.front_eta

    def __len__(self) -> int:
        return len(self.tension)


def fake_path(steps: int = 7, *, robot: Any = None, failed: int = 0) -> FakePath:
    """Return a pull to 3 N and back, `steps` each way; the last `failed` steps not converged."""
    robot = load_robot("pacheco2021-a") if robot is None else robot
    way = np.linspace(0.0, 3.0, steps)
    tension = np.concatenate([way, way[::-1]])
    lag = np.concatenate([way, np.minimum(1.0, way[::-1] * 6 / 5 / 3) * 3])
    n, count = robot.number_of_notches, len(tension)
    stiffness = np.linspace(1.0, 1.1, n)
    angle = np.minimum(np.radians(18.0) * lag[:, None] / stiffness, CLOSING)
    closed = angle >= CLOSING
    position, rotation = bodies_from_angles(robot, angle)
    good = np.arange(count) < count - failed
    spans = np.full((count, 1, 2 * n), np.nan)
    spans[:] = tension[:, None, None] * np.exp(-0.03 * np.arange(2 * n))
    contacts = (count, 1, 2 * n - 1)
    columns = {
        "tension": tension[:, None],
        "stroke": (angle * (0.7 + CENTROID)).sum(axis=1)[:, None],
        "external": (NOTHING,) * count,
        "commanded_tension": tension[:, None],
        "commanded_stroke": np.full((count, 1), np.nan),
        "notch_angle": angle,
        "total_angle": angle.sum(axis=1),
        "tip_axis_angle": np.arccos(np.cos(angle.sum(axis=1))),
        "tip_position": tip_from_angles(robot, angle)[0],
        "tip_rotation": rotation[:, -1],
        "body_position": position,
        "body_rotation": rotation,
        "span_tension": spans,
        "notch_moment": 1.38 * tension[:, None] * np.ones(n),
        "outer_strain": angle * 0.1235 / 0.8,
        "peak_strain": angle * 0.177 / 0.8,
        "gap": np.maximum(0.8 - angle * (0.81 + CENTROID), 0.0),
        "closed": closed,
        "contact_force": 0.4 * closed,
        "contact_log_ratio": np.full(contacts, 0.03),
        "contact_slid": np.full(contacts, 0.1),
        "contact_bound": np.full(contacts, 0.03),
        "contact_turning": np.full(contacts, np.radians(3.0)),
        "edge_angle": angle,
        "material_dissipation": np.zeros((count, n)),
        "chord_angle": np.full((count, n), np.nan),
        "total_chord_angle": np.full(count, np.nan),
        "front_contact": np.concatenate([np.ones(steps), np.arange(1, steps + 1)])[:, None],
        "front_eta": np.ones((count, 1)),
        "base_force": tension[:, None] * np.array([0.1, 0.0, 1.0]),
        "base_moment": tension[:, None] * np.array([0.0, 0.7, 0.0]),
        "moment_error": np.full(count, 1e-4),
        "contact_state": np.tile(np.array([0, 1, -1], np.int8), 2 * n)[: 2 * n - 1]
        * np.ones(contacts, np.int8),
        "stored_energy": tension**2,
        "dissipation": np.zeros(contacts),
        "tendon_work": tension[:, None] ** 2,
        "converged": good,
        "reason": np.where(good, "", "every notch closed"),
        "reason_code": np.where(good, "", "NOTCHES_CLOSED"),
        "residual": np.full(count, 1e-12),
        "iterations": np.full(count, 4),
        "stable": np.ones(count, bool),
        "smallest_eigenvalue": np.full(count, 7.0),
        "determinant_sign": np.ones(count),
        "snap": np.zeros((count, n), int),
    }
    return FakePath(robot, columns)
