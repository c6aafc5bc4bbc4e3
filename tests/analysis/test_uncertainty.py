"""Bands: tolerances carried through the solver, against derivatives and closed forms."""

from dataclasses import replace as fields_replaced

import numpy as np
import pytest
from scipy.special import ndtri

import notchflex as nf
from notchflex.analysis.bands import closing_bands
from notchflex.analysis.draws import sources_of, tolerances_of, values_at
from notchflex.plotting import picture
from notchflex.plotting.marks import Area
from notchflex.robot import from_table, to_table
from notchflex.robot.problems import amount
from notchflex.robot.value_names import number_at

# Of a normal distribution, 5 % lie below minus this many standard deviations.
Z = -float(ndtri(0.05))


@pytest.fixture(scope="module")
def linear(wrist: nf.Robot) -> nf.Robot:
    """Wrist A with a linear material."""
    return wrist.replace(material=nf.Linear(10_000.0))


def test_depth_alone_is_the_section_at_its_percentiles(wrist: nf.Robot, margin):
    """One notch under a small tension: the angle is F (r + y) h / (E I(g))."""
    notch = nf.ArcNotch("on-axis", depth=1.40, height=0.8, uncut_length=1.2)
    robot = wrist.replace(notch=(notch,), friction=nf.Capstan(0.0), tendon=(nf.Tendon(0.70),))
    tension, sd = 1e-4, 0.01
    bands = nf.uncertain(robot, nf.Load(tension=tension), {"notch.depth": sd}, draws=1000)
    one = bands["notch_angle"]
    for end, shift in ((one.low, -Z), (one.median, 0.0), (one.high, Z)):
        left = nf.annular_sector(0.81, 0.70, 1.40 + shift * sd)
        arm = 0.70 + float(left.centroid)
        wanted = tension * arm * 0.8 / (10_000.0 * float(left.second_moment_weak))
        margin.within("angle", float(end[0, 0]) / wanted - 1.0, 0.002, "of it")


def test_uniform_tolerances_stay_between_their_limits(wrist: nf.Robot):
    sizes = {"notch.depth": {"plus": 0.01, "minus": 0.02}, "tube.inner_diameter": {"sd": 0.01}}
    sizes["material.elastic_modulus"] = {"sd": "10 %", "plus": "5 %", "minus": "5 %"}
    bands = nf.uncertain(wrist, nf.Load(tension=0.1), sizes, draws=200)
    depth = bands.drawn["notch.depth"]
    assert 1.38 <= depth.min() < 1.3802
    assert 1.4098 < depth.max() <= 1.41
    assert np.median(depth) == pytest.approx(1.395, abs=2e-4)
    modulus = bands.drawn["material.elastic_modulus"]
    assert 9_500.0 <= modulus.min() < 9_520.0
    assert 10_480.0 < modulus.max() <= 10_500.0
    assert np.std(bands.drawn["tube.inner_diameter"]) == pytest.approx(0.01, rel=0.02)


def test_every_draw_has_its_own_history(wrist: nf.Robot, margin):
    load = nf.pull(0.0, 2.0, steps=5).release()
    bands = nf.uncertain(wrist, load, {"notch.depth": 0.01, "friction.coefficient": 0.02}, draws=9)
    assert bands.converged.tolist() == [9] * len(load)
    for draw in (0, 5):
        values = {name: float(numbers[draw]) for name, numbers in bands.drawn.items()}
        alone = nf.simulate(wrist.with_values(values), load)
        for name in ("total_angle", "stroke", "peak_strain"):
            margin.within(name, bands.samples[name][draw] - getattr(alone, name), 1e-11)
    one = bands["total_angle"]
    assert one.low[2] < bands.path.total_angle[2] < one.high[2]
    assert one.median[7] > one.median[2]  # unloading at the same tension


