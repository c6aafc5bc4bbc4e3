"""A state that can be saved and continued from: shape, tensions and memory."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import jax.tree_util as tree_util
import numpy as np

from notchflex.chain import Chain
from notchflex.errors import InputError
from notchflex.statics.stepping import Solved, at_rest

_FORMAT = "notchflex state 1"


@dataclass(frozen=True)
class State:
    """Everything that the next load needs to know of the past.

    Attributes:
        robot: Name of the robot it belongs to.
        solved: Unknowns, base tensions (N), memory of the contacts and stroke (mm).
    """

    robot: str
    solved: Solved

    def save(self, path: str | FilePath) -> None:
        """Write the state to a JSON file.

        Args:
            path: Where to; an existing file is replaced.

        Raises:
            InputError: The file cannot be written.
        """
        leaves, _ = tree_util.tree_flatten_with_path(self.solved)
        arrays = {tree_util.keystr(key): np.asarray(leaf).tolist() for key, leaf in leaves}
        content = {"format": _FORMAT, "robot": self.robot, "arrays": arrays}
        text = json.dumps(content, indent=1) + "\n"
        try:
            FilePath(path).write_text(text, encoding="utf-8")
        except (OSError, ValueError) as error:  # ValueError: a null character in the name
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"the state cannot be written to {path}: {reason}") from None

    @classmethod
    def load(cls, path: str | FilePath) -> SavedState:
        """Read a state back; it is fitted to a robot when it is continued from.

        Args:
            path: A file written by `save`.

        Returns:
            The state.

        Raises:
            InputError: The file is missing, is no state or is damaged.
        """
        if not str(path).strip():
            raise InputError("the name of the state file is empty; give that of a saved state")
        try:
            content = json.loads(FilePath(path).read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise InputError(f"there is no state file {path}") from None
        except (OSError, ValueError, RecursionError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(
                f"{path} cannot be read as a state: {reason}; give a file written by --save-state"
            ) from None
        if not isinstance(content, dict) or content.get("format") != _FORMAT:
            raise InputError(f"{path} is no notchflex state; give a file written by --save-state")
        robot, arrays = content.get("robot"), content.get("arrays")
        if not isinstance(robot, str) or not isinstance(arrays, dict):
            raise _damaged(path, "the name of its robot or its numbers are missing")
        return SavedState(robot, arrays, str(path))


@dataclass(frozen=True)
class SavedState:
    """A state as read from a file, not yet fitted to a robot."""

    robot: str
    arrays: Any
    source: str

    def fitted(self, chain: Chain) -> Solved:
        """The state for a chain.

        Raises:
            InputError: It is damaged, or belongs to a robot of another make.
        """
        leaves, structure = tree_util.tree_flatten_with_path(at_rest(chain))
        read = []
        for key, leaf in leaves:
            name = tree_util.keystr(key)
            if name not in self.arrays:
                raise _damaged(self.source, f"{name} is missing")
            try:
                array = np.asarray(self.arrays[name], float)
            except (TypeError, ValueError, OverflowError):
                raise _damaged(self.source, f"{name} is no table of numbers") from None
            if not np.isfinite(array).all():
                raise _damaged(self.source, f"{name} holds what is no finite number")
            if array.shape != leaf.shape:
                raise InputError(
                    f"{self.source} holds a state of robot {self.robot!r} with other notches or "
                    "tendons than this robot; continue from a state of the same robot"
                )
            read.append(array)
        return tree_util.tree_unflatten(structure, read)


def _damaged(source: str | FilePath, what: str) -> InputError:
    return InputError(f"the state file {source} is damaged: {what}; save the state again")


def fitted(state: State | SavedState | None, chain: Chain) -> Solved:
    """What to start from: rest, or a state that must fit the chain."""
    if state is None:
        return at_rest(chain)
    if isinstance(state, SavedState):
        return state.fitted(chain)
    rest = at_rest(chain)
    shapes = [leaf.shape for leaf in tree_util.tree_leaves(rest)]
    if [np.shape(leaf) for leaf in tree_util.tree_leaves(state.solved)] != shapes:
        raise InputError(
            f"the state belongs to robot {state.robot!r} with other notches or tendons; "
            "continue from a state of the same robot"
        )
    return state.solved
