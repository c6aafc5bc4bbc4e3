"""The sheet for shop and inspection: numbers of every cut."""

import dataclasses
import math

import pytest

import notchflex as nf
from notchflex.export.document import Subject
from notchflex.export.flat.sheet import pattern_sheet
from notchflex.export.options import PatternOptions


def texts_of(page):
    plain = [text.get_text() for text in page.texts]
    for axes in page.axes:
        plain += [text.get_text() for text in axes.texts]
        for table in axes.tables:
            plain += [cell.get_text().get_text() for cell in table.get_celld().values()]
    return plain


def rows_of(page):
    (table,) = page.axes[0].tables
    cells = table.get_celld()
    rows = range(1, 1 + max(row for row, _ in cells))
    return [[cells[row, column].get_text().get_text() for column in range(12)] for row in rows]


def test_the_table_has_the_nominal_numbers_of_every_cut(wrist):
    _, table, drawing = pattern_sheet(Subject(wrist), PatternOptions(kerf=0.03)).pages
    first = rows_of(table)[0]
    half = math.acos(1.0 - 1.4 / 0.81)
    assert first[:6] == ["1", "5", "8.0000", "8.8000", "0.8000", "0"]
    assert first[6] == f"{math.degrees(2.0 * half):.3f}"
    assert first[7] == f"{2.0 * (math.pi - half) * 0.81:.4f}"
    assert first[8:] == ["1.4000", "on-axis", "", ""]
    assert len(rows_of(table)) == 5
    assert "height 0.8" in texts_of(drawing)


def test_the_first_page_has_the_title_block_tolerances_and_warnings():
    robot = nf.load_robot("liu2022")
    robot = dataclasses.replace(robot, tolerance={"notch.depth": 0.01})
    words = "\n".join(texts_of(pattern_sheet(Subject(robot), PatternOptions()).pages[0]))
    for part in ("NOT COMPENSATED", "OFF-AXIS", "notch.depth standard deviation 0.01", "WARNING"):
        assert part in words


def test_a_long_table_goes_on_on_the_next_page():
    robot = nf.load_robot("york2015")
    robot = robot.replace(notch=(dataclasses.replace(robot.notch[0], repeat=35),))
    robot = robot.with_value("tendon.end_body", 35)
    sheet = pattern_sheet(Subject(robot), PatternOptions())
    assert sheet.facts["pages"] == 4
    numbers = [row[0] for page in sheet.pages[1:3] for row in rows_of(page)]
    assert numbers == [str(number) for number in range(1, 36)]


@pytest.mark.parametrize("y_unit", ["deg"])
def test_it_is_written_as_pdf(wrist, tmp_path, y_unit):
    files = [tmp_path / "a.pdf", tmp_path / "b.pdf"]
    for file in files:
        nf.export_robot(wrist, file, PatternOptions(y_unit=y_unit))
    first, second = (file.read_bytes() for file in files)
    assert first.startswith(b"%PDF")
    assert first == second
