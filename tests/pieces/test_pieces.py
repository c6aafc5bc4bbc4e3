"""Draws, states and searches in pieces: as without, by one process or several, resumed."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notchflex as nf
from notchflex.cli import run
from notchflex.fit import calibrate, calibration_document, simulate_measurements
from notchflex.pieces import PieceFolder
from swept import digests

pytest.importorskip("polars")

SPEC = nf.ToleranceSpec(
    [nf.AcceptanceLimit("total_angle", lower=0.75, upper=1.05)], {"pulled": nf.Load(tension=1.0)}
)
TOLERANCES = """
[load.pulled]
tension = 1.0
[[accept]]
quantity = "total_angle"
lower = 43
upper = 60
"""


@pytest.fixture(scope="module")
def wrist() -> nf.Robot:
    return nf.load_robot("pacheco2021-a")


def drawn(wrist, folder: Any = None, **options: Any) -> nf.ToleranceAnalysis:
    return nf.tolerance_analysis(wrist, SPEC, **({"draws": 800} | options), folder=folder)


@pytest.fixture(scope="module")
def tolerances(wrist, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("drawn") / "whole"
    drawn(wrist, folder)
    return folder


def test_draws_in_pieces_are_those_in_memory(wrist, tolerances):
    """Chains come from polynomials of other samples, whose error is below 1e-5."""
    whole, pieces = drawn(wrist), drawn(wrist, tolerances)
    assert pieces.counts == whole.counts
    assert 0.02 < whole.accepted_fraction < 0.98
    assert pieces.interval == pytest.approx(whole.interval)
    np.testing.assert_array_equal(pieces.below, whole.below)
    np.testing.assert_array_equal(pieces.above, whole.above)
    for part in (0.025, 0.5, 0.975):  # between two neighbours, and within a bin of the sketch
        near = [float(whole.percentile(part + off)[0]) for off in (-0.003, 0.003)]
        assert near[0] - 2e-3 <= float(pieces.percentile(part)[0]) <= near[1] + 2e-3
    assert pieces.drawn.histogram(0, 20)[1].sum() == pieces.draws


@pytest.mark.nightly
def test_lost_pieces_are_made_again(wrist, tolerances):
    before = digests(tolerances)
    (tolerances / "pieces" / "piece-000000003.parquet").unlink()
    (tolerances / "pieces" / "piece-000000007.parquet").write_bytes(b"PAR1")
    drawn(wrist, tolerances)
    assert digests(tolerances) == before


@pytest.mark.nightly
@pytest.mark.parametrize("change", [{"seed": 1}, {"draws": 1600}])
def test_other_draws_are_refused(wrist, tolerances, change):
    before = digests(tolerances)
    with pytest.raises(nf.InputError) as caught:
        drawn(wrist, tolerances, **change)
    assert caught.value.code.name == "CONFLICT"
    assert digests(tolerances) == before


@pytest.mark.nightly
def test_another_version_is_refused(wrist, tolerances, monkeypatch):
    monkeypatch.setattr("notchflex.pieces.folder.__version__", "0.0.1")
    with pytest.raises(nf.InputError) as caught:
        drawn(wrist, tolerances)
    assert caught.value.code.name == "CONFLICT"


def explored(robot, folder: Any = None, **options: Any) -> nf.Workspace:
    return nf.workspace(robot, **({"states": 34_368} | options), folder=folder)


@pytest.mark.nightly
def test_states_in_pieces(tmp_path, monkeypatch):
    """Other rays of the same sequence: extent and volume agree as those of two seeds do."""
    monkeypatch.setattr("notchflex.workspaces.explore._PIECE", 1024)  # 32,768 states
    robot = nf.load_robot("two-axis-wrist")
    whole, pieces = explored(robot), explored(robot, tmp_path / "x")
    assert len(os.listdir(tmp_path / "x" / "pieces")) == 2
    assert pieces.tried == whole.tried
    assert len(pieces) < whole.tried / 2
    np.testing.assert_allclose(pieces.extent, whole.extent, atol=0.01 * np.ptp(whole.extent))
    assert pieces.hull.size == pytest.approx(whole.hull.size, rel=0.01)
    most = float(np.nanmax(whole.hysteresis))
    assert float(np.nanmax(pieces.hysteresis)) == pytest.approx(most, rel=0.05)


@pytest.mark.nightly
def test_states_of_one_piece_keep_hull_and_hysteresis(wrist, tmp_path):
    """A piece that holds all rays solves those in memory."""
    whole, pieces = explored(wrist, states=3200), explored(wrist, tmp_path / "x", states=3200)
    assert len(pieces) < len(whole)
    assert (pieces.tried, pieces.failed) == (whole.tried, whole.failed)
    np.testing.assert_allclose(pieces.extent, whole.extent, rtol=1e-9, atol=1e-9)
    assert pieces.hull.size == pytest.approx(whole.hull.size, rel=1e-9)
    assert np.nanmax(pieces.hysteresis) == pytest.approx(np.nanmax(whole.hysteresis), rel=1e-9)
    size = whole.voxels().size
    dexterity = [one.voxels(size).dexterity.max() for one in (whole, pieces)]
    assert dexterity[1] == pytest.approx(dexterity[0], abs=2 / 96)


def fitted(wrist, folder: Any = None) -> dict[str, Any]:
    seen = simulate_measurements(
        wrist, nf.pull(0.2, 1.2, steps=3), deviation={"notch_angle": 0.01}, seed=1
    )
    found = calibrate(wrist, seen, "friction.coefficient", starts=3, folder=folder, intervals=False)
    document = json.loads(json.dumps(calibration_document(found), default=repr))
    del document["solves"]  # rows that this process solved
    return document


@pytest.mark.nightly
def test_searches_in_pieces_find_the_same(wrist, tmp_path):
    whole = fitted(wrist)
    assert fitted(wrist, tmp_path / "x") == whole
    before = digests(tmp_path / "x")
    assert len(before) == 5
    (tmp_path / "x" / "pieces" / "piece-000000001.parquet").unlink()
    assert fitted(wrist, tmp_path / "x") == whole
    assert digests(tmp_path / "x") == before


@pytest.mark.nightly
def test_two_workers(wrist, tolerances, tmp_path):
    pytest.importorskip("distributed")
    two = PieceFolder(tmp_path / "drawn", workers=2)
    drawn(wrist, two)
    assert digests(tmp_path / "drawn") == digests(tolerances)
    assert fitted(wrist, PieceFolder(tmp_path / "fit", workers=2)) == fitted(wrist)
    explored(wrist, tmp_path / "one", states=3200)
    explored(wrist, PieceFolder(tmp_path / "two", workers=2), states=3200)
    assert digests(tmp_path / "one") == digests(tmp_path / "two")


REFUSED = [
    "tolerance {file} --workers 2",
    "tolerance {file} --scheduler tcp://127.0.0.1:1",
    "tolerance {file} --folder x --workers 2 --scheduler tcp://127.0.0.1:1",
    "tolerance {file} --folder x --workers 0",
    "tolerance {file} --folder x --scheduler nowhere",
    "tolerance {file} --folder x --csv x.csv",
    "tolerance {file} --draws 100000000",
    "tolerance {file} --draws 100000000000 --folder x",
    "tolerance {file} --folder {file}",
    "tolerance {file} --folder no/such/folder",
    "tolerance {file} --folder full",
    "tolerance {file} --folder /proc/none",
    "workspace --states 50000000",
    "workspace --folder x --beside pacheco2021-b",
    "workspace --workers 2",
    "workspace --folder full",
]


@pytest.mark.parametrize("call", REFUSED)
def test_options_that_are_refused(call, tmp_path, monkeypatch, capsys, wording):
    monkeypatch.chdir(tmp_path)
    Path("limits.toml").write_text(TOLERANCES, encoding="utf-8")
    Path("full").mkdir()
    Path("full", "thesis.tex").write_text("x", encoding="utf-8")
    verb, *words = call.format(file="limits.toml").split()
    assert run([verb, "pacheco2021-a", *words]) == 2
    told = capsys.readouterr().err
    assert "Traceback" not in told
    assert not Path("x").exists()
    wording(f"pieces: {call}", told)


@pytest.mark.nightly
def test_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("limits.toml").write_text(TOLERANCES, encoding="utf-8")
    call = ["tolerance", "pacheco2021-a", "limits.toml", "--draws", "100", "--folder", "drawn"]
    assert run([*call, "--json", "a.json", "--plot", "a.svg", "--quiet"]) == 0
    before = digests(Path("drawn"))
    assert run([*call, "--json", "b.json", "--quiet"]) == 0
    assert Path("a.json").read_text() == Path("b.json").read_text()
    assert digests(Path("drawn")) == before
    assert "Traceback" not in capsys.readouterr().err


def test_a_number_that_is_not_given_is_no_difference(wrist, tolerances):
    """A load holds NaN for what is not given, and the draws differ by their seed alone."""
    with pytest.raises(nf.InputError, match="`seed` is 0 there and 3 here"):
        drawn(wrist, tolerances, seed=3)


def test_what_is_kept_is_told_when_interrupted(wrist, tmp_path, monkeypatch, capsys):
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    Path("t.toml").write_text(TOLERANCES, encoding="utf-8")
    monkeypatch.setattr("notchflex.pieces.run.stored_piece", interrupted)
    assert run(["tolerance", "pacheco2021-a", "t.toml", "--folder", "h"]) == 130
    assert "interrupted; finished pieces are kept" in capsys.readouterr().err
