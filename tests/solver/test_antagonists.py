"""Two tendons against each other: stroke as an equal of force, elasticity, slack, pretension."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.chain import assemble
from notchflex.solver.residual import closing_stroke

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
    margin.within("angles", by_stroke.notch_angle - by_force.notch_angle, 1e-11, "rad")
    margin.within("tensions", by_stroke.tension - by_force.tension, 2e-11, "N")


def test_elastic_cable_gives_by_its_tension(elastic, margin) -> None:
    """Beyond the shape's own, the stroke is the sum of T length / E A over all spans."""
    soft = nf.solve(elastic, nf.Load(tension=6.0)).raise_if_failed()
    rigid = nf.solve(nf.load_robot("liu2022"), nf.Load(tension=6.0)).raise_if_failed()
    spans = soft.span_tension[0]
    gaps, bodies = spans[1::2], spans[2::2]
    # Gaps of H = 3.5 mm and pieces of h = 1.5 mm; the cable ends where it enters the last piece,
    # and goes on through it with the tension of the last gap.
    stretch = (3.5 * gaps.sum() + 1.5 * bodies.sum() + 1.5 * gaps[-1]) / STIFF
    margin.within("stroke", soft.stroke[0] - rigid.stroke[0] - stretch, 1e-11, "mm")
    margin.within("shape", soft.notch_angle - rigid.notch_angle, 1e-11, "rad")


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
    margin.within("tensions", held.tension[0] - 3.0, 2e-11, "N")
    margin.within("shape", held.notch_angle[0] - state.notch_angle, 1e-11, "rad")


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
    margin.within("tension found", mixed.tension - both.tension, 2e-10, "N")
    margin.within("shape", mixed.notch_angle - both.notch_angle, 1e-11, "rad")


def _notch(path: str, opposite: str, friction: nf.Capstan | nf.Frictionless) -> nf.Robot:
    """One notch between two inextensible tendons."""
    return nf.Robot(
        name="one notch",
        tube=nf.Tube(1.62, 1.40),
        notch=[nf.ArcNotch(cut="on-axis", depth=1.4, height=0.8, uncut_length=1.2)],
        tendon=[
            nf.Tendon(0.7, path=path),
            nf.Tendon(0.7, direction_deg=180.0, path=opposite),
        ],
        material=nf.Linear(7510.0),
        friction=friction,
    )


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("robot", "strokes"),
    [
        (_notch("straight", "wall-arc", nf.Capstan(0.2)), (0.05, 0.0)),
        (_notch("wall-arc", "wall-arc", nf.Frictionless()), (0.1, 0.01)),
    ],
)
def test_strokes_that_contradict_each_other(robot, strokes) -> None:
    """Bent one way, the other tendon is let go; drawn as well, no shape has both strokes."""
    loads = [nf.Load(stroke=(0.05, -1.0)), nf.Load(stroke=strokes)]
    path = nf.simulate(robot, loads)
    assert path.converged.tolist() == [True, False], path.reason
    assert path.residual[1] > 1e-10, "a missed stroke is no imbalance"
    assert "strokes of tendons 1 and 2 contradict each other" in path.reason[1]
    assert "finite axial_stiffness" in path.reason[1]
    assert (path.tension[1] < 1e5 * path.chain.closing_force).all()
    given = robot.with_value("tendon.axial_stiffness", 1e4)
    assert nf.simulate(given, loads).converged.all(), "the remedy named is none"


def test_stroke_that_closes_every_notch() -> None:
    robot = _notch("wall-arc", "wall-arc", nf.Frictionless())
    reach = closing_stroke(assemble(robot))
    closing = nf.solve(robot, nf.Load(tension=(10.0, 0.0)))
    assert closing.closed.all()
    assert abs(reach[0] - closing.stroke[0]) < 1e-9
    assert np.isinf(reach[1]), "a tendon that the closing notch draws in goes on as it opens"
