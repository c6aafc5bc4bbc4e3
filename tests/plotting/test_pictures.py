"""Every kind of picture in every format, drawn from one description."""

import importlib.util
import re

import numpy as np
import pytest

import notchflex as nf
from fake_path import fake_path
from notchflex.analysis import Batch
from notchflex.comparison import compare
from notchflex.fit import weight_held
from notchflex.loads import ExternalLoad
from notchflex.plotting import (
    Picture,
    batch_picture,
    beside_picture,
    comparison_picture,
    friction_picture,
    path_picture,
    picture,
    save_animation,
    state_picture,
)
from notchflex.plotting.marks import Area, Curve, Panel, bar_panel, grid
from notchflex.plotting.pictures import MAX_FRAMES, frames_of
from notchflex.plotting.style import for_browser as html
from notchflex.results.quantities import QUANTITIES
from refusals import refused


def in_space():
    path = fake_path(3)
    path.columns["external"] = (ExternalLoad(tip_force=(0.0, 0.1, 0.0)),) * len(path)
    return path


def a_batch():
    path = fake_path(4)
    names = ("tension", "notch_angle", "total_angle", "tip_position", "converged")
    return Batch({name: np.asarray(getattr(path, name)) for name in names})


def a_comparison():
    robot = nf.load_robot("pacheco2021-a")
    angles = np.radians([[5.0, 5.0, 5.0, 4.0, 4.0], [9.0, 9.0, 8.0, 8.0, 8.0]])
    load = nf.pull(0.5, 0.9, steps=2)
    return compare(robot, nf.Measurements("m", load, ("1", "1"), True, {"notch_angle": angles}))


def a_rig():
    """Readings whose coefficient depends on the turn; of one no deviation is known."""
    turn = np.linspace(0.5, 1.5, 12)
    load = np.tile([100.0, 200.0, 400.0], 4)
    deviation = np.full((12, 4), np.nan)
    deviation[1:, 1] = 0.002 * load[1:]
    held = weight_held(load, 0.1 + 0.05 * turn, turn, turn)
    return nf.friction_rig(nf.FrictionReadings(load, held, turn, turn, deviation))


KINDS = {
    "path": lambda: path_picture(fake_path(4)),
    "failed": lambda: path_picture(fake_path(3, failed=6)),
    "space": lambda: path_picture(in_space()),
    "state": lambda: state_picture(fake_path(4), 2),
    "beside": lambda: beside_picture({"one": fake_path(4), "two": fake_path(3)}),
    "batch": lambda: batch_picture(a_batch()),
    "comparison": lambda: comparison_picture(a_comparison()),
    "rig": lambda: friction_picture(a_rig()),
}


@pytest.fixture(scope="module")
def drawn():
    return {name: make() for name, make in KINDS.items()}


# Every kind by both programs, and matplotlib in each of its formats.
FILES = [
    *[(kind, ".html") for kind in KINDS],
    *[(kind, ".png") for kind in ("path", "space", "batch")],
    *[(kind, ".svg") for kind in ("failed", "beside", "comparison")],
    *[(kind, ".pdf") for kind in ("state", "rig")],
]


@pytest.mark.parametrize(("kind", "suffix"), FILES)
def test_every_kind_and_every_format_is_written(drawn, tmp_path, kind, suffix):
    assert {kind for kind, suffix in FILES if suffix != ".html"} == set(KINDS)
    file = tmp_path / f"x{suffix}"
    drawn[kind].save(file)
    start = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF", ".html": b"<!doctype html>"}[
        suffix
    ]
    assert file.read_bytes().startswith(start)
    assert [found.name for found in tmp_path.iterdir()] == [file.name]
    if suffix == ".html":
        text = file.read_text(encoding="utf-8")
        # The program of plotly is inside: nothing is asked of another host.
        assert not re.search(r"<(script|link|img|iframe)[^>]*\b(src|href)=", text)
        assert "Plotly.newPlot" in text
        assert len(text) > 1_000_000
        assert "\\theta" not in text[text.index("Plotly.newPlot(") :]


@pytest.mark.parametrize("kind", KINDS)
def test_both_programs_show_the_same_curves(drawn, kind):
    """The numbers of every line that has any are the same on paper and in the browser."""
    own = drawn[kind]
    figure, interactive = own.figure(), own.interactive()
    assert len(figure.axes) == len(own.cells)
    for axes, cell in zip(figure.axes, own.cells, strict=True):
        lines = [one.rows for one in cell.panel.items if isinstance(one, Curve) and len(one.rows)]
        if cell.panel.z_label:
            continue
        on_paper = [np.stack(line.get_data(), axis=1) for line in axes.get_lines()]
        shown = [
            np.stack([np.array(trace.x, float), np.array(trace.y, float)], axis=1)
            for trace in interactive.data
            if trace.type == "scatter"
        ]
        for points in lines:
            assert any(
                points.shape == other.shape and np.array_equal(points, other, equal_nan=True)
                for other in on_paper
            )
            assert any(
                points.shape == other.shape
                and np.allclose(points, other, rtol=1e-5, atol=1e-12, equal_nan=True)
                for other in shown
            )


