"""At a kink derivatives are those of one side, and that is told."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.tangent import kinks
from notchflex.errors import ErrorCode
from notchflex.solver.programs.compiled import Native
from refusals import refused

ARC = nf.ArcNotch("on-axis", depth=1.40, height=0.8, uncut_length=1.2, repeat=2)
# Of the form of wrist A, whose programs others need too; linear up to 0.9 N.
TWO = nf.load_robot("pacheco2021-a").replace(
    name="two notches", notch=(ARC,), tendon=(nf.Tendon(0.70),), friction=nf.Capstan(0.2)
)
TENSION = (0.4, 0.8, 0.8, 0.6)
LOADS = [nf.Load(tension=value) for value in TENSION]
USUAL = ("total_angle", "tip_position")


def test_contacts_that_nothing_moved_are_at_a_switch():
    found = kinks(nf.simulate(TWO, LOADS))
    assert {(one.step, one.kind, one.tendon) for one in found} == {(2, "contact", 1)}
    assert [one.index for one in found] == [1, 2, 3]
    assert max(one.distance for one in found) < 1e-12


def test_a_notch_about_to_close():
    wrist = nf.load_robot("pacheco2021-a")
    closing = nf.closing(wrist).tension[0]
    path = nf.simulate(wrist, [nf.Load(tension=closing * part) for part in (0.5, 1 - 1e-9, 1.05)])
    found = kinks(path)
    assert [(one.step, one.kind, one.index, one.tendon) for one in found] == [(1, "notch", 1, None)]
    assert 0.0 < found[0].distance < 1e-8


def test_away_from_switches_there_is_none():
    assert kinks(nf.simulate(TWO, LOADS[:2])) == []
    frictionless = TWO.replace(friction=nf.Frictionless())
    assert kinks(nf.simulate(frictionless, LOADS)) == []


def test_both_sides_of_a_kink_and_the_one_that_jax_gives():
    bend = nf.differentiable(TWO, LOADS, ["tension"], outputs=(*USUAL, "converged"))
    assert {one.step for one in bend.kinks()} == {2}
    slopes = jax.jacfwd(lambda values: bend(values)["total_angle"])(bend.start)["tension"][..., 0]
    for load in range(4):
        direction = {"tension": jnp.zeros((4, 1)).at[load].set(1.0)}
        below, above = (side["total_angle"] for side in bend.one_sided(direction))
        own = np.asarray(slopes[:, load])
        smooth = np.abs(below - above) < 1e-6
        assert smooth.tolist() == [True, True, load not in (1, 2), True]
        nearest = np.where(np.abs(own - below) < np.abs(own - above), below, above)
        assert own == pytest.approx(nearest, abs=1e-6)


@pytest.mark.nightly
def test_the_slopes_of_a_tip_tell_their_kinks():
    found = nf.tip_response(TWO, LOADS[1:3])
    assert {(one.step, one.kind) for one in found.kinks} == {(1, "contact")}


def test_a_direction_that_changes_nothing_is_refused():
    bend = nf.differentiable(TWO, LOADS[:1], ["tension"])
    with refused(ErrorCode.NO_DATA):
        bend.one_sided({"tension": 0.0})


def test_robots_of_one_form_share_a_program():
    """Every call of `differentiable` compiled a program of its own."""
    first = nf.differentiable(TWO, LOADS[:2], ["notch.depth"])
    first()
    jax.grad(lambda values: first(values)["total_angle"][-1])(first.start)
    before = len(Native.programs)
    other = TWO.with_values({"notch.depth": 1.3, "friction.coefficient": 0.1})
    loads = [nf.Load(tension=value) for value in (0.3, 0.7, 0.9)]  # also with more steps
    second = nf.differentiable(
        other,
        loads,
        ["material.elastic_modulus"],
        settings=nf.Settings(max_iterations=50),
    )
    angle = second()["total_angle"]
    jax.grad(lambda values: second(values)["total_angle"][-1])(second.start)
    assert len(Native.programs) == before
    expected = nf.simulate(other, loads).total_angle
    assert np.asarray(angle) == pytest.approx(expected, rel=1e-11)
