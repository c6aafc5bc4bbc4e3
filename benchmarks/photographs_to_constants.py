"""How often constants fitted to photographs lie in their 95 % intervals.

`python benchmarks/photographs_to_constants.py FILE [SETS]` reads what `measured_photographs.py`
wrote to FILE. Each set bends a wrist by six pulls, gives the angles of each photograph the errors
and the standard deviations of a photograph of that study, all notches together, and calibrates.
"""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.fit import calibrate, read_measurements, simulate_measurements
from notchflex.photographs import MeasuredPhotograph, MeasuredPhotographs

TRUE = {"material.elastic_modulus": 9200.0, "friction.coefficient": 0.18}
TENSIONS = (0.7, 1.2, 1.6, 1.1, 0.6, 0.3)  # N


def photograph(angles: np.ndarray, row: dict) -> MeasuredPhotograph:
    """Return a photograph with the errors and standard deviations of another."""
    return MeasuredPhotograph(
        "", "", angles + np.radians(row["error"]), np.radians(row["deviation"]),
        np.zeros(3), np.ones(3), 1.0, 0.0, 0.0, 0.0, 1.0, np.zeros((0, 2)), np.zeros(0, bool),
    )  # fmt: skip


def main(file: Path, sets: int) -> None:
    """Print how many intervals hold the constants that bent the wrist."""
    robot = nf.load_robot("pacheco2021-a")
    rows = [row for row in map(json.loads, file.read_text().splitlines()) if not row["reason"]]
    pulls = [nf.Load(tension=one) for one in TENSIONS]
    bent = simulate_measurements(robot.with_values(TRUE), pulls, from_rest=False)
    held = dict.fromkeys(TRUE, 0)
    with tempfile.TemporaryDirectory() as folder:
        table = f"{folder}/measured.csv"
        for number in range(sets):
            chosen = np.random.default_rng(number).integers(len(rows), size=len(TENSIONS))
            photographs = tuple(
                photograph(angles, rows[one])
                for angles, one in zip(bent.observed["notch_angle"], chosen, strict=True)
            )
            loads = {"tendon_force_N": tuple(map(str, TENSIONS))}
            MeasuredPhotographs(robot, photographs, loads).write_csv(table)
            fitted = calibrate(robot, read_measurements(table, robot), list(TRUE), starts=1)
            for name, value in TRUE.items():
                held[name] += fitted.intervals[name].lower < value < fitted.intervals[name].upper
    for name, count in held.items():
        print(f"{name}: {count} of {sets} intervals of 95 % hold it ({100 * count / sets:.1f} %)")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if sys.argv[2:] else 200)
