"""Robots of disks against other programs' shapes and own solutions of Cosserat rods."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from reference_data import named_rows, reference
from shared_data import measured, measured_path, numbers


def _errors(rows: slice) -> np.ndarray:
    """Distance of tips of the table from those that are found from rest, mm."""
    table = reference("disks_two_segments.csv")[rows]
    robot = nf.load_robot("disks-two-segments")
    states = [
        nf.solve(robot, nf.Load(tension=row[:6], tip_force=row[6:9], tip_moment=row[9:12]))
        for row in table
    ]
    assert all(state.converged for state in states)
    found = np.array([state.tip_position for state in states])
    return np.linalg.norm(found - table[:, 12:], axis=1)


def test_two_segments() -> None:
    """The example of tdcr-modeling and five other loads, of 400 mm."""
    assert _errors(slice(6)).max() < 0.002


@pytest.mark.nightly
def test_hard_random_loads() -> None:
    """Six tensions up to 5 N and a tip force up to 0.3 N."""
    errors = _errors(slice(6, None))
    assert np.median(errors) < 0.005
    assert errors.max() < 0.05


def _tendon(name: str, disks: int) -> tuple[nf.Tendon, ...]:
    part = np.arange(1, disks + 1) / disks

    def converging(side: float) -> nf.Tendon:
        return nf.Tendon(8.0, side, path="straight", disk_radius=tuple(8.0 - 4.0 * part))

    def winding(first: float, turn: float) -> nf.Tendon:
        sides = tuple(first + turn * part)
        return nf.Tendon(6.0, first, path="straight", disk_direction_deg=sides)

    kind, _, rest = name.partition("_")
    if kind == "converging":
        return (converging(0.0), converging(120.0)) if rest == "two" else (converging(0.0),)
    if kind == "helical90":
        return (winding(30.0, 90.0),)
    straight = (nf.Tendon(6.0, 180.0, path="straight"),) if rest == "two" else ()
    return (winding(0.0, 360.0), *straight)


def _tip(row: dict[str, object], disks: int) -> float:
    robot = nf.Robot(
        "continuous",
        nf.Tube(20.0, 1.0),
        (nf.RodGap(200.0 / disks, 1.0, uncut_length=0.0, repeat=disks),),
        _tendon(str(row["name"]), disks),
        nf.Linear(60e3, poisson_ratio=0.33),
        nf.Frictionless(),
    )
    tension = tuple(map(float, str(row["tension"]).split()))
    tip = nf.solve(robot, nf.Load(tension=tension)).raise_if_failed().tip_position
    return float(np.linalg.norm(tip - [row["x"], row["y"], row["z"]]))


@pytest.mark.nightly
@pytest.mark.parametrize("row", named_rows("continuous_tendons.csv"), ids=lambda row: row["name"])
def test_many_disks_are_a_continuous_tendon(row: dict[str, object]) -> None:
    coarse, fine = (_tip(row, disks) for disks in (50, 100))
    assert fine < 1e-3 * 200.0
    assert fine < 0.3 * coarse


@pytest.mark.nightly
@pytest.mark.parametrize(("rod", "most"), [("steel", 0.15), ("tpu", 0.115)])
def test_shapes_of_sorosim(rod: str, most: float) -> None:
    """500 loads each, of opencr-mujoco: gravity, force and moment halfway and at the tip."""
    # An own Cosserat rod without disks is as far from them: 0.140 and 0.113 mm in the median.
    file = measured_path("sorosim_static_shapes.npz")
    if not file.is_file():
        pytest.skip("the shapes of SoRoSim are not beside this checkout")
    data = np.load(file)
    young, ratio, density, radius, length = data[f"{rod}_E_nu_rho_r_L"]
    robot = nf.Robot(
        rod,
        nf.Tube(4e3 * radius, 2e3 * radius),
        (nf.RodGap(50.0 * length, 2e3 * radius, uncut_length=0.0, repeat=20),),
        (nf.Tendon(1.5e3 * radius, path="straight"),),
        nf.Linear(1e-6 * young, poisson_ratio=ratio, density=density),
        nf.Frictionless(),
    )
    names = "gravity", "mid_force", "mid_moment", "tip_force", "tip_moment"
    errors = list[float]()
    turned = [1, 2, 0]  # its rod lies along x
    for tip, *values in zip(
        data[f"{rod}_p_sorosim"][:, -1], *(data[f"{rod}_{name}"] for name in names), strict=True
    ):
        gravity, force, moment, tip_force, tip_moment = (value[turned] for value in values)
        load = nf.Load(
            gravity=gravity,
            body_forces=(nf.BodyForce(10, force=force, moment=1e3 * moment),),
            tip_force=tip_force,
            tip_moment=1e3 * tip_moment,
        )
        state = nf.solve(robot, load).raise_if_failed()
        errors.append(float(np.linalg.norm(state.tip_position - 1e3 * tip[turned])))
    assert np.median(errors) <= most


def _nine_tendons(friction: float) -> nf.Robot:
    """FTDCR v4 of opencr-mujoco; radius and length before the base are fitted to train.csv."""
    turned = np.degrees(np.repeat([-3.0589, -2.5615, -2.0506], 3))
    tendons = tuple(
        nf.Tendon(
            0.932 * 4.5,
            float(side + 120.0 * (number % 3)),
            end_body=10 * (1 + number // 3),
            axial_stiffness=10e3,
            path="straight",
            free_length=2025.0,  # with that stiffness, the servos
        )
        for number, side in enumerate(turned)
    )
    gaps = tuple(nf.RodGap(length, 1.0, uncut_length=0.0, repeat=10) for length in (6.0, 6.25, 6.4))
    wire = nf.Linear(50e3, poisson_ratio=0.3)
    return nf.Robot("FTDCR v4", nf.Tube(11.0, 1.0), gaps, tendons, wire, nf.Capstan(friction))


@pytest.mark.nightly
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.2, 0.3])
@pytest.mark.parametrize(("part", "most"), [("train", 6.0), ("val", 8.1)])
def test_a_measured_robot_of_nine_tendons(part: str, most: float, friction: float) -> None:
    """Strokes of the servos and the tip by motion capture; opencr-mujoco is 9.68 and 12.11 off.

    As there, the error is the root mean square of the distances less their mean.
    """
    file = measured_path(f"ftdcr_v4_{part}.csv")
    if not file.is_file():
        pytest.skip("the measurements of FTDCR v4 are not beside this checkout")
    rows = measured(file.name)
    strokes = np.transpose([numbers(rows, key) for key in rows[0] if key.startswith("servo")])
    seen = np.transpose([numbers(rows, f"tip_{axis}") for axis in "xyz"])
    path = nf.simulate(_nine_tendons(friction), nf.LoadPath(stroke=strokes + 0.184))
    assert path.converged.all(), path[int(np.argmin(path.converged))].reason
    off = path.tip_position - seen
    assert np.sqrt(np.mean(np.sum((off - off.mean(axis=0)) ** 2, axis=1))) <= most
