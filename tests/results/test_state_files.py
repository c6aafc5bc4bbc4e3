"""State files: what cannot be written or read back is told in one sentence."""

import json

import numpy as np
import pytest

import notchflex as nf
from notchflex.errors import ErrorCode
from notchflex.mechanics.chain import assemble
from notchflex.results.state import State, leaves_of
from notchflex.solver.residual import at_rest
from refusals import refused


@pytest.fixture(scope="module")
def chain():
    return assemble(nf.load_robot("pacheco2021-a"))


@pytest.fixture
def file(tmp_path, chain):
    path = tmp_path / "state.json"
    State("wrist", leaves_of(at_rest(chain)), "tendons", loaded=False, refinement=0).save(path)
    return path


@pytest.mark.parametrize("name", ["missing/state.json", ".", "null\0"])
def test_states_that_cannot_be_written(tmp_path, chain, name):
    with refused(ErrorCode.FILE_UNWRITABLE):
        State("wrist", leaves_of(at_rest(chain)), "tendons", loaded=False, refinement=0).save(
            tmp_path / name
        )


def test_a_state_that_fails_to_be_written_leaves_the_old_one(file, chain, monkeypatch):
    old = file.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with refused(ErrorCode.FILE_UNWRITABLE, "No space left"):
        State("other", leaves_of(at_rest(chain)), "tendons", loaded=False, refinement=0).save(file)
    assert file.read_bytes() == old
    assert list(file.parent.iterdir()) == [file]


@pytest.mark.parametrize("given", ["state.json", nf.Load(tension=1.0), 1.0])
def test_what_is_no_state_is_told(given):
    with refused(ErrorCode.WRONG_TYPE, "from_state"):
        nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0), from_state=given)


@pytest.mark.parametrize("wrong", ["drop", "nan", "text", "huge", "null"])
def test_damaged_arrays_are_not_blamed_on_the_robot(file, chain, wrong):
    content = json.loads(file.read_text())
    name = next(iter(content["arrays"]))
    if wrong == "drop":
        del content["arrays"][name]
    else:
        damage = {"nan": np.nan, "text": "a", "huge": 10**400, "null": None}[wrong]
        content["arrays"][name] = np.full(
            np.shape(content["arrays"][name]), damage, object
        ).tolist()
    file.write_text(json.dumps(content))
    with refused(ErrorCode.FILE_DAMAGED):
        State.load(file).fitted(chain)


@pytest.mark.parametrize("key", ["robot", "arrays"])
def test_missing_parts_are_damage(file, key):
    content = json.loads(file.read_text())
    del content[key]
    file.write_text(json.dumps(content))
    with refused(ErrorCode.FILE_DAMAGED):
        State.load(file)
