"""Angles between the faces of notches: read, written, fitted and compared as such."""

import dataclasses

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import calibrate, simulate_measurements
from refusals import refused

RIGID = nf.load_robot("pacheco2021-a")
NOTCH = dataclasses.replace(RIGID.notch[0], ends="shell")
WRIST = dataclasses.replace(
    RIGID,
    tube=dataclasses.replace(RIGID.tube, base_length=1.2),
    notch=(NOTCH,),
    material=nf.Linear(30_000.0),
)
UP = nf.pull(0.2, 1.0, steps=3)
EDGES = ("edge_angle", "total_edge_angle")


def table(tmp_path, wrist, column):
    seen = simulate_measurements(wrist, UP, observed=("edge_angle",))
    angles = np.degrees(seen.observed["edge_angle"])
    names = [column.format(n) for n in range(1, 6)]
    lines = [",".join(["tendon_force_N", *names, "total_deg"])]
    for force, row in zip(UP.tension[:, 0], angles, strict=True):
        lines.append(",".join(map(repr, map(float, [force, *row, row.sum()]))))
    file = tmp_path / "seen.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_columns_of_edges_are_written_and_read_back(tmp_path):
    noise = {"edge_angle": 0.01, "total_edge_angle": 0.02}
    seen = simulate_measurements(WRIST, UP, observed=EDGES, deviation=noise, seed=2)
    nf.write_measurements(seen, tmp_path / "edges.csv")
    header = (tmp_path / "edges.csv").read_text().splitlines()[0]
    assert "notch_5_edge_deg,notch_5_edge_sd_deg,total_edge_deg,total_edge_sd_deg" in header
    again = nf.read_measurements(tmp_path / "edges.csv", WRIST)
    for name in EDGES:
        np.testing.assert_array_equal(again.observed[name], seen.observed[name])
        np.testing.assert_array_equal(again.deviation[name], seen.deviation[name])


def test_a_table_of_angles_is_read_as_edges_with_the_total_added_up_from_them(tmp_path):
    file = table(tmp_path, WRIST, "notch_{}_deg")
    rings = nf.read_measurements(file, WRIST)
    edges = nf.read_measurements(file, WRIST, measured="edge")
    assert set(rings.observed) == {"notch_angle", "total_angle"}
    assert set(edges.observed) == set(EDGES)
    # What the model made is what the model sees, and 3 % less than the rings.
    exact, wrong = nf.compare(WRIST, edges), nf.compare(WRIST, rings)
    assert exact.rmse_notches.max() < 1e-9
    assert exact.rmse_total < 1e-9
    assert exact.rmse_tip < 1e-9
    assert 0.02 < wrong.rmse_total / exact.total_angle.mean() < 0.05
    assert exact.angle == "edge_angle"


def test_a_modulus_is_found_from_edges_only_if_they_are_read_as_such(tmp_path):
    file = table(tmp_path, WRIST, "notch_{}_deg")
    start = WRIST.with_value("material.elastic_modulus", 25_000.0)
    found = {
        kind: calibrate(
            start,
            nf.read_measurements(file, WRIST, measured=kind),
            "material.elastic_modulus",
            starts=1,
            priors=False,
            intervals=False,
        ).values["material.elastic_modulus"]
        for kind in ("ring", "edge")
    }
    assert found["edge"] == pytest.approx(30_000.0, rel=1e-7)
    assert found["ring"] > 30_600.0


def test_rigid_ends_show_the_ring_angle():
    path = nf.simulate(RIGID, UP)
    np.testing.assert_array_equal(path.edge_angle, path.notch_angle)


def test_documents_name_what_was_measured(tmp_path):
    from notchflex.comparison import comparison_columns, comparison_document

    edges = nf.read_measurements(table(tmp_path, WRIST, "notch_{}_edge_deg"), WRIST)
    # A total beside columns of edges is its own measurement: of the rings.
    assert set(edges.observed) == {"edge_angle", "total_angle"}
    compared = nf.compare(WRIST, edges)
    assert "edge_angle_deg" in comparison_document(compared)["rows"][0]["model"]
    assert "notch_2_edge_deg_model" in comparison_columns(compared)


def test_contradicting_columns_and_words_are_refused(tmp_path):
    file = tmp_path / "both.csv"
    file.write_text("tendon_force_N,notch_1_deg,notch_1_edge_deg\n0.5,4.0,3.9\n")
    with refused("CONFLICT", "notch_1_edge_deg"):
        nf.read_measurements(file, WRIST, measured="edge")
    with refused("UNKNOWN_NAME", "edge", "camera"):
        nf.read_measurements(file, WRIST, measured="camera")
    file.write_text("tendon_force_N,total_deg\n0.5,20.0\n")
    with refused("CONFLICT", "notch_1_deg"):
        nf.read_measurements(file, WRIST, measured="edge")
