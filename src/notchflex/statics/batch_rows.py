"""The compiled program of a batch: rows of one form, a row of numbers each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from jaxtyping import Array, Float, Int

from notchflex._jax import in_one_kernel, jax, jnp
from notchflex._kept import kept
from notchflex.chain import Chain
from notchflex.statics.newton import Settings
from notchflex.statics.outputs import followed
from notchflex.statics.packing import Form
from notchflex.statics.stepping import advance, at_rest


@kept(4, 5, 6, 7)
def followed_rows(
    chains: Float[Array, "*b chain"],
    commands: Float[Array, "b s command"],
    numbers: Float[Array, " settings"],
    count: Int[Array, ""],
    chain_form: Form,
    command_form: Form,
    outputs: tuple[str, ...],
    one_robot: bool,
) -> dict[str, Array]:
    """Follow the paths of all rows: one after the other, or side by side on a GPU.

    Args:
        chains: A row per robot, or the one of all.
        commands: A row per path, then the steps.
        numbers: How hard the solver tries.
        count: How many rows count; others only fill up.
        chain_form: Form of the robots.
        command_form: Form of one step.
        outputs: Names of what is asked.
        one_robot: Whether there is one for all rows.

    Returns:
        By name, rows and then steps as leading axes.
    """
    work = partial(_rows, chain_form, command_form, outputs, one_robot)
    given = (chains, commands, numbers, count)
    if jax.default_backend() != "cpu":
        return work(lambda function, _: jax.vmap(function), *given)
    plain = chain_form.unpack(chains if one_robot else chains[0]).is_plain
    return in_one_kernel(partial(work, _in_turn), *given, short=plain)


def _in_turn(function: Callable[..., Any], count: Array) -> Callable[..., Any]:
    """A function of every row that counts, one after the other; 0 for those that only fill up.

    Side by side rows would wait for the one that takes longest, and want more than the cache.
    """

    def of_row(item: tuple[Array, ...]) -> Any:
        number, *row = item
        nothing = jax.tree.map(jnp.zeros_like, jax.eval_shape(function, *row))
        return jax.lax.cond(number < count, lambda: function(*row), lambda: nothing)

    return lambda *rows: jax.lax.map(of_row, (jnp.arange(len(rows[0])), *rows))


def _rows(
    chain_form: Form,
    command_form: Form,
    outputs: tuple[str, ...],
    one_robot: bool,
    of_every: Callable[[Callable[..., Any], Array], Callable[..., Any]],
    chains: Float[Array, "*b chain"],
    commands: Float[Array, "b s command"],
    numbers: Float[Array, " settings"],
    count: Int[Array, ""],
) -> dict[str, Array]:
    """What is asked of all rows."""
    settings = Settings.of(numbers)

    def one(chain: Chain, path: Array) -> dict[str, Array]:
        loads = command_form.unpack(path)
        return followed(chain, loads, at_rest(chain), settings, outputs, advance)

    if one_robot:
        return of_every(partial(one, chain_form.unpack(chains)), count)(commands)

    def other(vector: Array, path: Array) -> dict[str, Array]:
        return one(chain_form.unpack(vector), path)

    return of_every(other, count)(chains, commands)
