"""`notchflex compare` prints Table 4 of Pacheco et al. 2021, the model against measured angles.

Measured angles are read from ../shared/data. The paper's model is the specimen's: unrounded
constants (the authors' set 196) and notches that are bent when free. Its "experimental" tip is
the forward kinematics of the measured angles.

@article{pacheco2021beyond,
  author  = {Pacheco, Nicholas E. and Gafford, Joshua B. and Atalla, Mostafa A. and
             Webster, Robert J. III and Fichera, Loris},
  title   = {Beyond Constant Curvature: A New Mechanics Model for Unidirectional Notched-Tube
             Continuum Wrists},
  journal = {Journal of Medical Robotics Research},
  volume  = {6}, number = {1-2}, pages = {2140004}, year = {2021},
  doi     = {10.1142/s2424905x21400043}
}
"""

from __future__ import annotations

import json

import numpy as np
import pytest

from notchflex.cli import main
from shared_data import measured_path

# Table 4 and the totals of the text [deg]; tip RMSE over all wrists of fig. 12 [mm].
NOTCHES = {
    "a": [1.80, 1.32, 1.01, 0.84, 0.89],
    "b": [0.43, 0.41, 0.39, 0.57, 0.57],
    "c": [2.47, 1.49, 1.15, 0.79],
}
TOTAL = {"a": 3.73, "b": 1.61, "c": 3.95}
POINTS = {"a": 68, "b": 75, "c": 83}
NEGATIVE_FORCES = {"a": 2, "b": 0, "c": 1}
LINEAR = ("--set", "material.kind=linear", "--set", "material.elastic_modulus=7510")
MODELS = {
    "full": ((), 0.33),
    "linear with friction": ((*LINEAR, "--set", "friction.coefficient=0.05"), 0.92),
    "linear, frictionless": ((*LINEAR, "--set", "friction.kind=frictionless"), 0.90),
}


@pytest.fixture
def compare(capsys, monkeypatch):
    """Run the command and return the JSON document on its standard output."""

    def run(letter: str, *settings: str) -> dict:
        data = measured_path(f"pacheco2021_wrist_{letter.upper()}_measured.csv")
        robot = f"pacheco2021-{letter}-specimen"
        arguments = ["notchflex", "compare", robot, str(data), *settings, "--json", "-"]
        monkeypatch.setattr("sys.argv", arguments)
        try:
            code = main()
        except SystemExit as stop:
            code = stop.code
        output = capsys.readouterr()
        assert not code, output.err
        return json.loads(output.out)

    return run


@pytest.mark.parametrize("letter", "abc")
def test_table_4(letter, compare, margin):
    found = compare(letter)
    rmse = found["rmse_deg"]
    margin.note(f"RMSE: {np.round(rmse['notches'], 4).tolist()}, total {rmse['total']:.4f} deg")
    assert np.round(rmse["notches"], 2).tolist() == NOTCHES[letter]
    assert np.round(rmse["total"], 2) == TOTAL[letter]
    assert found["points"] == POINTS[letter]
    assert found["negative_forces"] == NEGATIVE_FORCES[letter]


@pytest.mark.parametrize("model", MODELS)
def test_tip_of_all_wrists_together(model, compare, margin):
    settings, printed = MODELS[model]
    square = 0.0
    for letter in "abc":
        found = compare(letter, *settings)
        square += found["points"] * found["tip_rmse_mm"] ** 2
    pooled = np.sqrt(square / sum(POINTS.values()))
    margin.note(f"pooled tip RMSE, {model}: {pooled:.4f} mm")
    assert np.round(pooled, 2) == printed