@pytest.mark.nightly
def test_notches_of_their_own_average_out(linear: nf.Robot):
    load = nf.Load(tension=0.5)
    common = nf.uncertain(linear, load, {"notch.depth": 0.01}, draws=400)
    own = nf.uncertain(linear, load, {"notch.depth": {"sd": 0.01, "per_notch": True}}, draws=400)
    assert list(own.drawn) == [f"notch[{number}].depth" for number in range(1, 6)]
    wide, narrow = (np.std(one.samples["total_angle"]) for one in (common, own))
    assert wide / narrow == pytest.approx(np.sqrt(5.0), rel=0.08)


def test_one_notch_replaces_what_holds_for_all(wrist: nf.Robot):
    sizes = {"notch[3].depth": 0.0, "notch.depth": 0.01}
    unlike = wrist.with_value("notch[1].depth", 1.37)
    bands = nf.uncertain(unlike, nf.Load(tension=0.3), sizes, draws=20)
    assert np.ptp(bands.drawn["notch[3].depth"]) == 0.0
    # Unlike depths get the same deviation.
    change = bands.drawn["notch[2].depth"] - bands.drawn["notch[1].depth"]
    np.testing.assert_allclose(change, 0.03, atol=1e-12)


def test_the_same_seed_draws_the_same_robots(wrist: nf.Robot):
    load = nf.Load(tension=1.0)
    first, again, other = (nf.uncertain(wrist, load, draws=16, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.samples["tip_position"], again.samples["tip_position"])
    assert (first.samples["tip_position"] != other.samples["tip_position"]).any()


def test_draws_that_fail_are_counted_and_told(wrist: nf.Robot):
    """A stroke that closes every notch of some draws, and then cannot go further."""
    bands = nf.uncertain(
        wrist, nf.stroke_path(0.0, 3.68, steps=4), {"notch.height": 0.02}, draws=40
    )
    assert bands.path.converged.all()
    assert bands.converged[:-1].tolist() == [40, 40, 40]
    assert 0 < bands.converged[-1] < 40
    (sentence,) = bands.warnings()
    assert f"{40 - bands.converged[-1]} of 40 draws did not converge" in sentence
    failed = np.isnan(bands.samples["total_angle"][:, -1])
    assert failed.sum() == 40 - bands.converged[-1]
    assert np.isfinite(bands["total_angle"].high).all()


def test_draws_without_a_valid_robot_are_drawn_again_and_told(wrist: nf.Robot):
    deep = wrist.with_value("notch.depth", 1.58)
    bands = nf.uncertain(deep, nf.Load(tension=1e-3), {"notch.depth": 0.03}, draws=64)
    assert bands.redrawn > 0
    assert bands.drawn["notch.depth"].max() < 1.62
    assert len(bands.drawn["notch.depth"]) == 64
    assert f"{bands.redrawn} of 64 draws made no valid robot" in bands.warnings()[0]


def test_the_file_replaces_what_is_assumed(wrist: nf.Robot):
    chosen, assumed = tolerances_of(wrist)
    assert assumed == (
        "notch.depth",
        "notch.height",
        "tube.inner_diameter",
        "material.elastic_modulus",
        "material.superelastic_modulus",
        "friction.coefficient",
        "tendon.radius",
    )
    assert chosen[0].sd == 0.010
    assert chosen[2].sd == 0.012
    own = wrist.replace(tolerance={"notch.depth": 0.0})
    chosen, rest = tolerances_of(own)
    assert rest == assumed[1:]
    assert chosen[0].sd == 0.0
    large = nf.load_robot("liu2022")
    sizes = {one.value: one.sd for one in tolerances_of(large)[0]}
    assert sizes["notch.depth"] == pytest.approx(0.005 * large.tube.outer_diameter, rel=0.01)


def test_a_tendon_of_known_diameter_has_its_play(wrist: nf.Robot):
    """The lumen has a radius of 0.7 mm."""
    thin = wrist.with_values({"tendon.diameter": 0.2, "tendon.radius": 0.55})
    chosen = {one.value: one for one in tolerances_of(thin)[0]}["tendon.radius"]
    assert (chosen.sd, chosen.plus, chosen.minus) == (None, 0.05, 0.05)


def test_nitinol_has_the_ranges_of_published_tubes(wrist: nf.Robot):
    table = to_table(wrist)
    table["material"] = {"kind": "nitinol", "elastic_modulus": 42e3, "plateau_stress": 350.0}
    table["friction"] = {"kind": "capstan", "coefficient": 0.18}
    robot = from_table(table)
    limits = {
        one.value: [
            number_at(robot, one.value) + sign * amount(size, number_at(robot, one.value))
            for sign, size in ((-1.0, one.minus), (1.0, one.plus))
        ]
        for one in tolerances_of(robot)[0]
        if one.sd is None
    }
    assert limits["material.elastic_modulus"] == pytest.approx([30e3, 65e3], rel=2e-3)
    assert limits["material.plateau_stress"] == pytest.approx([250.0, 520.0], rel=2e-3)
    assert limits["material.plateau_modulus"] == pytest.approx([2e3, 9e3], rel=2e-3)
    # Friction is unknown by a factor, but the middle of the band stays near that of the file.
    sources = sources_of(robot, tolerances_of(robot)[0])
    levels = np.random.default_rng(0).uniform(size=(2000, len(sources)))
    drawn = values_at(sources, levels)
    for name, usual in (("friction.coefficient", 0.18), ("tendon.radius", 0.7)):
        assert np.median(drawn[name]) == pytest.approx(usual, rel=0.1)
    friction = np.quantile(drawn["friction.coefficient"], (0.05, 0.95)) / 0.18
    assert friction[0] < 0.45
    assert friction[1] > 1.9


def test_shares_of_the_variance_are_those_of_sums(wrist: nf.Robot, margin):
    """Small deviations add up: each group has the part of the squares that it has alone."""
    tolerances = {
        "material.elastic_modulus": "2 %", "friction.coefficient": "4 %", "notch.depth": 0.001,
    }  # fmt: skip
    load = nf.Load(tension=0.5)

    def deviation(some: dict[str, object]) -> float:
        bands = nf.uncertain(wrist, load, draws=200, tolerances=some, outputs=("total_angle",))
        return float(bands.samples["total_angle"].std())

    alone = {name: deviation({name: size}) ** 2 for name, size in tolerances.items()}
    bands = nf.uncertain(wrist, load, draws=400, tolerances=tolerances, outputs=("total_angle",))
    shares = bands.variance_shares("total_angle", 0)
    assert sum(shares.values()) == pytest.approx(1.0)
    for group, name in zip(("material", "friction", "cuts"), tolerances, strict=True):
        margin.within(group, shares[group] - alone[name] / sum(alone.values()), 0.05)
    assert shares["other"] == 0.0


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"draws": 1}, "OUT_OF_RANGE"),
        ({"outputs": ("angle",)}, "UNKNOWN_NAME"),
        ({"tolerances": {"notch.dept": 0.1}}, "INVALID_ROBOT"),
        ({"tolerances": {"tube.inner_diameter": {"plus": 0.4, "minus": -0.3}}}, "INVALID_ROBOT"),
    ],
)
def test_what_makes_no_bands(wrist: nf.Robot, options: dict, code: str):
    with pytest.raises(nf.InputError) as error:
        nf.uncertain(wrist, nf.Load(tension=1.0), **options)
    assert error.value.code.name == code


