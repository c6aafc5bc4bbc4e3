"""Names of classes tell them apart: no two classes of the sources share one."""

import ast
from collections import defaultdict
from pathlib import Path

import notchflex

SOURCE = Path(notchflex.__file__).parents[1]

# Still shared; no name may be added.
SHARED = {
    *("Arc", "Bound", "Candidate", "Evaluation", "Linear", "Motion"),
    *("Outcome", "Problem", "Response", "Task"),
}


def test_classes_have_names_of_their_own():
    places: dict[str, list[str]] = defaultdict(list)
    for package in ("notchflex", "lanewise"):
        for file in sorted((SOURCE / package).rglob("*.py")):
            for node in ast.parse(file.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ClassDef):
                    places[node.name].append(str(file.relative_to(SOURCE)))
    assert len(places) > 500
    shared = {name: files for name, files in places.items() if len(files) > 1}
    assert not shared.keys() - SHARED, {name: shared[name] for name in shared.keys() - SHARED}