def test_legends_of_a_browser_name_what_those_of_paper_name(drawn):
    own = drawn["path"]
    named = {trace.name for trace in own.interactive().data if trace.showlegend}
    for axes in own.figure().axes:
        if axes.get_legend() is not None:
            assert {text.get_text() for text in axes.get_legend().get_texts()} <= named


def test_a_shape_goes_with_all_its_parts(drawn):
    traces = [
        trace for trace in drawn["path"].interactive().data if trace.fill == "toself" and trace.name
    ]
    assert all(trace.legendgroup == trace.name for trace in traces)
    area = next(
        one for one in drawn["path"].cells[0].panel.items if isinstance(one, Area) and one.name
    )
    # Five flexures and six bodies, each closed and followed by a gap.
    assert len(area.polygons) == 11
    assert sum(value is None or np.isnan(value) for value in traces[0].x) == 11


def test_symbols_are_letters_in_a_browser():
    for quantity in QUANTITIES.values():
        assert not re.search(r"[$\\{}]", html(quantity.label)), quantity.name
    assert html(QUANTITIES["notch_angle"].label) == "notch angle <i>θ<sub>j</sub></i> [deg]"
    assert html("a < b & <i>") == "a &lt; b &amp; &lt;i&gt;"


def test_same_picture_is_the_same_file(drawn, tmp_path):
    for name in ("a.html", "b.html"):
        drawn["state"].save(tmp_path / name)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_state_shows_its_step_alone():
    path = fake_path(4)
    shape, notches, tension = [cell.panel for cell in state_picture(path, 2).cells]
    assert len([one for one in shape.items if isinstance(one, Area) and one.name]) == 1
    np.testing.assert_allclose(notches.items[0].rows[:, 1], np.degrees(path.notch_angle[2]))
    np.testing.assert_allclose(tension.items[0].rows[:, 1], path.span_tension[2, 0])
    failed = state_picture(fake_path(3, failed=6), 1)
    assert len(failed.figure().axes) == 3


def test_robots_beside_each_other_have_one_colour_each():
    picture = beside_picture({"one": fake_path(4), "two": fake_path(3)})
    assert [cell.panel.title for cell in picture.cells[:2]] == ["one", "two"]
    colours = {line.name: line.colour for line in picture.legend}
    for cell in picture.cells[2:]:
        for line in cell.panel.items:
            assert line.colour == colours[line.group]
    for count in (1, 6):
        with refused("OUT_OF_RANGE"):
            beside_picture({str(i): fake_path(2) for i in range(count)})


def test_batch_leaves_out_what_did_not_converge():
    arrays = dict(a_batch())
    arrays["converged"] = np.arange(8) < 6
    picture = batch_picture(Batch(arrays), against=np.arange(8) / 2, label="load [N]")
    total = next(c.panel for c in picture.cells if c.panel.y_label.startswith("total"))
    assert total.x_label == "load [N]"
    assert np.isnan(total.items[0].rows[:, 1]).sum() == 2
    tips = picture.cells[-1].panel
    assert [len(item.rows) for item in tips.items] == [6, 2]
    with refused("WRONG_SHAPE"):
        batch_picture(Batch(arrays), against=[1, 2, 3])
    with refused("NO_DATA"):
        batch_picture(Batch({"converged": np.ones(2, bool)}))


def test_one_function_for_every_result():
    wrist = nf.load_robot("pacheco2021-a")
    path = nf.simulate(wrist, nf.pull(0.0, 1.0, steps=2))
    assert len(picture(path).cells) == 4
    assert len(picture(path[1]).cells) == 3
    assert picture({"a": path, "b": path}).title == wrist.name
    assert picture(a_batch(), title="mine").title == "mine"
    assert picture(a_comparison(), title="mine").title == "mine"
    with refused("WRONG_TYPE"):
        picture(3)


def test_centre_lines_that_were_not_measured_are_not_announced():
    load = nf.pull(0.5, 0.9, steps=2)
    seen = {"total_angle": np.radians([23.0, 42.0])}
    total_only = compare(
        nf.load_robot("pacheco2021-a"), nf.Measurements("m", load, ("1", "1"), True, seen)
    )
    titles = [
        {axis.get_title(loc="left") for axis in comparison_picture(one).figure().axes}
        for one in (total_only, a_comparison())
    ]
    assert "centre lines of the model" in titles[0]
    assert "centre lines: model –, measured ··•" in titles[1]


