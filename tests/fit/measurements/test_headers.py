"""Tables with headers in other words and units, and a column of directions."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.cli import run
from notchflex.results.reading import read_data_table
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")


def write(folder, text, encoding="utf-8"):
    file = folder / "data.csv"
    file.write_text(text, encoding=encoding)
    return file


@pytest.mark.parametrize(
    "header",
    [
        "Force [N];Angle (deg)",
        "tension (N);bending angle [°]",
        "tension_N;total_angle_deg",
        "Cable force [N];Total angle [deg]",
    ],
)
def test_words_and_a_german_spreadsheet_are_understood(tmp_path, header):
    file = write(tmp_path, f"{header}\n0,25;12,4\n0,5;24,9\n", "utf-8-sig")
    data = nf.read_measurements(file, WRIST)
    np.testing.assert_array_equal(data.load.tension[:, 0], [0.25, 0.5])
    np.testing.assert_allclose(data.observed["total_angle"], np.radians([12.4, 24.9]), rtol=1e-15)
    assert data.ignored == ()
    assert list(data.renamed) == ["tendon_force_N", "total_deg"]
    assert data.renamed["tendon_force_N"] == header.partition(";")[0]


def test_units_are_converted(tmp_path):
    text = "tension [mN],notch 1 (rad),tip_x [cm],tip z (m)\n250,0.125,0.1,0.01\n"
    data = nf.read_measurements(write(tmp_path, text), WRIST)
    assert data.load.tension[0, 0] == 0.25
    assert data.observed["notch_angle"][0, 0] == pytest.approx(0.125, rel=1e-15)
    np.testing.assert_allclose(data.observed["tip_position"][0, [0, 2]], [1.0, 10.0], rtol=1e-15)


def test_columns_may_be_named(tmp_path):
    file = write(tmp_path, "Kraft [mN];Winkel\n250;12,4\n")
    with refused("TABLE_COLUMNS", "Kraft [mN]", "--column tension="):
        nf.read_measurements(file, WRIST)
    data = nf.read_measurements(file, WRIST, columns={"tension": "Kraft [mN]", "total": "Winkel"})
    assert data.load.tension[0, 0] == 0.25
    assert data.observed["total_angle"][0] == pytest.approx(np.radians(12.4), rel=1e-15)
    with refused("TABLE_COLUMNS", "Zug", "tension"):
        nf.read_measurements(file, WRIST, columns={"tension": "Zug"})
    with refused("UNKNOWN_NAME", "--column colour=Winkel"):
        nf.read_measurements(file, WRIST, columns={"colour": "Winkel"})
    file = write(tmp_path, "tendon_force_N,total_deg,notch_1_deg\n0.25,12.4,2.5\n")
    with refused("UNKNOWN_NAME", "colour_deg", "tip_x_mm"):  # it was ignored, and a notch with it
        nf.read_measurements(file, WRIST, columns={"colour": "notch_1_deg"})


def test_an_error_names_the_header_of_the_file(tmp_path):
    with refused("NOT_A_NUMBER", "line 2: Force [N] is 'much'"):
        nf.read_measurements(write(tmp_path, "Force [N],total_deg\nmuch,3\n"), WRIST)


def test_the_usual_columns_stay_as_they_are(tmp_path):
    header = (
        "pull,from_rest,tendon_force_N,notch_1_deg,notch_1_sd_deg,total_edge_deg,tip_x_mm,"
        "axis_2.5_x_mm,tip_rx_deg,gravity_x_m_s2,tip_moment_x_Nmm,body_2_point_x_mm,weight_1_g"
    )
    row = ",".join(["1"] * len(header.split(",")))
    table = read_data_table(write(tmp_path, f"{header}\n{row}\n"))
    assert ",".join(table.header) == header
    assert table.written == {}


def test_directions_say_what_is_unloading(tmp_path):
    """Without it the order of these rows is unclear, and refused."""
    rows = [(0.5, "loading"), (2.0, "Loading"), (1.0, "unloading"), (1.5, "loading")]
    text = "tendon_force_N,total_deg,direction\n" + "".join(f"{n},1,{word}\n" for n, word in rows)
    data = nf.read_measurements(write(tmp_path, text), WRIST)
    assert not data.from_rest
    assert data.pull == ("1", "1", "1", "2")
    assert data.ignored == ()
    with refused("TABLE_COLUMNS", "line 2", "direction", "sideways"):
        nf.read_measurements(write(tmp_path, text.replace("loading", "sideways", 1)), WRIST)


def test_the_command_line_takes_names_and_tells_what_it_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "Kraft [N];Winkel (deg)\n0,25;12,4\n0,5;24,9\n")
    names = ["--column", "tension=Kraft [N]", "--column", "total=Winkel (deg)"]
    assert run(["compare", "pacheco2021-a", "data.csv", *names]) == 0
    err = capsys.readouterr().err
    assert "read Kraft [N] as tendon_force_N, Winkel (deg) as total_deg" in err
    write(tmp_path, "Kraft [N];Hub (mm)\n0,25;0,1\n0,5;0,2\n")
    names = ["--column", "tension=Kraft [N]", "--column", "stroke=Hub (mm)"]
    assert run(["sense", "pacheco2021-a", "data.csv", *names, "--quiet"]) in (0, 1)
    assert "Error: data.csv" not in capsys.readouterr().err


def test_the_name_of_a_robot_is_no_robot(tmp_path):
    with refused("WRONG_TYPE", "load_robot"):
        nf.read_measurements(write(tmp_path, "tension_N,total_deg\n1,3\n"), WRIST.name)
    with refused("WRONG_TYPE", "load_robot"):
        nf.read_targets(write(tmp_path, "total_deg\n3\n"), WRIST.name)
