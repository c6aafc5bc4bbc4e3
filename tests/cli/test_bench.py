"""`notchflex bench`: the table, the document, and what it refuses."""

from __future__ import annotations

import json

import pytest

from notchflex.bench import PEERS
from notchflex.bench.cases import first_call
from notchflex.cli.app import run


def test_rows_and_document(capsys):
    assert run(["bench", "--only", "wrist, one solve", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    force, stroke = document["rows"]
    assert force["name"] == "wrist, one solve"
    assert force["target"] == pytest.approx(0.7)
    for row in (force, stroke):
        assert row["us"] > 0.0
        assert row["lu135"] > 0.0
    # The target of the other is 1.5 times what the first took.
    assert stroke["target"] == pytest.approx(1.5 * force["lu135"])
    assert len(document["peers"]["rows"]) == len(PEERS)
    assert "2026" in document["peers"]["source"]


def test_table(capsys):
    assert run(["bench", "--only", "wrist, one solve by"]) == 0
    out = capsys.readouterr().out
    assert "wrist, one solve by stroke" in out
    assert "times 'wrist, one solve'" in out
    assert "tdcr-modeling" in out


def test_nothing_of_that_name(capsys):
    assert run(["bench", "--only", "rocket"]) == 2
    assert "`rocket`" in capsys.readouterr().err


def test_a_first_call_in_a_process_of_its_own():
    assert 0.01 < first_call("pacheco2021-a") < 300.0
