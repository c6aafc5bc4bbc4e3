"""The sheet for shop and inspection: numbers of every cut, title block, tolerances, pages."""

import dataclasses
import math
import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import notchflex as nf
from notchflex.export.formats import PatternOptions, Subject
from notchflex.export.sheet import pattern_sheet
from notchflex.robot.writing import robot_text

ENTRIES = {
    "part": "W-12",
    "revision": "B",
    "material": "Nitinol SE508",
    "finish": "electropolished",
    "drawn": "A. Smith",
    "date": "2026-11-26",
}


def sheet_of(robot, **options):
    return pattern_sheet(Subject(robot), PatternOptions(**options))


def texts_of(page):
    plain = [text.get_text() for text in page.texts]
    for axes in page.axes:
        plain += [text.get_text() for text in axes.texts]
        for table in axes.tables:
            plain += [cell.get_text().get_text() for cell in table.get_celld().values()]
    return plain


def rows_of(page):
    (table,) = (table for axes in page.axes for table in axes.tables)
    cells = table.get_celld()
    rows = range(1, 1 + max(row for row, _ in cells))
    return [[cells[row, column].get_text().get_text() for column in range(11)] for row in rows]


def test_the_table_has_the_nominal_numbers_of_every_cut(wrist):
    _, table, drawing = sheet_of(wrist, kerf=0.03).content
    rows = rows_of(table)
    half = math.acos(1.0 - 1.4 / 0.81)
    assert [row[0] for row in rows] == ["1", "2", "3", "4", "5"]
    assert rows[-1][:5] == ["5", "8.0000", "8.8000", "0.8000", "0"]
    assert rows[-1][5] == f"{math.degrees(2.0 * half):.3f}"
    assert rows[-1][6] == f"{2.0 * (math.pi - half) * 0.81:.4f}"
    assert rows[-1][7:] == ["1.4000", "on-axis", "", ""]
    assert "height\n[mm]" in texts_of(table)
    assert not any("width" in text for text in texts_of(table))
    assert "height 0.8" in texts_of(drawing)


def test_the_first_page_has_notes_and_warnings():
    words = "\n".join(texts_of(sheet_of(nf.load_robot("liu2022")).content[0]))
    for part in ("NOT COMPENSATED", "OFF-AXIS", "WARNING", "numbered from the base"):
        assert part in words


def test_the_title_block_has_what_the_robot_file_says(wrist):
    """On every page; what is not said has a default or stays empty."""
    robot = wrist.replace(drawing=nf.Drawing(**ENTRIES))
    sheet = sheet_of(robot)
    for number, page in enumerate(sheet.content, start=1):
        texts = texts_of(page)
        assert set(ENTRIES.values()) <= set(texts)
        assert f"{number} of {len(sheet.content)}" in texts
        assert "scale" in texts
    plain = texts_of(sheet_of(wrist).content[0])
    assert {wrist.name, "superelastic (of the model)"} <= set(plain)


def test_the_table_of_the_title_block_is_read_set_and_written(wrist, tmp_path):
    file = tmp_path / "a.toml"
    lines = "\n".join(f'{key} = "{value}"' for key, value in ENTRIES.items() if key != "date")
    file.write_text(f"{robot_text(wrist)}\n[drawing]\n{lines}\ndate = 2026-11-26\n")
    robot = nf.load_robot(file)
    assert robot.drawing == nf.Drawing(**ENTRIES)
    assert robot.with_value("drawing.revision", 3).drawing.revision == "3"
    for changed in (robot, wrist.with_value("drawing.part", "W-13")):
        nf.save_robot(changed, file)
        assert nf.load_robot(file) == changed
    # A title block changes no state, so that states of the plain robot go on.
    state = nf.simulate(wrist, nf.pull(0.0, 1.0, steps=2)).state
    assert nf.simulate(robot, nf.pull(1.0, 1.1, steps=2), from_state=state).converged.all()


