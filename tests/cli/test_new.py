"""`notchflex new`: from options, from a pipe, from a person; nothing is overwritten."""

import io
import re

import pytest

from notchflex import load_robot
from notchflex.cli import run

OPTIONS = {
    "--outer-diameter": "1.62",
    "--inner-diameter": "1.40",
    "--cut": "on-axis",
    "--notches": "4",
    "--depth": "1.36,1.39,1.42,1.42",
    "--height": "1.0",
    "--uncut-length": "1",
}


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def command(name="w", *more, **changed):
    options = {**OPTIONS, **{f"--{k.replace('_', '-')}": v for k, v in changed.items()}}
    return ["new", name, *more, *(x for pair in options.items() if pair[1] for x in pair)]


def pipe(monkeypatch, *lines):
    monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{line}\n" for line in lines)))


def person(monkeypatch, *answers):
    """A person at a terminal who types these answers; returns the prompts that were shown."""
    left, asked = iter(answers), []

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    def typed(prompt):
        asked.append(prompt)
        return next(left)

    monkeypatch.setattr("sys.stdin", Terminal())
    monkeypatch.setattr("builtins.input", typed)
    return asked


def test_options_alone_make_a_robot(monkeypatch, tmp_path, capsys):
    pipe(monkeypatch)
    assert run(command(friction="0.1", precurvature="-1")) == 0
    robot = load_robot(tmp_path / "w.toml")
    assert robot.name == "w"
    assert [notch.depth for notch in robot.notches] == [1.36, 1.39, 1.42, 1.42]
    assert [notch.repeat for notch in robot.notch] == [1, 1, 2]
    assert robot.notches[0].precurvature_deg == -1.0
    assert robot.tendon[0].radius == 0.7
    assert robot.friction.coefficient == 0.1
    assert "notchflex show w.toml" in capsys.readouterr().out


ESTIMATED = {
    "nitinol": ("plateau_stress", "plateau_modulus"),
    "superelastic": (
        "superelastic_modulus", "transition_strain", "plastic_strain", "plastic_modulus",
        "plastic_exponent",
    ),
}  # fmt: skip


@pytest.mark.parametrize("material", ESTIMATED)
def test_file_says_what_was_not_measured(monkeypatch, tmp_path, material):
    pipe(monkeypatch)
    assert run(command(elastic_modulus="9000", material=material)) == 0
    lines = (tmp_path / "w.toml").read_text(encoding="utf-8").splitlines()
    values = {line.partition(" = ")[0]: line for line in lines}
    for key in (
        *ESTIMATED[material], "poisson_ratio", "density", "allowed_strain", "coefficient",
    ):  # fmt: skip
        assert "estimate: " in values[key], key
    for key in ("base_length", "precurvature_deg", "radius", "axial_stiffness", "wrap"):
        assert "assumed" in values[key], key
    for key in ("elastic_modulus", "outer_diameter", "depth", "height", "uncut_length", "name"):
        assert not re.search("estimate|assumed", values[key]), key
    # What a key means stands at the first notch only.
    assert sum("depth of the cut" in line for line in lines) == 1


@pytest.mark.parametrize(
    ("material", "source"), [("nitinol", "30 to 65 GPa"), ("superelastic", "Pacheco 2021, Table 3")]
)
def test_an_estimate_names_the_source_of_its_kind(monkeypatch, tmp_path, material, source):
    pipe(monkeypatch)
    assert run(command(material=material)) == 0
    text = (tmp_path / "w.toml").read_text(encoding="utf-8")
    (line,) = re.findall("(?m)^elastic_modulus.*$", text)
    assert source in line


@pytest.mark.nightly
def test_a_new_wrist_is_warned_of_its_strain(monkeypatch, tmp_path, capsys):
    pipe(monkeypatch)
    assert run(command()) == 0
    assert load_robot(tmp_path / "w.toml").material.allowed_strain == 0.08
    assert (
        run(
            [
                "simulate",
                "w.toml",
                "--tension",
                "3",
                "--quiet",
                "--set",
                "material.allowed_strain=0.02",
            ]
        )
        == 0
    )
    assert "passes the allowed strain of 2 %" in capsys.readouterr().err
    assert run(command("v", allowed_strain="none")) == 0
    assert load_robot(tmp_path / "v.toml").material.allowed_strain is None
    assert run(command("u", allowed_strain="0.06")) == 0
    text = (tmp_path / "u.toml").read_text(encoding="utf-8")
    assert "recovers" not in text
    assert run(command("t", material="linear", elastic_modulus="60000")) == 0
    linear = load_robot(tmp_path / "t.toml").material
    assert (linear.density, linear.allowed_strain) == (None, None)


