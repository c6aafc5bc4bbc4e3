"""The notebook runs from top to bottom, and its page shows what it shows."""

import importlib.util
from pathlib import Path
from typing import Any

import nbformat
import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


def generator() -> Any:
    spec = importlib.util.spec_from_file_location("notebook_page", DOCS / "make" / "notebook.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_notebook_is_kept_without_outputs():
    notebook = nbformat.read(DOCS / "notebook.ipynb", as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(code) > 10
    assert all(not cell.outputs and cell.execution_count is None for cell in code)


@pytest.mark.nightly
def test_the_page_is_what_the_notebook_shows():
    made = generator()
    text, pictures = made.page(made.executed())
    on_page = (DOCS / "notebook.md").read_text(encoding="utf-8")
    assert text == on_page, "run docs/make/notebook.py"
    stored = {file.name for file in (DOCS / "images").glob("notebook_*.png")}
    assert set(pictures) == stored
    assert all(content.startswith(b"\x89PNG") for content in pictures.values())


def test_a_picture_without_a_description_is_refused():
    output = nbformat.v4.new_output("display_data", {"image/png": "aGVsbG8="})
    cell = nbformat.v4.new_code_cell("1", outputs=[output])
    with pytest.raises(ValueError, match="no alt text"):
        generator().page(nbformat.v4.new_notebook(cells=[cell]))
