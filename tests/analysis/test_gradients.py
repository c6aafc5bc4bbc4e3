"""Derivatives of results by numbers of the robot file and of the loads, against differences."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.analysis.forward_model import slope
from notchflex.errors import ErrorCode
from refusals import refused

# A pull to 1.66 N, let go and pulled again by a little: contacts slide both ways and stick, and
# what that pull was is remembered to the end.
LOOP = (
    nf.pull(0.0, 1.66, steps=3).then(nf.pull(1.3, 1.1, steps=2)).then(nf.pull(1.27, 1.27, steps=1))
)
TIP = {"tip_force": (0.3, 0.0, -0.1), "tip_moment": (0.0, 1.0, 0.0)}
CASES = {
    "wrist, loop": (
        "pacheco2021-a",
        LOOP,
        [
            "notch.depth",
            "notch[2].height",
            "notch[3].precurvature_deg",
            "tube.outer_diameter",
            "tube.inner_diameter",
            "material.elastic_modulus",
            "friction.coefficient",
            "tendon.radius",
            "tension",
        ],
    ),
    "wrist, stroke": (
        "pacheco2021-a",
        nf.stroke_path(0.0, 0.8, steps=3),
        ["notch.depth", "friction.coefficient", "stroke"],
    ),
    "links, loaded": (
        "gao2017",
        nf.pull(2.0, 6.0, steps=2).then(nf.pull(5.5, 5.5, steps=1)).loaded(**TIP),
        ["notch[1].strip_thickness", "material.elastic_modulus", "tension"],
    ),
}
OUTPUTS = ("total_angle", "tip_position")  # the usual ones: their programs serve other tests too


def judged(found: dict[str, jax.Array]) -> jax.Array:
    """One number of all outputs, so that an error in any shows."""
    return found["total_angle"][-1] + 0.1 * jnp.sum(found["tip_position"][-1])


def seen(path: nf.EquilibriumPath) -> float:
    return float(judged({name: jnp.asarray(getattr(path, name)) for name in OUTPUTS}))


def differences(of, value: float) -> float:
    """Slope by central differences of two widths, extrapolated: an error of their fourth power."""
    width = 2e-4 * (abs(value) or 1.0)
    wide, narrow = ((of(value + h) - of(value - h)) / (2.0 * h) for h in (width, 0.5 * width))
    return (4.0 * narrow - wide) / 3.0


@pytest.mark.parametrize(
    "case",
    ["wrist, loop", "wrist, stroke", pytest.param("links, loaded", marks=pytest.mark.nightly)],
)
def test_slopes_against_differences(case, margin):
    name, path, parameters = CASES[case]
    robot = nf.load_robot(name)
    bend = nf.differentiable(robot, path, parameters, outputs=(*OUTPUTS, "converged"))
    found = bend()
    assert found["converged"].all()
    alone = nf.simulate(robot, path)
    np.testing.assert_allclose(found["tip_position"], alone.tip_position, atol=1e-11)

    def one(values: dict[str, jax.Array]) -> jax.Array:
        return judged(bend(values))

    backward = jax.grad(one)(bend.start)
    if case == "wrist, loop":  # that both ways agree does not depend on the robot
        forward = jax.jacfwd(one)(bend.start)
        for parameter in parameters:
            size = np.max(np.abs(forward[parameter]))
            apart = np.max(np.abs(backward[parameter] - forward[parameter])) / size
            margin.within(f"{parameter}, backward against forward", apart, 1e-12)
    for parameter in parameters:
        present = np.asarray(bend.start[parameter])
        if parameter not in ("tension", "stroke"):

            def of_robot(value, parameter=parameter) -> float:
                return seen(nf.simulate(robot.with_value(parameter, value), path))

            expected = differences(of_robot, float(present))
            margin.within(parameter, float(backward[parameter]) / expected - 1.0, 1e-7)
            continue
        for step in {len(path) // 2, len(path) - 1}:  # what the past does, through memory, and now

            def of_load(value, parameter=parameter, step=step, present=present) -> float:
                values = present.copy()
                values[step, 0] = value
                return float(one({parameter: jnp.asarray(values)}))

            expected = differences(of_load, float(present[step, 0]))
            mine = float(backward[parameter][step, 0])
            margin.within(f"{parameter} {step}", (mine - expected) / max(abs(expected), 0.1), 1e-7)


def test_slopes_of_plain_functions(margin):
    def curve(x: float, y: float) -> np.ndarray:
        if y < 0.0:
            raise nf.InputError("not below 0")
        return np.array([np.sin(x) * y, np.inf, np.exp(x + y)])

    for order in (2, 6):
        by_x = slope(lambda x: curve(x, 0.0), 0.7, order=order)
        by_y = slope(lambda y: curve(0.7, y), 0.0, order=order)
        margin.within(f"by x, order {order}", by_x - [0.0, 0.0, np.exp(0.7)], 1e-10)
        by_hand = [np.sin(0.7), 0.0, np.exp(0.7)]
        margin.within(f"by y, inward, order {order}", by_y - by_hand, 1e-9)


@pytest.mark.parametrize(
    ("parameters", "code", "said"),
    [
        (["notch.deph"], "UNKNOWN_NAME", "`notch.deph`"),
        (["material.kind"], "UNSUPPORTED", "`material.kind`"),
        (["notch.repeat"], "UNSUPPORTED", "`notch.repeat`"),
        ([], "NO_DATA", "parameters"),
        (["tension", "tension"], "NO_DATA", "parameters"),
        (["stroke"], "NO_DATA", "stroke"),
    ],
)
def test_what_cannot_vary_is_said(parameters, code, said):
    with refused(code, said):
        nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, 2), parameters)


def test_values_that_do_not_fit_are_said():
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, 2), ["tension"])
    with refused(ErrorCode.UNKNOWN_NAME):
        bend({"notch.depth": 1.3})
    for wrong in (np.zeros((3, 1)), "1.0", ["1.0"], np.array([["1.0"]])):
        with refused(ErrorCode.WRONG_SHAPE):
            bend({"tension": wrong})
    for wrong in ([1.0], 3, "tension"):
        with refused(ErrorCode.WRONG_TYPE):
            bend(wrong)
    with refused(ErrorCode.OUT_OF_RANGE):
        bend({"tension": -1.0})
    with refused(ErrorCode.WRONG_TYPE):
        nf.differentiable("pacheco2021-a", nf.Load(tension=1.0), ["tension"])  # pyright: ignore
    outputs = (*OUTPUTS, "converged")
    deep = nf.differentiable(bend.robot, nf.pull(0.0, 1.0, 2), ["notch.depth"], outputs=outputs)
    with refused(ErrorCode.INVALID_ROBOT):
        deep({"notch.depth": 5.0})
    # Where it is traced nobody can raise.
    traced = jax.jit(lambda depth: deep({"notch.depth": depth}))(5.0)
    assert not traced["converged"].any()
    assert np.isnan(jax.grad(lambda depth: deep({"notch.depth": depth})["total_angle"][1])(5.0))
    with refused(ErrorCode.UNKNOWN_NAME):
        nf.differentiable(bend.robot, nf.pull(0.0, 1.0, 2), ["tension"], outputs=["angle"])


def test_a_value_that_is_no_number_is_not_taken_for_none():
    """Inside a compiled program it gives no converged state and no slope; outside it is refused."""
    loads, outputs = nf.pull(0.5, 1.0, steps=2), (*OUTPUTS, "converged")
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), loads, ["tension"], outputs=outputs)
    values = {"tension": jnp.asarray(bend.start["tension"]).at[0, 0].set(jnp.nan)}
    with pytest.raises(nf.InputError):
        bend(values)
    found = jax.jit(bend)(values)
    assert not found["converged"].any()
    assert np.isnan(found["total_angle"]).all()
    slopes = jax.jit(jax.grad(lambda given: bend(given)["total_angle"][-1]))(values)
    assert np.isnan(slopes["tension"]).all()


def test_an_output_that_was_not_asked_for_is_an_input_error():
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(1.0, 1.0, steps=1), "tension")
    for outputs in (bend(), jax.jit(bend)(bend.start)):
        with pytest.raises(nf.InputError) as problem:
            outputs["gap"]
        assert problem.value.code is ErrorCode.UNKNOWN_NAME
        assert isinstance(problem.value, KeyError)
        assert outputs.get("gap") is None


def test_second_derivatives_are_refused_with_a_sentence():
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(1.0, 1.0, steps=1), "tension")
    with pytest.raises(nf.InputError) as problem:
        jax.hessian(lambda values: bend(values)["total_angle"][0])(bend.start)
    assert problem.value.code is ErrorCode.UNSUPPORTED
    assert "differentiated once" in str(problem.value)
