"""The tests run unoptimised programs (conftest.py): optimised ones must find the same numbers."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np

import notchflex as nf

SCRIPT = """
import notchflex as nf
wrist = nf.load_robot("pacheco2021-a")
path = nf.simulate(wrist, nf.pull(0.0, 2.5, 6).release()).raise_if_failed()
print(*path.total_angle, *path.tip_position.ravel())
"""


def test_optimised_programs_find_the_same(margin) -> None:
    environment = {**os.environ, "XLA_FLAGS": "", "NOTCHFLEX_OPTIMISATION": ""}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True
    )
    wrist = nf.load_robot("pacheco2021-a")
    path = nf.simulate(wrist, nf.pull(0.0, 2.5, 6).release()).raise_if_failed()
    here = np.concatenate([path.total_angle, path.tip_position.ravel()])
    there = np.array(done.stdout.split(), float)
    assert "optimization_level=0" in os.environ["XLA_FLAGS"]
    assert os.environ["NOTCHFLEX_OPTIMISATION"] == "0"
    margin.within("optimised against unoptimised", there - here, 1e-11, "rad, mm")
