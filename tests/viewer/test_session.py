"""The model of the page: sliders make loads, loads make states, states remember."""

import csv
import io
from math import degrees

import numpy as np
import pytest

import notchflex as nf
from notchflex.viewer import Controls, Session
from notchflex.viewer.controls import reach_of
from notchflex.viewer.saving import table_bytes
from notchflex.viewer.session import hysteresis, kinds, numbers, with_kind
from robots import ready


def pulled(session, *tensions):
    """Angles after tensions of the first tendon, in rad."""
    goals = [session.controls.with_tendon(0, "tension", tension) for tension in tensions]
    angles = []
    for goal in goals:
        session.go(goal)
        angles.append(float(session.state.total_angle))
    return angles


def test_controls_are_the_load_that_a_person_would_write():
    controls = Controls(("tension", "stroke"), (1.0, 0.5), (0.0, 0.1, 0.0), 20.0, "sideways")
    assert controls.load() == nf.Load(
        tension=(1.0, None),
        stroke=(None, 0.5),
        tip_force=(0.0, 0.1, 0.0),
        tip_mass=20.0,
        base_rotation=(0.0, -np.pi / 2, 0.0),
    )
    assert controls.with_numbers(controls.numbers) == controls


def test_the_session_goes_where_simulate_goes():
    session = Session(ready("A"))
    up = [0.5, 1.0, 1.5]
    found = pulled(session, *up, *up[::-1])
    path = nf.simulate(ready("A"), nf.pull(0.5, 1.5, steps=3).release())
    assert found == pytest.approx(path.total_angle.tolist(), abs=1e-12)


def test_a_slider_that_goes_back_leaves_hysteresis_and_reset_takes_it_away():
    session = Session(ready("A"))
    first, _, back = pulled(session, 1.0, 2.0, 1.0)
    assert degrees(back - first) > 10.0  # 51.5 and about 79 deg
    tension, angle = hysteresis(session.history, 0).T
    assert tension.tolist() == [0.0, 1.0, 2.0, 1.0]
    assert angle[[1, 3]] == pytest.approx([first, back])
    session.reset()
    assert len(session.history) == 1
    assert pulled(session, 1.0) == pytest.approx([first], abs=1e-12)


def test_a_load_that_does_not_converge_changes_nothing():
    session = Session(ready("A"))
    pulled(session, 1.0)
    controls, solved, count = session.controls, session.solved, len(session.history)
    reason = session.go(controls.with_tendon(0, "stroke", 20.0))  # every notch closes before
    assert "closed" in reason
    assert session.state.tension == pytest.approx([1.0])
    assert session.controls is controls
    assert session.solved is solved
    assert len(session.history) == count
    # and it goes on from there, with the friction of before
    again = Session(ready("A"))
    assert pulled(session, 0.8) == pytest.approx(pulled(again, 1.0, 0.8)[1:], abs=1e-12)


def test_another_friction_does_the_same_again_beside_the_loop_before():
    session = Session(ready("A"))
    before = pulled(session, 1.0, 1.8, 1.0)
    session.change(ready("A").with_value("friction.kind", "frictionless"))
    assert [step.total_angle for step in session.before[1:]] == pytest.approx(before)
    angle = [step.total_angle for step in session.history]
    assert angle[1] == pytest.approx(angle[3], abs=1e-9)  # no friction, no hysteresis
    assert angle[1] > before[0]
    again = [step.controls for step in session.history]
    assert again == [step.controls for step in session.before]


def test_a_tube_that_points_elsewhere_feels_its_weight_otherwise():
    session = Session(ready("A"))
    goal = session.controls.with_tendon(0, "tension", 0.5)
    session.go(goal)
    up = session.state.tip_position
    session.change(pointing="sideways")
    assert session.state.tip_position == pytest.approx([-up[2], up[1], up[0]], abs=1e-9)
    light = float(session.state.total_angle)
    session.go(session.controls.with_numbers([0.5, 0.0, 0.0, 0.0, 5.0]))
    assert float(session.state.total_angle) < light - 0.05  # 5 g pull it down again


