"""Reading measured data: what is taken, what is ignored, what is refused with line and column."""

import numpy as np
import pytest

from notchflex import load_robot
from notchflex.comparison.measured import read_measured
from notchflex.errors import InputError

HEADER = "tendon_force_N,notch_1_deg,notch_2_deg,notch_3_deg,notch_4_deg,notch_5_deg"
ROWS = "-0.1,1,2,3,4,5\n0.5,2,3,4,5,6\n"


@pytest.fixture(scope="module")
def robot():
    return load_robot("pacheco2021-a")


@pytest.fixture
def read(tmp_path, robot):
    def reader(text, robot=robot):
        file = tmp_path / "data.csv"
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_measured(file, robot)

    return reader


def test_plain_table(read):
    data = read(f"{HEADER}\n{ROWS}")
    assert len(data) == 2
    np.testing.assert_allclose(data.tension[:, 0], [-0.1, 0.5])
    np.testing.assert_allclose(data.model_tension[:, 0], [0.0, 0.5])
    assert data.negative_forces == 1
    assert np.isnan(data.stroke).all()
    np.testing.assert_allclose(np.degrees(data.notch_angle[1]), [2, 3, 4, 5, 6])
    np.testing.assert_allclose(np.degrees(data.total_angle), [15.0, 20.0])
    assert data.trial == ("1", "1")
    assert data.ignored == ()


def test_optional_and_other_columns(read):
    data = read(f"wrist,trial,{HEADER},total_deg,note\nA,x,0.5,1,2,3,4,5,15.5,\n")
    assert data.trial == ("x",)
    assert np.degrees(data.total_angle[0]) == pytest.approx(15.5)
    assert data.ignored == ("wrist", "note")


def test_displacement_instead_of_force(read):
    data = read(HEADER.replace("tendon_force_N", "tendon_displacement_mm") + "\n0.5,1,2,3,4,5\n")
    assert np.isnan(data.tension).all()
    assert data.stroke.item() == 0.5


def test_force_goes_before_displacement(read):
    data = read(f"tendon_displacement_mm,{HEADER}\n0.7,0.5,1,2,3,4,5\n")
    assert data.tension.item() == 0.5
    assert np.isnan(data.stroke).all()
    assert data.ignored == ("tendon_displacement_mm",)


def test_several_tendons_have_their_own_columns(read, robot):
    two = robot.replace(tendon=robot.tendon * 2)
    header = HEADER.replace("tendon_force_N", "tendon_1_force_N,tendon_2_displacement_mm")
    data = read(f"{header}\n0.5,0.1,1,2,3,4,5\n", two)
    np.testing.assert_array_equal(data.tension, [[0.5, np.nan]])
    np.testing.assert_array_equal(data.stroke, [[np.nan, 0.1]])
    with pytest.raises(InputError, match="tendon_1_force_N or tendon_1_displacement_mm"):
        read(f"{HEADER}\n{ROWS}", two)


def test_spreadsheet_habits_are_taken(read):
    text = f"# pulled by hand\n{HEADER}\r\n\r\n 0.5 , 1,2,3,4,5\r\n,,,,,\r\n"
    data = read(b"\xef\xbb\xbf" + text.encode())
    assert len(data) == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        (f"{HEADER}\n", "a header and no rows"),
        (f"{HEADER.replace('tendon_force_N', 'force')}\n{ROWS}", "no column tendon_force_N or"),
        (HEADER.replace("notch_5_deg", "n5") + f"\n{ROWS}", "column notch_5_deg is not there"),
        (HEADER.replace("notch", "n") + f"\n{ROWS}", "notch_1_deg, notch_2_deg"),
        (f"{HEADER},notch_6_deg\n1,1,2,3,4,5,6\n", "notch_6_deg, but Pacheco 2021, wrist A has 5"),
        (f"{HEADER}\n1,1,2,three,4,5\n", "line 2: notch_3_deg is 'three'"),
        (f"{HEADER}\n{ROWS}1,1,2,,4,5\n", "line 4: notch_3_deg is nothing"),
        (f"{HEADER}\n1,1,nan,3,4,5\n", "notch_2_deg is nan; give a finite number"),
        (f"{HEADER}\ninf,1,2,3,4,5\n", "tendon_force_N is inf"),
        (f"{HEADER}\n1,2,3\n", "line 2: 3 entries for 6 columns"),
        (f"{HEADER},notch_5_deg\n1,1,2,3,4,5,5\n", "notch_5_deg is there more than once"),
        (HEADER.replace(",", ";") + "\n1;1;2;3;4;5\n", "semicolons"),
        (HEADER.replace(",", "\t") + "\n1\t1\t2\t3\t4\t5\n", "tabs"),
        (f"{HEADER}\n1,1,2,1e308,4,5\n", "notch_3_deg is 1e308; give at most 1e\\+06"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "no text in UTF-8"),
    ],
)
def test_bad_tables_are_told(read, text, words):
    with pytest.raises(InputError, match=words):
        read(text)


def test_missing_file_and_folder(tmp_path, robot):
    with pytest.raises(InputError, match="no such file"):
        read_measured(tmp_path / "none.csv", robot)
    with pytest.raises(InputError, match="is a folder"):
        read_measured(tmp_path, robot)
