"""The numbers on the pages about the papers are those that their scripts make."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from shared_data import FOLDER as MEASURED

PAPERS = Path(__file__).resolve().parents[2] / "docs" / "papers"
NAMES = sorted(path.stem for path in PAPERS.glob("*.md"))


@pytest.fixture
def script(monkeypatch) -> Iterator[ModuleType]:
    """The module that reads and writes pages; scripts beside it can be imported too."""
    monkeypatch.syspath_prepend(str(PAPERS))
    yield importlib.import_module("page")
    for name in [one for one in sys.modules if one == "page" or one.startswith("numbers_")]:
        del sys.modules[name]


def check(script: ModuleType, paper: str, made: dict[str, str]) -> None:
    on_page = script.marked(f"{paper}.md")
    for name, value in made.items():
        assert on_page.get(name), f"{name} is made, but not on the page"
        for found in on_page[name]:
            assert found == value, f"{name}: run docs/papers/numbers_{paper}.py"


def test_every_page_has_its_script():
    assert len(NAMES) == 3
    for name in NAMES:
        assert (PAPERS / f"numbers_{name}.py").is_file()


@pytest.mark.nightly
@pytest.mark.parametrize("paper", NAMES)
def test_page_has_the_numbers_of_its_script(paper, script):
    module = importlib.import_module(f"numbers_{paper}")
    made = module.numbers()
    check(script, paper, made)
    other = set(script.marked(f"{paper}.md")) - set(made)
    measured = set(getattr(module, "MEASURED_NAMES", ()))
    assert other == measured, "a mark on the page has no number"


def test_numbers_from_measured_data(script):
    if not MEASURED.is_dir():
        pytest.skip(
            "the measured data carry no licence, so they are not in this repository; this test "
            "reads them from ../shared/data beside it, which is absent"
        )
    module = importlib.import_module("numbers_pacheco2021")
    made = module.measured_numbers()
    assert set(made) == set(module.MEASURED_NAMES)
    check(script, "pacheco2021", made)
