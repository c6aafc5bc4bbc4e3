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
    "strips": (
        "liu2022",
        nf.pull(0.0, 5.0, steps=2),
        ["material.elastic_modulus", "friction.coefficient", "tension"],
    ),
    "links, loaded": (
        "gao2017",
        nf.pull(2.0, 6.0, steps=2).then(nf.pull(5.5, 5.5, steps=1)).loaded(**TIP),
        ["notch[1].strip_thickness", "material.elastic_modulus", "tension"],
    ),
}
OUTPUTS = ("total_angle", "tip_position", "contact_slid")


def judged(found: dict[str, jax.Array]) -> jax.Array:
    """One number of all outputs, so that an error in any shows."""
    slid = jnp.nansum(found["contact_slid"][-1])
    return found["total_angle"][-1] + 0.1 * jnp.sum(found["tip_position"][-1]) + slid


def seen(path: nf.EquilibriumPath) -> float:
    return float(judged({name: jnp.asarray(getattr(path, name)) for name in OUTPUTS}))


def differences(of, value: float) -> float:
    """Slope by central differences of two widths, extrapolated: an error of their fourth power."""
    width = 2e-4 * (abs(value) or 1.0)
    wide, narrow = ((of(value + h) - of(value - h)) / (2.0 * h) for h in (width, 0.5 * width))
    return (4.0 * narrow - wide) / 3.0


LONG = ("strips", "links, loaded")


