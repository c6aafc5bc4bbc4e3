"""Two tendons against each other: stroke as an equal of force, elasticity, slack, pretension."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf

STIFF = 4000.0  # N, E A of the elastic cables


@pytest.fixture(scope="module")
def elastic() -> nf.Robot:
    """Liu's robot with two elastic cables."""
    return nf.load_robot("liu2022").with_value("tendon.axial_stiffness", STIFF)


@pytest.fixture(scope="module")
def pretensioned(elastic) -> nf.EquilibriumPath:
    return nf.simulate(elastic, [nf.Load(tension=(3.0, 3.0))]).raise_if_failed()


@pytest.mark.parametrize("stiffness", [np.inf, STIFF])
def test_stroke_finds_the_state_of_the_tension(stiffness, margin) -> None:
    robot = nf.load_robot("liu2022").with_value("tendon.axial_stiffness", float(stiffness))
    by_force = nf.simulate(robot, nf.pull(0.0, 8.0, 5).release()).raise_if_failed()
    strokes = by_force.stroke.copy()
    strokes[:, 1] = np.nan
    by_stroke = nf.simulate(
        robot, nf.LoadPath(np.full_like(strokes, np.nan), strokes)
    ).raise_if_failed()
    margin.within("angles", by_stroke.notch_angle - by_force.notch_angle, 1e-9, "rad")
    margin.within("tensions", by_stroke.tension - by_force.tension, 1e-7, "N")


def test_elastic_cable_gives_by_its_tension(elastic, margin) -> None:
    """Beyond the shape's own, the stroke is the sum of T length / E A over all spans."""
    soft = nf.solve(elastic, nf.Load(tension=6.0)).raise_if_failed()
    rigid = nf.solve(nf.load_robot("liu2022"), nf.Load(tension=6.0)).raise_if_failed()
    spans = soft.span_tension[0]
    gaps, bodies = spans[1::2], spans[2::2]
    # Gaps of H = 3.5 mm and pieces of h = 1.5 mm; the cable ends where it enters the last piece,
    # and goes on through it with the tension of the last gap.
    stretch = (3.5 * gaps.sum() + 1.5 * bodies.sum() + 1.5 * gaps[-1]) / STIFF
    margin.within("stroke", soft.stroke[0] - rigid.stroke[0] - stretch, 1e-9, "mm")
    margin.within("shape", soft.notch_angle - rigid.notch_angle, 1e-9, "rad")


def test_slack_cable_never_pushes(elastic) -> None:
    """Let go by more than the shape takes up, the other cable hangs slack and changes nothing."""
    alone = nf.solve(elastic, nf.Load(tension=(5.0, None)))
    slack = nf.solve(elastic, nf.Load(tension=(5.0, None), stroke=(None, -30.0)))
    assert slack.converged, slack.reason
    assert slack.tension[1] == 0.0
    np.testing.assert_allclose(slack.notch_angle, alone.notch_angle, atol=1e-10)


def test_held_cable_resists(elastic) -> None:
    held = nf.solve(elastic, nf.Load(tension=(5.0, None), stroke=(None, 0.0)))
    alone = nf.solve(elastic, nf.Load(tension=(5.0, None)))
    assert held.converged, held.reason
    assert held.tension[1] > 0.1
    assert held.total_angle < alone.total_angle


def test_pretension_is_held_by_stroke(elastic, pretensioned, margin) -> None:
    state = pretensioned[-1]
    held = nf.simulate(
        elastic, [nf.Load(stroke=tuple(state.stroke))], from_state=state.state
    ).raise_if_failed()
    margin.within("tensions", held.tension[0] - 3.0, 1e-7, "N")
    margin.within("shape", held.notch_angle[0] - state.notch_angle, 1e-10, "rad")


def test_antagonists_drawn_against_each_other(elastic, pretensioned) -> None:
    """One cable is drawn by what the other is let go, there and back; neither goes slack."""
    start = pretensioned.stroke[-1]
    steps = np.concatenate([np.linspace(0, 1.5, 7), np.linspace(1.5, -1.5, 13)[1:]])
    strokes = start + steps[:, None] * np.array([1.0, -1.0])
    path = nf.simulate(
        elastic,
        nf.LoadPath(np.full_like(strokes, np.nan), strokes),
        from_state=pretensioned.state,
    )
    assert path.converged.all(), [reason for reason in path.reason if reason]
    assert (path.tension >= 0.0).all()
    assert path.total_angle[6] > 0.05
    assert path.total_angle[-1] < -0.05


def test_one_by_force_one_by_stroke(elastic, margin) -> None:
    both = nf.simulate(
        elastic, [nf.Load(tension=(k, 0.4 * k)) for k in (2.0, 4.0, 6.0, 3.0)]
    ).raise_if_failed()
    mixed = nf.simulate(
        elastic,
        [
            nf.Load(tension=(None, 0.4 * k), stroke=(u, None))
            for k, u in zip((2.0, 4.0, 6.0, 3.0), both.stroke[:, 0], strict=True)
        ],
    ).raise_if_failed()
    margin.within("tension found", mixed.tension - both.tension, 1e-7, "N")
    margin.within("shape", mixed.notch_angle - both.notch_angle, 1e-9, "rad")
