"""`notchflex export`: files, their checks, and what it says."""

import json

import ezdxf
import pytest


def test_files_of_one_call_agree(call, tmp_path):
    code, out, err = call(
        "export", "pacheco2021-a", "--dxf", "a.dxf", "--svg", "a.svg", "--stl", "a.stl",
        "--kerf", "0.025", "--shank", "5", "--set", "notch.depth=1.38", "--json", "a.json",
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert out.splitlines() == ["Wrote a.dxf.", "Wrote a.svg.", "Wrote a.stl."]
    document = json.loads((tmp_path / "a.json").read_text())
    files = {one["file"]: one for one in document["files"]}
    assert {one["robot_hash"] for one in files.values()} == {document["robot_hash"]}
    assert document["robot"]["notch"][0]["depth"] == 1.38
    assert files["a.dxf"]["path_inside_edge_mm"] == [0.0125, 0.0125]
    assert files["a.dxf"]["cut_off_mm"] == -5.0
    assert files["a.stl"]["box_mm"][0][2] == pytest.approx(-5.0)
    assert not ezdxf.readfile(tmp_path / "a.dxf").audit().errors


def test_an_old_version_of_dxf_says_nothing_more(call, caplog):
    code, out, err = call("export", "york2015", "--dxf", "a.dxf", "--dxf-version", "R12")
    assert (code, out, err) == (0, "Wrote a.dxf.\n", "")
    assert not caplog.records


def test_json_can_be_printed_alone(call):
    code, out, _ = call("export", "york2015", "--dxf", "a.dxf", "--json", "-")
    assert code == 0
    assert json.loads(out)["files"][0]["cuts"] == 5


def test_quiet_prints_warnings_only(call):
    code, out, err = call("export", "liu2022", "--dxf", "a.dxf", "--svg", "a.svg", "--quiet")
    assert (code, out) == (0, "")
    assert err.count("Warning: ") == 1  # the same one of both files


def test_a_file_that_is_there_is_replaced(call, tmp_path):
    (tmp_path / "a.dxf").write_text("old")
    assert call("export", "york2015", "--dxf", "a.dxf")[0] == 0
    assert (tmp_path / "a.dxf").read_text() != "old"


@pytest.mark.nightly
def test_a_solid_under_load_is_bent(call, tmp_path):
    code, *_ = call(
        "export", "pacheco2021-a", "--stl", "a.stl", "--dxf", "a.dxf", "--tension", "0:1:2",
        "--json", "a.json",
    )  # fmt: skip
    assert code == 0
    files = json.loads((tmp_path / "a.json").read_text())["files"]
    box = next(one["box_mm"] for one in files if one["file"] == "a.stl")
    assert box[1][0] > 3.0


@pytest.mark.nightly
def test_a_load_that_does_not_converge_writes_nothing(call, tmp_path):
    code, out, err = call("export", "pacheco2021-a", "--stl", "a.stl", "--stroke", "9")
    assert code == 1
    assert out == ""
    assert "not converged" in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("MISSING_VALUE", []),
        ("FILE_FORMAT", ["--dxf", "a.stl"]),
        ("FILE_FORMAT", ["--dxf", "-"]),
        ("FILE_FORMAT", ["--stl", "a"]),
        ("CONFLICT", ["--dxf", "a.dxf", "--svg", "./a.dxf"]),
        ("FILE_UNWRITABLE", ["--dxf", "nowhere/a.dxf"]),
        ("MISSING_VALUE", ["--dxf", ""]),
        ("CONFLICT", ["--dxf", "a.dxf", "--tension", "1"]),
        ("OUT_OF_RANGE", ["--dxf", "a.dxf", "--kerf", "-1"]),
        ("NOT_FINITE", ["--dxf", "a.dxf", "--kerf", "nan"]),
        ("NOT_A_NUMBER", ["--dxf", "a.dxf", "--kerf", "25um"]),
        ("INVALID_INPUT", ["--dxf", "a.dxf", "--kerf", "25"]),
        ("OUT_OF_RANGE", ["--dxf", "a.dxf", "--kerf", "0.8"]),
        ("UNKNOWN_NAME", ["--dxf", "a.dxf", "--seam", "cross"]),
        ("INVALID_INPUT", ["--dxf", "a.dxf", "--seam-at", "1e9"]),
        ("OUT_OF_RANGE", ["--stl", "a.stl", "--channels", "0.5"]),
        ("INVALID_INPUT", ["--stl", "a.stl", "--chord", "0"]),
        ("OUT_OF_RANGE", ["--stl", "a.stl", "--tension", "-1"]),
        ("UNKNOWN_NAME", ["--dxf", "a.dxf", "--set", "notch.dept=1"]),
    ],
)
def test_bad_input_writes_nothing(refused, code, arguments):
    refused(code, "export", "pacheco2021-a", *arguments)


def test_a_segment_is_refused_for_a_two_axis_machine(refused):
    message = refused("UNSUPPORTED", "export", "york2015", "--dxf", "a.dxf", "--two-axis")
    assert "two-axis" in message


def test_the_robot_file_is_not_replaced(call, tmp_path):
    (tmp_path / "robot.svg").write_text("x")
    code, _, err = call("export", "robot.svg", "--svg", "robot.svg")
    assert code == 2
    assert (tmp_path / "robot.svg").read_text() == "x"
    assert err.startswith("Error: ")


@pytest.mark.parametrize(
    ("option", "package", "extra"),
    [
        ("--dxf", "ezdxf", "export"),
        ("--svg", "shapely", "export"),
        ("--stl", "manifold3d", "export"),
        ("--step", "build123d", "cad"),
    ],
)
def test_a_missing_package_is_named(refused, monkeypatch, option, package, extra):
    import importlib.util

    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util,
        "find_spec",
        lambda name, *rest: None if name == package else find(name, *rest),
    )
    file = f"a.{option.removeprefix('--')}"
    message = refused("MISSING_PACKAGE", "export", "pacheco2021-a", option, file)
    assert f"notchflex[{extra}]" in message


def test_each_format_gets_the_load_that_it_needs(call, tmp_path):
    """A deck without a tension has a usual one; solids stay straight where that is wanted."""
    robot = "pacheco2021-c"
    files = ["--dxf", "a.dxf", "--stl", "a.stl", "--inp", "a.inp", "--mesh", "coarse"]
    plain = ["--set", "tendon.radius=0.6", "--set", "notch.precurvature_deg=0", "--json", "a.json"]
    for load in ([], ["--tension", "1", "--straight"]):
        code, out, err = call("export", robot, *files, *plain, *load)
        assert (code, len(out.splitlines())) == (0, 3)
        assert ("No tension was given" in err) is not bool(load)
        box = {
            one["file"]: one.get("box_mm")
            for one in json.loads((tmp_path / "a.json").read_text())["files"]
        }["a.stl"]
        assert box[1][0] < 1.0
        assert f"tendon 1 at {1 if load else ''}" in (tmp_path / "a.inp").read_text()