@pytest.mark.parametrize(
    "case", [pytest.param(one, marks=[pytest.mark.nightly] * (one in LONG)) for one in CASES]
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
            margin.within(f"{parameter}, backward against forward", apart, 1e-9)
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


@pytest.mark.nightly
def test_a_force_at_the_tip(margin):
    robot = nf.load_robot("pacheco2021-a")
    path = nf.pull(0.6, 1.2, steps=2).loaded(tip_force=(0.02, 0.01, 0.0))
    push = nf.differentiable(robot, path, ["tip_force", "tip_moment"], outputs=("tip_position",))
    slopes = jax.jacrev(lambda values: push(values)["tip_position"][-1])(push.start)
    for parameter, size in (("tip_force", 2e-4), ("tip_moment", 2e-3)):
        for axis in range(3):

            def at(value, parameter=parameter, axis=axis) -> np.ndarray:
                given = np.array(push.start[parameter])
                given[-1, axis] += value
                loads = [
                    nf.Load(
                        tension=float(tension[0]),
                        tip_force=row if parameter == "tip_force" else force,
                        tip_moment=row if parameter == "tip_moment" else (0.0, 0.0, 0.0),
                    )
                    for tension, row, force in zip(
                        path.tension, given, np.array(push.start["tip_force"]), strict=True
                    )
                ]
                return nf.simulate(robot, loads, refinement=0).tip_position[-1]

            expected = (at(size) - at(-size)) / (2.0 * size)
            mine = np.asarray(slopes[parameter])[:, -1, axis]
            largest = np.abs(np.asarray(slopes[parameter])).max()
            margin.within(f"{parameter} {axis}", (mine - expected) / largest, 1e-5)


def test_it_maps_and_compiles(margin):
    robot = nf.load_robot("pacheco2021-a")
    bend = nf.differentiable(robot, nf.pull(0.5, 1.0, steps=2), ["tension", "notch.depth"])
    tensions = jnp.array([[[0.5], [1.0]], [[0.4], [1.1]]])
    mapped = jax.jit(jax.vmap(lambda tension: bend({"tension": tension})["total_angle"][-1]))
    alone = [nf.solve(robot, nf.Load(tension=t)).total_angle for t in (1.0, 1.1)]
    margin.within("total angle", mapped(tensions) - np.array(alone), 1e-12, "rad")
    depths = jnp.array([1.38, 1.40])
    slopes = jax.vmap(jax.grad(lambda depth: bend({"notch.depth": depth})["total_angle"][-1]))
    deeper = slopes(depths)
    single = [jax.grad(lambda d: bend({"notch.depth": d})["total_angle"][-1])(d) for d in depths]
    margin.within("slopes", deeper - jnp.stack(single), 1e-11)


def test_what_is_not_solved_has_no_slope():
    robot = nf.load_robot("pacheco2021-a")
    outputs = ("total_angle", "converged")
    draw = nf.differentiable(
        robot, nf.stroke_path(50.0, 50.0, steps=1), ["stroke"], outputs=outputs
    )
    assert not draw()["converged"][0]
    assert np.isnan(draw()["total_angle"][0])
    assert np.isnan(jax.grad(lambda v: draw(v)["total_angle"][0])(draw.start)["stroke"]).all()


@pytest.mark.nightly
def test_what_loads_did_before_the_tendons_has_a_slope(margin):
    robot = nf.load_robot("pacheco2021-a").with_value("friction.coefficient", 0.4)
    # A push against the bend, see test_tip_response.py.
    path = nf.pull(0.373, 0.373, steps=1).loaded(tip_force=(-0.114, -0.024, -0.189))
    push = nf.differentiable(robot, path, ["friction.coefficient", "notch.depth", "tip_force"])
    mine = jax.grad(lambda values: push(values)["total_angle"][0])(push.start)
    for name in ("friction.coefficient", "notch.depth"):

        def at(value: float, name=name) -> float:
            return float(nf.simulate(robot.with_value(name, value), path).total_angle[0])

        expected = differences(at, float(push.start[name]))
        margin.within(name, float(mine[name]) / expected - 1.0, 1e-6)

    def pushed(force: float) -> float:
        return float(push({"tip_force": [[force, -0.024, -0.189]]})["total_angle"][0])

    along = differences(pushed, -0.114)
    margin.within("tip force", float(mine["tip_force"][0, 0]) / along - 1.0, 1e-6)


@pytest.mark.nightly
def test_a_load_cut_into_many_parts_has_no_slope_with_friction():
    robot = nf.load_robot("pacheco2021-a").with_value("friction.coefficient", 0.4)
    # It is solved in three parts, see test_tip_response.py.
    hard = nf.pull(0.122, 0.122, steps=1).loaded(tip_force=(0.574, -0.7, 0.597))
    push = nf.differentiable(robot, hard, ["tension"])
    angle, by = jax.value_and_grad(lambda values: push(values)["total_angle"][0])(push.start)
    assert np.isfinite(angle)
    assert np.isnan(by["tension"]).all()


def test_numbers_at_the_end_of_their_range(margin):
    robot = nf.load_robot("pacheco2021-a").with_value("friction.coefficient", 0.0)
    bend = nf.differentiable(robot, nf.pull(0.9, 0.9, steps=1), ["friction.coefficient"])
    mine = jax.grad(lambda v: bend(v)["total_angle"][0])(bend.start)["friction.coefficient"]

    def at(value: float) -> float:
        changed = robot.with_value("friction.coefficient", value)
        return float(nf.solve(changed, nf.Load(tension=0.9)).total_angle)

    width = 1e-5
    expected = (-3.0 * at(0.0) + 4.0 * at(width) - at(2.0 * width)) / (2.0 * width)
    margin.within("friction at 0", float(mine) / expected - 1.0, 2e-8)


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


@pytest.mark.parametrize("parameter", ["tension", "tip_force"])
def test_a_refinement_that_is_none_is_said(parameter):
    robot, load = nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, 2)
    with refused(ErrorCode.OUT_OF_RANGE):
        nf.differentiable(robot, load, [parameter], refinement=7)


