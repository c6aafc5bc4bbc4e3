"""What Gao 2017 states about its robot in words, each as a number; its contacts and its slots."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from balance import cone_used, left_over
from gao2017 import CONTACTS, PULLED, pulled_and_let_go, robot, squeezed

SLOTS = 28
TOP = PULLED - 1  # step at 13 N


def test_slots_bodies_and_contacts():
    path = pulled_and_let_go()
    assert sum(row.slots for row in robot().notch) == SLOTS
    assert path.notch_angle.shape == (2 * PULLED, SLOTS - 1)
    assert path.body_position.shape == (2 * PULLED, SLOTS, 3)
    # 14 gaps on the tendon's side, 13 pieces between them: 28 spans, F_0 to F_27, 27 contacts.
    assert path.span_tension.shape == (2 * PULLED, 1, CONTACTS + 1)
    assert path.contact_turning.shape == (2 * PULLED, 1, CONTACTS)
    assert (path.contact_turning[1:-1] > 0.0).all()


def test_tension_rises_everywhere_at_once(margin):
    """Loading: no span waits for another; every contact slides toward the base."""
    path = pulled_and_let_go()
    rise = np.diff(path.span_tension[:PULLED, 0], axis=0)
    margin.note(f"least rise of any tension with 1 N: {rise.min():.4f} N")
    margin.within("least rise", rise.min() - 0.2113306, 1e-5, "N")  # of F_27, from 12 to 13 N
    assert (path.contact_state[1:PULLED] == 1).all()


def test_front_travels_from_the_base(margin):
    """Unloading: contacts turn one after another from the base; beyond, nothing changes yet."""
    path = pulled_and_let_go()
    m = path.front[0][PULLED:, 0]
    margin.note(f"contacts turned at 13, 12, ... 0 N: {m - 1}")
    np.testing.assert_array_equal(m, [1, 1, 3, 4, 6, 8, 10, 14, 19, 26, 28, 28, 28, 28])
    held, changed = path.span_tension[TOP, 0], []
    for step, front in zip(range(PULLED, 2 * PULLED - 1), m, strict=False):
        state, tension = path.contact_state[step, 0], path.span_tension[step, 0]
        assert (state[: front - 1] == -1).all()
        if front <= CONTACTS:
            assert (state[front:] != -1).all()
            changed.append(np.abs(tension[front:] - held[front:]).max())
    # Between two stuck contacts of one piece the tendon counts as all but inextensible, not quite.
    margin.within("tension beyond the front", changed, 1e-7, "N")


def test_base_tension_is_more_than_twice_the_distal_one(margin):
    tension = pulled_and_let_go().span_tension[TOP, 0]
    ratio = tension[0] / tension[-1]
    assert ratio > 2.0
    margin.within("F_0 / F_27 at 13 N against 2.225478", ratio - 2.225478, 5e-6)


def test_shapes_are_even_while_bending_and_uneven_while_unbending(margin):
    """Distance of the tip from one shape to the next, 1 N further."""
    tip = pulled_and_let_go().tip_position
    bending = np.linalg.norm(np.diff(tip[:PULLED], axis=0), axis=1)
    unbending = np.linalg.norm(np.diff(tip[PULLED:], axis=0), axis=1)
    spread, other = (float(np.std(gaps) / np.mean(gaps)) for gaps in (bending, unbending))
    margin.note(f"spread of the gaps: bending {spread:.3f}, unbending {other:.3f} of their mean")
    assert spread < 0.25 < 3.0 * spread < other
    # From 13 to 12 N the shape does not move at all.
    margin.within("first gap of unbending", unbending[0] / bending.min(), 1e-11)


def test_shape_is_no_circular_arc(margin):
    """The wall pieces on the tendon's side turn against each other by less and less."""
    angle = np.degrees(pulled_and_let_go().notch_angle[TOP])
    of_gap = angle[0:26:2] + angle[1:26:2]
    margin.note(f"gap rotations from {of_gap[0]:.2f} to {of_gap[-1]:.2f} deg")
    assert (np.diff(of_gap) < 0.0).all()
    margin.within("first", of_gap[0] - 7.3, 0.05, "deg")
    margin.within("last", of_gap[-1] - 3.7, 0.05, "deg")


def test_slots_close_under_a_strong_pull(margin):
    """Every slot on the tendon's side closes in turn, the first one first; nothing else changes."""
    path = squeezed()
    assert path.converged.all(), path.reason
    force, gap = path.contact_force, path.gap
    first = np.array([np.argmax(touching) for touching in (force > 0.0).T])
    closes = (force > 0.0).any(axis=0)
    margin.note(f"first contact above {path.tension[first[closes].min() - 1, 0]:g} N")
    assert closes[1]
    assert first[closes].min() == first[1]
    assert (np.diff(first[closes]) >= 0).all()
    assert not closes[0::2][:-1].any()  # the other side opens
    margin.within("overlap", np.minimum(gap, 0.0), 1e-11, "mm")
    margin.within("force times gap", force * gap, 1e-11, "N mm")
    margin.within("residual", path.residual, 1e-11)
    for what, error in zip(("force", "moment"), left_over(path), strict=True):
        margin.within(f"{what} left over", error, 1e-11)
    margin.within("friction beyond its cone", np.maximum(cone_used(path), 1.0) - 1.0, 5e-11)


@pytest.mark.parametrize("step", [10, 25])
def test_gaps_are_those_between_the_pieces(step, margin):
    """The slots measured on the bodies' poses, the free robot telling where their faces are."""
    path = squeezed()
    row = robot().notch[0]
    assert isinstance(row, nf.ULink)
    widest = robot().tube.outer_radius
    found = np.full(SLOTS - 1, np.inf)
    for slot in range(SLOTS):
        side = -widest if slot % 2 == 0 else widest
        start = robot().tube.base_length + slot * row.pitch
        low, high = (np.array([side, 0.0, z]) for z in (start, start + row.height))
        below, above = max(slot - 1, 0), min(slot + 1, SLOTS - 1)
        face = path.body_rotation[step, below][:, 2]
        across = _moved(path, step, above, high) - _moved(path, step, below, low)
        found[above - 1] = min(found[above - 1], across @ face)
    margin.within("gaps", path.gap[step] - found, 1e-12, "mm")


def _moved(path: nf.EquilibriumPath, step: int, body: int, point: np.ndarray) -> np.ndarray:
    """Where a point of a body has gone that was `point` in the free robot."""
    inside = path.body_rotation[0, body].T @ (point - path.body_position[0, body])
    return path.body_position[step, body] + path.body_rotation[step, body] @ inside