def test_rig_in_a_browser_is_that_on_paper(drawn):
    rig, own = a_rig(), drawn["rig"]
    shown, (left, right) = own.interactive(), own.figure().axes
    assert left.get_ylim() == right.get_ylim()
    assert shown.layout.yaxis2.matches == "y"
    assert shown.layout.yaxis.range == shown.layout.yaxis2.range
    assert tuple(shown.layout.yaxis.range) == pytest.approx(left.get_ylim(), rel=1e-3)
    stripes = [one for one in shown.data if one.fill == "toself"]
    ends = [(np.nanmin(one.y), np.nanmax(one.y)) for one in stripes]
    spread = (rig.coefficient - rig.spread, rig.coefficient + rig.spread)
    np.testing.assert_allclose(ends, [spread, rig.interval] * 2, rtol=1e-5)
    levels = [one for one in shown.data if one.name.startswith("<i>")]
    assert [one.y[0] for one in levels] == pytest.approx([rig.coefficient] * 2)
    named = {one.name for one in shown.data if one.showlegend and one.xaxis == "x2"}
    assert named == {
        text.get_text().replace(r"$\mu$", "<i>μ</i>") for text in right.get_legend().texts
    }
    groups = {one.legendgroup for one in shown.data if one.showlegend}
    assert {one.legendgroup for one in [*stripes, *levels]} <= groups
    deviation = rig.readings.coefficient_deviation
    # Every reading has a bar from end to end, and a gap behind it.
    bars = [one for one in shown.data if one.name == "reading" and one.mode == "lines"]
    on_paper = next(one for one in left.get_lines() if len(one.get_xdata()) == 3 * len(deviation))
    for heights in (np.array(bars[0].y, float), on_paper.get_ydata()):
        low, high, gap = heights.reshape(-1, 3).T
        assert np.isnan(low[0])
        np.testing.assert_allclose((high - low)[1:], 2.0 * deviation[1:])
        assert np.isnan(gap).all()
    assert picture(rig).title == own.title


def test_names_at_an_axis_have_room_in_a_browser():
    def place(name):
        panel = bar_panel(np.ones(1), [name], "mm")
        plain = Panel([Curve([[0.0, 0.0], [1.0, 1.0]], "red")], "x", "y")
        layout = Picture("", grid([plain, panel], 2)).interactive().layout
        return (layout.xaxis2.domain[0] - layout.xaxis.domain[1]) * layout.meta["width"]

    assert place("long name " * 4) - place("short") > 6.0 * 35


def seconds_of_frames(moving):
    stays = []
    for frame in range(moving.n_frames):
        moving.seek(frame)
        stays.append(moving.info["duration"] / 1000.0)
    return stays


def takes_its_time_and_stands_at_both_ends(moving):
    stays = seconds_of_frames(moving)
    assert sum(stays) >= 4.0
    assert min(stays[0], stays[-1]) >= 0.8


def test_animation_moves_and_ends_where_the_path_ends(tmp_path):
    from PIL import Image

    path, seen = fake_path(3, failed=1), []
    file = tmp_path / "x.gif"
    save_animation(path, file, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(i + 1, 5) for i in range(5)]
    with Image.open(file) as moving:
        assert moving.n_frames >= 4
        first = np.asarray(moving.convert("L"), int)
        moving.seek(2)
        assert np.abs(np.asarray(moving.convert("L"), int) - first).max() > 100
        takes_its_time_and_stands_at_both_ends(moving)
    assert [found.name for found in tmp_path.iterdir()] == ["x.gif"]


@pytest.mark.nightly
@pytest.mark.parametrize("steps", [2, 9, 40])
def test_animation_takes_its_time_and_stands_at_both_ends(tmp_path, monkeypatch, steps):
    from PIL import Image

    monkeypatch.setattr("notchflex.plotting.pictures.DOTS_PER_INCH", 12)
    file = tmp_path / "x.gif"
    save_animation(fake_path(steps), file)
    with Image.open(file) as moving:
        takes_its_time_and_stands_at_both_ends(moving)


def test_frames_are_spread_over_a_long_path():
    steps = frames_of(fake_path(100, failed=3))
    assert len(steps) == MAX_FRAMES
    assert (steps[0], steps[-1]) == (0, 196)
    with refused("TOO_FEW_DATA"):
        save_animation(fake_path(2, failed=4), "x.gif")


@pytest.mark.parametrize(("suffix", "module"), [(".html", "plotly"), (".png", "matplotlib")])
def test_a_missing_library_is_told_with_its_command(drawn, tmp_path, monkeypatch, suffix, module):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == module else real(name)
    )
    with refused("MISSING_PACKAGE") as caught:
        drawn["state"].save(tmp_path / f"a{suffix}")
    assert module in str(caught.value)
    assert "pip install 'notchflex[plot]'" in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_browser_has_the_arrangement_of_paper(drawn):
    own = drawn["beside"]
    paper, layout = own.figure(), own.interactive().layout
    paper.draw_without_rendering()
    for number, axes in enumerate(paper.axes, 1):
        suffix = "" if number == 1 else str(number)
        x, y = layout[f"xaxis{suffix}"], layout[f"yaxis{suffix}"]
        box = axes.get_position()
        assert x.domain == pytest.approx((box.x0, box.x1), abs=1e-3)
        assert y.domain == pytest.approx((box.y0, box.y1), abs=1e-3)
        assert x.range == pytest.approx(axes.get_xlim(), rel=1e-3)
        assert y.range == pytest.approx(axes.get_ylim(), rel=1e-3)
        if axes.get_legend() is not None:
            legend = axes.get_legend().get_window_extent()
            assert layout[f"legend{number + 1}"].x == pytest.approx(
                legend.x0 / paper.bbox.width, abs=1e-2
            )
