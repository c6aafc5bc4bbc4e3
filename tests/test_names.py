"""Names of classes tell them apart: no two classes of the sources share one."""

import ast
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
    assert len(files) > 500
    assert not {name: where for name, where in files.items() if len(where) > 1}
