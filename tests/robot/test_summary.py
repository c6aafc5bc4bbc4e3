"""What a notebook shows of a robot."""

import notchflex as nf


def test_a_robot_is_a_few_lines():
    lines = repr(nf.load_robot("pacheco2021-a")).splitlines()
    assert lines[:3] == [
        "Robot Pacheco 2021, wrist A",
        "  tube      outer diameter 1.62 mm, inner diameter 1.4 mm",
        "  notches   5 arc: cut on-axis, depth 1.4 mm, height 0.8 mm, uncut length 1.2 mm",
    ]
    assert any("elastic modulus 10000 MPa" in line for line in lines)
    assert lines[-2] == "  friction  capstan, coefficient 0.13, wrap whole-before"


def test_unlike_notches_show_their_values_or_range():
    text = repr(nf.load_robot("pacheco2021-c"))
    assert "depth 1.36/1.39/1.42/1.45 mm" in text
    assert "precurvature 1.724 to 2.433 deg" in repr(nf.load_robot("pacheco2021-a-specimen"))


def test_a_notebook_gets_an_escaped_table():
    robot = nf.load_robot("pacheco2021-a").replace(name="<i>mine</i>")
    assert "&lt;i&gt;mine&lt;/i&gt;" in robot._repr_html_()
    assert "<i>" not in robot._repr_html_()
