"""Work of the tendon = stored energy + friction, recomputed here from tensions and slid lengths.

Trapezoid throughout: it is exact while everything is linear, and falls with the square of the
step where a notch turns superelastic or closes inside a step. What the package reports for work,
energy and dissipation is compared with what follows from its tensions and strokes, and the stored
energy with the integral of the material law (tests/oracles/wrist.py).
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from loads import tensions
from oracles.wrist import WRISTS
from robots import ready

# Steps per 3 N of the long paths: with 4,000 the trapezoid of the loops is right to 6e-7.
FINE = 4000
# A contact that sticks all round a loop loses nothing, and slides by rounding only [N mm].
ROUNDING = 1e-12


def legs(turns: list[float], steps_per_newton: float) -> np.ndarray:
    """Base tensions [N] from 0 through the turning points."""
    parts, last = [np.zeros(1)], 0.0
    for turn in turns:
        count = max(2, round(abs(turn - last) * steps_per_newton))
        parts.append(np.linspace(last, turn, count + 1)[1:])
        last = turn
    return np.concatenate(parts)


def simulate(robot: nf.Robot, tension: np.ndarray) -> nf.EquilibriumPath:
    path = nf.simulate(robot, tensions(tension))
    assert path.converged.all(), [reason for reason in path.reason if reason][:3]
    return path


def tendon_work(path: nf.EquilibriumPath, start: int = 0) -> float:
    """Integral of T ds at the base [N mm] from step `start` on."""
    return float(np.trapezoid(path.tension[start:, 0], path.stroke[start:, 0]))


def friction_work(path: nf.EquilibriumPath, start: int = 0) -> np.ndarray:
    """Loss at every contact [N mm]: tension lost over it times the tendon that slid over it."""
    span, slid = path.span_tension[start:, 0], path.contact_slid[start:, 0]
    return np.trapezoid(span[:, :-1] - span[:, 1:], slid, axis=0)


def stored(path: nf.EquilibriumPath, step: int) -> float:
    """Elastic energy [N mm] of wrist A at a step: integral of the material law over the angle."""
    wrist = WRISTS["A"]
    law, energy = wrist.material, 0.0
    for j, angle in enumerate(path.notch_angle[step]):
        section, height = wrist.sections[j], wrist.height[j]
        fibre = wrist.outer_diameter / 2 - section.centroid
        strain = angle * fibre / height
        low = min(strain, law.transition_strain)
        more = strain - low
        density = law.elastic_modulus * low * (low / 2 + more)
        density += law.superelastic_modulus * more**2 / 2
        energy += density * section.second_moment * height / fibre**2
    return energy


def with_friction(wrap: str, coefficient: float = 0.13) -> nf.Robot:
    return ready("A").replace(friction=nf.Capstan(coefficient, wrap=wrap))


@pytest.mark.parametrize("wrap", ["whole-before", "geometric"])
def test_loading_to_3_newton(wrap, margin):
    path = simulate(with_friction(wrap), np.linspace(0.0, 3.0, 1001))
    work, lost = tendon_work(path), friction_work(path)
    margin.within("balance", (work - stored(path, -1) - lost.sum()) / work, 1e-6)
    margin.within("reported work", path.tendon_work[-1, 0] / work - 1, 1e-12)
    margin.within("reported energy", path.stored_energy[-1] / stored(path, -1) - 1, 1e-11)
    margin.within("reported dissipation", (path.dissipation[-1, 0] - lost) / lost.sum(), 1e-12)
    assert (lost >= 0).all()
    assert lost.sum() > 0.1 * work


@pytest.mark.parametrize("steps", [1, 7])
@pytest.mark.parametrize("wrap", ["whole-before", "geometric"])
def test_linear_range_at_any_step(wrap, steps, margin):
    """Up to 0.9 N every notch of wrist A is linear, and the trapezoid exact."""
    path = simulate(with_friction(wrap), np.linspace(0.0, 0.9, steps + 1))
    assert path.outer_strain.max() < 0.028
    work, lost = tendon_work(path), friction_work(path).sum()
    margin.within("balance", (work - stored(path, -1) - lost) / work, 1e-12)
    reported = path.stored_energy[-1] + path.dissipation[-1].sum()
    margin.within("reported balance", path.tendon_work[-1].sum() / reported - 1, 1e-12)


def test_partial_loops_in_the_linear_range_at_any_step(margin):
    path = simulate(with_friction("geometric"), np.array([0, 0.9, 0.2, 0.5, 0.3, 0.8, 0.1, 0.0]))
    work, lost = tendon_work(path), friction_work(path).sum()
    margin.within("balance", (work - stored(path, -1) - lost) / work, 1e-12)


@pytest.mark.parametrize("turns", [[3.0, 0.0], [2.0, 0.5, 1.5, 0.0]], ids=str)
@pytest.mark.parametrize("wrap", ["whole-before", "geometric"])
def test_loop_from_rest_to_rest(wrap, turns, margin):
    path = simulate(with_friction(wrap), legs(turns, FINE / 3))
    margin.within("shape at the end", path.notch_angle[-1], 1e-11, "rad")
    check_loop(path, 0, margin)


def test_closed_inner_loop(margin):
    """From 1.2 N to 1.8 N and back, round a second time: the loop is closed, not at rest."""
    tension = legs([2.0, 1.2, 1.8, 1.2], FINE / 3)
    start = int(np.flatnonzero(tension == 1.2)[0])
    path = simulate(with_friction("whole-before"), tension)
    assert tension[start] == tension[-1] == 1.2
    margin.within("loop closes", path.notch_angle[-1] - path.notch_angle[start], 1e-11, "rad")
    check_loop(path, start, margin)


def check_loop(path: nf.EquilibriumPath, start: int, margin) -> None:
    work, lost = tendon_work(path, start), friction_work(path, start)
    margin.within("work of the loop = dissipation", (work - lost.sum()) / work, 1e-6)
    assert work > 0.05, "nothing is lost round the loop"
    margin.note(f"least loss of a contact {lost.min():.1e} N mm")
    assert (lost > -ROUNDING).all()
    reported = path.dissipation[-1, 0] - path.dissipation[start, 0]
    margin.within("reported dissipation", (reported - lost) / lost.sum(), 1e-11)
    assert (reported > -ROUNDING).all()


def test_without_friction_nothing_is_lost(margin):
    path = simulate(ready("A").replace(friction=nf.Frictionless()), legs([3.0, 0.0], 10))
    margin.within("dissipation", friction_work(path), 1e-12, "N mm")
    margin.within("reported", path.dissipation[-1], 1e-12, "N mm")