def test_values_that_do_not_fit_are_said():
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, 2), ["tension"])
    with refused(ErrorCode.UNKNOWN_NAME):
        bend({"notch.depth": 1.3})
    with refused(ErrorCode.WRONG_SHAPE):
        bend({"tension": np.zeros((3, 1))})
    with refused(ErrorCode.OUT_OF_RANGE):
        bend({"tension": -1.0})
    with refused(ErrorCode.WRONG_TYPE):
        nf.differentiable("pacheco2021-a", nf.Load(tension=1.0), ["tension"])  # pyright: ignore
    outputs = ("total_angle", "converged")
    deep = nf.differentiable(bend.robot, nf.pull(0.0, 1.0, 2), ["notch.depth"], outputs=outputs)
    with refused(ErrorCode.INVALID_ROBOT):
        deep({"notch.depth": 5.0})
    # Where it is traced nobody can raise.
    traced = jax.jit(lambda depth: deep({"notch.depth": depth}))(5.0)
    assert not traced["converged"].any()
    assert np.isnan(jax.grad(lambda depth: deep({"notch.depth": depth})["total_angle"][1])(5.0))
    with refused(ErrorCode.UNKNOWN_NAME):
        nf.differentiable(bend.robot, nf.pull(0.0, 1.0, 2), ["tension"], outputs=["angle"])


@pytest.mark.parametrize(
    ("loads", "parameter"),
    [(nf.pull(0.5, 1.0, steps=2), "tension"), (nf.stroke_path(0.1, 0.5, steps=2), "stroke")],
)
def test_a_value_that_is_no_number_is_not_taken_for_none(loads, parameter):
    """Inside a compiled program it gives no converged state and no slope; outside it is refused."""
    outputs = ("total_angle", "converged")
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), loads, [parameter], outputs=outputs)
    values = {parameter: jnp.asarray(bend.start[parameter]).at[0, 0].set(jnp.nan)}
    with pytest.raises(nf.InputError):
        bend(values)
    found = jax.jit(bend)(values)
    assert not found["converged"].any()
    assert np.isnan(found["total_angle"]).all()
    slopes = jax.jit(jax.grad(lambda given: bend(given)["total_angle"][-1]))(values)
    assert np.isnan(slopes[parameter]).all()


@pytest.mark.parametrize("values", [[1.0], 3, "tension"])
def test_values_come_by_name(values):
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(1.0, 1.0, steps=1), "tension")
    with refused(ErrorCode.WRONG_TYPE):
        bend(values)


def test_an_output_that_was_not_asked_for_is_an_input_error():
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(1.0, 1.0, steps=1), "tension")
    for outputs in (bend(), jax.jit(bend)(bend.start)):
        with pytest.raises(nf.InputError) as problem:
            outputs["gap"]
        assert problem.value.code is ErrorCode.UNKNOWN_NAME
        assert isinstance(problem.value, KeyError)
        assert outputs.get("gap") is None


@pytest.mark.parametrize("text", ["1.0", ["1.0"], np.array([["1.0"]])])
def test_text_is_not_a_number(text):
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(1.0, 1.0, steps=1), "tension")
    with pytest.raises(nf.InputError) as problem:
        bend({"tension": text})
    assert problem.value.code is ErrorCode.WRONG_SHAPE


def test_second_derivatives_are_refused_with_a_sentence():
    bend = nf.differentiable(nf.load_robot("pacheco2021-a"), nf.pull(1.0, 1.0, steps=1), "tension")
    with pytest.raises(nf.InputError) as problem:
        jax.hessian(lambda values: bend(values)["total_angle"][0])(bend.start)
    assert problem.value.code is ErrorCode.UNSUPPORTED
    assert "differentiated once" in str(problem.value)


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
def test_all_usual_outputs_have_a_jacobian(jacobian):
    bend = nf.differentiable(
        nf.load_robot("pacheco2021-a"), nf.pull(0.5, 1.0, steps=2), ["notch.depth", "tension"]
    )
    slopes = jacobian(bend)(bend.start)
    assert slopes["tip_position"]["tension"].shape == (2, 3, 2, 1)
    assert np.isfinite(slopes["total_angle"]["notch.depth"]).all()
    assert len(repr(bend)) < 300
