"""`notchflex friction-rig`: what it prints, writes, draws and refuses."""

from __future__ import annotations

import json

import pytest

from notchflex.cli import run

TABLE = """weight_1_g,weight_2_g,turn_1_deg,turn_2_deg,weight_2_sd_g,day
100,63.1,90,85,0.5,mon
100,64.0,90,85,0.5,mon
200,127.4,88,86,0.5,tue
200,126.5,89,86,0.5,tue
400,253.0,90,85,0.5,tue
400,255.5,91,84,,wed
"""


@pytest.fixture(autouse=True)
def rig(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.csv").write_text(TABLE)
    return tmp_path


def test_prints_and_draws(capsys, rig):
    assert run(["friction-rig", "rig.csv", "--plot", "rig.svg"]) == 0
    told = capsys.readouterr()
    words = " ".join(told.out.split())
    assert "95 % interval" in words
    assert "from 6 readings" in words
    assert "constant mu is enough" in words
    assert max(len(line) for line in told.out.splitlines()) <= 80
    assert "ignored columns: day" in told.err
    assert run(["friction-rig", "rig.csv", "--plot", "rig.html"]) == 0
    for name in ("rig.svg", "rig.html"):
        picture = (rig / name).read_text(encoding="utf-8")
        for text in ("turn over both edges [deg]", "weight 1 [g]", "95 % interval", "reading"):
            assert text in picture


def test_headers_in_own_words(capsys, rig):
    own = TABLE.replace("weight_1_g", "Zug").replace("turn_1_deg", "Winkel")
    (rig / "own.csv").write_text(own)
    assert run(["friction-rig", "own.csv", "--json", "-"]) == 2
    capsys.readouterr()
    named = ("--column", "weight_1_g=Zug", "--column", "turn_1_deg=Winkel")
    documents = []
    for words in (["own.csv", *named], ["rig.csv"]):
        assert run(["friction-rig", *words, "--json", "-"]) == 0
        documents.append(json.loads(capsys.readouterr().out))
    assert documents[0]["coefficient"] == documents[1]["coefficient"]


def test_document(capsys):
    assert run(["friction-rig", "rig.csv", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    low, high = document["interval_95"]
    assert low < document["coefficient"] < high
    assert document["constant"]["degrees_of_freedom"] == 2
    assert document["constant"]["enough"] is True
    assert document["outliers"] == []
    assert document["ignored_columns"] == ["day"]
    first, last = document["readings"][0], document["readings"][-1]
    assert first["line"] == 2
    assert first["turn_1_deg"] == pytest.approx(90.0)
    assert first["coefficient_sd"] > 0.0
    assert last["weight_2_sd_g"] is None
    assert last["coefficient_sd"] is None


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("FILE_NOT_FOUND", ["none.csv"]),
        ("FILE_FORMAT", ["rig.csv", "--plot", "rig.txt"]),
        ("CONFLICT", ["rig.csv", "--json", "rig.csv"]),
        ("OUT_OF_RANGE", ["wrong.csv"]),
    ],
)
def test_bad_input(refused, rig, code, arguments):
    head = TABLE.splitlines()[0].split(",weight_2_sd")[0]
    (rig / "wrong.csv").write_text(f"{head}\n200,150,90,90\n150,200,90,90\n")
    refused(code, "friction-rig", *arguments)
