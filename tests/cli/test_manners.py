"""What is written where: progress on a terminal only, quiet, colours, the width of tables."""

import json
import os
import pty
import re
import subprocess
import sys

import pytest

import notchflex as nf

PULL = ("simulate", "pacheco2021-a", "--tension", "0:3:4")
LONGER = [pytest.param(name, marks=pytest.mark.nightly) for name in ("gao2017", "two-axis-wrist")]
BESIDE = (*PULL, "--beside", "slick: friction.coefficient=0", "--beside", "Y: york2015")


def on_a_terminal(*arguments, **variables):
    """Run the command with standard output and error on a terminal; return what it shows."""
    own, its = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
    with subprocess.Popen(
        [sys.executable, "-m", "notchflex", *arguments],
        stdin=subprocess.DEVNULL, stdout=its, stderr=its,
        env=environment | {"TERM": "xterm-256color", "COLUMNS": "80"} | variables,
    ) as process:  # fmt: skip
        os.close(its)
        shown = b""
        try:
            while part := os.read(own, 65536):
                shown += part
        except OSError:  # the other end was closed
            pass
        assert process.wait(timeout=120) == 0
    os.close(own)
    return shown.decode()


def test_colours_on_a_terminal_only_and_not_where_unwanted():
    assert "\x1b[1m" in on_a_terminal("robots")
    for variables in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
        assert "\x1b[36m" not in on_a_terminal("robots", **variables)


def test_progress_is_shown_on_a_terminal_and_taken_away():
    shown = on_a_terminal(*PULL)
    assert "solving 4 steps" in shown
    assert "solving 4 steps" not in on_a_terminal(*PULL, "--quiet")


def test_nothing_but_the_table_in_a_pipe(call):
    code, out, err = call(*PULL)
    assert code == 0
    assert "\x1b" not in out + err
    assert "solving" not in out + err
    assert "153.14" in out


def test_quiet_keeps_warnings_errors_and_documents(call):
    code, out, err = call(*PULL, "--quiet", "--csv", "a.csv")
    assert (code, out) == (0, "")
    assert "Warning: the peak strain passes" in err
    assert json.loads(call(*PULL, "--quiet", "--json", "-")[1])["converged"] is True
    code, out, err = call("simulate", "pacheco2021-a", "--stroke", "9", "--quiet")
    assert (code, out) == (1, "")
    assert "Error: not converged" in err
    assert call("show", "pacheco2021-a", "--quiet") == (0, "", "")
    assert call("robots")[1]  # the next call is not quiet


@pytest.mark.parametrize("robot", ["pacheco2021-a", "liu2022", *LONGER])
def test_tables_fit_80_columns(call, robot):
    out = call("show", robot)[1]
    assert max(map(len, out.splitlines())) <= 80


def test_comparison_of_many_notches_fits_80_columns(call, tmp_path):
    assert call("simulate", "gao2017", "--tension", "1=1,2", "--csv", "g.csv")[0] == 0
    code, out, _ = call("compare", "gao2017", "g.csv")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    for notch in range(1, 28):
        assert f"notch {notch} [deg]" in out


@pytest.mark.parametrize(
    ("columns", "in_one"), [pytest.param("70", False, marks=pytest.mark.nightly), ("130", True)]
)
def test_a_table_is_as_wide_as_the_terminal(columns, in_one):
    loads = ("--tension", "0:2:3", "--gravity", "0,0.5,-9.81")
    out = on_a_terminal("simulate", "pacheco2021-a", *loads, COLUMNS=columns)
    lines = out.splitlines()
    assert any("n5" in line and "tip y" in line for line in lines) is in_one
    table = lines[: next(i for i, line in enumerate(lines) if line.startswith("T: "))]
    assert max(len(re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", line)) for line in table[1:]) <= int(
        columns
    )


@pytest.mark.parametrize("columns", ["", "60"])
def test_a_pipe_has_one_width_unless_told(call, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    _, out, _ = call("simulate", "two-axis-wrist", "--tension", "1=0:2:3", "--tension", "2=1")
    assert any("T4" in line and "n8" in line for line in out.splitlines()) is not columns


def test_robots_beside_each_other(call, tmp_path):
    files = ("--json", "b.json", "--plot", "b.html", "--csv", "b.csv")
    code, out, err = call(*BESIDE, *files)
    assert code == 0
    head = next(line for line in out.splitlines() if "slick" in line)
    assert head.split() == ["step", "pacheco2021-a", "slick", "Y"]
    assert "slick: the peak strain" in err
    document = json.loads((tmp_path / "b.json").read_text())
    assert list(document["beside"]) == ["slick", "Y"]
    wrist = nf.load_robot("pacheco2021-a").with_value("friction.coefficient", 0.0)
    wanted = nf.simulate(wrist, nf.pull(0.0, 3.0, steps=4)).total_angle[1]
    found = document["beside"]["slick"]["steps"][1]["total_angle_deg"]
    assert found == pytest.approx(wanted * 57.29577951308232)
    assert "slick" in (tmp_path / "b.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("code", "given"),
    [
        ("UNKNOWN_NAME", ["slick"]),
        ("UNKNOWN_NAME", ["a: friction.nothing=0"]),
        ("BAD_SYNTAX", ["=1"]),
        ("CONFLICT", ["pacheco2021-a"]),
        ("CONFLICT", ["a: york2015", "a: pacheco2021-b"]),
        (
            "OUT_OF_RANGE",
            [f"{number}: york2015" for number in range(5)],
        ),
    ],
)
def test_what_cannot_stand_beside_is_told(refused, code, given):
    refused(code, *PULL, *(part for text in given for part in ("--beside", text)))


def test_a_robot_with_fewer_tendons_cannot_be_pulled_alike(refused):
    refused("WRONG_SHAPE", "simulate", "two-axis-wrist", "--tension", "2=1", "--beside", "york2015")


def test_every_kind_of_file(call, tmp_path):
    files = ("--nc", "a.nc", "--parquet", "a.parquet", "--json", "a.json", "--plot", "a.gif")
    assert call(*PULL, *files)[0] == 0
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 3.0, steps=4))
    for name in ("a.nc", "a.parquet", "a.json"):
        assert (nf.read_path(tmp_path / name).notch_angle == path.notch_angle).all()
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.parametrize(
    ("code", "options"),
    [
        ("FILE_FORMAT", ("--nc", "-")),
        ("FILE_FORMAT", ("--parquet", "-")),
        ("FILE_UNWRITABLE", ("--nc", "missing/a.nc")),
        ("FILE_FORMAT", ("--plot", "a.jpg")),
        ("FILE_FORMAT", ("--plot", "a.gif", "--beside", "york2015")),
        ("CONFLICT", ("--nc", "a", "--parquet", "a")),
    ],
)
def test_files_that_cannot_be_written_are_told_first(refused, code, options):
    refused(code, *PULL, *options)
