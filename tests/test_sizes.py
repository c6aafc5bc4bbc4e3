"""Sizes that keep the sources readable: lengths of files and functions, numbers of parameters.

Of functions, commands are excluded: their parameters are the options that `--help` shows.
"""

import ast
from functools import cache
from pathlib import Path

import notchflex

SOURCE = Path(notchflex.__file__).parents[1]

MOST_LINES_OF_A_FILE = 300

MOST_LINES = 60
"""Lines of a function without its docstring."""

MOST_PARAMETERS = 10

_NOT_COUNTED = ("self", "cls", "progress")
"""The result does not depend on where progress is reported."""


_Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def _functions() -> dict[str, _Function]:
    """Every function of the sources by its place; those of the command line's verbs excluded."""
    functions: dict[str, _Function] = {}
    for package in ("notchflex", "lanewise"):
        for file in sorted((SOURCE / package).rglob("*.py")):
            place = file.relative_to(SOURCE)
            if place.parts[:3] == ("notchflex", "cli", "verbs"):
                continue
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    functions[f"{place}:{node.lineno} {node.name}"] = node
    return functions


def _lines(function: _Function) -> int:
    assert function.end_lineno is not None
    lines = function.end_lineno - function.lineno + 1
    if (text := ast.get_docstring(function, clean=False)) is not None:
        lines -= text.count("\n") + 1
    return lines


def _parameters(function: _Function) -> int:
    arguments = function.args
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return sum(one.arg not in _NOT_COUNTED for one in named)


def test_files_are_short():
    files = [file for name in ("notchflex", "lanewise") for file in (SOURCE / name).rglob("*.py")]
    assert len(files) > 500
    lines = {
        str(file.relative_to(SOURCE)): file.read_text(encoding="utf-8").count("\n")
        for file in files
    }
    long = {file: n for file, n in lines.items() if n > MOST_LINES_OF_A_FILE}
    assert not long, f"a file has at most {MOST_LINES_OF_A_FILE} lines; {long}"


def test_functions_are_short():
    functions = _functions()
    assert len(functions) > 3000
    long = {place: n for place, one in functions.items() if (n := _lines(one)) > MOST_LINES}
    assert not long, f"a function has at most {MOST_LINES} lines without its docstring; {long}"


def test_functions_have_few_parameters():
    many = {
        place: n for place, one in _functions().items() if (n := _parameters(one)) > MOST_PARAMETERS
    }
    assert not many, f"a function has at most {MOST_PARAMETERS} parameters; {many}"
