"""The pages of the documentation: what they show is what comes out, and they hang together."""

from __future__ import annotations

import importlib
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import notchflex as nf
from notchflex.results.tables import path_columns

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))
BY_THEMSELVES = ["calibrate.md", "examples.md", "notebook.md"]  # run by tests of their own
RUN = [name for name in PAGES if "/" not in name and name not in BY_THEMSELVES]


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Import one of the scripts that make the pages."""
    before = set(sys.modules)
    for folder in ("make", "papers"):
        monkeypatch.syspath_prepend(str(DOCS / folder))
    yield importlib.import_module
    for name in set(sys.modules) - before:
        file = getattr(sys.modules[name], "__file__", None)
        if file is not None and Path(file).is_relative_to(DOCS):
            del sys.modules[name]


@pytest.mark.nightly
@pytest.mark.parametrize("page", RUN)
def test_blocks_print_what_the_page_shows(page: str, make: Any):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert make("run_pages").with_output(text) == text, f"run docs/make/run_pages.py {page}"


def test_every_page_with_code_is_run():
    for name in set(PAGES) - set(RUN) - set(BY_THEMSELVES):
        assert "```python" not in (DOCS / name).read_text(encoding="utf-8"), name


@pytest.mark.parametrize(
    ("script", "page"), [("robot_file", "robot_file.md"), ("quantities", "units_and_frames.md")]
)
def test_tables_are_those_of_the_code(script: str, page: str, make: Any):
    on_page = make("page").marked(f"../{page}")
    assert on_page == {name: [text] for name, text in make(script).tables().items()}


def test_robot_of_the_page_is_read():
    text = (DOCS / "robot_file.md").read_text(encoding="utf-8")
    toml, tolerance = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert nf.robot.robot_from_text(toml + tolerance).number_of_notches == 5
    assert nf.robot.robot_from_text(toml).number_of_notches == 5


def test_validation_page(make: Any):
    """Its quick parts; the comparisons themselves are tests/validation."""
    on_page = make("page").marked("../validation.md")
    for part in ("sections", "finite_elements"):
        for name, text in make(f"against_{part}").tables().items():
            assert on_page[name] == [text], f"run docs/make/validation.py {part}"
    paper = make("page").marked("pacheco2021.md")
    for name in ("table4", "tips"):
        assert on_page[name] == paper[name], "run docs/make/validation.py measured"
    assert all(text.strip() for texts in on_page.values() for text in texts)


@pytest.mark.nightly
def test_page_from_the_drawing(make: Any):
    drawing = make("against_drawing")
    on_page = make("page").marked(drawing.PAGE)
    assert on_page == {name: [text] for name, text in drawing.tables().items()}


@pytest.mark.nightly
def test_pictures_can_be_drawn_again(tmp_path: Path, make: Any):
    for script in ("figures", "control", "learning"):
        make(script).main(tmp_path)
    analyses = make("analyses")
    for draw in ("sweep", "tolerances", "transmission", "temperature", "fatigue"):
        getattr(analyses, draw)(tmp_path)
    for part in ("finite_elements", "drawing"):
        make(f"against_{part}").pictures(tmp_path)
    drawn = {file.name for file in tmp_path.iterdir()}
    # The picture of every wrist needs measured angles that are not in the repository.
    plain = {file.name for file in (DOCS / "images").glob("*.svg")} - {"accuracy.svg"}
    compared = {"finite_elements.svg", "drawing_wrists.svg", "drawing_depth.svg"}
    assert drawn == plain | compared
    assert len(plain) == 21
    # A picture that changes in more than what a drawing program does has other text.
    for name in plain:
        texts = [
            re.findall(r"<text[^>]*>([^<]*)</text>", (folder / name).read_text(encoding="utf-8"))
            for folder in (tmp_path, DOCS / "images")
        ]
        assert texts[0] == texts[1], f"run docs/make/figures.py: {name}"
        assert texts[0]


def test_differences_are_those_of_arrays(make: Any):
    compared = make("differences").Differences()
    compared.add("it", [1.0, 2.5], [1.0, 2.0], "mm")
    compared.add("it", [1.0, 2.5], [1.0, 2.0])
    compared.add("it", [1.0], [0.0], "mm")
    assert compared.rows == {("it", "mm"): (3, 1.0), ("it", ""): (2, 0.25)}
    assert "| it | 3 | 1e+00 mm |" in compared.table()


def nav_files(entries: list[Any]) -> list[str]:
    files: list[str] = []
    for entry in entries:
        for value in entry.values():
            files += [value] if isinstance(value, str) else nav_files(value)
    return files


def test_every_page_is_in_the_navigation_once():
    settings = tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))["project"]
    assert sorted(nav_files(settings["nav"])) == PAGES
    assert settings["theme"]["font"] is False


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str):
    text = (DOCS / page).read_text(encoding="utf-8")
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)]+)\)", text):
        assert "://" not in target, "a page that needs the network"
        file, _, anchor = target.partition("#")
        found = (DOCS / page).parent / file if file else DOCS / page
        assert found.is_file(), target
        if anchor:
            heads = re.findall(r"(?m)^#+ (.*)$", found.read_text(encoding="utf-8"))
            slugs = [re.sub(r"[^a-z0-9]+", "-", head.lower()).strip("-") for head in heads]
            assert anchor in slugs, target


@pytest.mark.parametrize("page", PAGES)
def test_marks_break_no_paragraph(page: str):
    """A line that begins with a mark and goes on is taken as HTML, and ends its paragraph."""
    text = (DOCS / page).read_text(encoding="utf-8")
    assert not re.findall(r"(?m)^\s*<!-- [\w.]+ -->[^<\n].*", text)


def test_reference_has_every_public_name():
    pages = [(DOCS / name).read_text(encoding="utf-8") for name in PAGES if "reference/" in name]
    told = [name for text in pages for name in re.findall(r"(?m)^::: notchflex\.(\S+)$", text)]
    assert len(told) == len(set(told))
    assert {name for name in told if "." not in name} == set(nf.__all__) - {"__version__"}
    index = (DOCS / "reference.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"\]\[notchflex\.([^\]]+)\]", index)) == sorted(told)


def test_checked_site_fetches_nothing(tmp_path: Path, make: Any):
    check = make("check_site")
    good = '<link href="style.css"><a href="https://doi.org/x">paper</a><img src="a.svg">'
    good += '<script src="iframe-worker.js"></script>'
    for number in range(15):
        (tmp_path / f"{number}.html").write_text(good)
    for name in ("style.css", "iframe-worker.js"):
        (tmp_path / name).write_text((DOCS / name).read_text())
    for name in ("search.js", "a.svg"):
        (tmp_path / name).touch()
    assert check.problems(tmp_path) == []
    bad = {
        3: '<script src="//cdn.net/x.js"></script><a href="gone.html">',
        4: "<p>a $x_j$</p><pre>$ notchflex robots</pre><p>2 $</p>",
        5: "<math><mi>k</mi><mi>l</mi><mi>z</mi><mi>z</mi></math>",
        6: '<div class="doc doc-object doc-module">solve</div>',
    }
    for number, content in bad.items():
        (tmp_path / f"{number}.html").write_text(good + content)
    wrong = check.problems(tmp_path)
    assert len(wrong) == 5
    assert "$x_j$" in wrong[2]
    (tmp_path / "0.html").write_text("")
    (tmp_path / "search.js").unlink()
    (tmp_path / "style.css").write_text("")
    index, style, worker = (one for one in check.problems(tmp_path) if one not in wrong)
    assert "index" in index
    assert "cuts off" in style
    assert "iframe-worker.js" in worker


def test_the_menu_has_the_titles_of_the_pages():
    menu = re.findall(r'\{ "([^"]+)" = "([^"]+\.md)" \}', (ROOT / "zensical.toml").read_text())
    assert len(menu) > 30
    heads = {page: (ROOT / "docs" / page).read_text().partition("\n")[0] for _, page in menu}
    assert {page: f"# {title}" for title, page in menu} == heads


def test_columns_that_the_page_on_control_cuts_out_are_those_of_the_tip():
    columns = re.search(r"cut -d, -f(\d+),(\d+)", (DOCS / "control.md").read_text())
    assert columns is not None
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.5, 1.0, steps=6).release())
    heads = list(path_columns(path))
    assert [heads[int(number) - 1] for number in columns.groups()] == ["tip_x_mm", "tip_z_mm"]
