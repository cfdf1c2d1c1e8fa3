#!/usr/bin/env python3
"""Every link of the site leads somewhere, nothing comes from elsewhere, and the first page shows README's block: docs/site/check.py SITE [MISSING ...]

MISSING are files of the site that this build leaves out. Pages of the book are read too; addresses outside the site are not tried.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from fill import readme_block

# What a page loads; a link that is followed is not loaded.
LOADED = {"src", "poster", "data", "srcset"}


class Page(HTMLParser):
    """The ids of a page, its links, what it loads, and its blocks."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.blocks: list[str] = []
        self.inside = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.ids |= {given[name] for name in ("id", "name") if name in given}
        if "href" in given:
            (self.loads if tag == "link" and given.get("rel") in ("stylesheet", "icon") else self.links).append(given["href"])
        self.loads += [given[name] for name in LOADED & set(given)]
        if tag == "pre":
            self.inside = True
            self.blocks.append("")

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.blocks[-1] += data

    def handle_endtag(self, tag: str) -> None:
        if tag == "pre":
            self.inside = False


def links_of(text: str) -> list[str]:
    """Of Markdown and of llms.txt, but for its blocks."""
    return re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL))


def slug(heading: str) -> str:
    return re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-")


def main() -> int:
    site = Path(sys.argv[1]).resolve()
    missing = {site / name for name in sys.argv[2:]}
    browser = site / "browser"
    # The page in the browser makes its links itself; tests/browser/page tries it.
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html")) if browser not in path.parents}
    faults: list[str] = []
    count = 0

    def try_link(source: Path, link: str) -> None:
        parts = urlsplit(link)
        if parts.scheme in ("http", "https", "mailto", "data"):
            return
        target = (source.parent / unquote(parts.path)).resolve() if parts.path else source
        if target.is_dir():
            target /= "index.html"
        if site not in target.parents:
            faults.append(f"{source.relative_to(site)}: {link} leads out of the site")
        elif target not in missing and not target.is_file():
            faults.append(f"{source.relative_to(site)}: {link} leads nowhere")
        elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].ids:
            faults.append(f"{source.relative_to(site)}: {link}: there is no such place on that page")

    for path, page in pages.items():
        for load in page.loads:
            if re.match(r"(https?:)?//", load):
                faults.append(f"{path.relative_to(site)}: takes {load} from elsewhere")
        for link in page.links + page.loads:
            count += 1
            try_link(path, link)
    for name in ("llms.txt", "agents.md"):
        text = (site / name).read_text(encoding="utf-8")
        headings = {slug(heading) for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}
        for link in links_of(text):
            count += 1
            if not link.startswith("#"):
                try_link(site / name, link)
            elif link[1:] not in headings:
                faults.append(f"{name}: {link}: there is no such heading")
    if re.search(r"url\(|@import", (site / "style.css").read_text(encoding="utf-8")):
        faults.append("style.css: takes something by an address")
    if readme_block().rstrip("\n") not in pages[site / "index.html"].blocks:
        faults.append("index.html: its block is not that of README.md")
    print("\n".join(f"docs/site/check.py: {fault}" for fault in faults) or f"{len(pages)} pages, {count} links: no fault")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
