"""Names: no two classes share one, and the tension keeps its own where it is known."""

import ast
import re
from collections import defaultdict
from pathlib import Path

import notchflex

SOURCE = Path(notchflex.__file__).parents[1]


def test_classes_have_names_of_their_own():
    files: dict[str, list[str]] = defaultdict(list)
    for package in ("notchflex", "lanewise"):
        for file in sorted((SOURCE / package).rglob("*.py")):
            for node in ast.parse(file.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ClassDef):
                    files[node.name].append(str(file.relative_to(SOURCE)))
    assert files
    assert not {name: where for name, where in files.items() if len(where) > 1}


def test_few_files_of_the_solver_know_the_tension_at_the_base() -> None:
    """ARCHITECTURE.md follows it through these files; the others pass whole points."""
    solver = SOURCE / "notchflex" / "solver"
    named = {
        file.name
        for file in solver.glob("*.py")
        if re.search(r"\b\w*base_tension\b", file.read_text("utf-8"))
    }
    assert named == {
        "continuation.py",
        "linear_step.py",
        "newton.py",
        "quantities.py",
        "residual.py",
        "sheaths.py",
        "solved_state.py",
    }
