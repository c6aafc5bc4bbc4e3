"""Slopes as methods of paths and of closings, and the robot as a function that JAX maps."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import notchflex as nf
from notchflex.robot.value_names import number_at
from refusals import refused

LOOP = nf.pull(0.4, 1.2, steps=2).release()
WEIGHTS = {"total_angle": 1.0, "tip_position": 0.0}
NUMBERS = ("notch.depth", "notch[2].height", "friction.coefficient")
LOADS = {
    "pacheco2021-a": nf.Load(tension=1.0),
    "pacheco2021-c-true": nf.Load(tension=0.8),
    "gao2017": nf.Load(tension=6.0),
    "liu2022": nf.Load(tension=1.0),
    "two-axis-wrist": nf.Load(tension=[0.1, 0.05, 0.0, 0.0]),
    "york2015": nf.Load(tension=1.0),
}


def wrist() -> nf.Robot:
    return nf.load_robot("pacheco2021-a")


def differences(function: Callable[[float], np.ndarray], at: float) -> np.ndarray:
    """Central differences, accurate to the fourth order."""
    width = 3e-6 * (abs(at) or 1.0)  # plateaus of nitinol begin at 1e-5 from wrist A
    near, far = (
        (np.asarray(function(at + step)) - np.asarray(function(at - step))) / (2.0 * step)
        for step in (width, 2.0 * width)
    )
    return (4.0 * near - far) / 3.0


def numbers_of(robot: nf.Robot) -> Iterator[str]:
    """Names of the numbers of a robot that may vary to both sides."""
    parts = [
        ("tube", robot.tube),
        ("material", robot.material),
        ("friction", robot.friction),
        ("notch[1]", robot.notches[0]),
        ("notch[3]", robot.notches[2]),
        ("tendon[1]", robot.tendon[0]),
    ]
    for section, part in parts:
        for field in dataclasses.fields(part):
            name = f"{section}.{field.name}"
            value = getattr(part, field.name)
            if type(value) is not float or not np.isfinite(value):
                continue
            try:
                for moved in (1.001 * value or 1e-3, 0.999 * value or -1e-3):
                    robot.with_value(name, moved)
            except nf.InputError:  # at an end of its range, or tied to another number
                continue
            yield name


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "load"), LOADS.items())
def test_slopes_by_every_number_of_a_ready_robot(name, load, margin):
    robot = nf.load_robot(name)
    outputs = ("total_angle", "tip_position")
    path = nf.simulate(robot, [load])
    assert path.converged.all()
    function = nf.differentiable(robot, [load], ["tension"])
    assert not function.kinks()
    names = list(numbers_of(robot))
    if path.chain.frame is not None:  # a planar robot; such a turn makes it another one
        turns = [number for number in names if number.endswith("direction_deg")]
        for number in turns:
            with refused("OUT_OF_RANGE", "another form"):
                path.jacobian([number], outputs)
        names = [number for number in names if number not in turns]
    assert len(names) > 8
    slopes = path.jacobian(names, outputs)
    gradient = path.gradient(WEIGHTS)
    backwards = gradient.by(names)
    for column, number in enumerate(names):
        at = number_at(robot, number)

        def bent(value: float, number=number) -> np.ndarray:
            other = nf.simulate(robot.with_value(number, value), [load]).raise_if_failed()
            return np.append(other.tip_position[0], other.total_angle[0])

        expected = differences(bent, at)
        computed = np.append(slopes["tip_position"][0, :, column], slopes["total_angle"][0, column])
        size = max(np.abs(expected).max(), 1e-3 * np.abs(bent(at)).max() / (abs(at) or 1.0))
        margin.within(number, (computed - expected) / size, 1e-6)
        margin.within(f"{number}, backwards", (backwards[column] - computed[-1]) / size, 1e-10)


def test_slopes_of_a_path_are_those_of_the_function(margin):
    """Also in a turned base, for which vectors are in the world."""
    load = dataclasses.replace(LOOP, base_rotation=np.array([0.3, 0.2, -0.1]))
    path = nf.simulate(wrist(), load)
    bend = nf.differentiable(wrist(), load, [*NUMBERS, "tension"])
    expected = jax.jacfwd(bend)(bend.start)
    slopes = path.jacobian([*NUMBERS, "tension"])
    for name in ("total_angle", "tip_position"):
        columns = [np.asarray(expected[name][number])[..., None] for number in NUMBERS]
        shape = slopes[name].shape[:-1]
        columns.append(np.asarray(expected[name]["tension"]).reshape(*shape, -1))
        margin.within(name, slopes[name] - np.concatenate(columns, axis=-1), 1e-12)
    weights = np.arange(12.0).reshape(4, 3)
    gradient = path.gradient({"total_angle": 0.0, "tip_position": weights})
    by_names = np.einsum("sa,sak->k", weights, slopes["tip_position"])
    margin.within("gradient", gradient.by([*NUMBERS, "tension"]) / by_names - 1.0, 1e-11)
    assert gradient["tension"].shape == (4, 1)
    assert gradient["notch.depth"] == gradient.by(["notch.depth"])[0]
    assert "pacheco" in repr(gradient).lower()


@pytest.mark.nightly
def test_slopes_by_loads_of_the_tip(margin):
    push = {"tip_force": (0.02, 0.01, 0.0), "tip_moment": (0.0, 0.1, 0.0)}
    path = nf.simulate(wrist(), nf.pull(0.5, 0.8, steps=2).loaded(**push))
    slopes = path.jacobian(list(push))["tip_position"]
    assert slopes.shape == (2, 3, 12)
    for number, (name, vector) in enumerate(push.items()):
        for axis in range(3):

            def moved(value: float, name=name, axis=axis, vector=vector) -> np.ndarray:
                other = [*vector]
                other[axis] = value
                load = path.load.loaded(**{name: tuple(other)})
                return nf.simulate(wrist(), load).tip_position[1]

            both = slopes[1, :, 6 * number + axis] + slopes[1, :, 6 * number + 3 + axis]
            expected = differences(moved, vector[axis] or 1e-3) if vector[axis] else both
            margin.within(f"{name} {axis}", (both - expected) / np.abs(slopes).max(), 1e-7)


@pytest.mark.nightly
def test_weight_of_bodies_counts_in_gradients(margin):
    """Loads depend on the numbers of a robot: forward and backward agree with differences."""
    load = nf.pull(0.5, 0.5, steps=1).loaded(gravity=(9.81, 0.0, 0.0), tip_mass=2.0)
    path = nf.simulate(wrist(), load)
    for name in ("material.density", "tube.outer_diameter"):
        expected = differences(
            lambda value, name=name: nf.simulate(wrist().with_value(name, value), load).total_angle,
            number_at(wrist(), name),
        )[0]
        forward = path.jacobian(name)["total_angle"][0, 0]
        backward = path.gradient(WEIGHTS)[name]
        margin.within(f"{name}, forward", forward / expected - 1.0, 1e-6)
        margin.within(f"{name}, backward", backward / forward - 1.0, 1e-13)


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda path: path.jacobian("notch.deph"), "UNKNOWN_NAME"),
        (lambda path: path.jacobian("notch.depth", "angle"), "UNKNOWN_NAME"),
        (lambda path: path.jacobian("notch.depth", "converged"), "UNKNOWN_NAME"),
        (lambda path: path.jacobian("stroke"), "NO_DATA"),
        (lambda path: path.gradient({"total_angle": np.ones(7)}), "WRONG_SHAPE"),
        (lambda path: path.gradient({"total_angle": "much"}), "WRONG_SHAPE"),
        (lambda path: path.gradient(WEIGHTS)["notch.deph"], "UNKNOWN_NAME"),
    ],
)
def test_what_has_no_slope_is_refused(call, code):
    with refused(code):
        call(nf.simulate(wrist(), LOOP))


def test_a_path_of_a_file_has_no_slopes(tmp_path):
    pytest.importorskip("xarray")
    nf.save_path(nf.simulate(wrist(), LOOP), tmp_path / "loop.nc")
    with refused("UNSUPPORTED", "file"):
        nf.read_path(tmp_path / "loop.nc").jacobian("notch.depth")


def test_closing_tensions_and_angles_have_slopes(margin):
    table = nf.closing(wrist())
    names = ("notch.height", "notch[2].depth", "friction.coefficient", "tendon.radius")
    slopes = table.jacobian(names)
    assert slopes["tension"].shape == slopes["angle"].shape == (5, 4)
    for column, name in enumerate(names):
        for quantity in ("tension", "angle"):
            expected = differences(
                lambda value, name=name, quantity=quantity: getattr(
                    nf.closing(wrist().with_value(name, value)), quantity
                ),
                number_at(wrist(), name),
            )
            size = np.abs(getattr(table, quantity)).max() / number_at(wrist(), name)
            error = (slopes[quantity][:, column] - expected) / size
            margin.within(f"{quantity} by {name}", error, 1e-6)
    with refused("UNKNOWN_NAME"):
        table.jacobian("notch.deph")


def test_maps_of_jax_are_equal_to_loops(margin):
    outputs = ("total_angle", "tip_position", "converged")
    bend = nf.differentiable(wrist(), LOOP, [*NUMBERS, "tension"], outputs=outputs)
    random = np.random.default_rng(0)
    rows = {
        name: np.asarray(at) * random.uniform(0.99, 1.01, (5, *np.shape(at)))
        for name, at in bend.start.items()
    }
    single = [{name: values[row] for name, values in rows.items()} for row in range(5)]
    mapped = jax.jit(jax.vmap(bend))(rows)
    for name in outputs:
        alone = np.stack([bend(values)[name] for values in single])
        margin.within(name, mapped[name].astype(float) - alone, 1e-13)

    def height(values):
        found = bend(values)
        return found["tip_position"][-1, 2] + found["total_angle"][1]

    for kind, derivative in (("grad", jax.grad), ("jacfwd", jax.jacfwd)):
        several = jax.jit(jax.vmap(derivative(height)))(rows)
        by_row = [derivative(height)(values) for values in single]
        for name in rows:
            error = several[name] - np.stack([one[name] for one in by_row])
            margin.within(f"{kind} by {name}", error, 1e-11)
    tangent = jax.tree.map(np.ones_like, rows)
    both = jax.jit(jax.vmap(lambda at, along: jax.jvp(height, (at,), (along,))))(rows, tangent)
    expected = sum(np.sum(np.reshape(one, (5, -1)), axis=1) for one in several.values())
    margin.within("jvp", both[1] - expected, 1e-11)


def test_nested_maps_and_rows_without_results():
    bend = nf.differentiable(
        wrist(), nf.pull(1.0, 1.0, steps=1), ["notch.depth", "tension"],
        outputs=("total_angle", "tip_position", "converged"),
    )  # fmt: skip

    def angle(depth, tension):
        return bend({"notch.depth": depth, "tension": tension})["total_angle"][0]

    depths, tensions = np.array([1.38, 9.0, 1.40]), np.array([0.5, -1.0])
    inner = jax.vmap(angle, in_axes=(None, 0))
    nested = jax.jit(jax.vmap(inner, in_axes=(0, None)))(depths, tensions)
    assert np.isfinite(nested).tolist() == [[True, False], [False, False], [True, False]]
    assert nested[2, 0] == pytest.approx(float(angle(1.40, 0.5)), rel=1e-14)
    slopes = jax.vmap(jax.vmap(jax.grad(angle), in_axes=(None, 0)), in_axes=(0, None))
    by = slopes(depths, tensions)
    assert np.isfinite(by).tolist() == np.isfinite(nested).tolist()
    assert by[2, 0] == pytest.approx(float(jax.grad(angle)(1.40, 0.5)), rel=1e-12)
    found = jax.vmap(lambda depth: bend({"notch.depth": depth}))(depths)
    assert found["converged"][:, 0].tolist() == [True, False, True]


def test_rows_that_fail_are_nan_alone():
    outputs = ("total_angle", "tip_position", "converged")
    draw = nf.differentiable(
        wrist(), nf.stroke_path(0.2, 0.4, steps=2), ["stroke"], outputs=outputs
    )
    rows = np.array([[[0.2], [0.4]], [[0.2], [50.0]], [[50.0], [0.4]]])
    found = jax.jit(jax.vmap(lambda stroke: draw({"stroke": stroke})))(rows)
    assert found["converged"].tolist() == [[True, True], [True, False], [False, False]]
    assert np.isfinite(found["total_angle"]).tolist() == found["converged"].tolist()
    by = jax.vmap(jax.grad(lambda stroke: draw({"stroke": stroke})["total_angle"][0]))(rows)
    assert np.isfinite(by).all(axis=(1, 2)).tolist() == [True, True, False]


@pytest.mark.nightly
def test_what_acts_on_bodies_is_mapped_too(margin):
    """Forces at the tip are rows of one robot; numbers of a robot that weighs something are not."""
    load = nf.pull(0.5, 0.5, steps=1).loaded(tip_force=(0.01, 0.0, 0.0))
    for names in (["tip_force"], ["tip_force", "notch.depth"]):
        push = nf.differentiable(wrist(), load, names)
        forces = np.array([[[0.01, 0.0, 0.0]], [[0.0, 0.02, 0.01]]])

        def tip(force, push=push):
            return push({"tip_force": force})["tip_position"][0, 0]

        alone = np.stack([tip(force) for force in forces])
        margin.within(f"{names}", jax.jit(jax.vmap(tip))(forces) - alone, 1e-12)
        by = jax.vmap(jax.grad(tip))(forces)
        expected = np.stack([jax.grad(tip)(force) for force in forces])
        margin.within(f"slopes, {names}", by - expected, 2e-12)


def test_a_product_of_jacobian_and_transpose(margin):
    """What is linear in its tangents can be transposed and differentiated by them."""
    bend = nf.differentiable(wrist(), LOOP, ["tension"])
    start = bend.start["tension"]

    def tips(tension):
        return bend({"tension": tension})["tip_position"].ravel()

    full = jax.jacfwd(tips)(start).reshape(12, -1)
    change = jnp.linspace(0.0, 1.0, start.size).reshape(start.shape)

    def energy(along):
        return 0.5 * jnp.sum(jax.jvp(tips, (start,), (along,))[1] ** 2)

    expected = full.T @ (full @ change.ravel())
    margin.within("gradient", jax.grad(energy)(change).ravel() - expected, 1e-11)
