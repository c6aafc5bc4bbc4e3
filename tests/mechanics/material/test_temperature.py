"""Temperature: moved plateaus, the memory of fibres that are heated, data sheets, loads."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from fibre_sections import bending, respond, section
from notchflex.mechanics.material import section_law

FLAG = nf.Nitinol(
    42_000.0,
    350.0,
    4_000.0,
    compression_ratio=1.3,
    unloading_stress=150.0,
    transformation_strain=0.05,
    reference_temperature=22.0,
)
WRIST = nf.load_robot("pacheco2021-a-true")
MEASURED = WRIST.replace(material=replace(WRIST.material, reference_temperature=22.0))


def with_memory():
    flag = replace(WRIST.material, reference_temperature=22.0, unloading_stress=120.0)
    return WRIST.replace(material=flag)


def own_fibres(curvature, material, temperature, past, own):
    """Transformed strains and moment of a bent section, by a play operator of our own."""
    modulus, hard = material.elastic_modulus, 1.0 - material.plateau_modulus / 42_000.0
    warm = 6.5 * (temperature - material.reference_temperature)
    length = material.transformation_strain - material.plateau_stress / modulus

    def on_plateau(strain, begin):
        return hard * np.clip(strain - begin, 0.0, length)

    def transformed(strain):
        load, unload = ((s + warm) / modulus for s in (350.0, 150.0))
        least = on_plateau(strain, load) - on_plateau(-strain, 1.3 * unload)
        most = on_plateau(strain, unload) - on_plateau(-strain, 1.3 * load)
        return np.clip(past, least, most)

    arm, area = np.asarray(own.fibres.arm), np.asarray(own.fibres.area)

    def stress(axial):
        strain = axial + curvature * arm
        return modulus * (strain - transformed(strain))

    axial = brentq(lambda e: area @ stress(e), -0.1, 0.1, xtol=1e-16, rtol=1e-15)
    return transformed(axial + curvature * arm), area @ (stress(axial) * arm)


def test_heated_and_cooled_fibres_keep_their_memory():
    own, law = section(), section_law(FLAG)
    memory, past = law.rest(own), np.zeros(own.fibres.arm.shape)
    states = [(0.2, 22.0), (0.35, 22.0), (0.35, 37.0), (0.3, 37.0), (0.3, 22.0), (0.1, 30.0)]
    moments = []
    for curvature, temperature in states:
        answer = respond(law.warmed(temperature - 22.0), bending(curvature), own, memory)
        past, moment = own_fibres(curvature, FLAG, temperature, past, own)
        memory = answer.memory
        moments.append(float(answer.resultants[1]))
        assert moments[-1] == pytest.approx(moment, rel=1e-9)
        assert np.asarray(memory) == pytest.approx(past, abs=1e-12)
    fresh = respond(law, bending(0.3), own, law.rest(own)).resultants[1]
    assert moments[4] < 0.95 * float(fresh)  # cooled and unloading, not loading


def test_a_law_at_another_temperature_is_that_of_the_material_there():
    plain = nf.Superelastic(10_000.0, 3_000.0, 0.028, reference_temperature=22.0)
    for material in (FLAG, plain):
        moved = section_law(material).warmed(15.0)
        made = section_law(replace(material, temperature=37.0))
        for name in set(vars(moved)) - {"temperature"}:
            assert np.asarray(getattr(moved, name)) == pytest.approx(
                np.asarray(getattr(made, name)), rel=1e-15
            )
    assert plain.plateaus == pytest.approx((280.0,))
    assert replace(plain, temperature=37.0).plateaus == pytest.approx((377.5,))
    assert replace(FLAG, temperature=37.0).plateaus == pytest.approx((447.5, 247.5))


def stresses(material, strains):
    """Stresses of a tensile test on the law, strain by strain [MPa]."""
    law, own = section_law(material), section()
    memory = law.rest(own)
    for strain in strains:
        strain, none = np.array(strain), np.array(0.0)
        force = law.sum_fibres(own.fibres, memory, strain, none).force
        memory = law._remember(own.fibres, memory, (strain, none, none, none))
        yield float(force / np.sum(own.fibres.area))


@pytest.mark.parametrize("keys", [{}, {"plateau_modulus": 800.0, "transformation_strain": 0.055}])
def test_a_tensile_test_returns_what_the_data_sheet_says(keys):
    test = nf.TensileTest(upper_plateau=520.0, lower_plateau=230.0, test_temperature=22.0)
    material = test.nitinol(elastic_modulus=48_000.0, **keys)
    up, _, down = stresses(material, (0.03, 0.06, 0.025))
    assert (up, down) == pytest.approx((520.0, 230.0), rel=1e-9)
    assert material.reference_temperature == 22.0


@pytest.mark.parametrize("stresses", [(900.0, 100.0), (100.0, None), (500.0, 100.0)])
def test_impossible_data_sheets(stresses):
    with pytest.raises(nf.InputError, match="no material has an upper_plateau"):
        nf.TensileTest(*stresses).nitinol(elastic_modulus=20_000.0, plateau_modulus=6_000.0)


def test_a_load_moves_the_plateaus_as_by_hand():
    tensions = (0.8, 1.0, 1.2, 1.5)
    moved = WRIST.with_value("material.plateau_stress", WRIST.material.plateau_stress + 97.5)
    by_hand = nf.simulate(moved, [nf.Load(tension) for tension in tensions])
    warm = MEASURED.with_value("material.temperature", 37.0)
    of_robot = nf.simulate(warm, [nf.Load(tension) for tension in tensions])
    loaded = nf.simulate(MEASURED, [nf.Load(each, temperature=37.0) for each in tensions])
    for path in (of_robot, loaded):
        assert path.total_angle == pytest.approx(by_hand.total_angle, abs=1e-12)
        assert path.peak_strain == pytest.approx(by_hand.peak_strain, abs=1e-12)
        assert path.stored_energy == pytest.approx(by_hand.stored_energy, abs=1e-10)
    cold = nf.simulate(MEASURED, [nf.Load(each, temperature=22.0) for each in tensions])
    change = np.degrees(loaded.total_angle - cold.total_angle)
    assert (change < -1.0).all()
    assert change[-1] < -20.0
    assert loaded.prepared is cold.prepared  # another temperature is no other program
    assert len(loaded.prepared.long.programs) == 1


@pytest.mark.parametrize(
    "joint",
    [
        nf.TableNotch(2.0, angle_deg=(5.0, 20.0), moment=(1.0, 3.0), uncut_length=1.0),
        replace(MEASURED.notch[0], repeat=1, material=nf.Linear(200e3, density=7900.0)),
    ],
    ids=["table", "steel"],
)
def test_a_load_warms_nitinol_beside_other_parts(joint):
    """As the robot does at that temperature, alone and among others with other numbers."""
    robot = MEASURED.replace(notch=(joint, *MEASURED.notch))
    warm = nf.Load(tension=1.0, temperature=37.0)
    there = nf.solve(robot.with_value("material.temperature", 37.0), nf.Load(tension=1.0))
    cold = nf.solve(robot, nf.Load(tension=1.0))
    assert np.abs(nf.solve(robot, warm).notch_angle - there.notch_angle).max() < 1e-12
    assert cold.notch_angle[1] - there.notch_angle[1] > np.radians(0.5)
    other = robot.with_value("material.plateau_stress", 300.0)
    rows = nf.solve_batch([robot, other], warm, outputs=("notch_angle",))["notch_angle"]
    assert np.abs(rows[0] - there.notch_angle).max() < 1e-9
    assert np.abs(rows[1] - nf.solve(other, warm).notch_angle).max() < 1e-9


def test_a_load_warms_one_nitinol_only():
    other = replace(MEASURED.material, plateau_stress=300.0)
    robot = MEASURED.replace(
        notch=(replace(MEASURED.notch[0], repeat=1, material=other), *MEASURED.notch)
    )
    with pytest.raises(nf.InputError, match="several of its materials have one"):
        nf.solve(robot, nf.Load(tension=1.0, temperature=37.0))


def test_batches_states_files_and_slopes_know_the_temperature(tmp_path):
    robot = with_memory()
    path = nf.pull(0.0, 1.2, steps=4).release().loaded(temperature=np.linspace(22.0, 36.0, 8))
    whole = nf.simulate(robot, path)
    first = nf.simulate(robot, path[:5])
    rest = nf.simulate(robot, path[5:], from_state=first.state)
    assert np.concatenate([first.total_angle, rest.total_angle]) == pytest.approx(
        whole.total_angle, abs=1e-12
    )
    robots = [robot.with_value("material.temperature", value) for value in (20.0, 22.0, 30.0)]
    rows = nf.simulate_batch(robots, path, outputs=("total_angle",))["total_angle"]
    assert rows == pytest.approx(np.tile(whole.total_angle, (3, 1)), abs=1e-10)
    nf.save_path(whole, tmp_path / "path.parquet")
    again = nf.read_path(tmp_path / "path.parquet")
    assert again.load == whole.load
    assert again.load[7].temperature == 36.0


def test_a_load_of_a_design_has_a_temperature(tmp_path):
    nf.save_robot(MEASURED, tmp_path / "wrist.toml")
    spec = nf.DesignSpec(
        name="warm",
        robot=str(tmp_path / "wrist.toml"),
        variable=[{"value": "notch.depth", "lower": 1.38, "upper": 1.42}],
        load={"pulled": {"tension": 1.0, "temperature": 37.0}},
        objective=[{"quantity": "total_angle", "load": "pulled", "target": 60.0}],
        search={"starts": 1, "candidates": 2},
    )
    state = nf.design(spec).path[-1]
    warm = nf.simulate(state.robot, nf.pull(0.0, 1.0, steps=6).loaded(temperature=37.0))
    assert state.load.temperature == 37.0
    assert state.total_angle == pytest.approx(warm.total_angle[-1], rel=1e-6)


def test_slopes_by_the_temperature_of_the_robot():
    def angle(value, load):
        robot = MEASURED.with_value("material.temperature", value)
        return nf.simulate(robot, load).total_angle

    warm = MEASURED.with_value("material.temperature", 30.0)
    for load in ([nf.Load(0.8), nf.Load(1.2)], [nf.Load(0.8), nf.Load(1.2, temperature=37.0)]):
        slope = nf.simulate(warm, load).jacobian(["material.temperature"], "total_angle")
        differences = (angle(30.01, load) - angle(29.99, load)) / 0.02
        assert np.ravel(slope["total_angle"]) == pytest.approx(differences, rel=1e-5, abs=1e-12)


def test_a_temperature_that_all_loads_replace_does_not_vary():
    warm = MEASURED.with_value("material.temperature", 30.0)
    load, name = [nf.Load(0.8, temperature=37.0)], "material.temperature"
    path = nf.simulate(warm, load)
    refused = pytest.raises(nf.InputError, match="leave `temperature` out of the loads")
    with refused:
        path.jacobian([name], "total_angle")
    with refused:
        path.gradient({"total_angle": 1.0}).by(name)
    with refused:
        nf.differentiable(warm, load, [name])
    with pytest.warns(nf.InputWarning, match="leave `temperature` out of the loads"):
        rows = nf.batch(warm, {name: [22.0, 37.0]}, path.load)["total_angle"]
    assert rows[0] == pytest.approx(rows[1], abs=1e-12)
    # Where the plateaus were measured counts: 1 K more there is 1 K less here.
    reference = path.jacobian("material.reference_temperature", "total_angle")["total_angle"]
    alone = nf.simulate(MEASURED.with_value(name, 37.0), [nf.Load(0.8)])
    slope = alone.jacobian(name, "total_angle")["total_angle"]
    assert slope[0, 0] < -1e-3
    assert reference == pytest.approx(-slope, rel=1e-9)


def test_what_is_refused_and_what_is_warned_of():
    with pytest.raises(nf.InputError, match="reference_temperature"):
        nf.solve(WRIST, nf.Load(1.0, temperature=37.0))
    with pytest.raises(nf.InputError, match="spring back"):
        nf.solve(with_memory(), nf.Load(1.0, temperature=0.0))
    with pytest.raises(nf.InputError, match="reference_temperature"):
        replace(WRIST.material, temperature=37.0)
    with pytest.raises(nf.InputError, match="2 temperatures for 3 steps"):
        nf.pull(0.0, 1.0, steps=3).loaded(temperature=[22.0, 37.0])
    with pytest.raises(nf.InputError, match="at most 200 deg C"):
        replace(MEASURED.material, temperature=310.0)
    finish = MEASURED.with_value("material.austenite_finish", 15.0)
    with pytest.warns(nf.InputWarning, match="below the austenite finish"):
        nf.solve(finish, nf.Load(1.0, temperature=10.0))
    with pytest.warns(nf.InputWarning, match="below the austenite finish"):
        finish.with_value("material.temperature", 10.0)
    own = replace(finish.notch[0], material=finish.material, repeat=2)
    sections = MEASURED.replace(notch=[finish.notch[0], own])
    first = finish.notch[0].repeat + 1
    with pytest.warns(nf.InputWarning, match=rf"notch\[{first}\].material.temperature` is 10"):
        sections.with_value(f"notch[{first}].material.temperature", 10.0)
    carried = MEASURED.replace(
        material=nf.Linear(200e3, density=MEASURED.material.density), notch=[replace(own, repeat=5)]
    )
    with pytest.warns(nf.InputWarning, match="`temperature` is 10 deg C, below the austenite"):
        nf.solve(carried, nf.Load(1.0, temperature=10.0))
