"""Runs docs/notebook.ipynb and writes docs/notebook.md with what every cell shows.

`python docs/make/notebook.py`; a test runs the notebook and compares the page. The notebook holds
no outputs. `alt` in the metadata of a cell describes its picture.
"""

from __future__ import annotations

import base64
import os
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

DOCS = Path(__file__).resolve().parents[1]
NOTEBOOK = DOCS / "notebook.ipynb"
PAGE = DOCS / "notebook.md"
IMAGES = "images"


def executed() -> Any:
    """Return the notebook with its outputs, run in an empty folder.

    Raises:
        CellExecutionError: A cell raises.
    """
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    # JAX warns on standard error where its cache was filled by another machine.
    env = {name: value for name, value in os.environ.items() if not name.startswith("JAX_COMPIL")}
    with tempfile.TemporaryDirectory() as folder:
        place = {"metadata": {"path": folder}}
        client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources=place)
        return client.execute(env=env)


def page(notebook: Any) -> tuple[str, dict[str, bytes]]:
    """Return the page of an executed notebook, and its pictures by file name."""
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        for output in cell.outputs:
            parts.append(_shown(output, cell.metadata.get("alt", ""), pictures))
    return "\n\n".join(part for part in parts if part) + "\n", pictures


def _shown(output: Any, alt: str, pictures: dict[str, bytes]) -> str:
    if output.output_type == "stream":
        return f"```text\n{output.text.rstrip()}\n```"
    data = output.data
    if "image/png" in data:
        if not alt:
            raise ValueError("a cell shows a picture, but its metadata have no alt text")
        name = f"notebook_{len(pictures) + 1}.png"
        pictures[name] = base64.b64decode(data["image/png"])
        return f"![{alt}]({IMAGES}/{name})"
    return f"```text\n{data['text/plain']}\n```"


def main() -> None:
    """Write the page and its pictures."""
    text, pictures = page(executed())
    for old in (DOCS / IMAGES).glob("notebook_*.png"):
        old.unlink()
    for name, content in pictures.items():
        (DOCS / IMAGES / name).write_bytes(content)
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