@pytest.mark.parametrize("word", ["<", "back"])
def test_a_person_goes_back(monkeypatch, tmp_path, capsys, word):
    asked = person(
        monkeypatch, word, "mine", "1.62", "1.4", word, word, "1.8", "1.5", "", "", "off", "2",
        "1.2", *[""] * 20,
    )  # fmt: skip
    options = {"--height": "1", "--uncut-length": "1"}
    assert run(["new", "w", *(part for pair in options.items() for part in pair)]) == 0
    robot = load_robot(tmp_path / "w.toml")
    assert robot.name == "mine"
    assert (robot.tube.outer_diameter, robot.tube.inner_diameter) == (1.8, 1.5)
    assert robot.notches[1].depth == 1.2
    assert robot.tendon[0].radius == 0.75  # the default follows the answer that was changed
    diameters = [prompt for prompt in asked if "diameter" in prompt]
    wanted = ["Outer", "Inner", "Inner", "Outer", "Inner"]
    assert [prompt.split()[0] for prompt in diameters] == wanted
    out = capsys.readouterr().out
    assert "This is the first question" in out
    assert "goes back to the previous question" in " ".join(out.split())


def test_prompts_are_broken_at_words(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "50")
    asked = person(
        monkeypatch, "", "1.62", "1.4", "", "", "on-axis", "3", "1.3", "1", "1", *[""] * 12
    )
    assert run(["new", "w"]) == 0
    shown = [*capsys.readouterr().out.splitlines()[:-1], *asked]
    assert max(map(len, shown)) <= 50
    words = " ".join(shown).split()
    assert {"straight", "stiffness", "superelastic", "commas,"} <= set(words)


def test_what_a_pipe_holds_is_no_way_back(monkeypatch, tmp_path):
    pipe(monkeypatch, "back", "1.62", "1.4", "", "on", "5", "1.4", "0.8", "1.2")
    assert run(["new", "w"]) == 0
    assert load_robot(tmp_path / "w.toml").name == "back"
    pipe(monkeypatch, "x", "1.62", "<")
    assert run(["new", "v"]) == 2


def test_answers_come_line_by_line_from_a_pipe(monkeypatch, tmp_path):
    pipe(monkeypatch, "My wrist", "1.62", "1.62-2*0.11", "", "on", "5", "1.62-0.22", "0.8", "1.2")
    assert run(["new", "piped.toml"]) == 0
    robot = load_robot(tmp_path / "piped.toml")
    assert robot.name == "My wrist"
    assert robot.tube.inner_diameter == 1.4
    assert robot.notches[0].depth == 1.4
    assert robot.notch[0].repeat == 5


def test_a_person_is_asked_again_and_told_why(monkeypatch, tmp_path, capsys):
    tube = ["", "1,62", "1.62", "1.7", "1.40", ""]
    notches = ["", "x", "on-axis", "0", "2", "9", "1.4", "0.8", "1.2", "", ""]
    rest = ["", "", "linear", "60000", "0.01", "", "0"]
    asked = person(monkeypatch, *tube, *notches, *rest)
    assert run(["new", "asked"]) == 0
    robot = load_robot(tmp_path / "asked.toml")
    assert robot.number_of_notches == 2
    assert robot.material.elastic_modulus == 60000.0
    assert robot.material.allowed_strain == 0.01
    out = " ".join(capsys.readouterr().out.split())
    assert "it should be less than 1.62" in out
    assert "give on-axis or off-axis" in out
    assert asked[1] == "Outer diameter of the tube [mm]: "


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"inner_diameter": "1.7"}, "less than 1.62"),
        ({"outer_diameter": "-1"}, "greater than 0"),
        ({"outer_diameter": "nan"}, "got 'nan'"),
        ({"depth": "1.62"}, "less than 1.62"),
        ({"depth": "0"}, "greater than 0"),
        ({"depth": "1.3,1.4"}, "got 2 numbers; give one for all, or 4"),
        ({"height": "1e400"}, "finite"),
        ({"uncut_length": "-0.1"}, "greater than or equal to 0"),
        ({"notches": "2.5"}, "valid integer"),
        ({"notches": "0"}, "greater than or equal to 1"),
        ({"cut": "o"}, "give on-axis or off-axis"),
        ({"tendon_radius": "0.9"}, "less than or equal to 0.81"),
        ({"friction": "-0.1"}, "greater than or equal to 0"),
        ({"depth": "__import__('os')"}, "give a number such as"),
        ({"depth": "9**9**9**9"}, "give a number such as"),
        *(({"height": text}, "") for text in ("1,2,3", "1/0", "True", "(", "2**3")),
        ({"height": None}, "No answer to: Height of the notch"),
        ({"tendon_radius": "0.7,0.7"}, "No answer to: Side of the tube on which the tendon runs"),
    ],
)
def test_bad_readings_write_nothing(monkeypatch, tmp_path, capsys, changed, words):
    pipe(monkeypatch)
    assert run(command(**changed)) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_file_that_is_there_is_kept(monkeypatch, tmp_path, capsys):
    pipe(monkeypatch)
    (tmp_path / "w.toml").write_text("mine")
    assert run(command()) == 2
    assert "already there" in capsys.readouterr().err
    assert (tmp_path / "w.toml").read_text() == "mine"


