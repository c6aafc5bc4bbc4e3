"""Strain cycles against our own sums over fibres, limit lines, loops until strains repeat."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from notchflex.fatigue import cycle_columns, cycle_document

WRIST = nf.load_robot("pacheco2021-a-true").with_value("fatigue.line", "cao2020")
MODULUS = WRIST.material.elastic_modulus


class OwnNotch:
    """A notch by the equations of `mechanics/material/law.py` and a play operator of our own."""

    def __init__(self, path, notch, unloading=None):
        chain = path.chain
        section = chain.rods.section
        number = notch, 0
        self.ends = {name: getattr(section.ends, name)[number] for name in vars(section.ends)}
        self.arm, self.area = section.fibres.arm[number], section.fibres.area[number]
        self.rigidity = MODULUS * section.second_moment_weak[number]
        self.length = float(np.sum(chain.rods.length[notch]))
        outer, angle = section.outer_radius[number], section.half_angle[number]
        middle = section.edge_spine[number] - outer
        # The corners of the cut, the ends of the arc, and its middle: arms of the fibres.
        self.places = np.array([-section.edge_near[number], middle + outer * np.cos(angle)])
        self.places = np.append(self.places, section.edge_spine[number])
        hard = 1.0 - WRIST.material.plateau_modulus / MODULUS
        load = WRIST.material.plateau_stress / MODULUS
        unload = load if unloading is None else unloading / MODULUS
        self.bounds = hard, load, unload
        self.past = np.zeros_like(self.arm)

    def transformed(self, strain):
        hard, load, unload = self.bounds
        least = hard * (np.maximum(strain - load, 0.0) - np.maximum(-strain - unload, 0.0))
        most = hard * (np.maximum(strain - unload, 0.0) - np.maximum(-strain - load, 0.0))
        return np.clip(self.past, least, most)

    def axis(self, curvature):
        """The strain of the neutral axis, at which the axial force vanishes."""

        def force(axial):
            strain = axial + curvature * self.arm
            return self.area @ (strain - self.transformed(strain))

        return brentq(force, -0.2, 0.2, xtol=1e-16, rtol=1e-15)

    def strains(self, angle):
        """Bend the notch by an angle; return the strains at its places."""
        kappa, w, a = angle / self.length, self.ends["weak"], self.ends["warped"]
        shape = 1.0 + self.ends["odd"] * kappa + self.ends["even"] * kappa**2
        share = self.ends["material_share"] * w

        def beyond(curvature):
            strain = self.axis(curvature) + curvature * self.arm
            moment = MODULUS * self.area @ ((strain - self.transformed(strain)) * self.arm)
            elastic = moment / self.rigidity
            bend = kappa * (1.0 - a * (1.0 + w) * elastic) / shape / (1.0 - kappa * a / shape)
            return (1.0 + share) * curvature + (w - share) * elastic - bend

        most = 1.5 * abs(kappa) + 1e-6
        curvature = brentq(beyond, -most, most, xtol=1e-16, rtol=1e-15)
        axial = self.axis(curvature)
        self.past = self.transformed(axial + curvature * self.arm)
        return axial + curvature * self.places


def own_strains(path, notch, unloading=None):
    own = OwnNotch(path, notch, unloading)
    free = np.radians(WRIST.notch[0].precurvature_deg)
    return np.array([own.strains(angle - free) for angle in path.notch_angle[:, notch]])


CORNER, ARC_END, SPINE = 33 + 7, 0, 16
"""The places of `OwnNotch` among the points."""


@pytest.mark.parametrize("unloading", [None, 120.0])
def test_mean_and_amplitude_are_those_of_our_own_fibres(unloading):
    robot = WRIST.replace(material=replace(WRIST.material, unloading_stress=unloading))
    path = nf.simulate(robot, nf.pull(0.2, 1.25, steps=4).release())
    cycle = nf.strain_cycle(path)
    loop = nf.simulate(robot, path.load, from_state=path.state)
    for notch in (0, 3):
        own = OwnNotch(path, notch, unloading)
        free = np.radians(WRIST.notch[0].precurvature_deg)
        angles = np.concatenate([path.notch_angle[:, notch], loop.notch_angle[:, notch]]) - free
        last = np.array([own.strains(angle) for angle in angles])[len(path) :]
        mean, amplitude = 0.5 * (last.max(0) + last.min(0)), 0.5 * np.ptp(last, axis=0)
        points = [CORNER, ARC_END, SPINE]
        assert cycle.mean[notch, 0, points] == pytest.approx(mean, abs=1e-9)
        assert cycle.amplitude[notch, 0, points] == pytest.approx(amplitude, abs=1e-9)
        peak = np.abs(last).max()
        assert loop.peak_strain[:, notch].max() == pytest.approx(peak, abs=1e-9)
    assert cycle.reason == ""


def own_limit(mean):
    """The line of Cao 2020."""
    return np.interp(mean, [0.0, 0.03, 0.07], [0.0055, 0.0016, 0.0016], right=np.nan)


def at_angle(angle_deg):
    """The state of the wrist at a total angle, while it is loaded."""

    def beyond(tension):
        return float(np.degrees(nf.solve(WRIST, nf.Load(tension)).total_angle)) - angle_deg

    return nf.solve(WRIST, nf.Load(brentq(beyond, 0.0, 1.6, xtol=1e-10)))


@pytest.mark.parametrize("begin", [11.4592, 60.0, 90.0])
def test_the_duty_cycle_that_stays_under_the_line_is_that_of_our_own_fibres(begin):
    first = at_angle(begin) if begin > 12.0 else nf.solve(WRIST, nf.Load(0.0))

    def margin(angle):
        return nf.strain_cycle([first, at_angle(angle)]).smallest_margin.min()

    last = brentq(margin, begin + 0.5, begin + 30.0 if begin < 12.0 else begin + 15.0, xtol=1e-4)
    state = at_angle(last)
    both = np.array(
        [
            [own_strains(one.path[one.step : one.step + 1], notch)[0] for notch in range(5)]
            for one in (first, state)
        ]
    )
    mean, amplitude = np.abs(both.mean(axis=0)), 0.5 * np.abs(both[1] - both[0])
    assert np.min(own_limit(mean) - amplitude) == pytest.approx(0.0, abs=1e-6)


def test_the_margin_of_a_state_is_that_of_its_cycle_with_rest():
    states = [nf.solve(WRIST, nf.Load(tension)) for tension in (0.0, 0.6, 1.1)]
    for state in states[1:]:
        cycle = nf.strain_cycle([states[0], state])
        assert cycle.smallest_margin == pytest.approx(state.fatigue_margin, abs=1e-12)


def test_bent_sideways_a_cycle_sees_both_signs():
    load = nf.LoadPath([[0.6], [0.6]]).loaded()
    sides = [nf.Load(0.6, tip_force=(0.0, side, 0.0)) for side in (0.05, -0.05)]
    path = nf.simulate(WRIST, sides)
    cycle = nf.strain_cycle(path)
    still = nf.strain_cycle(nf.simulate(WRIST, load))
    left, right = cycle.mean[:, 0, CORNER], cycle.mean[:, 0, CORNER + 8]
    assert cycle.amplitude[:, 0, CORNER].max() > 1e-4 > still.amplitude.max()
    # The plane of the wrist mirrors one side to the other.
    assert left == pytest.approx(right, abs=1e-9)
    largest = np.abs(cycle.mean) + cycle.amplitude
    assert largest.max(axis=(1, 2)) == pytest.approx(path.peak_strain.max(axis=0), rel=1e-3)


@pytest.mark.parametrize("others", [(), (nf.RodGap(4.0, 0.8, uncut_length=0.5),)])
@pytest.mark.parametrize("side", [(0.05, 0.0, 0.0), (0.0, 0.05, 0.0)])
def test_states_under_the_tendon_alone_and_under_loads_have_a_cycle(others, side):
    robot = WRIST.replace(notch=(*others, *WRIST.notch))
    alone, loaded = nf.solve(robot, nf.Load(0.6)), nf.solve(robot, nf.Load(0.6, tip_force=side))
    still = nf.solve(robot, nf.Load(0.6, tip_force=tuple(1e-12 * force for force in side)))
    cycle, expected = nf.strain_cycle([alone, loaded]), nf.strain_cycle([still, loaded])
    assert cycle.mean == pytest.approx(expected.mean, abs=1e-9)
    assert cycle.amplitude == pytest.approx(expected.amplitude, abs=1e-9)
    assert expected.amplitude[-1].max() > 1e-4
    finer = nf.solve(robot, nf.Load(0.6), refinement=1)
    with pytest.raises(nf.InputError, match="refinement"):
        nf.strain_cycle([finer, loaded])


def test_corner_factor_and_lines_of_ones_own():
    path = nf.simulate(WRIST, nf.pull(0.0, 0.4, steps=3).release())
    plain = nf.strain_cycle(path)
    sharp = nf.strain_cycle(path, limit=nf.Fatigue(line="cao2020", corner_factor=2.0))
    corner = 0, 0, CORNER
    mean, amplitude = 2.0 * abs(plain.mean[corner]), 2.0 * plain.amplitude[corner]
    assert sharp.margin[corner] == pytest.approx(own_limit(mean) - amplitude, abs=1e-12)
    assert sharp.margin[0, 0, SPINE] == plain.margin[0, 0, SPINE]
    same = nf.Fatigue(mean=(0.0, 0.03, 0.07), amplitude=(0.0055, 0.0016, 0.0016))
    assert nf.strain_cycle(path, limit=same).margin == pytest.approx(plain.margin, abs=1e-15)
    assert any("left out" in sentence for sentence in plain.warnings())
    assert not any("left out" in sentence for sentence in sharp.warnings())


def test_where_the_line_is_not_known_there_is_no_margin():
    path = nf.simulate(WRIST, nf.pull(0.0, 1.3, steps=5).release())
    cycle = nf.strain_cycle(path, limit=nf.Fatigue(line="pelton2003"))
    assert np.isnan(cycle.smallest_margin).any()
    assert any("0 to 1.5 %" in sentence for sentence in cycle.warnings())
    none = nf.strain_cycle(path, limit=nf.Fatigue())
    assert np.isnan(none.margin).all()
    assert any("no limit line" in sentence for sentence in none.warnings())
    assert "nan" not in repr(cycle)


def test_a_step_that_fails_is_told():
    path = nf.simulate(WRIST, nf.stroke_path(0.0, 30.0, steps=2))
    assert not path.converged.all()
    cycle = nf.strain_cycle(path)
    assert cycle.reason
    assert np.isnan(cycle.smallest_margin).all()


def test_tables_and_documents():
    cycle = nf.strain_cycle(nf.simulate(WRIST, nf.pull(0.0, 0.4, steps=3).release()))
    columns = cycle_columns(cycle)
    assert len({len(values) for values in columns.values()}) == 1
    worst = columns["margin"][columns["notch"] == 1].min()
    document = cycle_document(cycle)
    assert document["notches"][0]["margin_%"] == pytest.approx(100.0 * worst)
    assert document["limit"]["cycles"] == 4e8


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"line": "cao2020", "mean": (0.0, 1e-2), "amplitude": (1e-3, 1e-3)}, "own `mean`"),
        ({"mean": (0.0, 0.01)}, "one number for each"),
        ({"mean": (0.01, 0.0), "amplitude": (1e-3, 1e-3)}, "must rise"),
        ({"line": "cao2021"}, "cao2020"),
        ({"corner_factor": 0.5}, "at least 1"),
    ],
)
def test_lines_that_are_refused(keys, words):
    with pytest.raises(nf.InputError, match=words):
        nf.Fatigue(**keys)


def test_a_cycle_needs_two_states_of_one_robot():
    state = nf.solve(WRIST, nf.Load(0.5))
    with pytest.raises(nf.InputError, match="two solved states"):
        nf.strain_cycle([state])
    with pytest.raises(nf.InputError, match="one state is no cycle"):
        nf.strain_cycle(state.path)
    other = nf.solve(WRIST.with_value("notch.depth", 1.39), nf.Load(0.5))
    with pytest.raises(nf.InputError, match="different robots"):
        nf.strain_cycle([state, other])


MEASURED = WRIST.with_value("material.reference_temperature", 22.0)


@pytest.mark.parametrize(
    ("robot", "temperatures", "words"),
    [
        (MEASURED, (None,), "at 22 deg C, and the limit line is for 37"),
        (MEASURED, (37.0,), ""),
        (MEASURED, (37.0, 30.0), "at 30 and 37 deg C"),
        (MEASURED.with_value("material.temperature", 37.0), (None,), ""),
        (
            WRIST.replace(notch=[replace(WRIST.notch[0], material=MEASURED.material)]),
            (None,),
            "at 22 deg C",
        ),
        (WRIST, (None,), ""),
    ],
)
def test_the_temperature_of_sections_and_loads_is_compared_with_that_of_the_line(
    robot, temperatures, words
):
    loads = [nf.Load(0.1, temperature=one) for one in (*temperatures, temperatures[0])]
    sentences = [s for s in nf.strain_cycle(nf.simulate(robot, loads)).warnings() if "deg C" in s]
    assert [words in sentence for sentence in sentences] == [True] * bool(words)


def test_round_backbones_have_no_corners_and_tables_no_strain():
    rods = nf.RodGap(3.0, 0.8, uncut_length=0.5, repeat=2)
    table = nf.TableNotch(2.0, angle_deg=(5.0, 20.0), moment=(1.0, 3.0), uncut_length=1.0)
    tendon = [replace(WRIST.tendon[0], end_body=None, path="straight")]
    notch = [rods, table, replace(WRIST.notch[0], repeat=1)]
    robot = WRIST.replace(notch=notch, tendon=tendon)
    path = nf.simulate(robot, nf.pull(0.0, 0.1, steps=2).release())
    plain = nf.strain_cycle(path, limit=nf.Fatigue(line="cao2020"))
    for corner in ({"corner_factor": 3.0}, {"corner_radius": 0.05}):
        cycle = nf.strain_cycle(path, limit=nf.Fatigue(line="cao2020", **corner))
        assert cycle.corner_factor[:2].tolist() == [1.0, 1.0]
        assert cycle.margin[:2] == pytest.approx(plain.margin[:2], abs=0.0)
        assert cycle.smallest_margin[3] < plain.smallest_margin[3]
        known = robot.replace(fatigue=cycle.limit)
        margin = nf.solve(known, nf.Load(0.1)).fatigue_margin
        assert np.isfinite(margin).tolist() == [True, True, False, True]
    assert cycle.to_table()["at"][:2] == ["surface", "surface"]
    sentences = plain.warnings()
    assert next(s for s in sentences if "known strain" in s).endswith("have no margin: 3.")
    assert not any("mean strains of" in sentence for sentence in sentences)
    alone = nf.simulate(
        WRIST.replace(notch=[rods], tendon=tendon), nf.pull(0.0, 0.1, steps=2).release()
    )
    assert nf.strain_cycle(alone, limit=nf.Fatigue(line="cao2020")).warnings() == []
