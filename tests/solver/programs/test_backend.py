"""The choice of the compiler, its loud fallback, and what must never fall back."""

import warnings

import numpy as np
import pytest

from lanewise import UnsupportedPrimitiveError
from notchflex._jax import jnp
from notchflex.solver.programs import compiled as backend
from notchflex.solver.programs.compiled import Native
from refusals import refused


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
