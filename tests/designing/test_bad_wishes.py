"""Bad design files: refused with one sentence and exit code 2, and nothing is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import notchflex as nf
from mutations import mutated
from notchflex.cli import run
from notchflex.designing import read_design

TEMPLATE = Path(nf.__file__).parent / "designing" / "template.toml"
TEXT = TEMPLATE.read_text(encoding="utf-8")

BAD = {
    "no TOML": (TEXT + "\n[[load", "FILE_UNREADABLE"),
    "unknown key": (TEXT.replace("lower = 1.2", "lowest = 1.2"), "INVALID_SPECIFICATION"),
    "reversed": (TEXT.replace("lower = 1.2", "lower = 1.9"), "INVALID_SPECIFICATION"),
    "unknown robot": (TEXT.replace("pacheco2021-a", "pacheco2021-x"), "UNKNOWN_NAME"),
    "unknown value": (TEXT.replace("notch.depth", "notch.dept"), "UNKNOWN_NAME"),
    "unknown quantity": (TEXT.replace('"peak_strain"', '"peak_strian"'), "UNKNOWN_NAME"),
    "unknown load": (TEXT.replace('load = "pulled"', 'load = "puled"', 1), "UNKNOWN_NAME"),
    "strain in percent": (TEXT.replace("upper = 0.06", "upper = 6.0"), "OUT_OF_RANGE"),
    "depth in metres": (TEXT.replace("lower = 1.2 ", "lower = -0.0012 "), "OUT_OF_RANGE"),
    "negative tension": (TEXT.replace("tension = 2.0", "tension = -2.0"), "OUT_OF_RANGE"),
    "two tendons": (TEXT.replace("tension = 2.0", "tension = [2.0, 1.0]"), "WRONG_SHAPE"),
    "nan": (TEXT.replace("equal = 90.0", "equal = nan"), "INVALID_SPECIFICATION"),
    "same twice": (TEXT.replace('"notch.height"', '"notch[2].depth"', 1), "CONFLICT"),
    "contradiction": (
        TEXT + '[[constraint]]\nquantity = "total_angle"\nload = "pulled"\nupper = 80.0\n',
        "CONFLICT",
    ),
    "nothing asked": (TEXT.split("# --- Objectives")[0], "INVALID_SPECIFICATION"),
    "load key": (TEXT.replace("tension = 2.0", "tensoin = 2.0"), "INVALID_SPECIFICATION"),
    "in a circle": (
        TEXT.replace("tension = 2.0", 'tension = 2.0\nafter = "pulled"'),
        "CONFLICT",
    ),
    "not to be made": (
        TEXT.replace("lower = 1.2 ", "lower = 1.7 ").replace("upper = 1.5 ", "upper = 1.9 "),
        "UNSUPPORTED",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_wishes(name, tmp_path, wording):
    text, code = BAD[name]
    file = tmp_path / "wish.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(nf.InputError) as caught:
        nf.design(file)
    assert caught.value.code.name == code, caught.value
    wording(f"design: {name}", str(caught.value).replace(str(tmp_path), ""))


ROBUST = (
    TEXT.replace("# [robust]", "[robust]")
    .replace("# wanted_yield = 0.95", "wanted_yield = 0.95")
    .replace("# [tolerance]", "[tolerance]")
    .replace("# notch.depth = {", "notch.depth = {")
    .replace("# material.elastic_modulus", "material.elastic_modulus")
)
SECOND = '[[objective]]\nquantity = "total_angle"\nload = "pulled"\ngoal = "maximise"\n\n'
FRONT = TEXT.replace("# --- Constraints", f"{SECOND}# --- Constraints")
KINDS = {
    "plain": (TEXT, ()),
    "robust": (ROBUST, ()),
    "verb": (TEXT, ("--robust",)),
    "front": (FRONT, ("--front",)),
}
NIGHTLY = pytest.mark.nightly


@pytest.mark.parametrize(
    ("kind", "seeds"),
    [
        ("plain", range(40)),
        pytest.param("plain", range(40, 300), marks=NIGHTLY),
        ("robust", range(10)),
        pytest.param("robust", range(10, 300), marks=NIGHTLY),
        pytest.param("verb", range(300, 400), marks=NIGHTLY),
        ("front", range(10)),
        pytest.param("front", range(10, 300), marks=NIGHTLY),
    ],
)
def test_300_mutated_files(kind, seeds, tmp_path, monkeypatch, capsys):
    """Each is refused, or asks for a design; none ends in a traceback, and none writes a file."""
    monkeypatch.chdir(tmp_path)

    class ReachedError(Exception):
        """The specification was accepted: what a search does is tested elsewhere."""

    def stop(*_):
        raise ReachedError

    monkeypatch.setattr("notchflex.designing.design_robot.search", stop)
    monkeypatch.setattr("notchflex.designing.design_robot._spread", stop)
    text, options = KINDS[kind]
    refused = 0
    for seed in seeds:
        Path("wish.toml").write_text(mutated(text, seed), encoding="utf-8")
        try:
            code = run(["design", "wish.toml", "-o", "made", *options])
        except ReachedError:
            continue
        out, err = capsys.readouterr()
        refused += 1
        assert code == 2, (seed, err)
        assert err.startswith("Error: "), (seed, err)
        assert out == ""
        assert not Path("made").exists()
    assert refused > len(seeds) // 2


OLD_VARIABLE = '[[variable]]\nvalue = "state.pulled.tension"\nlower = 1.0\nupper = 3.0'
OLD = (
    TEXT.replace("[load.pulled]", '[[state]]\nname = "pulled"')
    .replace('load = "pulled"', 'state = "pulled"')
    .replace("# --- Sizes", f"{OLD_VARIABLE}\n# --- Sizes")
)


def test_old_words_are_read_with_a_note(tmp_path):
    (tmp_path / "old.toml").write_text(OLD, encoding="utf-8")
    (tmp_path / "new.toml").write_text(TEXT, encoding="utf-8")
    with pytest.warns(FutureWarning, match="`state` is now called `load`"):
        old, _ = read_design(tmp_path / "old.toml")
    new, _ = read_design(tmp_path / "new.toml")
    assert old.load == new.load == old.state
    assert old.constraint == new.constraint
    with pytest.warns(FutureWarning):
        assert nf.DesignSpec(robot="pacheco2021-a", state=old.load, variable=old.variable,
                             objective=old.objective).load == new.load  # fmt: skip


def test_schema_names_every_table(capsys):
    assert run(["schema", "--design"]) == 0
    schema = json.loads(capsys.readouterr().out)
    tables = {"variable", "stock", "load", "objective", "constraint", "curve", "search"}
    assert tables < set(schema["properties"])


def test_new_writes_a_design_file_that_can_be_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["new", "wish", "--design"]) == 0
    assert "notchflex design wish.toml" in capsys.readouterr().out
    spec, robot = read_design("wish.toml")
    assert robot == nf.load_robot("pacheco2021-a")
    assert len(spec.constraint) == 3
    assert run(["new", "wish", "--design"]) == 2  # it is there already