def test_folder_that_is_missing_is_told_before_asking(monkeypatch, capsys):
    monkeypatch.setattr("builtins.input", lambda prompt: pytest.fail("asked"))
    assert run(["new", "missing/w"]) == 2
    assert "does not exist" in capsys.readouterr().err


TUBE = ["--outer-diameter", "5.99", "--inner-diameter", "4"]
LINK = [
    "--kind", "u-link", "--notches", "5", "--set", "notch.slot_radius=0.275", "--set",
    "notch.strip_thickness=0.7", "--set", "notch.strip_length=2", "--set",
    "notch.proximal_slot=away", "--tendon-radius", "2.5", "--material", "linear",
    "--elastic-modulus", "60000",
]  # fmt: skip


def test_a_row_of_links_by_options(monkeypatch):
    pipe(monkeypatch)
    friction = ["--friction-kind", "corner", "--friction", "0.3", "--set", "friction.turning=slope"]
    assert run(["new", "w", "--yes", *TUBE, *LINK, *friction]) == 0
    robot = load_robot("w.toml")
    assert [notch.kind for notch in robot.notch] == ["u-link"]
    assert robot.notch[0].repeat == 5
    assert robot.tendon[0].path == "straight"
    assert (robot.friction.kind, robot.friction.coefficient) == ("corner", 0.3)


def test_disks_on_a_backbone_by_options(monkeypatch):
    """The hole of the disks and the bore of the backbone are both inner diameters."""
    pipe(monkeypatch)
    gap = ["--kind", "rod", "--notches", "6", "--set", "notch.length=9", "--set"]
    gap += ["notch.diameter=1.2", "--uncut-length", "1", "--material", "linear"]
    tube = ["--outer-diameter", "12", "--inner-diameter", "1.2", "--elastic-modulus", "54000"]
    tendons = ["--tendon-radius", "5,5", "--tendon-direction", "0,180"]
    assert run(["new", "w", "--yes", *tube, *gap]) == 2  # the backbone fills the hole
    assert run(["new", "w", "--yes", *tube, *gap, *tendons]) == 0
    robot = load_robot("w.toml")
    (row,) = robot.notch
    assert (row.kind, row.repeat, row.diameter, row.inner_diameter) == ("rod", 6, 1.2, 0.0)
    assert {tendon.path for tendon in robot.tendon} == {"straight"}


def test_links_that_differ_keep_their_slots_in_turn(monkeypatch):
    pipe(monkeypatch)
    unlike = [
        "notch.strip_thickness=0.7,0.7,0.7,0.8,0.8" if "thickness" in one else one for one in LINK
    ]
    assert run(["new", "w", "--yes", *TUBE, *unlike]) == 0
    robot = load_robot("w.toml")
    assert [notch.repeat for notch in robot.notch] == [3, 2]
    assert [one.proximal_slot for one in robot.notches] == [
        "away",
        "toward",
        "away",
        "toward",
        "away",
    ]


def test_a_person_is_asked_for_every_key_of_a_strip(monkeypatch):
    answers = ["", "10", "6", "", "strip", "7", "3.5", "1.5", "6.9", "", "", "", "0", "", ""]
    rest = ["4", "", "linear", "1000", "", "frictionless"]
    asked = person(monkeypatch, *answers, *rest)
    assert run(["new", "w"]) == 0, asked
    robot = load_robot("w.toml")
    assert (robot.notch[0].kind, robot.notch[0].strip_length) == ("strip", None)
    assert robot.friction.kind == "frictionless"


