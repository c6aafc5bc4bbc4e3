"""How notches of every kind are listed: their own columns, within 80 characters."""

import math

import pytest
from rich.console import Console

import notchflex as nf
from notchflex.cli.verbs.show import (
    closing_legend,
    closing_table,
    description_tables,
    run_of,
)


def text_of(table):
    console = Console(width=200, no_color=True)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


@pytest.mark.parametrize("name", list(nf.list_robots()))
def test_descriptions_fit_80_columns(name):
    for table in description_tables(nf.load_robot(name)):
        assert max(len(line) for line in text_of(table).splitlines()) <= 80


def test_each_kind_has_its_own_columns():
    (table,) = description_tables(nf.load_robot("gao2017"))
    text = text_of(table)
    for word in ("u-link", "slot", "radius", "0.275", "proximal", "away", "toward"):
        assert word in text
    assert "cut" not in text.replace("uncut", "")
    rows = [line.split() for line in text.splitlines() if "0.275" in line]
    assert [row[:4] for row in rows] == [["1,", "3", "…", "27"], ["2,", "4", "…", "26"]]
    (table,) = description_tables(nf.load_robot("liu2022"))
    assert "1–7" in text_of(table)


def test_kinds_of_one_robot_have_a_table_each():
    liu = nf.load_robot("liu2022")
    arc = nf.ArcNotch("off-axis", depth=7.0, height=2.0, uncut_length=1.0)
    tables = description_tables(liu.replace(notch=(*liu.notch, arc)))
    assert ["strip" in text_of(one) for one in tables] == [True, False]
    assert "off-axis" in text_of(tables[1])


def test_runs_are_written_shortly():
    assert run_of([4]) == "4"
    assert run_of([1, 2]) == "1–2"
    assert run_of([1, 2, 4, 5, 6]) == "1–2, 4–6"
    assert run_of([2, 4, 6, 8]) == "2, 4 … 8"


ROW = {
    "notch": 1,
    "area_mm2": 1.0,
    "second_moment_mm4": 2.0,
    "moment_arm_mm": [0.0, 3.25],
    "closing_angle_deg": float("nan"),
    "closing_tendon": 2,
    "closing_tension_N": float("nan"),
    "closing_status": "never",
    "closing_outer_strain": float("nan"),
    "closing_peak_strain": float("nan"),
}


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ({"closing_status": "never"}, "never"),
        ({"closing_status": "not found"}, "not found"),
        ({"closing_status": "closes", "closing_tension_N": 1.5}, "1.500"),
    ],
)
def test_a_failed_search_is_not_called_never(given, word):
    row = ROW | given
    others = {"never", "not found"} - {word}
    text = " ".join(text_of(closing_table([row])).split())
    assert word in text
    assert not any(other in text for other in others)
    legend = closing_legend([row])
    assert ("no tension closes the notch" in legend) is (word == "never")
    assert ("the notch may close" in legend) is (word == "not found")


def test_columns_without_a_number_are_left_out():
    text = text_of(closing_table([{**ROW, "closing_tension_N": math.inf}]))
    assert "never" in text
    assert "3.2500" in text
    assert "strain" not in text
    assert "closing" not in text
    assert "centroid" not in closing_legend([ROW])
    spine = {**ROW, "centroid_mm": 0.5, "closing_angle_deg": 30.0, "closing_outer_strain": 0.08}
    text = text_of(closing_table([spine]))
    assert "8.00" in text
    assert "30.00" in text
    assert "eq. 16" in closing_legend([spine])
