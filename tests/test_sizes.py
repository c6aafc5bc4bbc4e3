"""Sizes that keep the sources readable: lengths of files and functions, numbers of parameters.

The parameters of commands are the options that `--help` shows: they count neither as parameters nor
as lines.
"""

import ast
import tomllib
from functools import cache
from pathlib import Path

import notchflex
from tokens import BUDGET, sizes

SOURCE = Path(notchflex.__file__).parents[1]

MOST_LINES_OF_A_FILE = 700

MOST_LINES = 60
"""Lines of a function without its docstring; of a command without its parameters, too."""

MOST_PARAMETERS = 10

_NOT_COUNTED = ("self", "cls", "progress")
"""The result does not depend on where progress is reported."""


_Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def _functions() -> dict[str, _Function]:
    """Every function of the sources by its place."""
    functions: dict[str, _Function] = {}
    for package in ("notchflex", "lanewise"):
        for file in sorted((SOURCE / package).rglob("*.py")):
            place = file.relative_to(SOURCE).as_posix()
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    functions[f"{place}:{node.lineno} {node.name}"] = node
    return functions


def _is_verb(place: str) -> bool:
    return place.startswith("notchflex/cli/verbs/")


def _lines(place: str, function: _Function) -> int:
    assert function.end_lineno is not None
    first = function.body[0].lineno if _is_verb(place) else function.lineno
    lines = function.end_lineno - first + 1
    if (text := ast.get_docstring(function, clean=False)) is not None:
        lines -= text.count("\n") + 1
    return lines


def _parameters(function: _Function) -> int:
    arguments = function.args
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return sum(one.arg not in _NOT_COUNTED for one in named)


def test_files_are_short():
    files = [file for name in ("notchflex", "lanewise") for file in (SOURCE / name).rglob("*.py")]
    assert files
    lines = {
        str(file.relative_to(SOURCE)): file.read_text(encoding="utf-8").count("\n")
        for file in files
    }
    long = {file: n for file, n in lines.items() if n > MOST_LINES_OF_A_FILE}
    assert not long, f"a file has at most {MOST_LINES_OF_A_FILE} lines; {long}"


def test_folders_keep_to_their_budgets():
    budget, counted = tomllib.loads(BUDGET.read_text(encoding="utf-8")), sizes()
    assert counted.keys() == budget.keys()
    grown = {folder: n for folder, n in counted.items() if n > budget[folder]}
    assert not grown, f"more tokens than `budget.toml` allows: {grown}; take something away"
    shrunk = {folder: n for folder, n in counted.items() if n < 0.98 * budget[folder]}
    assert not shrunk, f"`python tests/tokens.py` lowers the budgets of {', '.join(shrunk)}"


def test_functions_are_short():
    functions = _functions()
    assert functions
    long = {place: n for place, one in functions.items() if (n := _lines(place, one)) > MOST_LINES}
    assert not long, f"a function has at most {MOST_LINES} lines without its docstring; {long}"


def test_functions_have_few_parameters():
    many = {
        place: n
        for place, one in _functions().items()
        if not _is_verb(place) and (n := _parameters(one)) > MOST_PARAMETERS
    }
    assert not many, f"a function has at most {MOST_PARAMETERS} parameters; {many}"
