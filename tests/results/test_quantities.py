"""The one table of quantities: unique names, and headers that measured data have too."""

import pytest

from notchflex.results.quantities import QUANTITIES, span_names


@pytest.mark.parametrize("part", ["key", "column"])
def test_no_two_quantities_share_a_name(part):
    names = [getattr(q, part) for q in QUANTITIES.values() if getattr(q, part)]
    assert len(names) == len(set(names))


def test_every_quantity_is_described():
    for quantity in QUANTITIES.values():
        assert quantity.description.endswith(".")
        assert quantity.title


def test_only_angles_change_their_number_at_the_edge():
    scaled = {q.name for q in QUANTITIES.values() if q.scale != 1.0}
    assert scaled == {
        "notch_angle",
        "total_angle",
        "tip_axis_angle",
        "edge_angle",
        "chord_angle",
        "total_chord_angle",
        "contact_turning",
        "sheath_bend",
    }
    assert {q.unit for q in QUANTITIES.values() if q.scale != 1.0} == {"deg"}


def test_keys_of_the_interface():
    keys = {q.key for q in QUANTITIES.values()}
    assert keys >= {
        "load.tension_N",
        "load.stroke_mm",
        "notch_angle_deg",
        "total_angle_deg",
        "tip_position_mm",
        "tip_rotation",
        "span_tension_N",
        "tendon_stroke_mm",
        "outer_strain",
        "peak_strain",
        "closed",
        "contact_force_N",
        "contacts.log_ratio",
        "contacts.slid_mm",
        "contacts.state",
        "contacts.turning_deg",
        "chord_angle_deg",
        "front.m",
        "front.eta",
        "base_force_N",
        "base_moment_Nmm",
        "moment_error",
        "converged",
        "reason",
        "stable",
        "residual",
        "iterations",
    }


def test_headers_are_those_of_measured_data():
    assert QUANTITIES["tension"].header(tendon="") == "tendon_force_N"
    assert QUANTITIES["stroke"].header(tendon="") == "tendon_displacement_mm"
    assert QUANTITIES["stroke"].header(tendon=2) == "tendon_2_displacement_mm"
    assert QUANTITIES["notch_angle"].header(notch=3) == "notch_3_deg"
    assert QUANTITIES["total_angle"].header() == "total_deg"


def test_spans_alternate_from_base_to_tip():
    assert span_names(6) == ["proximal", "gap_1", "body_1", "gap_2", "body_2", "gap_3"]
