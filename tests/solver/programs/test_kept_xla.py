"""Compiled programs kept on disk: found again without tracing, and never a wrong one."""

import numpy as np
import pytest

from notchflex._jax import jax, jnp
from notchflex.solver.programs import store
from notchflex.solver.programs.kept_xla import Kept


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(store.VARIABLE, str(tmp_path))
    monkeypatch.setattr(Kept, "loaded", {})
    return store.program_folder()


@pytest.fixture
def traced():
    """How often the function below was traced, by its static argument."""
    return []


@pytest.fixture
def process(traced):
    """The function as a new process has it: nothing of it is loaded."""

    def begun():
        def grown(values, factor):
            traced.append(factor)
            return {"grown": factor * jnp.cumsum(values)}

        return Kept(grown, (1,))

    return begun


def test_another_process_loads_the_program_and_does_not_trace_it(folder, process, traced):
    first = process()(np.arange(3.0), 2)
    assert traced == [2]
    again = process()
    np.testing.assert_array_equal(again(np.arange(3.0), 2)["grown"], first["grown"])
    np.testing.assert_array_equal(again(np.ones(3), 2)["grown"], [2.0, 4.0, 6.0])
    assert traced == [2]
    assert len(list(folder.iterdir())) == 1


def test_other_shapes_kinds_and_static_arguments_are_other_programs(folder, process, traced):
    function = process()
    function(np.arange(3.0), 2)
    np.testing.assert_array_equal(function(np.arange(4.0), 2)["grown"], [0.0, 2.0, 6.0, 12.0])
    np.testing.assert_array_equal(function(np.arange(3), 2)["grown"], [0, 2, 6])
    np.testing.assert_array_equal(function(np.arange(3.0), 3)["grown"], [0.0, 3.0, 9.0])
    assert traced == [2, 2, 2, 3]
    assert len(list(folder.iterdir())) == 4


@pytest.mark.parametrize("spoil", [lambda content: content[:-9], lambda content: b"no program"])
def test_a_spoilt_file_is_made_again(folder, process, traced, spoil):
    process()(np.arange(3.0), 2)
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    file.write_bytes(spoil(whole))
    np.testing.assert_array_equal(process()(np.arange(3.0), 2)["grown"], [0.0, 2.0, 6.0])
    assert traced == [2, 2]
    process()(np.arange(3.0), 2)
    assert traced == [2, 2]


def test_a_folder_that_cannot_be_made_costs_only_time(tmp_path, process, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "file" / "inside"))
    np.testing.assert_array_equal(process()(np.arange(3.0), 2)["grown"], [0.0, 2.0, 6.0])


def test_without_compiling_it_is_the_plain_function(folder, process):
    with jax.disable_jit():
        np.testing.assert_array_equal(process()(np.arange(3.0), 2)["grown"], [0.0, 2.0, 6.0])
    assert not list(folder.iterdir())


def test_a_file_that_cannot_be_replaced_leaves_nothing_beside_it(folder, process):
    process()(np.arange(3.0), 2)
    (file,) = folder.iterdir()
    file.unlink()
    file.mkdir()
    process()(np.arange(3.0), 2)
    assert list(folder.iterdir()) == [file]
