"""`notchflex doctor` and `completion`."""

import json
import subprocess
from pathlib import Path

import pytest

from notchflex.cli.verbs import installation
from notchflex.cli.verbs.installation import requirements
from notchflex.solver.programs import store


def test_healthy_installation(call):
    code, out, err = call("doctor", "--json", "-")
    found = json.loads(out)
    assert code == 0
    assert err == ""
    assert found["healthy"] is True
    assert found["device"]["x64"] is True
    assert found["canary"] == {"expected": 268_435_456.0, "computed": 268_435_456.0}
    assert found["backend"]["name"] == "native"
    assert {"jax", "jaxlib", "numpy", "cyclopts"} <= found["packages"].keys()
    assert all(found["packages"].values())
    assert "matplotlib" in found["extras"]["plot"]["packages"]


def test_table_has_what_is_asked_and_fits(call):
    code, out, _ = call("doctor")
    assert code == 0
    for words in ("python", "jaxlib", "known sum", "right", "programs", "plot"):
        assert words in out
    assert max(map(len, out.splitlines())) <= 80


def test_backend_is_shown_and_checked(call, monkeypatch):
    assert "native: lanewise and LLVM" in " ".join(call("doctor")[1].split())
    monkeypatch.setenv("NOTCHFLEX_BACKEND", "xla")
    assert "xla: NOTCHFLEX_BACKEND asks for it" in " ".join(call("doctor")[1].split())
    monkeypatch.setenv("NOTCHFLEX_BACKEND", "gcc")
    code, out, err = call("doctor")
    assert (code, out) == (2, "")
    assert "'gcc'; allowed are native, xla" in " ".join(err.split())


def test_wrong_sums_end_with_code_1(call, monkeypatch):
    wrong = (268_435_456.0, 266_342_400.0)
    monkeypatch.setattr(installation, "canary", lambda: wrong)
    code, out, err = call("doctor")
    assert code == 1
    assert "WRONG" in out
    assert "a sum that is 268435456 came out as 266342400" in err
    assert call("doctor", "--quiet")[:2] == (1, "")


def test_missing_extras_are_told_with_their_command(call, monkeypatch):
    lines = ["numpy", "nothing-like-it>=2; extra == 'data'", "notchflex[data]; extra == 'all'"]
    monkeypatch.setattr("importlib.metadata.requires", lambda name: lines)
    out = " ".join(call("doctor")[1].split())
    assert "nothing-like-it missing: pip install 'notchflex[data]'" in out
    found = json.loads(call("doctor", "--json", "-")[1])
    assert found["extras"]["data"]["installed"] is False
    assert list(found["extras"]) == ["data"]


def test_requirements_of_this_wheel():
    found = requirements()
    assert "jax" in found[""]
    assert "matplotlib" in found["plot"]
    assert "ruff" not in found[""]


def test_kept_programs_are_counted_and_cleared(call, tmp_path, monkeypatch):
    monkeypatch.setenv(store.VARIABLE, str(tmp_path))
    store.write("one", b"123")
    code, out, err = call("doctor", "--clear-cache", "--json", "-")
    assert code == 0
    assert "removed 1 programs" in err
    assert json.loads(out)["compile_cache"]["programs"] == 0
    assert store.read("one") is None


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_verbs_and_options(call, shell):
    code, out, _ = call("completion", shell)
    assert code == 0
    for word in ("simulate", "doctor", "tension", "beside"):
        assert word in out


def test_completion_in_a_real_bash(call, tmp_path):
    script = tmp_path / "complete.sh"
    script.write_text(call("completion", "bash")[1])
    line = (
        f"source {script}; COMP_WORDS=(notchflex sim); COMP_CWORD=1; _notchflex; "
        'echo "${COMPREPLY[@]}"; COMP_WORDS=(notchflex simulate --tens); COMP_CWORD=2; '
        '_notchflex; echo "${COMPREPLY[@]}"; complete -p notchflex'
    )
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=True)
    first, second, how = done.stdout.splitlines()
    assert (first.strip(), second.strip()) == ("simulate", "--tension")
    assert "-o default" in how  # robots and data are files


def test_completion_is_installed_for_this_user(call, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    code, out, _ = call("completion", "bash", "--install")
    assert code == 0
    written = Path(out.split("Written: ")[1].split(". It works")[0])
    assert tmp_path in written.parents
    assert "complete -o default" in written.read_text(encoding="utf-8")
    assert str(written) in (tmp_path / ".bashrc").read_text()


def test_other_shells_are_refused(call):
    code, _, err = call("completion", "tcsh")
    assert code == 2
    assert "Choose from" in err
