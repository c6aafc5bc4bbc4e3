"""Which rows and columns of a path are printed, and what is said of the rest."""

import re

import numpy as np
import pytest

from notchflex.cli import path_table
from notchflex.support import QUANTITIES

WRIST = ("simulate", "pacheco2021-a")
NAMES = [name for name, quantity in QUANTITIES.items() if "row" not in quantity.per]


def shown(out):
    """The steps of a table, counted from 0."""
    return [int(row) - 1 for row in re.findall(r"(?m)^ +(\d+) ", out)]


@pytest.mark.parametrize(("steps", "stride"), [(60, 1), (61, 2), (121, 5), (500, 10)])
def test_long_paths_have_a_regular_stride_with_both_ends(call, steps, stride):
    out = call(*WRIST, "--tension", f"0:1:{steps}", "--columns", "tension")[1]
    assert shown(out) == sorted({*range(0, steps, stride), steps - 1})


def test_reversals_and_peaks_are_always_shown(call):
    loop = ("--tension", "0:3:101,3:0.7:78,0.7:2:66", "--columns", "tension")
    out = call(*WRIST, *loop)[1]
    assert shown(out) == sorted({*range(0, 245, 5), 100, 101, 178, 179, 244})
    assert "245 steps, 53 shown: every 5th one, and where the load reverses" in out
    out = call(*WRIST, *loop, "--all")[1]
    assert shown(out) == list(range(245))
    assert "shown" not in out


def test_the_first_failure_is_always_shown(call):
    code, out, err = call(*WRIST, "--stroke", "0:4:101", "--columns", "stroke")
    failed = int(re.search(r"step (\d+) of 101", err)[1]) - 1
    assert (code, failed % 2) == (1, 1)
    assert shown(out) == sorted({*range(0, 101, 2), failed})
    assert f"{4 * failed / 100:.3f}" in out  # what was commanded


def test_a_path_that_reverses_all_the_time_keeps_its_extremes(call):
    tension = np.where(np.arange(301) % 2, 1.0, 2.0)
    tension[[37, 41]] = 2.5, 0.0
    loads = ("--tension", ",".join(map(str, tension)), "--columns", "tension")
    assert shown(call(*WRIST, *loads)[1]) == sorted({*range(0, 301, 10), 37, 41})


def test_all_rows_are_refused_where_nobody_could_read_them(refused, monkeypatch):
    monkeypatch.setattr(path_table, "_MAX_ALL", 20)
    refused("UNSUPPORTED", *WRIST, "--tension", "0:1:21", "--all")


def test_every_usual_column_is_explained_with_its_unit(call):
    out = call(*WRIST, "--tension", "0,3")[1]
    legend = " ".join(out.partition("T: ")[2].split())
    for words in (
        "base [N]",
        "drawn out at the base [mm]",
        "total bending angle [deg]",
        "* closed",
    ):
        assert words in legend
    assert "strain: largest strain of all notches [%]" in legend
    assert "tip y" not in out  # across the plane of a planar robot


@pytest.mark.parametrize("columns", [(), ("--columns", "notch_angle,total_angle")])
def test_what_does_not_fit_is_continued_below(call, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", "40")
    out = call(*WRIST, "--tension", "0,2", *columns)[1]
    table = out[: out.index("n: notch")].partition("T: ")[0]
    assert max(map(len, table.splitlines())) <= 40
    assert table.count("step") == (2 if columns else 3)


def test_every_quantity_can_be_a_column(call):
    code, out, _ = call(*WRIST, "--stroke", "0.5,4", "--columns", ",".join(NAMES))
    assert code == 1
    assert "This path has no values of commanded_tension" in " ".join(out.split())
    assert "slip toward" in out
    assert "converged" in out