@pytest.mark.nightly
def test_closing_moves_with_the_tolerances(wrist: nf.Robot, margin):
    """Against the closing of robots that are solved one by one."""
    table = nf.closing(wrist)
    # With friction of any set-up some draws need more tension than the band looks at.
    narrow = {"notch.depth": 0.005, "friction.coefficient": "20 %"}
    found = closing_bands(wrist.replace(tolerance=narrow), table)
    assert found is not None
    bands = found.bands
    tensions, angles = [], []
    for draw in range(bands.draws):
        values = {name: float(numbers[draw]) for name, numbers in bands.drawn.items()}
        one = nf.closing(wrist.with_values(values))
        tensions.append(one.tension)
        angles.append(one.angle)
    for name, each, own in (("tension", tensions, found.tension), ("angle", angles, found.angle)):
        assert np.isfinite(each).mean() > 0.99  # of some draws `closing` does not find one
        low, median, high = np.nanquantile(each, (0.05, 0.5, 0.95), axis=0)
        width = high - low
        margin.within(f"median {name}", np.max(np.abs(own.median - median) / width), 0.02, "width")
        margin.within(f"width of {name}", (own.high - own.low) / width - 1.0, 0.03, "of it")
    deeper, shallower = (
        nf.solve(wrist.with_value("notch.depth", depth), nf.Load(tension=found.load)).total_angle
        for depth in (1.41, 1.39)
    )
    margin.within("by depth", found.by_depth - 0.5 * (deeper - shallower), 1e-9, "rad")
    assert closing_bands(nf.load_robot("liu2022"), nf.closing(nf.load_robot("liu2022"))) is None