def test_capstan_and_linear_take_further_keys(monkeypatch):
    pipe(monkeypatch)
    arc = ["--cut", "on-axis", "--notches", "1", "--depth", "4", "--height", "1"]
    further = ["--set", "friction.constant_loss=0.05", "--set", "material.density=6450"]
    linear = ["--material", "linear", "--elastic-modulus", "60000"]
    assert run(["new", "w", "--yes", *TUBE, *arc, "--uncut-length", "1", *linear, *further]) == 0
    robot = load_robot("w.toml")
    assert (robot.friction.constant_loss, robot.material.density) == (0.05, 6450.0)


def test_a_curve_is_given_by_values_joined_by_commas(monkeypatch, tmp_path, capsys):
    pipe(monkeypatch)
    curve = ["--material", "stress-strain", "--set", "material.stress=400, 500"]
    assert run(command("w", *curve, "--set", "material.strain=0.01, 0.05")) == 0
    material = load_robot(tmp_path / "w.toml").material
    assert (material.strain, material.stress) == ((0.01, 0.05), (400.0, 500.0))
    assert run(command("v", *curve, "--set", "material.strain=0.01, x")) == 2
    assert "got 'x'; give a number" in capsys.readouterr().err
    assert not (tmp_path / "v.toml").exists()


@pytest.mark.parametrize("option", ["--kind", "--friction-kind", "--material"])
def test_an_unknown_kind_is_refused_before_anything_else(monkeypatch, capsys, option):
    pipe(monkeypatch)
    assert run(["new", "w", option, "foo", "--outer-diameter", "x"]) == 2
    assert capsys.readouterr().err.startswith(f"Error: {option} foo: got 'foo'; give ")


@pytest.mark.parametrize(
    "wrong",
    [
        "notch.slot_radius",
        "tube.x=1",
        "notch.cut=on-axis",
        "friction.nonsense=1",
        "friction.coefficient=0.2",  # a question asks for it: --friction
    ],
)
def test_a_set_that_nothing_asks_for_writes_nothing(monkeypatch, tmp_path, wrong):
    pipe(monkeypatch)
    assert run(["new", "w", "--yes", *TUBE, *LINK, "--set", wrong]) == 2
    assert list(tmp_path.iterdir()) == []


def test_decimal_commas_are_read(tmp_path):
    depths = "1,36; 1,39; 1,42; 1,42"
    changed = {"outer_diameter": "1,62", "inner_diameter": "1,62-0,22", "depth": depths}
    assert run(command("w", "--yes", **changed)) == 0
    robot = load_robot(tmp_path / "w.toml")
    assert (robot.tube.outer_diameter, robot.tube.inner_diameter) == (1.62, 1.4)
    assert [notch.depth for notch in robot.notches] == [1.36, 1.39, 1.42, 1.42]


def test_a_decimal_comma_in_a_list_gets_a_hint(capsys):
    assert run(command("w", "--yes", height="1,9")) == 2
    assert "got 2 numbers" in (err := capsys.readouterr().err)
    assert "For decimal commas, separate numbers by semicolons, or write a point: 1.9." in err


def test_what_a_data_sheet_prints_makes_the_constants(monkeypatch, tmp_path, capsys):
    pipe(monkeypatch)
    sheet = {"upper_plateau": "520", "lower_plateau": "230", "test_temperature": "22"}
    assert run(command("w", "--yes", **sheet, elastic_modulus="48000", plateau_modulus="800")) == 0
    material = load_robot(tmp_path / "w.toml").material
    share = 1.0 - 800.0 / 48_000.0
    assert material.plateau_stress == pytest.approx((520.0 - 24.0) / share, rel=1e-9)
    assert material.unloading_stress == pytest.approx((230.0 - 20.0) / share, rel=1e-9)
    assert material.reference_temperature == 22.0
    text = (tmp_path / "w.toml").read_text(encoding="utf-8")
    assert "estimate" not in next(x for x in text.splitlines() if x.startswith("plateau_stress"))
    assert (
        run(command("v", "--yes", upper_plateau="520", material="linear", elastic_modulus="9")) == 2
    )
    assert run(command("v", "--yes", upper_plateau="100")) == 2
    assert "no material has an upper_plateau of 100" in capsys.readouterr().err
    assert run(command("v", "--yes", upper_plateau="520", lower_plateau="600")) == 2
    assert "`lower_plateau` is 600 MPa; it must be less" in capsys.readouterr().err
    assert run(command("v", "--yes", lower_plateau="200")) == 2
    assert "an option that it goes with is missing" in capsys.readouterr().err
    asked = person(monkeypatch, *[""] * 5, "500", "", "none", *[""] * 5)
    assert run(command("p", friction="0.1", title="x")) == 0
    assert any("Upper plateau" in words for words in asked)
    assert load_robot(tmp_path / "p.toml").material.unloading_stress is None
