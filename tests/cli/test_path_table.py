"""Which rows and columns of a path are printed, and what is said of the rest."""

import numpy as np
import pytest

from fake_path import fake_path
from notchflex.cli.path_table import (
    MAX_ROWS,
    MEANINGS,
    parse_columns,
    print_path,
    reversals_of,
    rows_note,
    shown_rows,
    usual_columns,
)
from notchflex.errors import ErrorCode, InputError
from notchflex.results.quantities import QUANTITIES


def commanded(*tension):
    """A path of one tendon with these tensions; only its rows matter."""
    path = fake_path(2)
    column = np.array(tension, float)[:, None]
    path.columns["tension"] = path.columns["commanded_tension"] = column
    path.columns["commanded_stroke"] = np.full_like(column, np.nan)
    path.columns["converged"] = np.ones(len(column), bool)
    return path


def test_short_paths_are_shown_whole():
    path = commanded(*range(MAX_ROWS))
    assert shown_rows(path) == (list(range(MAX_ROWS)), 1)
    assert rows_note(MAX_ROWS, MAX_ROWS, 1) == ""


@pytest.mark.parametrize(("steps", "stride"), [(61, 2), (121, 5), (500, 10), (6001, 200)])
def test_long_paths_have_a_regular_stride_with_both_ends(steps, stride):
    rows, found = shown_rows(commanded(*range(steps)))
    assert found == stride
    assert rows == sorted({*range(0, steps, stride), steps - 1})


def test_reversals_peaks_and_the_first_failure_are_always_shown():
    up, down = np.linspace(0.0, 3.0, 101), np.linspace(3.0, 0.7, 78)
    path = commanded(*up, *down, *np.linspace(0.7, 2.0, 66))
    assert reversals_of(path.columns["tension"][:, 0]) == {100, 101, 178, 179}
    path.columns["converged"][213:] = False
    rows, stride = shown_rows(path)
    assert stride == 5
    assert rows == sorted({*range(0, 245, 5), 101, 178, 179, 213, 244})
    assert rows_note(245, len(rows), stride).startswith("245 steps, 54 shown: every 5th one")


def test_a_path_that_reverses_all_the_time_keeps_its_extremes():
    tension = np.where(np.arange(301) % 2, 1.0, 2.0)
    tension[[37, 41]] = 5.0, 0.0
    rows, _ = shown_rows(commanded(*tension))
    assert rows == sorted({*range(0, 301, 10), 37, 41})


def test_all_rows_are_refused_where_nobody_could_read_them():
    assert shown_rows(commanded(*range(100)), every_row=True) == (list(range(100)), 1)
    with pytest.raises(InputError) as problem:
        shown_rows(commanded(*np.zeros(20_001)), every_row=True)
    assert problem.value.code is ErrorCode.UNSUPPORTED


def test_every_usual_column_is_explained_with_its_unit(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    print_path(fake_path(3), "a wrist")
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "a wrist"
    legend = " ".join(line for line in out if "[" in line)
    for name, unit in (("tension", "N"), ("stroke", "mm"), ("total_angle", "deg")):
        assert f"{MEANINGS[name]} [{unit}]" in legend
    assert "strain: largest strain of all notches [%]" in legend
    assert "* closed" in legend


def test_what_was_asked_for_is_continued_below(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    path = fake_path(3)
    print_path(path, "a wrist", columns=["notch_angle", "total_angle"])
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 40
    assert out.count("step") == 2
    assert f"{np.degrees(path.total_angle[2]):.2f}" in out
    assert f"{np.degrees(path.notch_angle[1, 4]):.2f}" in out


@pytest.mark.parametrize("name", [n for n, q in QUANTITIES.items() if "row" not in q.per])
def test_every_quantity_can_be_a_column(capsys, name):
    path = fake_path(3, failed=1)
    assert parse_columns(name) == [name]
    print_path(path, "a wrist", columns=[name])
    out = capsys.readouterr().out
    values = np.asarray(getattr(path, name))
    if values.dtype.kind == "f" and not np.isfinite(values).any():
        assert "–" in out
    assert len([line for line in out.splitlines() if line.startswith("   1")]) >= 1


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("notch_angel", ErrorCode.UNKNOWN_NAME),
        ("tension,", ErrorCode.UNKNOWN_NAME),
        ("gap,gap", ErrorCode.CONFLICT),
        ("tip_rotation", ErrorCode.UNKNOWN_NAME),
    ],
)
def test_wrong_names_are_refused(text, code, wording):
    with pytest.raises(InputError) as problem:
        parse_columns(text)
    assert problem.value.code is code
    wording(f"--columns {text}", str(problem.value))


def test_a_step_that_failed_shows_what_was_commanded():
    path = fake_path(3, failed=1)
    columns = usual_columns(path, [4, 5])
    (tension,), (stroke,) = columns["tension"], columns["stroke"]
    assert tension.cells == ["1.500", "0.000"]
    assert stroke.cells[1] == "–"
