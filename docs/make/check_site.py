"""Checks the built pages (site/): nothing is fetched from elsewhere, every local file is there.

`zensical build --strict && python docs/make/check_site.py`.
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

SITE = Path(__file__).resolve().parents[2] / "site"
FETCHING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}


class Fetched(HTMLParser):
    """Collects what a browser fetches with a page, and where its links lead."""

    def __init__(self) -> None:
        """Begin with nothing."""
        super().__init__()
        self.fetched: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the address of one element."""
        values = dict(attrs)
        if tag in FETCHING:
            self.fetched.append(values.get(FETCHING[tag]) or "")
        elif tag == "a":
            self.links.append(values.get("href") or "")


def problems(site: Path) -> list[str]:
    """Return what is wrong with the pages below a folder."""
    found = []
    pages = sorted(site.rglob("*.html"))
    if len(pages) < 15:
        found.append(f"{site} has {len(pages)} pages; build them first")
    for page in pages:
        name, reader = page.relative_to(site), Fetched()
        reader.feed(page.read_text(encoding="utf-8"))
        found += [f"{name} fetches {one}" for one in reader.fetched if urlsplit(one).netloc]
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
