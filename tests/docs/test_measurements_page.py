"""The tables of docs/measurements.md can be read, and its columns are those of the reader."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import notchflex as nf

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "measurements.md").read_text("utf-8")
BLOCKS = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)


def test_tables_of_the_page_are_read(tmp_path):
    measured, rig = BLOCKS
    (tmp_path / "wrist.csv").write_text(measured)
    data = nf.read_measurements(tmp_path / "wrist.csv", nf.load_robot("pacheco2021-a"))
    assert data.pulls == ("a", "b")
    assert data.ignored == ()
    (tmp_path / "rig.csv").write_text(rig)
    assert len(nf.read_friction_rig(tmp_path / "rig.csv")) == 2


def columns_of_the_page() -> list[str]:
    found: list[str] = []
    for row in re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE):
        names = re.findall(r"`([^`]+)`", row)
        for name in names:
            if re.fullmatch(r"_r?[yz]", name):  # the same column of another axis
                letter = name[-1]
                name = re.sub(r"(?<=_)(r?)x(?=_)", rf"\g<1>{letter}", names[0])
            found.append(name.replace("axis_12.5", "axis_2.5"))
    return found


@pytest.mark.parametrize("column", columns_of_the_page())
def test_every_column_of_the_page_is_known(tmp_path, column):
    robot = nf.load_robot("pacheco2021-a")
    table = {"tendon_force_N": "0.5", "total_deg": "20", "notch_3_deg": "4", column: "1"}
    if column == "direction":
        table[column] = "loading"
    if column == "tendon_displacement_mm":
        table["tendon_force_N"] = ""
    (tmp_path / "one.csv").write_text(f"{','.join(table)}\n{','.join(table.values())}\n")
    assert nf.read_measurements(tmp_path / "one.csv", robot).ignored == ()