def test_the_table_holds_every_step():
    session = Session(ready("A"))
    angles = pulled(session, 0.6, 1.2, 0.6)
    rows = list(csv.DictReader(io.StringIO(table_bytes(session).decode())))
    assert [float(row["tendon_force_N"]) for row in rows] == pytest.approx([0.0, 0.6, 1.2, 0.6])
    told = [float(row["total_deg"]) for row in rows[1:]]
    assert told == pytest.approx([degrees(angle) for angle in angles], abs=1e-9)


@pytest.mark.parametrize("section", ["friction", "material"])
@pytest.mark.parametrize("name", ["pacheco2021-a", "gao2017", "liu2022"])
def test_every_kind_can_be_put_in_and_taken_out(section, name):
    robot = nf.load_robot(name)
    for kind in kinds(section):
        changed = with_kind(robot, section, kind, robot)
        assert getattr(changed, section).kind == kind
        own = getattr(robot, section).kind
        assert with_kind(changed, section, own, robot) == robot


def test_numbers_are_those_of_the_file():
    found = {one.key: one for one in numbers(ready("A"), "material")}
    assert found["superelastic_modulus"].value == 3000.0
    assert found["superelastic_modulus"].unit == "MPa"
    assert [one.value for one in numbers(ready("A"), "friction")] == [0.13]


def test_a_robot_that_cannot_be_solved_leaves_the_one_before(monkeypatch):
    session = Session(ready("A"))
    pulled(session, 0.5, 1.0)
    before = dict(session.__dict__)
    go = Session.go
    refusal = nf.InputError("no such robot")

    def refuse(self, controls):
        if controls.value[0] == 1.0 and self is not session:
            raise refusal
        return go(self, controls)

    monkeypatch.setattr(Session, "go", refuse)
    with pytest.raises(nf.InputError) as problem:
        session.change(ready("A").with_value("friction.coefficient", 0.2))
    assert problem.value is refusal
    assert session.__dict__ == before


def test_doing_all_again_can_be_stopped():
    session = Session(ready("A"))
    angles = pulled(session, 0.2, 0.4, 0.6)
    reason = session.change(
        ready("A").with_value("friction.coefficient", 0.1), go_on=lambda done, _: done < 3
    )
    assert "stopped after step 3 of 4" in reason
    assert session.controls.value == (0.4,)
    assert angles[1] < float(session.state.total_angle) < angles[2]
    assert session.change(ready("A"), go_on=lambda *_: True) == ""


@pytest.mark.parametrize("name", ["pacheco2021-a", "gao2017", "liu2022", "two-axis-wrist"])
def test_sliders_end_where_the_robot_is_well_bent_and_by_stroke_at_the_same_place(name):
    robot = nf.load_robot(name)
    reach = reach_of(robot)
    state = nf.solve(robot, nf.Load(tension=reach.tension[0]))
    assert state.converged
    assert degrees(np.abs(state.notch_angle).sum()) > 60.0
    assert reach.stroke[0] == pytest.approx(float(state.stroke[0]), rel=0.01)
    assert reach.stroke[0] <= float(state.stroke[0])


def test_the_stroke_of_wrist_a_ends_where_it_is_closed():
    assert reach_of(ready("A")).stroke[0] == pytest.approx(3.7, abs=0.05)
    state = nf.solve(ready("A"), nf.Load(stroke=reach_of(ready("A")).stroke[0]))
    assert state.converged


def test_steps_and_ends_of_every_number():
    reach = reach_of(nf.load_robot("two-axis-wrist"))
    count = len(reach.tension)
    assert reach.ends(0, "tension") == (0.0, reach.tension[0])
    assert reach.ends(1, "stroke") == (-reach.stroke[1], reach.stroke[1])  # let out as well
    assert reach.ends(count, "") == (-reach.force, reach.force)
    assert reach.ends(count + 3, "") == (0.0, reach.mass)
    by = ("stroke",) + ("tension",) * (count - 1)
    assert 60.0 * reach.stride(by)[:2] == pytest.approx([reach.stroke[0], reach.tension[1]])
    assert reach.stretched(1, "tension", 9.0).tension[1] == 9.0
