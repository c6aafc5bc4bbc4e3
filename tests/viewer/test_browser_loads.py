"""Tension, stroke, typing, Stop and Reset on the real page, by mouse and keyboard alone."""

import pytest

import notchflex as nf
from notchflex.plotting import LOADING, UNLOADING
from visit import Visit

pytest.importorskip("viser", reason="the extra `viewer` is not installed")
pytestmark = [pytest.mark.browser, pytest.mark.nightly]

TENSION, STROKE = "tension [N]", "stroke [mm]"


@pytest.fixture(scope="module", params=["pacheco2021-a", "gao2017"])
def visit(browser, request):
    port = 18040 if request.param == "gao2017" else 18060
    opened = Visit(browser, nf.load_robot(request.param), port=port)
    opened.robot = request.param
    # a tension and a stroke from the middle of the sliders
    opened.middle = {"pacheco2021-a": (1.0, 1.5), "gao2017": (6.0, 2.0)}[request.param]
    yield opened
    opened.leave()


@pytest.fixture(autouse=True)
def begin_at_rest(visit):
    visit.reset()
    if visit.chosen("tendon by") != TENSION:
        visit.choose("tendon by", TENSION)
    visit.slider(TENSION).wait_for()
    yield
    assert visit.errors == []


@pytest.fixture
def slow_robot(monkeypatch):
    """The robot takes many seconds from one end of a slider to the other.

    It usually takes one, and a browser on a busy machine types later than that.
    """
    monkeypatch.setattr("notchflex.viewer.viewer.MAX_STEPS", 4.0)


def ends(visit, label):
    slider = visit.slider(label)
    return [float(slider.get_attribute(f"aria-value{which}")) for which in ("min", "now", "max")]


def shown(visit, label):
    return float(visit.box(label).input_value())


def test_tension_stroke_and_tension_again_each_take_effect_at_once(visit):
    tension, stroke = visit.middle
    end = ends(visit, TENSION)[2]
    visit.set_tension(tension)
    reached = visit.still()["stroke_1"]
    visit.choose("tendon by", STROKE)
    visit.slider(STROKE).wait_for()
    assert visit.slider(TENSION).count() == 0  # its label and range went with it
    assert visit.still()["stroke_1"] == pytest.approx(reached, abs=2e-3)  # nothing moved
    low, now, high = ends(visit, STROKE)
    assert (low, now) == (0.0, pytest.approx(reached, abs=2e-3))
    assert high < 15.0
    visit.set_stroke(stroke)
    assert shown(visit, STROKE) == stroke
    held = visit.still()["tension_1"]
    visit.choose("tendon by", TENSION)
    visit.slider(TENSION).wait_for()
    assert visit.slider(STROKE).count() == 0
    assert visit.still()["tension_1"] == pytest.approx(held, abs=2e-3)
    assert ends(visit, TENSION)[2] == end
    further = round(1.3 * tension, 1)
    visit.set_tension(further)
    assert shown(visit, TENSION) == further


def test_stroke_first_and_then_tension(visit):
    tension, stroke = visit.middle
    visit.choose("tendon by", STROKE)
    visit.slider(STROKE).wait_for()
    visit.set_stroke(stroke)
    visit.choose("tendon by", TENSION)
    visit.slider(TENSION).wait_for()
    visit.set_tension(tension)
    visit.choose("tendon by", STROKE)
    visit.set_stroke(0.5 * stroke)
    visit.reset()
    assert visit.chosen("tendon by") == TENSION
    visit.set_tension(0.5 * tension)


@pytest.mark.usefixtures("slow_robot")
def test_a_switch_while_the_robot_is_on_its_way_stops_it_and_takes_effect(visit):
    _, stroke = visit.middle
    visit.press("Play a cycle")
    visit.page.wait_for_timeout(300)
    visit.choose("tendon by", STROKE)
    visit.set_stroke(stroke)
    assert visit.still()["stroke_1"] == pytest.approx(stroke)


def test_what_was_chosen_stays_when_friction_is_changed(visit):
    _, stroke = visit.middle
    visit.choose("tendon by", STROKE)
    visit.set_stroke(stroke)
    law = visit.chosen("law")
    rubbed = visit.read("tension_1")
    visit.choose("law", "frictionless")
    visit.page.wait_for_function(
        "old => document.querySelector('[data-name=tension_1]').innerText !== old", arg=rubbed
    )
    assert visit.chosen("tendon by") == STROKE
    visit.set_stroke(0.5 * stroke)
    visit.choose("tendon by", TENSION)
    visit.set_tension(visit.middle[0])
    visit.choose("law", law)
    visit.set_tension(0.5 * visit.middle[0])


