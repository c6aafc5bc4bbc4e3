"""Names of constants: shared, of one robot, of every robot, of every notch; limits and starts."""

import math

import pytest

import notchflex as nf
from notchflex.fit import Constant
from notchflex.fit.constants import deviations_of, unknowns
from refusals import refused

TWO = {"A": nf.load_robot("pacheco2021-a"), "B": nf.load_robot("pacheco2021-b")}


def names(fit, robots=TWO):
    return [one.name for one in unknowns(robots, fit)]


def test_a_name_alone_is_shared_by_all_robots():
    (one,) = unknowns(TWO, "friction.coefficient")
    sets = [number[:2] for number in one.sets]
    assert sets == [("A", "friction.coefficient"), ("B", "friction.coefficient")]


def test_each_robot_and_each_notch_have_their_own():
    assert names("each:friction.coefficient") == [
        "A:friction.coefficient",
        "B:friction.coefficient",
    ]
    assert names("A:notch[each].precurvature_deg") == [
        f"A:notch[{notch}].precurvature_deg" for notch in range(1, 6)
    ]
    assert len(names("notch[each].precurvature_deg")) == 10


def test_units_limits_and_starts_come_from_the_robot():
    modulus, friction = unknowns(TWO, ["material.elastic_modulus", "friction.coefficient"])
    assert (modulus.unit, modulus.lower, modulus.upper) == ("MPa", 1e-6, 1e9)
    assert modulus.first < 10_000.0 < modulus.last
    assert (friction.unit, friction.lower) == ("", 0.0)


def test_limits_of_the_user_hold():
    (one,) = unknowns(TWO, Constant("friction.coefficient", 0.05, 0.3))
    assert (one.lower, one.upper, one.first, one.last) == (0.05, 0.3, 0.05, 0.3)


@pytest.mark.parametrize(
    ("fit", "code", "name"),
    [
        ((), "NO_DATA", "friction.coefficient"),
        (("material.modulus",), "UNKNOWN_NAME", "material.modulus"),
        (("C:friction.coefficient",), "UNKNOWN_NAME", "C"),
        (("friction.coefficient", "A:friction.coefficient"), "CONFLICT", "friction.coefficient"),
        (("friction.coefficient",) * 2, "CONFLICT", "friction.coefficient"),
        (("material.kind",), "UNSUPPORTED", "material.kind"),
        (("tube.base_length",), "MISSING_VALUE", "tube.base_length"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_words(fit, code, name):
    with refused(code, name):
        unknowns(TWO, fit)


@pytest.mark.parametrize(
    "made",
    [
        lambda: Constant("x", 2.0, 1.0),
        lambda: Constant("x", prior=(1.0, 0.0)),
        lambda: Constant("x", lower=math.nan),
        lambda: Constant(" "),
    ],
)
def test_limits_and_priors_must_make_sense(made):
    with pytest.raises(nf.InputError):
        made()


def test_the_law_deviates_in_the_last_notch_only():
    """A factor on all notches is no other number than the moduli."""
    wrist = nf.load_robot("pacheco2021-a-true")
    found = deviations_of({"A": wrist}, unknowns({"A": wrist}, "notch.depth"))
    assert [one.name for one in found if "stiffness" in one.name] == ["notch[5].stiffness_factor"]
