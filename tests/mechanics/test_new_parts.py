"""A notch, a material and a friction law as an engineer adds them, against a closed form.

The files in `new_parts/` are copied into a copy of the package; no list in it is edited.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex

PARTS = Path(__file__).parent / "new_parts"
TUBE, HEIGHT, THICK, WIDTH, OFFSET, RADIUS = (3.0, 2.4), 1.5, 0.2, 1.0, 1.3, 1.2
MODULUS, LIMIT, LOSS, PULL = 40_000.0, 0.03, 0.4, 2.0

SCRIPT = f"""
import json
import numpy as np
import notchflex as nf
from notchflex.mechanics.chain import with_fibres
from notchflex.robot.value_names import number_at
from notchflex.mechanics.flexure import rod
robot = nf.Robot(
    name="new parts",
    tube=nf.Tube{TUBE},
    notch=(nf.FlatNotch({HEIGHT}, {THICK}, {WIDTH}, {OFFSET}, uncut_length=1.0, repeat=2),),
    tendon=(nf.Tendon({RADIUS}),),
    material=nf.Softening({MODULUS}, {LIMIT}),
    friction=nf.Sheath({LOSS}),
)
from notchflex.robot import robot_from_text, robot_text
assert robot_from_text(robot_text(robot)) == robot
notch, tube = robot.notches[0], robot.tube
section = with_fibres(rod(notch, tube), notch, tube).section
linear = section.fibres.area * section.fibres.arm**2
assert abs(linear.sum(axis=-1) / ({WIDTH} * {THICK}**3 / 12.0) - 1.0).max() < 1e-12
load = nf.Load(tension={PULL})
state = nf.solve(robot, load)
print(json.dumps([state.converged, *state.notch_angle.tolist(), sorted(nf.json_schema()["$defs"])]))
"""
TRACED = """
# The formulas are traced as well: for slopes, and for many robots.
names = ["notch.thickness", "material.limit", "friction.loss"]
slopes = state.path.jacobian(names, "total_angle")["total_angle"][0]
for name, slope in zip(names, slopes, strict=True):
    at = number_at(robot, name)
    moved = [robot.with_value(name, at * part) for part in (0.999, 1.001)]
    ends = [nf.solve(one, load).total_angle for one in moved]
    assert abs((ends[1] - ends[0]) / (2e-3 * at) / slope - 1.0) < 1e-5
many = nf.batch(robot, {"notch.thickness": np.linspace(0.19, 0.21, 300)}, load)
assert abs(many["total_angle"][7] - many.path(7).total_angle[0]) < 1e-12
"""


def angle(tension: float) -> float:
    """Angle of a notch under a tension in its gap, rad."""
    second_moment, edge = WIDTH * THICK**3 / 12.0, 0.5 * THICK

    def missing(theta: float) -> float:
        strain = theta / HEIGHT * edge
        moment = MODULUS * second_moment * theta / HEIGHT * (1.0 - (strain / LIMIT) ** 2 / 3.0)
        return moment - tension * (RADIUS + OFFSET)

    return float(brentq(missing, 0.0, LIMIT / edge * HEIGHT, xtol=1e-14))


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources with the new files, and one line that makes them public."""
    copy = tmp_path_factory.mktemp("copy")
    for name in ("notchflex", "lanewise"):
        source = Path(notchflex.__file__).parents[1] / name
        shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(PARTS, copy / "notchflex", dirs_exist_ok=True)
    init = copy / "notchflex" / "__init__.py"
    line = '            "ArcNotch",\n'
    text = init.read_text(encoding="utf-8")
    assert line in text
    init.write_text(text.replace(line, line + '"FlatNotch", "Sheath", "Softening",\n', 1), "utf-8")
    return copy


@pytest.mark.parametrize("more", ["", pytest.param(TRACED, marks=pytest.mark.nightly)])
def test_new_parts_solve_as_their_closed_form(package: Path, more: str) -> None:
    environment = os.environ | {"PYTHONPATH": str(package)}
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT + more],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    converged, *angles, kinds = json.loads(run.stdout.splitlines()[-1])
    assert converged
    # The tendon loses the same at the first edge, and at both edges beyond it.
    np.testing.assert_allclose(angles, [angle(PULL - LOSS), angle(PULL - 3.0 * LOSS)], rtol=1e-9)
    assert {"FlatNotch", "Sheath", "Softening"} <= set(kinds)


def test_new_parts_are_short() -> None:
    files = list(PARTS.rglob("*.py"))
    code = [line for file in files for line in file.read_text("utf-8").splitlines() if line.strip()]
    assert len(files) == 6
    assert len(code) <= 100
