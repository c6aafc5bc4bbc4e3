"""The import graph of the sources: one way through the folders, and without cycles.

Imports inside functions and for types only count like any other.
"""

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import notchflex
from notchflex import support

SOURCE = Path(notchflex.__file__).parents[1]

ORDER = (
    "lanewise",
    "",  # files beside the folders
    "robot",
    "mechanics",
    "loads",
    "solver",
    "results",
    "analysis",
    "search",
    "specification",
    "pieces",
    "fit",
    "comparison",
    "tolerancing",
    "sweeping",
    "designing",
    "control",
    "sensing",
    "workspaces",
    "fatigue",
    "photographs",
    "plotting",
    "export",
    "learning",
    "viewer",
    "bench",
    "cli",
)
"""Folders from the first to the last: a file imports from its own folder and from those before."""

MOST_FILES = 17

SATELLITES = ORDER[ORDER.index("search") :]

INNER_NAMES = 42
"""Names of the core that satellites import from elsewhere than `notchflex` and
`notchflex.support`: this number only ever falls."""

LAZY = {
    "notchflex": vars(notchflex)["_HOME"],
    "notchflex.support": vars(support)["_HOME"],
}
"""Modules whose names are loaded on first use, and where those names live."""

_PICTURE = "pictures need matplotlib or plotly: they are imported when one is asked for"
_SHOWN = "an object shows itself: what writes its summary is imported when it is shown"
_FILES = "a path is returned as a table by a method; the table is made elsewhere"
_TYPE = "for the type only: a path calls this file and hands itself over"

EXCEPTIONS: dict[tuple[str, str], str] = {
    ("__main__", "cli"): "`python -m notchflex` is the command line",
    ("_plot", "plotting"): _PICTURE,
    ("robot.notches.arc", "mechanics.cuts"): (
        "whether lips touch at rest depends on the centroid of the section; seldom asked for"
    ),
    ("robot.robot", "analysis.geometry"): "`Robot.geometry`; seldom asked for",
    ("results.state", "analysis.geometry"): "`Equilibrium.shape`; made when asked for",
    ("robot.robot", "robot.value_names"): "`Robot.with_values`; setting a value makes a robot",
    ("robot.problems", "robot.robot"): "for the type only: a robot checks itself by this file",
    ("robot.problems", "robot.value_names"): "a tolerance names a value; value names make robots",
    ("results.state", "results.tables"): _FILES,
    ("results.path", "results.io"): _FILES,
    ("results.path", "analysis.slopes"): "slopes of a path are methods of it",
    ("results.state", "results.path"): _TYPE,
    ("results.quantities", "results.path"): _TYPE,
    ("fit.calibration", "fit.documents"): _SHOWN,
    ("fit.calibration", "fit.residual_tests"): (
        "a fit tests its residuals when it is asked whether to trust it"
    ),
    ("viewer.viewer", "viewer.page"): "the viewer makes its page; the page acts on the viewer",
}
"""Importer and imported, without `notchflex.`, and why the one may import the other."""


def _name(file: Path) -> str:
    parts = file.relative_to(SOURCE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {
    _name(file): file
    for name in ("notchflex", "lanewise")
    for file in (SOURCE / name).rglob("*.py")
}


def _imported(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in FILES)
        elif isinstance(node, ast.ImportFrom):
            module = str(node.module)
            assert node.level == 0, f"{file}: relative import"
            if module.partition(".")[0] not in ("notchflex", "lanewise"):
                continue
            assert module in FILES, f"{file}: there is no {module}"
            for alias in node.names:
                inside = f"{module}.{alias.name}"
                home = LAZY.get(module, {}).get(alias.name, module)
                yield inside if inside in FILES else home


def _short(module: str) -> str:
    return module.removeprefix("notchflex.")


@cache
def _graph() -> dict[str, set[str]]:
    """Every module and those that it imports."""
    return {
        _short(module): {_short(other) for other in _imported(file)}
        for module, file in FILES.items()
    }


@cache
def _allowed() -> dict[str, set[str]]:
    """The graph without the exceptions."""
    return {
        module: {other for other in others if (module, other) not in EXCEPTIONS}
        for module, others in _graph().items()
    }


def _place(module: str) -> int:
    folder = module.partition(".")[0]
    return ORDER.index(folder if folder in ORDER else "")


def test_imports_go_one_way():
    upward = [
        f"{module} -> {other}"
        for module, others in _allowed().items()
        for other in others
        if _place(other) > _place(module)
    ]
    assert not upward, "\n".join(sorted(upward))


def test_no_cycles():
    cycles: list[str] = []
    done: set[str] = set()

    def follow(module: str, way: list[str]) -> None:
        if module in way:
            cycles.append(" -> ".join([*way[way.index(module) :], module]))
        elif module not in done:
            for other in sorted(_allowed()[module]):
                follow(other, [*way, module])
            done.add(module)

    for module in sorted(_allowed()):
        follow(module, [])
    assert not cycles, "\n".join(cycles)


def test_every_exception_is_still_needed():
    for module, other in EXCEPTIONS:
        assert other in _graph()[module], f"{module} no longer imports {other}"


def test_the_compiler_knows_nothing_of_robots():
    for module, others in _graph().items():
        if module.partition(".")[0] == "lanewise":
            assert all(other.partition(".")[0] == "lanewise" for other in others), module


def test_folders_are_small():
    for folder in {file.parent for file in FILES.values()}:
        assert len(list(folder.glob("*.py"))) <= MOST_FILES, folder


def test_every_folder_has_its_place():
    folders = {path.parent.name for path in (SOURCE / "notchflex").glob("*/__init__.py")}
    assert folders == set(ORDER) - {"lanewise", ""}


def _names_of_the_core(file: Path) -> Iterator[str]:
    """Yield what a file imports from the folders of the core, other than by a public door."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("notchflex."):
            module = str(node.module)
            if module not in LAZY and module.split(".")[1] not in SATELLITES:
                yield from (f"{module}.{alias.name}" for alias in node.names)


def test_satellites_import_public_names():
    names = [
        name
        for module, file in FILES.items()
        if _short(module).partition(".")[0] in SATELLITES
        for name in _names_of_the_core(file)
    ]
    assert len(names) == INNER_NAMES, f"write {len(names)} if it is less; {sorted(names)}"


def test_names_of_the_support_are_loaded_on_first_use():
    code = "import notchflex.support as s, sys; s.need; print({'jax', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_type_checkers_see_the_names_of_the_support():
    stub = ast.parse((SOURCE / "notchflex" / "support.pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    named = {alias.asname: str(node.module) for node in imports for alias in node.names}
    assert named == LAZY["notchflex.support"]
    for name, module in named.items():
        assert getattr(support, name) is getattr(importlib.import_module(module), name)
