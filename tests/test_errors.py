"""Codes of errors and failures: every raise site has one, and the page lists them all."""

import ast
import importlib.util
import pickle
from pathlib import Path

import pytest

import notchflex as nf
from notchflex.errors import InputError, RobotFileError

ROOT = Path(__file__).parents[1]
CLASSES = ("InputError", "RobotFileError")
SOURCES = sorted((ROOT / "src" / "notchflex").rglob("*.py"))


def made_without_code(file: Path) -> list[int]:
    """Lines where an input error is made by its class with a message only, or with another code."""
    lines = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in (
            "InputError",
            "RobotFileError",
        ):
            # An error that is raised again with more words keeps its code.
            keeps = len(node.args) == 2 and ast.unparse(node.args[1]).endswith(".code")
            lines += [] if keeps else [node.lineno]
    return lines


def test_every_input_error_has_a_code():
    for file in SOURCES:
        assert made_without_code(file) == [], f"raise InputError.OUT_OF_RANGE(...) in {file}"


def test_codes_and_ways_to_raise_them_are_the_same():
    for code in nf.ErrorCode:
        if code is not nf.ErrorCode.INVALID_INPUT:  # the code of errors that others raise
            for cls in (InputError, RobotFileError):
                error = getattr(cls, code.name)("message")
                assert (type(error), error.code, str(error)) == (cls, code, "message")
                assert code.remedy
    assert InputError("message").code is nf.ErrorCode.INVALID_INPUT


def test_every_code_is_used():
    text = "".join(file.read_text(encoding="utf-8") for file in SOURCES if file.stem != "errors")
    for code in nf.ErrorCode:
        if code is not nf.ErrorCode.INVALID_INPUT:
            assert f"Error.{code.name}(" in text, code
    for failure in nf.Failure:
        assert f"Failure.{failure.name}" in text, failure


def test_errors_keep_their_code_between_processes():
    error = pickle.loads(pickle.dumps(InputError.OUT_OF_RANGE("got 0")))
    assert (str(error), error.code) == ("got 0", nf.ErrorCode.OUT_OF_RANGE)
    failed = pickle.loads(pickle.dumps(nf.ConvergenceError("step 1", nf.Failure.NOT_TRIED)))
    assert failed.code is nf.Failure.NOT_TRIED


def test_the_page_is_what_the_codes_give():
    file = ROOT / "docs" / "make" / "errors.py"
    spec = importlib.util.spec_from_file_location("errors_page", file)
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert (ROOT / "docs" / "errors.md").read_text(encoding="utf-8") == made.page()


@pytest.fixture(scope="module")
def wrist():
    return nf.load_robot("pacheco2021-a")


def test_failures_have_a_code(wrist, tmp_path):
    path = nf.simulate(wrist, nf.stroke_path(3.0, 9.0, steps=3))
    assert path.reason_code == ["", "NOTCHES_CLOSED", "NOT_TRIED"]
    assert path[1].reason_code == "NOTCHES_CLOSED"
    assert nf.Failure.NOTCHES_CLOSED.text in path[1].reason
    assert nf.Failure.NOTCHES_CLOSED.remedy in path[1].reason
    with pytest.raises(nf.ConvergenceError) as caught:
        path.raise_if_failed()
    assert caught.value.code is nf.Failure.NOTCHES_CLOSED
    with pytest.raises(nf.ConvergenceError) as caught:
        path[2].raise_if_failed()
    assert caught.value.code is nf.Failure.NOT_TRIED
    nf.save_path(path, tmp_path / "path.json")
    assert nf.read_path(tmp_path / "path.json").reason_code == path.reason_code


def test_a_tendon_without_free_length_is_named():
    notch = nf.ArcNotch("on-axis", 1.6, 0.7, uncut_length=3.5, ends="shell", closing="elastic")
    robot = nf.Robot(
        name="pressed together",
        tube=nf.Tube(3.5, 3.0),
        notch=(notch,),
        tendon=(nf.Tendon(1.44, path="straight"),),
        material=nf.Linear(60000.0),
        friction=nf.Capstan(0.1),
    )
    path = nf.simulate(robot, [nf.Load(tension=600.0), nf.Load(tension=3000.0)])
    assert path.reason_code == ["", "TENDON_EDGES_MEET"]
    assert "tendon 1's channel meet in notch 1" in path.reason[1]


def test_a_stroke_across_slack_names_the_constant_loss():
    robot = nf.load_robot("pacheco2021-a").replace(friction=nf.Capstan(0.13, constant_loss=15.0))
    pulled = nf.simulate(robot, [nf.Load(tension=pull) for pull in (18.0, 60.0, 172.5)])
    assert pulled.converged.all()
    for stroke in (1.5, 2.5):
        assert pulled.stroke[0, 0] < stroke < pulled.stroke[2, 0]  # a tension reaches it
        path = nf.simulate(robot, [nf.Load(stroke=stroke)])
        assert path.reason_code == ["LOSS_LEAVES_SLACK"]
        assert "135 N over all edges of tendon 1" in path.reason[0]  # 9 edges
        assert "command a tension" in path.reason[0]


@pytest.mark.parametrize(
    ("code", "call"),
    [
        ("UNKNOWN_NAME", lambda wrist: nf.load_robot("no-such-robot")),
        ("UNKNOWN_NAME", lambda wrist: nf.solve_batch(wrist, nf.Load(1.0), outputs=["bend"])),
        ("UNKNOWN_NAME", lambda wrist: nf.solve(wrist, nf.Load(1.0)).quantity("tip_positon")),
        ("OUT_OF_RANGE", lambda wrist: nf.Load(tension=-1.0) and nf.solve(wrist, nf.Load(-1.0))),
        ("NOT_FINITE", lambda wrist: nf.tip_from_angles(wrist, [[float("nan")] * 5])),
        ("WRONG_SHAPE", lambda wrist: nf.tip_from_angles(wrist, [[0.1] * 4])),
        ("WRONG_SHAPE", lambda wrist: nf.solve(wrist, nf.Load((1.0, 2.0)))),
        ("WRONG_TYPE", lambda wrist: nf.solve("wrist", nf.Load(1.0))),
        ("CONFLICT", lambda wrist: nf.solve(wrist, nf.Load(tension=1.0, stroke=1.0))),
        ("FILE_NOT_FOUND", lambda wrist: nf.load_robot("nowhere/robot.toml")),
        ("FILE_FORMAT", lambda wrist: nf.read_path("table.csv")),
        ("INVALID_ROBOT", lambda wrist: wrist.replace(name="")),
    ],
)
def test_what_a_mistake_is_called(wrist, code, call):
    with pytest.raises(nf.InputError) as caught:
        call(wrist)
    assert caught.value.code.name == code
    assert caught.value.code.remedy
