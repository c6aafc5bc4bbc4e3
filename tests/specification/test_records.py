"""The records that specifications share: their schemas, the limits in words, entries by name."""

from __future__ import annotations

import json

import numpy as np
import pytest

import notchflex as nf
from notchflex.cli import run
from refusals import refused


@pytest.mark.parametrize("option", ["--design", "--sweep"])
def test_every_key_of_a_file_is_described(option, capsys):
    assert run(["schema", option]) == 0
    schema = json.loads(capsys.readouterr().out)
    tables = [schema, *schema["$defs"].values()]
    for table in tables:
        for key, value in table["properties"].items():
            if key != "load" or table is not schema:
                assert value.get("description"), (table.get("title"), key)


def test_an_editor_sees_loads_by_name(capsys):
    run(["schema", "--design"])
    schema = json.loads(capsys.readouterr().out)
    assert schema["properties"]["load"]["additionalProperties"] == {"$ref": "#/$defs/DesignState"}
    assert "name" not in schema["$defs"]["DesignState"]["properties"]


def test_one_quantity_has_one_name_everywhere():
    assert nf.AcceptanceLimit("strain", upper=0.06).quantity == "peak_strain"
    wrist = nf.load_robot("pacheco2021-a")
    (limit,) = nf.workspace(wrist, states=32, tension=0.5, limits={"angle": (0.0, np.inf)}).limits
    assert (limit.quantity, limit.ends) == ("total_angle", (0.0, np.inf))
    assert limit.text == "total bending angle at least 0 deg"


@pytest.mark.parametrize(
    ("keys", "code"),
    [
        ({"notch": [1, 2, 0]}, "OUT_OF_RANGE"),
        ({"notch": "1"}, "WRONG_TYPE"),
        ({"tendon": 1}, "CONFLICT"),
        ({"axis": "q"}, "UNKNOWN_NAME"),
        ({"upper": 0.01, "lower": 0.02}, "OUT_OF_RANGE"),
        ({"upper": 6.0}, "OUT_OF_RANGE"),  # in percent
    ],
)
def test_entries_and_limits_that_cannot_be(keys, code):
    with refused(code):
        nf.AcceptanceLimit("peak_strain", **{"upper": 0.06} | keys)
