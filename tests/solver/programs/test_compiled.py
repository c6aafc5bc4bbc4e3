"""Compiled functions: programs of our own, and XLA's of the same functions where there are none."""

from collections import OrderedDict

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jnp
from notchflex.solver.programs import compiled as backend
from notchflex.solver.programs import store
from notchflex.solver.programs.compiled import Native, Packed
from notchflex.solver.programs.prepare import prepare


@pytest.fixture
def wrist():
    return nf.load_robot("pacheco2021-a").replace(
        notch=(nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2, repeat=2),),
        tendon=(nf.Tendon(0.7),),
    )


@pytest.fixture(autouse=True)
def nothing_warned_of(monkeypatch):
    monkeypatch.setattr(backend, "_warned", set())


@pytest.mark.nightly
def test_xla_finds_the_same(wrist, monkeypatch, margin):
    loads = [nf.pull(0.0, top, steps=4).release() for top in (1.0, 2.0, 2.5)]
    outputs = ("total_angle", "peak_strain", "contact_force")
    own = nf.simulate_batch(wrist, loads, outputs=outputs)
    alone = nf.simulate(wrist, loads[1])
    monkeypatch.setattr(Native, "_program", lambda *_: None)
    prepare.cache_clear()  # a prepared robot keeps the programs that solved it
    other = nf.simulate_batch(wrist, loads, outputs=outputs)
    for name in outputs:
        np.testing.assert_allclose(own[name], other[name], rtol=1e-9, atol=1e-10, err_msg=name)
    again = nf.simulate(wrist, loads[1])
    prepare.cache_clear()
    margin.within("XLA against our program", alone.total_angle - again.total_angle, 1e-12, "rad")


def test_what_cannot_be_read_goes_to_xla():
    function = Native(lambda values, count: jnp.sort(values)[:count])
    with pytest.warns(RuntimeWarning, match="sort"):
        np.testing.assert_array_equal(function(np.array([3.0, 1.0, 2.0]), 2), [1.0, 2.0])
    rows = np.array([[3.0, 1.0], [0.0, -1.0], [5.0, 6.0]])
    found = function.rows(Packed(rows, None, True), 1)  # warned of once
    np.testing.assert_array_equal(found, [[1.0], [-1.0], [5.0]])


def growing(carried, rows, count):
    return jnp.sort(carried + rows[: carried.size]), {"sum": jnp.sum(carried), "first": rows[0]}


def cumulated(carried, rows, count):
    return carried + rows[: carried.size], {"sum": jnp.sum(carried), "first": rows[0]}


@pytest.mark.parametrize("rows", [1, 2, 7])
def test_rows_in_order_carry_a_vector(rows):
    """By a program of ours and by XLA, for any number of rows by the same program."""
    table = np.arange(3.0 * rows).reshape(rows, 3)
    before = np.cumsum(np.vstack([np.zeros(2), table[:, :2]]), axis=0)[:-1]
    own = Native(cumulated).scan(np.zeros(2), Packed(table, None, True), 2)
    with pytest.warns(RuntimeWarning, match="sort"):
        other = Native(growing).scan(np.zeros(2), Packed(table, None, True), 2)
    for found in (own, other):
        np.testing.assert_array_equal(found["sum"], before.sum(axis=1))
        np.testing.assert_array_equal(found["first"], table[:, 0])


def test_programs_not_used_for_longest_are_let_go(monkeypatch):
    monkeypatch.setattr(Native, "programs", OrderedDict())
    monkeypatch.setattr("notchflex.solver.programs.compiled._MAX_PROGRAMS", 2)
    functions = [Native(lambda values, own=k: own * values) for k in range(3)]
    for one in (*functions, functions[1]):
        one(np.ones(2))
    assert [key[0] for key in Native.programs] == [functions[2], functions[1]]


def test_programs_are_kept_and_what_is_no_program_is_not_taken(tmp_path, monkeypatch):
    monkeypatch.setenv(store.VARIABLE, str(tmp_path))
    monkeypatch.setattr(Native, "programs", OrderedDict())
    traced = []

    def doubled(values):
        traced.append(1)
        return 2.0 * values

    def again():
        return Native(doubled)(np.arange(3.0)).tolist()

    assert again() == again() == [0.0, 2.0, 4.0]
    assert len(traced) == 1
    (file,) = tmp_path.glob("programs-*/program-*")
    file.write_bytes(file.read_bytes()[:-5])
    assert again() == [0.0, 2.0, 4.0]
    assert len(traced) == 2
