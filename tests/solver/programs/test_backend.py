"""The choice of the compiler, its loud fallback, and what must never fall back."""

import os
import subprocess
import sys
import warnings
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from lanewise import UnsupportedPrimitiveError
from notchflex._jax import jnp
from notchflex.solver.programs import compiled as backend
from notchflex.solver.programs.compiled import Native
from refusals import refused

TYPICAL_CALLS = Path(__file__).parents[3] / "packaging" / "typical_calls.py"


@pytest.fixture(autouse=True)
def nothing_warned_of(monkeypatch):
    monkeypatch.setattr(backend, "_warned", set())


def doubled(values):
    return 2.0 * values


def test_xla_when_asked_for(monkeypatch):
    monkeypatch.setenv(backend.BACKEND, "xla")
    assert Native(doubled)(np.arange(3.0)).tolist() == [0.0, 2.0, 4.0]
    assert list(Native.programs.values())[-1] is None  # no program of lanewise
    monkeypatch.setenv(backend.BACKEND, "")
    assert Native(doubled)(np.arange(3.0)).tolist() == [0.0, 2.0, 4.0]
    assert list(Native.programs.values())[-1] is not None


def test_other_values_are_refused(monkeypatch):
    monkeypatch.setenv(backend.BACKEND, "llvm")
    with refused("UNKNOWN_NAME", backend.BACKEND, "llvm", "native, xla"):
        Native(lambda values: values + 1.0)(np.arange(3.0))


def test_one_warning_for_each_primitive():
    def ordered(values):
        return jnp.sort(values)

    def ordered_otherwise(values):
        return -jnp.sort(-values)

    with pytest.warns(RuntimeWarning, match="ordered.*`sort`"):
        Native(ordered)(np.arange(3.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Native(ordered_otherwise)(np.arange(3.0))
    with pytest.warns(RuntimeWarning, match="erf"):
        backend.warn_of_xla("f", UnsupportedPrimitiveError("JAX's primitive `erf`", "erf"))


@pytest.mark.parametrize("name", ["pacheco2021-a", "gao2017", "liu2022", "two-axis-wrist"])
def test_ready_robots_are_native(name, monkeypatch):
    """Warnings are errors here, too: a program that XLA compiles fails."""
    monkeypatch.setattr(Native, "programs", OrderedDict())
    state = nf.solve(nf.load_robot(name), nf.Load(tension=0.1))
    assert state.converged
    assert np.isfinite(state.span_tension).all()
    assert Native.programs
    assert all(made is not None for made in Native.programs.values())


@pytest.mark.nightly
def test_shipped_programs_are_native():
    environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": ""}
    command = [sys.executable, "-W", "error:XLA compiles:RuntimeWarning", str(TYPICAL_CALLS)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
