"""What the solver promises beside numbers: reasons, states, stability, no recompilation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from notchflex.solver.programs.compiled import Native
from refusals import refused


def test_failure_is_data_with_the_last_good_state(wrist: nf.Robot) -> None:
    load = nf.stroke_path(3.0, 4.2, steps=3)
    path = nf.simulate(wrist, load)
    assert path.converged.tolist() == [True, True, False]
    assert "every notch closed" in path.reason[2]
    assert path.stroke[2, 0] == pytest.approx(3.70598716, abs=1e-3)
    assert np.isfinite(path.tip_position).all()
    with pytest.raises(nf.ConvergenceError, match="step 3 of 3: every notch closed"):
        path.raise_if_failed()


def test_an_elastic_tendon_can_be_drawn_on_when_all_is_closed(wrist: nf.Robot) -> None:
    robot = wrist.with_value("tendon.axial_stiffness", 500.0)
    state = nf.solve(robot, nf.Load(stroke=4.5)).raise_if_failed()
    assert state.closed.all()
    assert state.stroke[0] == pytest.approx(4.5, abs=1e-12)
    spans = np.array([0.0, *np.tile([0.8, 1.2], 5)])
    tension = np.append(state.span_tension[0], state.span_tension[0, -1])
    stretch = (tension * spans).sum() / 500.0
    assert stretch == pytest.approx(4.5 - 3.705987158, abs=1e-8)


def test_a_slack_tendon_does_not_push(wrist: nf.Robot) -> None:
    path = nf.simulate(wrist, nf.LoadPath([[np.nan]] * 3, [[-1.0], [0.5], [-0.2]]))
    np.testing.assert_allclose(path.tension[[0, 2]], 0.0, atol=1e-12)
    assert path.tension[1, 0] > 0.2
    np.testing.assert_allclose(path.total_angle[[0, 2]], 0.0, atol=1e-9)


def test_a_state_of_another_robot_is_refused(wrist: nf.Robot, tmp_path: Path) -> None:
    state = nf.solve(wrist, nf.Load(tension=1.0)).state
    other = nf.load_robot("pacheco2021-c")
    with refused("STATE_OF_ANOTHER_ROBOT", "wrist A", "wrist C"):
        nf.solve(other, nf.Load(tension=1.0), from_state=state)
    state.save(tmp_path / "state.json")
    with refused("STATE_OF_ANOTHER_ROBOT"):
        nf.solve(other, nf.Load(tension=1.0), from_state=nf.State.load(tmp_path / "state.json"))
    with refused("FILE_NOT_FOUND", "none.json"):
        nf.State.load(tmp_path / "none.json")
    (tmp_path / "text.json").write_text("no state")
    with refused("FILE_UNREADABLE", "text.json"):
        nf.State.load(tmp_path / "text.json")


def test_solve_each_is_solve_of_each(wrist: nf.Robot) -> None:
    tensions = [2.0, 0.3, 1.1]
    each = nf.solve_each(wrist, [nf.Load(tension=value) for value in tensions])
    alone = [nf.solve(wrist, nf.Load(tension=value)) for value in tensions]
    np.testing.assert_allclose(each.notch_angle, [state.notch_angle for state in alone], atol=1e-11)


def test_wrists_under_tension_are_stable(wrist: nf.Robot) -> None:
    path = nf.simulate(wrist, nf.pull(0.0, 3.0, steps=13).release())
    assert path.stable.all()
    # One notch alone: the stiffness is E I / h on the linear branch.
    one = wrist.replace(
        notch=(wrist.notches[0],), tendon=(nf.Tendon(0.70),), friction=nf.Frictionless()
    )
    state = nf.solve(one, nf.Load(tension=0.5))
    assert state.smallest_eigenvalue == pytest.approx(10000.0 * 5.816412685e-4 / 0.8, rel=1e-9)


def test_a_new_load_or_robot_of_the_same_shape_needs_no_new_program(wrist: nf.Robot) -> None:
    nf.simulate(wrist, nf.pull(0.0, 1.0, steps=5))
    nf.simulate(wrist, nf.stroke_path(0.0, 1.0, steps=5))  # strokes are a program of their own
    programs = set(Native.programs)
    nf.simulate(wrist, nf.pull(0.0, 2.0, steps=17).release())
    nf.simulate(nf.load_robot("pacheco2021-b-specimen"), nf.stroke_path(0.0, 1.0, steps=40))
    nf.simulate(wrist.with_value("notch[2].depth", 1.3), nf.pull(0.0, 2.0, steps=3))
    for notches in (1, 4, 7):
        shorter = wrist.replace(notch=wrist.notches[:1] * notches, tendon=(nf.Tendon(0.7),))
        assert nf.solve(shorter, nf.Load(tension=0.5)).converged
    assert set(Native.programs) <= programs


@pytest.mark.nightly
def test_wrists_of_one_to_forty_notches_share_four_programs(wrist: nf.Robot) -> None:
    programs = set()
    for notches in (1, 7, 8, 24, 40):
        longer = wrist.replace(notch=wrist.notches[:1] * notches, tendon=(nf.Tendon(0.7),))
        state = nf.solve(longer, nf.Load(tension=0.3)).raise_if_failed()
        programs.add(state.path.prepared.long.static_structure)
        if notches in (8, 40):  # against a program without added flexures, compiled for each
            alone = nf.solve_batch(longer, [nf.Load(tension=0.3)])
            assert state.total_angle == pytest.approx(alone["total_angle"][0], abs=1e-12)
    assert len(programs) <= 4


@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")
def test_huge_and_tiny_loads(wrist: nf.Robot) -> None:
    path = nf.solve_each(wrist, [nf.Load(tension=value) for value in (1e-9, 1e-3, 1e3, 1e6)])
    assert path.converged.all()
    arm, lip = 1.3865332868, 1.4965332868
    moment = path.span_tension[:, 0, 1::2] * arm - path.contact_force * lip
    error = np.abs(path.notch_moment - moment) / path.tension
    assert error.max() < 1e-9  # the levers above have ten digits


def test_kinematic_model_tells_the_stroke_it_loses(wrist: nf.Robot) -> None:
    shared = nf.equal_stroke(wrist, np.array([1.0, 3.705, 4.5]))
    np.testing.assert_allclose(shared.stroke_lost, [0.0, 0.0, 4.5 - 3.705987158], atol=1e-8)
    np.testing.assert_allclose(shared.notch_angle[2], nf.closing(wrist).angle)
    with refused("NOT_FINITE", "stroke"):
        nf.equal_stroke(wrist, np.array([np.nan]))


@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # 162 mm wide
@pytest.mark.parametrize("scale", [0.1, 100.0])
def test_a_robot_of_another_size_bends_alike(wrist: nf.Robot, scale: float) -> None:
    scaled = nf.Robot(
        name="scaled",
        tube=nf.Tube(1.62 * scale, 1.40 * scale),
        notch=(
            nf.ArcNotch("on-axis", 1.4 * scale, 0.8 * scale, uncut_length=1.2 * scale, repeat=5),
        ),
        tendon=(nf.Tendon(0.70 * scale),),
        material=wrist.material,
        friction=wrist.friction,
    )
    path = nf.simulate(wrist, nf.stroke_path(0.0, 3.6).release())
    other = nf.simulate(scaled, nf.stroke_path(0.0, 3.6 * scale).release()).raise_if_failed()
    np.testing.assert_allclose(other.notch_angle, path.notch_angle, atol=1e-9)
    np.testing.assert_allclose(other.tension, path.tension * scale**2, rtol=1e-8, atol=1e-9)


def test_a_stroke_far_too_long_says_so(wrist: nf.Robot) -> None:
    with pytest.warns(nf.InputWarning, match="`stroke`"):
        assert "every notch closed" in nf.solve(wrist, nf.Load(stroke=1e6)).reason
    assert "every notch closed" in nf.solve(wrist, nf.Load(stroke=3.707)).reason


def test_a_tendon_without_lever_is_not_converged_in_silence(wrist: nf.Robot) -> None:
    robot = wrist.replace(tendon=(nf.Tendon(0.6865332867926, 180.0),))
    state = nf.solve(robot, nf.Load(stroke=1.0))
    assert not state.converged
    assert state.reason


def test_the_base_stretches_too(wrist: nf.Robot) -> None:
    robot = wrist.with_value("tendon.axial_stiffness", 50.0)
    short = nf.solve(robot, nf.Load(tension=1.0))
    long = nf.solve(robot.with_value("tube.base_length", 300.0), nf.Load(tension=1.0))
    assert long.stroke[0] - short.stroke[0] == pytest.approx(300.0 / 50.0, rel=1e-12)


def test_precurvature_past_closing_is_refused(wrist: nf.Robot) -> None:
    with refused("INVALID_ROBOT", "`notch[1].precurvature_deg`", "30.63 deg"):
        nf.solve(wrist.with_value("notch.precurvature_deg", 40.0), nf.Load(tension=1.0))


@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # 100 MPa
def test_a_notch_that_would_pass_through_itself_is_no_answer():
    # Draw 1191 of seed 5 of benchmarks/robustness.py in short: far more load than a notch can bear
    # where nothing closes it.
    robot = nf.Robot(
        name="soft",
        tube=nf.Tube(2.0, 1.8),
        notch=(nf.ArcNotch("on-axis", 1.6, 3.0, uncut_length=1.0, repeat=2),),
        tendon=(nf.Tendon(0.9),),
        material=nf.Superelastic(100.0, 100.0, 0.028),
        friction=nf.Capstan(0.0),
    )
    for moment in (20.0, 200.0):
        state = nf.solve(robot, nf.Load(tip_moment=(0.0, -moment, 0.0)))
        assert not state.converged
        assert "half a turn" in state.reason or "equilibrium" in state.reason


def test_a_notch_bent_about_several_axes_at_once_is_not_known():
    # Draw 10066 of seed 5 of benchmarks/robustness.py in short: bent by 105 degrees in one notch,
    # sideways and twisted. Its balance, added up outside the solver, is off by 1e-5.
    robot = nf.Robot(
        name="far",
        tube=nf.Tube(4.516, 2.258, base_length=3.68),
        notch=tuple(
            nf.ArcNotch("on-axis", depth, height, uncut_length=1.351)
            for depth, height in ((3.074, 3.249), (3.247, 3.293), (3.213, 3.285))
        ),
        tendon=(nf.Tendon(0.852),),
        material=nf.Superelastic(18135.0, 6670.0, 0.02509, plastic_strain=0.1),
        friction=nf.Capstan(0.0666, wrap="geometric"),
    )
    tip = {"tip_force": (-83.75, -37.02, 88.01), "tip_moment": (293.8, -956.7, 491.9)}
    body = nf.BodyForce(1, force=(8.696, 25.46, 57.52))
    load = nf.Load(tension=49.06, **tip, following=True, body_forces=[body], tip_mass=12950.0)
    state = nf.solve(robot, load)
    assert not state.converged
    assert "several axes" in state.reason
    assert nf.solve(robot, nf.Load(tension=49.06, tip_force=(-0.5, -0.2, 0.5))).converged
