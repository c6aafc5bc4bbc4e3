"""Compiled functions: programs of our own, and XLA's of the same functions where there are none."""

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex._kept import Kept
from notchflex._native import Native


@pytest.fixture
def wrist():
    return nf.load_robot("pacheco2021-a").replace(
        notch=(nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2, repeat=2),),
        tendon=(nf.Tendon(0.7),),
    )


def test_xla_finds_the_same(wrist, monkeypatch, margin):
    loads = [nf.pull(0.0, top, steps=4).release() for top in (1.0, 2.0, 2.5)]
    outputs = ("total_angle", "peak_strain", "contact_force")
    own = nf.simulate_batch(wrist, loads, outputs=outputs)
    alone = nf.simulate(wrist, loads[1])
    monkeypatch.setattr(Native, "_made", lambda *_: None)
    other = nf.simulate_batch(wrist, loads, outputs=outputs)
    for name in outputs:
        np.testing.assert_allclose(own[name], other[name], rtol=1e-9, atol=1e-10, err_msg=name)
    again = nf.simulate(wrist, loads[1])
    margin.within("XLA against our program", alone.total_angle - again.total_angle, 1e-12, "rad")


def test_it_runs_without_compiling(wrist):
    load = nf.Load(tension=0.2)
    with jax.disable_jit():
        plain = nf.solve(wrist.replace(friction=nf.Frictionless()), load).total_angle
    assert plain == pytest.approx(
        nf.solve(wrist.replace(friction=nf.Frictionless()), load).total_angle, abs=1e-12
    )


def test_what_cannot_be_read_goes_to_xla():
    function = Native(lambda values, count: jnp.sort(values)[:count], 1, lambda _: ())
    np.testing.assert_array_equal(function(np.array([3.0, 1.0, 2.0]), 2), [1.0, 2.0])
    rows = np.array([[3.0, 1.0], [0.0, -1.0], [5.0, 6.0]])
    np.testing.assert_array_equal(function.rows((True,), rows, 1), [[1.0], [-1.0], [5.0]])


def test_programs_are_kept_and_what_is_no_program_is_not_taken(tmp_path, monkeypatch):
    monkeypatch.setattr(Kept, "folder", tmp_path)
    monkeypatch.setattr(Native, "made", {})
    traced = []

    def doubled(values):
        traced.append(1)
        return 2.0 * values

    def again():
        return Native(doubled, 1, lambda: ())(np.arange(3.0)).tolist()

    assert again() == again() == [0.0, 2.0, 4.0]
    assert len(traced) == 1
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:-5])
    assert again() == [0.0, 2.0, 4.0]
    assert len(traced) == 2