@pytest.mark.parametrize(
    ("tolerance", "text"),
    [
        ({"notch.height": {"plus": 0.01, "minus": 0.01}}, "height 0.8 ±0.01"),
        ({"notch.height": 0.01}, "height 0.8 ±0.02"),
        ({"notch.height": "1 %"}, "height 0.8 ±0.016"),
        ({"notch.depth": {"plus": 0.02, "minus": 0.0}}, "depth\n1.4 +0.02 −0"),
        ({"tube.outer_diameter": {"plus": 0, "minus": 0.013}}, "outer diameter 1.62 +0 −0.013"),
        ({"tendon.radius": 0.01}, "tendon\nradius\n0.7 ±0.02"),
        ({"notch[3].depth": 0.01}, "Of single parts: notch[3].depth 1.4 ±0.02."),
    ],
)
def test_dimensions_have_their_tolerances(wrist, tolerance, text):
    page = sheet_of(dataclasses.replace(wrist, tolerance=tolerance)).content[-1]
    assert any(text in one for one in texts_of(page))


def test_a_long_table_goes_on_on_the_next_page():
    robot = nf.load_robot("york2015")
    robot = robot.replace(notch=(dataclasses.replace(robot.notch[0], repeat=35),))
    robot = robot.with_value("tendon.end_body", 35)
    sheet = sheet_of(robot)
    assert sheet.facts["pages"] == 4
    numbers = [row[0] for page in sheet.content[1:3] for row in rows_of(page)]
    assert numbers == [str(number) for number in range(1, 36)]


UNUSUAL = {
    "long": {"tube.base_length": 1e6},
    "thick": {"tube.outer_diameter": 60.0, "tube.inner_diameter": 50.0, "tendon.radius": 10.0},
    "uneven": {f"notch[{number}].depth": 1.3 + 0.01 * number for number in range(1, 6)},
}


def numbers_of(axes):
    """The numbers along x that are drawn: matplotlib makes others beyond the ends."""
    low, high = axes.get_xlim()
    return [one for one in axes.get_xticklabels() if low <= one.get_position()[0] <= high]


@pytest.mark.parametrize("paper", ["a4", "a3"])
@pytest.mark.parametrize("name", ["wrist", "york2015", "liu2022", "gao2017", *UNUSUAL])
def test_every_page_fits_its_paper(wrist, name, paper):
    """All that is written lies within the frame."""
    robot = wrist.with_values(UNUSUAL.get(name, {}))
    if name in nf.list_robots():
        robot = nf.load_robot(name)
    width, height = {"a4": (297.0, 210.0), "a3": (420.0, 297.0)}[paper]
    for page in sheet_of(robot, paper=paper).content:
        assert page.get_size_inches() * 25.4 == pytest.approx([width, height])
        canvas = FigureCanvasAgg(page)
        canvas.draw()  # places the numbers of the axes
        renderer = canvas.get_renderer()
        boxes = [
            (text.get_text(), text.get_window_extent(renderer).extents * 25.4 / page.dpi)
            for axes in page.axes
            for text in (*axes.texts, *numbers_of(axes), axes.xaxis.label, axes.yaxis.label)
            if (text.get_text() and axes.axison) or text in axes.texts
        ]
        for text, (left, low, right, top) in boxes:
            assert 20.0 < left < right < width - 10.0 or not text, text
            assert 10.0 < low < top < height - 10.0 or not text, text


def test_the_pattern_has_the_scale_of_the_title_block(wrist):
    page = sheet_of(wrist).content[0]
    (ratio,) = (int(one[1]) for text in texts_of(page) if (one := re.fullmatch(r"(\d+):1", text)))
    axes = page.axes[1]
    size = axes.get_position().size * page.get_size_inches() * 25.4
    assert np.ptp([axes.get_xlim(), axes.get_ylim()], axis=1) * ratio == pytest.approx(size)


def test_the_sheet_is_in_mm_where_other_files_are_in_degrees(wrist):
    first, second = (texts_of(sheet_of(wrist, y_unit=unit).content[0]) for unit in ("mm", "deg"))
    assert first == second


def test_it_is_written_as_pdf(wrist, tmp_path):
    files = [tmp_path / "a.pdf", tmp_path / "b.pdf"]
    for file in files:
        nf.export_robot(wrist.replace(name="$\\frac{1}{$"), file)
    first, second = (file.read_bytes() for file in files)
    assert first.startswith(b"%PDF")
    assert first == second
