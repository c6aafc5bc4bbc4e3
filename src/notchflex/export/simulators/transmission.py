"""The transmission table: what the tendons do to the joints, and what these answer with."""

from __future__ import annotations

import numpy as np

from notchflex.export.simulators.joint_model import JointModel
from notchflex.export.simulators.levers import tendon_levers
from notchflex.results.files.csv import csv_text

_ANGLES = 11


def transmission_table(model: JointModel) -> str:
    """Return a CSV table with a row for every joint and some of its angles.

    Its columns are the angle from the free robot, the lever of every tendon (by how much it
    shortens per turn, the other joints as in the free robot), and the elastic and the friction
    moment of the joint. While the angle rises at tension T, T times the lever is the elastic
    plus the friction moment; while it falls, their difference.
    """
    tendons = range(len(model.holes))
    rows: list[list[str]] = []
    levers = [f"tendon_{k + 1}_lever_mm" for k in tendons]
    header = ["joint", "angle_rad", *levers, "elastic_moment_Nmm", "friction_moment_Nmm"]
    count = len(model.springs)
    for j, spring in enumerate(model.springs):
        at = np.linspace(spring.low, spring.high, _ANGLES)
        angle = np.zeros((_ANGLES, count))
        angle[:, j] = at
        columns = [
            at,
            *(tendon_levers(model.hinges, model.holes[k], angle)[:, j] for k in tendons),
            spring.moment(at),
            np.abs(spring.friction_moment(at)),
        ]
        for row in np.stack(columns, axis=1).tolist():
            rows.append([f"notch_{j + 1}", *(f"{value:.7g}" for value in row)])
    return csv_text(header, rows)
