"""Examples in docstrings and in the README run, and print what they say."""

import doctest
import re
from importlib import import_module
from pathlib import Path

import pytest

import lanewise
import notchflex

DOCS = Path(__file__).parents[1] / "docs"
README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
FILES = {
    ".".join((package.__name__, *file.relative_to(root).with_suffix("").parts)): file
    for package in (notchflex, lanewise)
    for root in map(Path, package.__path__)
    for file in sorted(root.rglob("*.py"))
}
WITH_EXAMPLES = [
    name.removesuffix(".__init__")
    for name, file in FILES.items()
    if re.search(r">>> (?!.*\+SKIP)", file.read_text(encoding="utf-8"))
]


def test_every_module_can_be_imported():
    names = [name.removesuffix(".__init__") for name in FILES if not name.endswith("__main__")]
    assert {import_module(name).__name__ for name in names} == set(names)
    assert len(WITH_EXAMPLES) > 20


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_docstrings(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)  # an example may write a file
    module = import_module(name)
    # an example reads as after `import notchflex as nf`
    globs = vars(module) | {"nf": notchflex}
    failed, tried = doctest.testmod(
        module, extraglobs=globs, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    )
    assert failed == 0
    assert tried > 0


def test_readme_examples(capsys: pytest.CaptureFixture[str]):
    names: dict[str, object] = {}  # one example goes on from the other
    for code, shown in re.findall(r"```python\n(.*?)```\n+```text\n(.*?)```", README, re.DOTALL):
        exec(compile(code, "README.md", "exec"), names)
        assert capsys.readouterr().out == shown
    assert "state" in names
    assert README.count("```python") == README.count("```text")


def test_readme_comparisons_are_those_of_the_pages():
    (table,) = re.findall(r"## Accuracy\n\n(.*?)\n\n", README, re.DOTALL)
    names = ("validation.md", "from_the_drawing.md")
    pages = "".join((DOCS / name).read_text(encoding="utf-8") for name in names)
    rows = [line.split("|")[1:-1] for line in table.splitlines()[2:]]
    assert len(rows) == 6
    for _, _, worst in rows:
        number = re.escape(worst.split()[0])
        assert re.search(rf"\| [+−]?{number}( |$)", pages), worst


def test_readme_links():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (DOCS.parent / target).exists(), target


def test_readme_commands():
    lines = [line for line in README.splitlines() if line.startswith("python3 -m venv")]
    assert lines == [
        "python3 -m venv .venv && .venv/bin/pip install '.[plot]' && .venv/bin/notchflex simulate "
        "pacheco2021-a --tension 0:3:31,3:0:31 --plot wrist.png",
        "python3 -m venv .venv && .venv/bin/pip install '.[test]' && .venv/bin/pytest -n 2",
    ]