def test_a_number_beyond_the_slider_is_set_to_its_end_and_said_so(visit):
    end = ends(visit, TENSION)[2]
    visit.type(TENSION, f"{10.0 * end:g}", delay=120)
    text = visit.notice("is outside its slider")
    assert f"{10.0 * end:g} N" in text
    assert f"set to {end:g} N" in text
    visit.wait_for("tension_1", f"{end:.3f}")
    assert shown(visit, TENSION) == end
    assert visit.still()["tension_1"] == end
    visit.set_tension(0.5 * end)
    visit.no_notice()


def test_a_slider_cannot_be_stretched_without_limit(visit):
    end = ends(visit, TENSION)[2]
    visit.type("slider to", "1000000000", delay=0)  # at once, also on a busy machine
    visit.notice("The end of the slider")
    assert ends(visit, TENSION)[2] == shown(visit, "slider to") == 10.0 * end
    visit.type("slider to", f"{end:g}")
    visit.page.wait_for_selector(f"[role=slider][aria-valuemax='{end:g}']")
    visit.no_notice()


@pytest.mark.usefixtures("slow_robot")
def test_a_new_number_is_obeyed_at_once_whatever_the_robot_was_on_its_way_to(visit):
    end = ends(visit, TENSION)[2]
    visit.type(TENSION, f"{end:g}")
    visit.page.wait_for_function(
        "() => parseFloat(document.querySelector('[data-name=tension_1]').innerText) > 0"
    )
    low = 0.11 * end  # between two steps of the way up
    visit.type(TENSION, f"{low:g}")
    visit.wait_for("tension_1", f"{low:.3f}")
    most = max(step.tension[0] for step in visit.viewer.session.history)
    assert most < 0.9 * end


def test_typing_slowly_does_not_pass_the_numbers_that_are_typed_on_the_way(visit):
    end = ends(visit, TENSION)[2]
    visit.set_tension(0.8 * end)
    wanted = round(0.7 * end, 1)  # 2.1 and 10.5 begin with 2 and 1, which are below
    visit.set(TENSION, wanted, delay=120)
    tension = [step.tension[0] for step in visit.viewer.session.history]
    after = tension[tension.index(max(tension)) :]
    assert min(after) == pytest.approx(wanted)


@pytest.mark.usefixtures("slow_robot")
def test_stop_leaves_the_robot_and_the_box_where_it_is(visit):
    end = ends(visit, TENSION)[2]
    visit.press("Play a cycle")
    visit.page.wait_for_function(
        "() => parseFloat(document.querySelector('[data-name=tension_1]').innerText) > 0"
    )
    visit.press("Stop")
    stands = visit.still()["tension_1"]
    assert 0.0 < stands < end
    assert shown(visit, TENSION) == pytest.approx(stands, abs=2e-3)
    visit.set_tension(0.25 * end)  # and it goes on from there


@pytest.mark.usefixtures("slow_robot")
def test_reset_on_the_way_leaves_the_free_robot(visit):
    visit.type(TENSION, f"{ends(visit, TENSION)[2]:g}")
    visit.press("Reset")
    found = visit.still()
    assert found["tension_1"] == found["total_angle"] == 0.0
    assert shown(visit, TENSION) == 0.0


def test_no_sign_before_a_zero(visit):
    for name in ("tension_1", "stroke_1", "total_angle", "tip_position"):
        assert "-0.00" not in visit.read(name).replace("-0.00 ", "-0.00")


def test_by_stroke_the_loop_is_drawn_against_stroke(visit):
    tension, stroke = visit.middle
    visit.loop_is("tension")
    visit.choose("tendon by", STROKE)
    visit.set_stroke(stroke)
    visit.set_stroke(0.5 * stroke)
    visit.loop_is("stroke", LOADING, UNLOADING)
    visit.choose("tendon by", TENSION)
    visit.slider(TENSION).wait_for()
    visit.set_tension(tension)
    ways = visit.page.evaluate(
        "() => document.querySelector('.js-plotly-plot').data.map(line => line.name)"
    )
    assert len(ways) >= 3  # with the dot of now


def test_both_sliders_end_where_the_robot_is_bent_as_far(visit):
    end = ends(visit, TENSION)[2]
    visit.set_tension(end)
    far = visit.still()
    visit.reset()
    visit.choose("tendon by", STROKE)
    visit.slider(STROKE).wait_for()
    most = ends(visit, STROKE)[2]
    assert most == pytest.approx(far["stroke_1"], rel=0.01)
    visit.set_stroke(most)
    assert visit.angle() == pytest.approx(far["total_angle"], rel=0.02)
    visit.no_notice()
