"""Checks the built pages (site/): nothing is fetched from elsewhere, every local file is there.

The search works from the disk too, and no line of code is cut off. Every formula must have become
MathML: no `$...$` is left in the text, no placeholder in a formula.
The reference describes functions and classes, never a module of the same name.

`zensical build --strict && python docs/make/check_site.py`.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

SITE = Path(__file__).resolve().parents[2] / "site"
WORKER = "iframe-worker.js"  # without it browsers refuse the search to a page from the disk
WRAPPED = re.compile(r"pre > code \{[^}]*white-space: pre-wrap;")
FETCHING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}


class Fetched(HTMLParser):
    """Collects what a browser fetches with a page, and where its links lead."""

    def __init__(self) -> None:
        """Begin with nothing."""
        super().__init__()
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.formulas: list[str] = []
        self.modules = 0
        self._inside: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the address of one element."""
        values = dict(attrs)
        if tag in ("code", "pre", "script", "style", "math"):
            self._inside.append(tag)
        self.modules += "doc-module" in (values.get("class") or "").split()
        if tag in FETCHING:
            self.fetched.append(values.get(FETCHING[tag]) or "")
        elif tag == "a":
            self.links.append(values.get("href") or "")

    def handle_endtag(self, tag: str) -> None:
        """Leave an element whose text is none of the page's sentences."""
        if self._inside and self._inside[-1] == tag:
            self._inside.pop()

    def handle_data(self, data: str) -> None:
        """Keep the text of sentences and of formulas."""
        if not self._inside:
            self.words.append(data)
        elif self._inside[-1] == "math":
            self.formulas.append(data)


def problems(site: Path) -> list[str]:
    """Return what is wrong with the pages below a folder."""
    found = []
    pages = sorted(site.rglob("*.html"))
    if len(pages) < 15:
        found.append(f"{site} has {len(pages)} pages; build them first")
    if not (site / "search.js").exists():
        found.append("the search has no index that a page from the disk can read")
    if not WRAPPED.search((site / "style.css").read_text(encoding="utf-8")):
        found.append("style.css cuts off long lines of code")
    for page in pages:
        name, reader = page.relative_to(site), Fetched()
        reader.feed(page.read_text(encoding="utf-8"))
        found += [f"{name} fetches {one}" for one in reader.fetched if urlsplit(one).netloc]
        if not any(one.endswith(WORKER) for one in reader.fetched):
            found.append(f"{name} has no {WORKER}")
        left = re.findall(r"\$[^$\n]+\$", " ".join(reader.words))
        found += [f"{name} has a formula that was not read: {one}" for one in left]
        if reader.modules:
            found.append(f"{name} describes a module instead of what is in it")
        # Markdown puts such letters where it took a backslash for its own.
        if "klzz" in "".join(reader.formulas):
            found.append(f"{name} has a formula with an escaped character; write it as a block")
        if page.name == "404.html":  # its addresses are those of a server
            continue
        for one in reader.fetched + reader.links:
            parts = urlsplit(one)
            target = page.parent / unquote(parts.path)
            if not parts.scheme and not parts.netloc and not target.exists():
                found.append(f"{name} leads to {one}, which is not there")
    return found


if __name__ == "__main__":
    wrong = problems(SITE)
    sys.exit("\n".join(wrong) if wrong else 0)