def test_a_picture_shades_the_bands_of_both_branches(wrist: nf.Robot):
    bands = nf.uncertain(wrist, nf.pull(0.0, 1.0, steps=5).release(), draws=8)
    total = picture(bands).cells[2].panel
    areas = [item for item in total.items if isinstance(item, Area)]
    assert len(areas) == 2
    corners = areas[0].polygons[0]
    top = np.degrees(bands["total_angle"].high[4])
    assert corners[:, 1].max() == pytest.approx(top, rel=1e-12)
    text = repr(bands)
    assert text.startswith("Bands of 8 draws over 10 steps")
    assert "notch.depth" in text


def test_sections_and_sheaths_have_tolerances_of_their_own(wrist: nf.Robot):
    """A backbone is a drawn wire, not a laser's cut in a tube as wide as its disks."""
    nitinol = nf.Nitinol(42e3, 350.0, 6e3, density=6450.0)
    shaft = nf.RodGap(
        10.0,
        0.5,
        uncut_length=1.0,
        repeat=2,
        tube=nf.Tube(8.0, 0.5),
        material=nf.Linear(200e3, density=7900.0),
    )
    tendon = nf.Tendon(
        0.7,
        path="straight",
        sheath_length=500.0,
        sheath_friction=0.1,
        sheath_wire_stiffness=14e3,
    )
    cut = tuple(
        fields_replaced(notch, tube=nf.Tube(1.5, 1.3), material=nitinol) for notch in wrist.notch
    )
    robot = wrist.replace(notch=(shaft, *cut), tendon=(tendon,))
    chosen = {each.value: each for each in tolerances_of(robot)[0]}
    assert chosen["notch.diameter"].sd == 0.006
    assert chosen["notch.tube.inner_diameter"].sd == 0.012
    assert "tube.inner_diameter" not in chosen  # no flexure is cut from it
    assert "material.elastic_modulus" not in chosen  # nor made of it
    assert chosen["notch.material.elastic_modulus"].plus == f"{100 * (65 / 42 - 1):.3g} %"
    assert chosen["notch.material.plateau_stress"].minus == f"{100 * (1 - 250 / 350):.3g} %"
    assert chosen["tendon.sheath_friction"].sd == chosen["friction.coefficient"].sd
    # One deviation for all flexures of a value, each about its own.
    source = {each.name: each for each in sources_of(robot, list(chosen.values()))}
    values = source["notch.material.elastic_modulus"].values(1.0)
    assert values["notch[1].material.elastic_modulus"] == pytest.approx(200e3 * 65 / 42, rel=2e-3)
    assert values["notch[3].material.elastic_modulus"] == pytest.approx(65e3, rel=2e-3)
