"""Sweeps: the same bytes whoever works on them, going on after a stop, refusals, reading."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit

import notchflex as nf
from notchflex.cli import run
from notchflex.pieces import folder as pieces
from notchflex.plotting import sweep_picture
from refusals import refused as expect_refused
from swept import TABLE, digests, plan


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sweep") / "whole"
    nf.sweep(plan(), folder)
    return folder


@contextlib.contextmanager
def files_up_to(size: int | None) -> Iterator[None]:
    """Let the system take no file beyond a size, as a full disk takes none."""
    if size is None:
        yield
        return
    resource = pytest.importorskip("resource")
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limit[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)


@pytest.fixture
def refused(wording):
    def runner(code: str, name: str, plan: Any, folder: Path, **options: Any) -> None:
        limit = options.pop("largest_file", None)
        with pytest.raises(nf.InputError) as caught, files_up_to(limit):
            nf.sweep(plan, folder, **options)
        assert caught.value.code.name == code, caught.value
        wording(f"sweep: {name}", str(caught.value).replace(str(folder.parent), ""))

    return runner


def test_rows_are_those_of_single_solves(whole):
    found = nf.read_sweep(whole)
    assert found.finished
    assert found.rows == 200
    rows = found.lazy().collect()
    assert rows["row"].to_list() == list(range(200))
    robot, load = nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=3)
    for row in (0, 57, 199):
        one = rows.row(row, named=True)
        values = {name: one[name] for name in ("notch.depth", "friction.coefficient")}
        path = nf.simulate(robot.with_values(values), load)
        assert np.isclose(one["total_angle_deg"], np.degrees(path.total_angle[-1]), rtol=2e-5)
        assert np.isclose(one["notch_angle_2_deg"], np.degrees(path.notch_angle[-1, 1]), rtol=2e-5)
        assert one["code"] == ("accepted" if one["total_angle_deg"] <= 60.0 else "rejected")


def test_what_is_summed_up_is_that_of_the_rows(whole):
    found = nf.read_sweep(whole)
    angle = found.lazy().collect()["total_angle_deg"].to_numpy()
    one = json.loads((whole / "summary.json").read_text())["columns"]["total_angle_deg"]
    assert one["count"] == 200
    assert np.isclose(one["mean"], angle.mean(), rtol=1e-12)
    assert np.isclose(one["sd"], angle.std(), rtol=1e-9)
    assert one["smallest"] == angle.min()
    assert one["largest"] == angle.max()
    assert sum(one["histogram"]["counts"]) == 200
    exact = np.quantile(angle, [0.1, 0.5, 0.9], method="inverted_cdf")
    assert np.allclose(found.quantiles("total_angle_deg", [0.1, 0.5, 0.9]), exact, atol=0.3)
    worst = found.worst("total_angle_deg")
    assert worst["total_angle_deg"].to_list() == sorted(angle)[:-4:-1]
    assert found.counts["rejected"] == (angle > 60.0).sum()


def test_grid_as_data_set(whole):
    data = nf.read_sweep(whole).to_xarray()
    assert dict(data.sizes) == {"friction.coefficient": 2, "point": 100}
    rows = nf.read_sweep(whole).lazy().collect()
    chosen = data.sel({"friction.coefficient": 0.1})["total_angle_deg"].values
    assert (chosen == rows["total_angle_deg"].to_numpy()[100:]).all()
    assert (data["notch.depth"].values == rows["notch.depth"].to_numpy()[100:]).all()


def test_parts_in_any_order_give_the_bytes_of_the_whole(whole, tmp_path):
    for number in (5, 1, 7, 2, 3, 6, 4):
        nf.sweep(plan(), tmp_path / "parts", part=(number, 7))
    assert digests(tmp_path / "parts") == digests(whole)


def test_parts_in_folders_of_their_own_are_copied_together(whole, tmp_path):
    for number in (1, 2):
        nf.sweep(plan(), tmp_path / str(number), part=(number, 2))
    for file in (tmp_path / "2" / "pieces").iterdir():
        file.rename(tmp_path / "1" / "pieces" / file.name)
    nf.sweep(plan(), tmp_path / "1")
    assert digests(tmp_path / "1") == digests(whole)


def test_a_stopped_sweep_goes_on(whole, tmp_path, monkeypatch):
    """Ctrl-C after three pieces, two of them damaged, and one left half written."""
    folder = tmp_path / "stopped"
    done = []

    def stop(count: int, *_: int) -> None:
        done.append(count)
        if len(done) == 3:
            raise KeyboardInterrupt

    with monkeypatch.context() as one:
        # Several threads may have done all of it before the third piece is told.
        one.setattr("notchflex.solver.programs.compiled.number_of_cores", lambda: 1)
        with pytest.raises(KeyboardInterrupt):
            nf.sweep(plan(), folder, progress=stop)
    files = sorted((folder / "pieces").glob("piece-*"))
    assert len(files) == 3
    assert not (folder / "summary.json").exists()
    unfinished = nf.read_sweep(folder)
    assert not unfinished.finished
    assert len(unfinished.lazy().collect()) == unfinished.rows
    files[0].write_bytes(files[0].read_bytes()[:1000])
    rotten = bytearray(files[1].read_bytes())
    rotten[200] ^= 1  # a number, which nothing else would tell
    files[1].write_bytes(rotten)
    (folder / "pieces" / ".notchflex-piece-000000005-abc.parquet").write_bytes(b"half")
    monkeypatch.setattr("notchflex._replacing._swept", set())
    worked = []
    make = pieces.write_piece
    monkeypatch.setattr(
        "notchflex.pieces.run.write_piece",
        lambda *args: worked.append(args[2]) or make(*args),
    )
    nf.sweep(plan(), folder)
    assert sorted(worked) == [0, 1, 3, 4, 5, 6]
    assert digests(folder) == digests(whole)


def test_another_plan_version_or_robot_is_refused(whole, tmp_path, monkeypatch, refused):
    before = digests(whole)
    other = plan(sampling={"points": 100, "seed": 5})
    refused("CONFLICT", "another seed", other, whole)
    refused("CONFLICT", "another robot", plan(robot="pacheco2021-b"), whole)
    monkeypatch.setattr("notchflex.pieces.folder.__version__", "0.0.1")
    refused("CONFLICT", "another version", plan(), whole)
    assert digests(whole) == before


HOLD = """
import fcntl, sys
file = open(sys.argv[1], "ab")
fcntl.lockf(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB, 2, 3)
print("held", flush=True)
sys.stdin.read()
"""


def test_two_at_once_on_one_folder(whole, refused):
    """Another process holds pieces 3 and 4 of seven."""
    pytest.importorskip("fcntl")
    command = [sys.executable, "-c", HOLD, str(whole / ".lock")]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        refused("CONFLICT", "two at once", plan(), whole)
        refused("CONFLICT", "two at once, a part", plan(), whole, part=(4, 7))
        nf.sweep(plan(), whole, part=(7, 7))
        other.communicate("")
    nf.sweep(plan(), whole)


def test_a_full_disk_loses_nothing(whole, tmp_path, refused):
    folder = tmp_path / "full"
    nf.sweep(plan(), folder, part=(1, 7))
    refused("FILE_UNWRITABLE", "full disk", plan(), folder, largest_file=3000)
    assert 32 <= nf.read_sweep(folder).rows < 200  # a thread may just have been at work
    assert not list((folder / "pieces").glob(".*"))
    nf.sweep(plan(), folder)
    assert digests(folder) == digests(whole)


def test_failures_are_rows_with_codes(tmp_path, capsys):
    """A notch deeper than the tube is no robot; where all are, the exit code is 1."""
    depths = {"value": "notch.depth", "values": [-0.1, 1.7]}
    changes = {"variable": [depths], "sampling": None, "keep": [{"quantity": "total_angle"}]}
    with pytest.raises(nf.InputError):
        plan(**changes, output={"rows": "all"})
    found = nf.sweep(plan(**changes), tmp_path / "none")
    rows = found.lazy().collect()
    assert rows["code"].to_list() == ["INVALID_ROBOT"] * 2
    assert rows["total_angle_deg"].to_list() == [None, None]
    assert found.counts["INVALID_ROBOT"] == 2
    assert found.first_failures()["row"].to_list() == [0, 1]
    file = tmp_path / "plan.toml"
    table = {key: value for key, value in (TABLE | changes).items() if value is not None}
    file.write_text(tomlkit.dumps(table), encoding="utf-8")
    assert run(["sweep", str(file), "-o", str(tmp_path / "again")]) == 1
    assert "2 of 2 rows have no result" in capsys.readouterr().err


@pytest.mark.nightly
def test_failures_among_results(tmp_path):
    """Beyond some stroke the notches are closed, and there is no result."""
    changes: dict[str, Any] = {
        "variable": [{"value": "notch.height", "values": [0.1, 0.2, 1.0, 1.2, -0.9]}],
        "sampling": None,
        "load": {"drawn": {"stroke": 2.0}},
        "keep": [{"quantity": "total_angle"}],
    }
    found = nf.sweep(plan(**changes), tmp_path / "failures")
    rows = found.lazy().collect()
    codes = ["NOT_CONVERGED", "NOT_CONVERGED", "accepted", "accepted", "INVALID_ROBOT"]
    assert rows["code"].to_list() == codes
    assert rows["total_angle_deg"].is_null().to_list() == [True, True, False, False, True]
    robot = nf.load_robot("pacheco2021-a").with_value("notch.height", 1.2)
    path = nf.simulate(robot, nf.LoadPath(np.array([[np.nan]]), np.array([[2.0]])))
    assert np.isclose(rows["total_angle_deg"][3], np.degrees(path.total_angle[-1]), rtol=1e-9)


def test_without_rows_only_extremes_and_failures_are_kept(whole, tmp_path):
    output = {"rows": False, "extremes": 3}
    found = nf.sweep(plan(output=output), tmp_path / "few")
    every = nf.read_sweep(whole)
    assert len(found.lazy().collect()) < 100
    names = ["row", "notch.depth", "total_angle_deg"]
    worst = found.worst("total_angle_deg").select(names)
    assert worst.equals(every.worst("total_angle_deg").select(names))
    assert found.quantiles("total_angle_deg") == every.quantiles("total_angle_deg")
    with pytest.raises(nf.InputError) as caught:
        found.to_xarray()
    assert caught.value.code.name == "UNSUPPORTED"


@pytest.mark.parametrize(
    ("code", "name", "changes"),
    [
        ("UNKNOWN_NAME", "quantity", {"keep": [{"quantity": "totl_angle"}]}),
        ("UNKNOWN_NAME", "load", {"keep": [{"quantity": "total_angle", "load": "puled"}]}),
        ("CONFLICT", "index", {"keep": [{"quantity": "total_angle", "notch": 1}]}),
        ("OUT_OF_RANGE", "notch", {"keep": [{"quantity": "notch_angle", "notch": 9}]}),
        ("CONFLICT", "twice", {"keep": [{"quantity": "total_angle"}] * 2}),
        ("OUT_OF_RANGE", "step", {"keep": [{"quantity": "total_angle", "step": 4}]}),
        ("UNKNOWN_NAME", "load key", {"load": {"pulled": {"tensoin": 1.0}}}),
        ("MISSING_VALUE", "empty load", {"load": {"pulled": {}}}),
        (
            "OUT_OF_RANGE",
            "latin hypercube",
            {"sampling": {"method": "latin-hypercube", "points": 10**9}, "piece": 4096},
        ),
        (
            "UNKNOWN_NAME",
            "variable",
            {"variable": [{"value": "notch.dept", "values": [1.0, 2.0]}], "sampling": None},
        ),
        (
            "INVALID_ROBOT",
            "no robot",
            {"variable": [{"value": "notch.depth", "values": [5.0]}], "sampling": None},
        ),
    ],
)
def test_plans_that_do_not_fit_the_robot(code, name, changes, tmp_path, refused):
    refused(code, f"plan with a bad {name}", plan(**changes), tmp_path / "bad")
    assert not (tmp_path / "bad").exists()


def test_places_that_cannot_be_used(tmp_path, refused):
    (tmp_path / "file").write_text("x")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("x")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "sweep.json").write_text("{}")
    refused("FILE_UNWRITABLE", "no folder above", plan(), tmp_path / "no" / "folder")
    refused("FILE_UNWRITABLE", "a file", plan(), tmp_path / "file" / "below")
    refused("FILE_UNWRITABLE", "other files", plan(), tmp_path / "full")
    refused("FILE_DAMAGED", "damaged manifest", plan(), tmp_path / "other")
    refused("OUT_OF_RANGE", "part 8 of 7", plan(), tmp_path / "new", part=(8, 7))
    refused("OUT_OF_RANGE", "no worker", plan(), tmp_path / "new", workers=0)
    refused("BAD_SYNTAX", "no address", plan(), tmp_path / "new", scheduler="nonsense")
    refused("WRONG_TYPE", "no plan", 3, tmp_path / "new")
    assert not (tmp_path / "new").exists()
    for place in ("full", "nowhere", "other"):
        with pytest.raises(nf.InputError):
            nf.read_sweep(tmp_path / place)


def test_a_manifest_that_was_changed_after_its_pieces_is_refused(tmp_path):
    """Its pieces are marked with the former one: they are not shown as a sweep without rows."""
    nf.sweep(plan(), tmp_path / "s")
    file = tmp_path / "s" / "sweep.json"
    former = file.read_text()
    changed = json.loads(former)
    changed["robot"]["name"] = "another"
    file.write_text(json.dumps(changed))
    with expect_refused("FILE_DAMAGED", "sweep.json", "piece-000000000.parquet"):
        nf.read_sweep(tmp_path / "s")
    file.write_text(former)
    assert nf.read_sweep(tmp_path / "s").finished


def test_command_line(tmp_path, monkeypatch, capsys):
    """The commented plan, its cost, the sweep, its picture; and what is refused."""
    monkeypatch.chdir(tmp_path)
    assert run(["new", "new", "--sweep"]) == 0
    assert "notchflex sweep new.toml -o FOLDER" in capsys.readouterr().out
    assert nf.read_plan("new.toml")[0].rows == 30000
    text = tomlkit.dumps({key: value for key, value in TABLE.items() if key != "piece"})
    Path("plan.toml").write_text(text, encoding="utf-8")
    assert run(["sweep", "plan.toml", "--dry-run", "--json", "-"]) == 0
    expected = json.loads(capsys.readouterr().out)
    assert expected["rows"] == 200
    assert sorted(os.listdir()) == ["new.toml", "plan.toml"]
    assert run(["sweep", "plan.toml", "-o", "swept"]) == 0
    assert "200 rows" in capsys.readouterr().out
    size = sum(file.stat().st_size for file in Path("swept/pieces").iterdir())
    assert np.isclose(expected["bytes"], size, rtol=0.05)
    assert run(["sweep", "swept", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 200
    assert run(["sweep", "swept", "--plot", "notch.depth,total_angle_deg", "-o", "a.svg"]) == 0
    assert Path("a.svg").stat().st_size > 1000
    for arguments in (
        ["sweep", "plan.toml"],
        ["sweep", "plan.toml", "-o", "swept", "--plot", "a,b"],
        ["sweep", "plan.toml", "-o", "x", "--part", "7"],
        ["sweep", "plan.toml", "-o", "x", "--part", "0/7"],
        ["sweep", "plan.toml", "-o", "x", "--workers", "2", "--scheduler", "tcp://here:1"],
        ["sweep", "swept", "--plot", "notch.depth"],
        ["sweep", "swept", "--plot", "notch.depth,angle", "-o", "b.svg"],
        ["sweep", "swept", "--plot", "row,code", "-o", "b.svg"],
        ["sweep", "swept", "-o", "elsewhere"],
        ["sweep", "swept", "--workers", "2"],
        ["sweep", "swept", "--dry-run"],
        ["sweep", "swept", "--part", "1/2"],
        ["sweep", ""],
        ["sweep", "."],
        ["sweep", "none.toml", "-o", "x"],
    ):
        assert run(arguments) == 2, arguments
    assert not Path("x").exists()


def test_labels_of_a_picture_are_those_of_quantities(whole):
    found = nf.read_sweep(whole)
    shown = ("notch.depth", *found.columns, "row")
    texts = [sweep_picture(found, one, "row").cells[0].panel.x_label for one in shown]
    assert texts == [
        "notch.depth [mm]",
        r"total bending angle $\theta$ [deg]",
        r"angle of notch 2 $\theta_2$ [deg]",
        "row",
    ]


def test_a_folder_that_is_no_path_is_refused():
    with pytest.raises(nf.InputError, match="a folder of a sweep is needed; got 5") as caught:
        nf.read_sweep(5)
    assert caught.value.code is nf.ErrorCode.WRONG_TYPE


def test_dots_alone_are_thinned(whole, monkeypatch):
    found, marks = nf.read_sweep(whole), list[Any]()
    monkeypatch.setattr("notchflex.plotting.results._BINS", 6)
    for most in (found.rows, found.rows // 4):
        monkeypatch.setattr("notchflex.plotting.results.MAX_ROWS", most)
        picture = sweep_picture(found, "notch.depth", "total_angle_deg")
        marks.append({mark.name: mark for mark in picture.cells[0].panel.items})
    assert "drawn" in picture.title
    alone, thinned = marks
    np.testing.assert_array_equal(thinned["median"].points, alone["median"].points)
    assert len(thinned["accepted"].points) < 0.5 * len(alone["accepted"].points)
