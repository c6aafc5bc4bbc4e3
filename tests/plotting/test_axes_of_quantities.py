"""One quantity over another on axes that are given, and one function that draws anything."""

import importlib.util

import numpy as np
import pytest
from matplotlib.figure import Figure

import notchflex as nf
from notchflex.plotting import Picture
from notchflex.plotting.curves import LOADING, UNLOADING
from refusals import refused


@pytest.fixture(scope="module")
def path(loop):
    return loop


@pytest.fixture(scope="module")
def in_space():
    return nf.simulate(nf.load_robot("two-axis-wrist"), nf.pull(0.0, 1.0, steps=3))


@pytest.fixture
def ax():
    return Figure().add_subplot()


def names(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_a_quantity_over_another_with_units(path, ax):
    assert path.plot("stroke", "tension", ax=ax) is ax
    assert ax.get_xlabel() == "tendon stroke $u$ [mm]"
    assert ax.get_ylabel() == "tendon tension $T$ [N]"
    there, back = ax.get_lines()
    np.testing.assert_array_equal(there.get_xdata(), path.stroke[:5, 0])
    np.testing.assert_array_equal(back.get_ydata(), path.tension[4:, 0])


def test_angles_are_in_degrees_and_both_ways_differ(path, ax):
    path.plot("tension", "total_angle", ax=ax)
    assert ax.get_ylabel() == r"total bending angle $\theta$ [deg]"
    there, back = ax.get_lines()
    np.testing.assert_allclose(there.get_ydata(), np.degrees(path.total_angle[:5]))
    assert there.get_linestyle() != back.get_linestyle()
    assert there.get_color() != back.get_color()
    assert names(ax) == [LOADING, UNLOADING]


def test_a_quantity_with_several_entries_has_a_line_for_each(path, ax):
    path.plot("tension", "notch_angle", ax=ax)
    assert names(ax) == [*(f"notch {number}" for number in range(1, 6)), LOADING, UNLOADING]
    drawn = [line for line in ax.get_lines() if len(line.get_xdata())]
    assert len(drawn) == 10
    np.testing.assert_allclose(drawn[4].get_ydata(), np.degrees(path.notch_angle[:5, 2]))


def test_a_column_of_the_csv_is_one_entry(path, ax):
    path.plot("notch_2_deg", "notch_2_peak_strain", ax=ax)
    assert ax.get_xlabel() == r"angle of notch 2 $\theta_2$ [deg]"
    assert ax.get_ylabel().startswith("peak strain of notch 2")
    np.testing.assert_array_equal(ax.get_lines()[0].get_ydata(), path.peak_strain[:5, 1])
    path.plot("step", "tip_z_mm", ax=ax)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("step", "tip position z $p_z$ [mm]")


def test_equal_tendons_are_drawn_over_each_other(in_space, ax):
    in_space.plot("stroke", "tension", ax=ax)
    assert names(ax) == [f"tendon {number}" for number in range(1, 5)]
    np.testing.assert_array_equal(ax.get_lines()[0].get_xdata(), in_space.stroke[:, 0])


def test_of_several_tendons_the_one_that_is_pulled_counts(in_space, ax):
    in_space.plot("tension", "total_angle", ax=ax)
    np.testing.assert_array_equal(ax.get_lines()[0].get_xdata(), in_space.tension[:, 0])


def test_steps_that_failed_are_left_out_and_marked(ax):
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.stroke_path(0.0, 9.0, steps=4))
    path.plot("step", "total_angle", ax=ax)
    assert np.isfinite(ax.get_lines()[0].get_ydata()).tolist() == [True, True, False, False]
    assert "not converged" in names(ax)


def test_new_axes_are_those_of_pyplot(path):
    from matplotlib import pyplot

    axes = path.plot("stroke", "tension")
    assert pyplot.gca() is axes
    pyplot.close(axes.figure)


@pytest.mark.parametrize(
    ("x", "y", "code", "names"),
    [
        ("tensoin", "total_angle", "UNKNOWN_NAME", "tension"),
        ("tension", "zzz", "UNKNOWN_NAME", "commanded_tension"),
        ("notch_angle", "tension", "WRONG_SHAPE", "notch_1_deg, notch_2_deg"),
        ("tension", "tip_rotation", "UNSUPPORTED", "tip_rotation"),
        ("tension", "reason", "UNSUPPORTED", "reason"),
        ("tension", None, "MISSING_VALUE", ""),
        (None, "tension", "MISSING_VALUE", ""),
    ],
)
def test_what_cannot_be_drawn_is_refused(path, x, y, code, names):
    with refused(code) as caught:
        path.plot(x, y)
    assert names in str(caught.value)


def test_shapes_on_given_axes(path, in_space, ax):
    assert path[2].plot(ax=ax) is ax
    assert ax.get_aspect() == 1.0
    assert ax.get_ylabel() == "along the base, z [mm]"
    assert path.robot.plot(ax=Figure().add_subplot()).patches
    with refused("UNSUPPORTED"):
        in_space[2].plot(ax=ax)
    assert in_space[2].plot(ax=Figure().add_subplot(projection="3d")).name == "3d"


def test_one_function_draws_what_it_is_given(path):
    batch = nf.solve_batch(path.robot, nf.pull(0.0, 2.0, steps=3))
    for thing in (path, path[2], path.robot, batch, {"a": path, "b": path}):
        drawn = nf.plot(thing)
        assert isinstance(drawn, Picture)
        assert len(drawn.cells) >= 1
    assert isinstance(path.plot(), Picture)
    assert isinstance(path[1].plot(), Picture)
    assert isinstance(path.robot.plot(), Picture)
    with refused("WRONG_TYPE"):
        nf.plot(3)
    with refused("WRONG_TYPE"):
        nf.plot(path[1], "stroke", "tension")
    with refused("WRONG_TYPE"):
        nf.plot(batch, ax=Figure().add_subplot())


def test_a_notebook_shows_a_picture(path):
    shown = path[1].plot()
    assert shown._repr_png_().startswith(b"\x89PNG")
    assert repr(shown) == "Picture 'Pacheco 2021, wrist A' of 3 panels; .save(file) writes it"


@pytest.mark.parametrize("draw", [lambda p: p.plot(), lambda p: p[0].plot(), lambda p: nf.plot(p)])
def test_without_matplotlib_the_extra_is_named(path, monkeypatch, draw):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "matplotlib" else real(name)
    )
    with refused("MISSING_PACKAGE"):
        draw(path)
