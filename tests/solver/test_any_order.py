"""What a robot does does not depend on the robots that the process solved before it."""

import subprocess
import sys
from pathlib import Path

import pytest

import notchflex as nf

PROGRAM = Path(__file__).with_name("five_forms.py")


def digests(forms: str, count: int, seed: int) -> str:
    """Return what a new process prints that solves robots in the order of a seed."""
    command = [sys.executable, str(PROGRAM), forms, str(count), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("forms", "count", "orders"),
    [("0", 4, 2), pytest.param("01234", 40, 3, marks=pytest.mark.nightly)],
)
def test_results_are_equal_to_the_bit_in_any_order(forms, count, orders):
    first = digests(forms, count, 0)
    assert len(set(first.split()[1::2])) == count  # the digests tell robots apart
    for seed in range(1, orders):
        assert digests(forms, count, seed) == first


@pytest.mark.nightly
def test_a_load_of_a_batch_does_not_depend_on_the_others():
    robot = nf.load_robot("pacheco2021-a")
    loads = [
        nf.Load(tension=1.0),
        nf.Load(tension=1.0, tip_force=(0.01, 0.0, 0.0)),
        nf.Load(tension=1.0, tip_force=(0.0, 0.01, 0.0)),
    ]
    outputs = ("total_angle", "tip_position", "tension")
    together = nf.solve_batch(robot, loads, outputs=outputs)
    for row, load in enumerate(loads):
        alone, state = nf.solve_batch(robot, load, outputs=outputs), nf.solve(robot, load)
        for name in outputs:
            assert (together[name][row] == alone[name][0]).all(), (row, name)
            assert together[name][row] == pytest.approx(state.quantity(name), rel=1e-12)
