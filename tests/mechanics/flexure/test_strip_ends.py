"""Strips and U-links with elastic ends against finite elements of cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import notchflex as nf
from margins import Margin
from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import unchecked_dimensions
from notchflex.mechanics.flexure import (
    Site,
    flexure_state,
    law_error,
    relative_pose,
    rod,
    validity_warnings,
)
from notchflex.mechanics.material import section_law
from reference_data import named_rows

STRIPS, LINKS = named_rows("fem_strip_cells.csv"), named_rows("fem_u_link_cells.csv")
AXES = ("uy", "ux", "uz", "ry", "rx", "rz")  # of the tables, in the order of the notch's frame
PLANE = ("rx", "uy", "uz")
# Full meshes of the papers' dimensions; mm/N, rad/(N mm).
LIU = {"rx": 0.00588327, "uy": 0.005093919, "uz": 0.01923623}
LIU_PULLED = {"rotation": 0.02353681, "gap": 0.1133988}  # by 1 N of cable, rad and mm
GAO = {"rx": 2.741072e-3, "uy": 2.909225e-4, "uz": 2.625105e-3, "uy_uz": -3.480495e-4}
GAO |= {"ux": 2.243258e-3, "ry": 3.827097e-4, "rz": 9.271828e-5, "ry_rz": 3.893311e-5}


def liu(
    height: float = 3.5, thickness: float = 1.5, depth: float = 6.9, **keys: Any
) -> nf.StripNotch:
    return nf.StripNotch(height, thickness, depth, ends="elastic", uncut_length=5.0, **keys)


def part(row: Mapping[str, Any]) -> tuple[Any, nf.Tube]:
    tube = nf.Tube(2.0 * row["outer"], 2.0 * row["inner"])
    if "depth" in row:
        return liu(row["height"], row["thickness"], row["depth"]), tube
    slot, length = row["slot_radius"], row["length"]
    return nf.ULink(slot, row["thickness"], length, "toward", ends="elastic"), tube


def site(nu: float = 0.33) -> Site:
    side = nf.mechanics.ring.Side("between", 1.0)
    return Site(side, side, nu)


def left_ranges(notch: Any, tube: nf.Tube) -> list[str]:
    return validity_warnings(notch, tube, site())


def compliance(notch: Any, tube: nf.Tube, modulus: float = 1.0, nu: float = 0.33) -> np.ndarray:
    """Compliance (6, 6) at the middle of the strip, mm/N, rad/(N mm), displacements first."""
    shape = rod(notch, tube, 0, site(nu))
    law = section_law(nf.Linear(modulus, poisson_ratio=nu))

    def forces(modes: jax.Array) -> jax.Array:
        return flexure_state(shape, law, (), modes, with_pose=True).internal

    rest = jnp.zeros(shape.modes)
    twist = np.asarray(flexure_state(shape, law, (), rest, with_pose=True).twist)
    own = twist @ np.linalg.solve(np.asarray(jax.jacobian(forces)(rest)), twist.T)
    offset = np.asarray(relative_pose(shape, rest).translation)
    offset = offset - [0.0, 0.0, notch.height + 0.5 * notch.strip_thickness]
    carry = np.eye(6)
    carry[3:, :3] = np.cross(np.eye(3), offset)
    own = carry @ own @ carry.T
    return np.roll(np.roll(own, 3, axis=0), 3, axis=1)


def entry(found: np.ndarray, name: str) -> float:
    first, second = name.split("_") if "_" in name else (name, name)
    return found[AXES.index(first), AXES.index(second)]


def errors(rows: Sequence[Mapping[str, Any]], inside: bool) -> np.ndarray:
    """Errors in % of entries of cells: rx, uy, uz, their coupling; ux, ry, rz, their coupling."""
    made: list[list[float]] = []
    for row in rows:
        notch, tube = part(row)
        if inside and left_ranges(notch, tube):
            continue
        found = compliance(notch, tube, nu=row["nu"])
        of = {name: row[f"EC_{name}_{name}"] for name in (*PLANE, "ux", "ry", "rz")}
        size = np.sqrt(of["uy"] * of["uz"])
        errors = {name: entry(found, name) / value - 1.0 for name, value in of.items()}
        coupling = (entry(found, "uy_uz") - row["EC_uy_uz"]) / size
        sideways = [errors[name] for name in ("ux", "ry", "rz")]
        both = (entry(found, "ry_rz") - row["EC_ry_rz"]) / np.sqrt(of["ry"] * of["rz"])
        made.append([*(errors[name] for name in PLANE), coupling, *sideways, both])
    return 100.0 * np.array(made)


@pytest.mark.nightly
def test_liu_and_gao_at_small_loads(margin: Margin) -> None:
    found = compliance(liu(), nf.Tube(10.0, 6.0), 1000.406, 0.4)
    for name, value in LIU.items():
        margin.within(f"strip, {name}", 100.0 * (entry(found, name) / value - 1.0), 2.0, "%")
    link = nf.ULink(0.275, 0.70, 2.0, "toward", ends="elastic")
    found = compliance(link, nf.Tube(5.99, 4.0), 22000.0)
    for name, value in GAO.items():
        margin.within(f"link, {name}", 100.0 * (entry(found, name) / value - 1.0), 2.0, "%")


def pulled_strip() -> nf.Robot:
    ready = nf.load_robot("liu2022").with_values({"friction.coefficient": 0.0})
    return nf.Robot(
        name="one strip",
        tube=nf.Tube(10.0, 6.0, base_length=5.0),
        notch=(liu(),),
        tendon=(nf.Tendon(radius=4.0, direction_deg=0.0, end_body=1, path="straight"),),
        material=nf.Linear(1000.406, poisson_ratio=0.4),
        friction=ready.friction,
    )


def test_liu_pulled_to_12_degrees(margin: Margin) -> None:
    rows = named_rows("fem_liu_strip.csv")
    path = nf.simulate(pulled_strip(), [nf.Load(tension=[row["F_N"]]) for row in rows])
    angle = np.degrees(path.quantity("notch_angle")[:, 0])
    shortening = path.quantity("stroke")[:, 0]
    wanted = np.array([(row["rot_fem_deg"], row["gap_shortening_mm"]) for row in rows]).T
    margin.within("angle", 100.0 * (angle / wanted[0] - 1.0), 2.0, "%")
    margin.within("shortening of the gap", 100.0 * (shortening / wanted[1] - 1.0), 2.0, "%")
    small = nf.simulate(pulled_strip(), [nf.Load(tension=[1e-3])])
    slope = small.quantity("notch_angle")[0, 0] / 1e-3, small.quantity("stroke")[0, 0] / 1e-3
    for value, (name, wanted) in zip(slope, LIU_PULLED.items(), strict=True):
        margin.within(f"{name} per N", 100.0 * (value / wanted - 1.0), 2.0, "%")


@pytest.mark.nightly
@pytest.mark.parametrize("use", ["fit", "judge", "kept"])
def test_cells_inside_validity(use: str, margin: Margin) -> None:
    """Against the cells fitted, those seen when terms were chosen, and those computed after."""
    found = np.concatenate(
        [errors([row for row in rows if row["use"] == use], True) for rows in (STRIPS, LINKS)]
    )
    rms, largest = np.sqrt(np.mean(found**2, axis=0)), np.abs(found).max(axis=0)
    allowed = {"rx": (2.6, 5.3), "uy": (3.7, 9.0), "uz": (2.8, 8.0), "coupling": (3.4, 7.7)}
    allowed |= {"ux": (5.8, 14), "ry": (3.2, 8), "rz": (5.2, 15), "coupling sideways": (4, 11.5)}
    for (name, (most_rms, most)), one, worst in zip(allowed.items(), rms, largest, strict=True):
        margin.within(f"{use}: {name}, rms of {len(found)}", one, most_rms, "%")
        margin.within(f"{use}: {name}, max", worst, most, "%")
    if use == "kept":
        error = law_error(liu(), nf.Tube(10.0, 8.0), site(), yields=False)
        margin.within("law", np.sqrt(np.mean(rms[:3] ** 2)) - 100.0 * error, 0.1, "%")


@pytest.mark.nightly
def test_cells_outside_validity(margin: Margin) -> None:
    """What the sentence on thin walls says."""
    rows = [row for row in STRIPS + LINKS if row["inner"] / row["outer"] > 0.8]
    assert len(rows) == 7
    assert all("inner / outer diameter" in left_ranges(*part(row))[0] for row in rows)
    found = np.abs(np.concatenate([errors([row], False) for row in rows])).max(axis=0)
    margin.within("bending", found[0], 3.1, "%")
    margin.within("the others", found[1:], 18.0, "%")
    assert found[6] > 10.0


def test_validity_names_each_range() -> None:
    tube = nf.Tube(10.0, 6.0)
    assert left_ranges(liu(), tube) == []
    assert unchecked_dimensions(nf.load_robot("liu2022")) == []  # a model of a paper
    row = nf.StripNotch(3.5, 1.5, 6.9, ends="elastic")
    (text,) = left_ranges(row, tube)
    assert text.startswith("uncut length / height is 0, below 0.7")
    link = nf.ULink(0.275, 0.7, 0.6, "toward", ends="elastic")
    assert len(left_ranges(link, nf.Tube(5.99, 4.0))) == 2


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "tensions"), [("liu2022", (6.0, 0.0)), ("gao2017", (8.0,))])
def test_robots_with_friction_and_loads(name: str, tensions: tuple[float, ...]) -> None:
    robot = nf.load_robot(name).with_values({"notch[*].ends": "elastic"})
    sideways = (-0.02, 0.03, 0.0)
    up = [
        nf.Load(tension=[part * t for t in tensions], tip_force=sideways)
        for part in (0.5, 1.0, 0.7)
    ]
    path = nf.simulate(robot, up)
    assert path.converged.all(), path.reason
    assert path.total_angle[1] > path.total_angle[0] > 0.0
    assert np.all(path.quantity("dissipation") >= 0.0)
    # The base carries what acts at the tip.
    force = -path.quantity("base_force")  # that of the base on the robot, turned round
    np.testing.assert_allclose(force[:, :2], np.tile(sideways[:2], (3, 1)), atol=1e-6)


@pytest.mark.parametrize("name", ["liu2022", "gao2017"])
def test_roots_are_stiff_not_heavy(name):
    robot = nf.load_robot(name).with_values({"material.density": 6450.0, "notch.ends": "rigid"})
    rooted = robot.with_value("notch.ends", "elastic").geometry.body_mass
    assert rooted.sum() == pytest.approx(robot.geometry.body_mass.sum(), rel=1e-12)


def test_a_pull_along_the_strip_stretches_its_whole_section():
    """Shear has five sixths of the section, stretch has all of it."""
    state = nf.solve(pulled_strip(), nf.Load(tip_force=(0.5, 0.0, 0.0)))
    stretch = state.path.solver_quantity("notch_strain")[0, 0, :, 0]
    middle = len(stretch) // 2
    area = 2.0 * 2.0 * 1.5  # of both walls
    assert abs(stretch[middle]) == pytest.approx(0.5 / (1000.406 * area), rel=0.02)
