"""Web pages of README, docs and what they link to: Sphinx reads the Markdown as it is in the repository, from its root.

docs/README.md is the list of contents: the pages of its lists are in the side bar. Every link is checked: to pages, to headings (named as a forge names them) and to files of the repository,
which are copied beside the pages.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

project = "calibench"
version = release = re.search(r'^version = "(.+)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
copyright = "the authors of calibench"
language = "en"

root_doc = "README"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "CODE_OF_CONDUCT.md", "docs/*.md", "docs/**/*.md", "benches/README.md", "tests/data/README.md"]
# The pages of the packages.
include_patterns += [f"{package}/README.md" for package in ("wire", "programs", "logs", "discover", "recovery", "report", "loopback", "rehearsal", "readout", "workbench", "cli", "sim", "sim/lab", "sim/mujoco", "sim/serve", "sim/view")]
# A folder that is not walked costs nothing; target holds a hundred thousand files.
exclude_patterns = [".*", "target", "runs", "**/node_modules"]

myst_heading_anchors = 4
# A page or a heading that is not there is an error (`-W` in docs/book/make).
nitpicky = True
# The table of divisions is made by a script and begins with its sums; a language without colours is no error.
suppress_warnings = ["myst.header", "misc.highlighting_failure"]
highlight_language = "text"

html_theme = "furo"
html_title = "calibench"
html_static_path = ["style.css"]
html_favicon = "../../report/src/page/icon.svg"
html_css_files = ["style.css"]
html_copy_source = False
html_show_sphinx = False
# The excerpts would be fetched, which a browser refuses for files on a disk.
html_show_search_summary = False
html_theme_options = {"navigation_with_keys": True}
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"


def links(text: str) -> list[tuple[str, str]]:
    """The lines of a list of contents: what each says, and the page that it links to, as Sphinx names pages."""
    return [(said, str(Path("docs", page))) for said, page in re.findall(r"^\* \[(.+)\]\(([\w./-]+)\.md\)$", text, re.MULTILINE)]


def toctree(entries: list[str], caption: str = "") -> str:
    """A list of contents of Sphinx that is not shown on the page."""
    named = f":caption: {caption}\n" if caption else ""
    return "\n".join(["", "```{toctree}", f":hidden:\n{named}", *entries, "```", ""])


def contents() -> list[tuple[str, list[tuple[str, str]]]]:
    """The parts of docs/README.md: a heading, and the pages of the list under it."""
    parts = re.split(r"^## ", (ROOT / "docs/README.md").read_text(), flags=re.MULTILINE)[1:]
    return [(part.split("\n")[0], [(said, page.removeprefix("docs/../")) for said, page in links(part)]) for part in parts]


def with_contents(app, name, source):
    """Gives the first page the contents of docs/README.md, a caption a heading. All other pages stay out of the side bar: links lead to them."""
    parts = contents()
    if name == root_doc:
        for caption, pages in parts:
            source[0] += toctree([f"{said} <{page}>" for said, page in pages if page != root_doc], caption)
        source[0] += toctree(["docs/README"], "All pages")
    elif name != "docs/README" and not any(page == name for _, pages in parts for _, page in pages):
        source[0] = f"---\norphan: true\n---\n\n{source[0]}"


# What the theme leaves out, found by axe-core: what scrolls can be reached by keys, and what has a role has its attributes.
MENDED = {
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="Contents of the book">',
    '<aside class="toc-drawer">': '<aside class="toc-drawer" aria-label="On this page">',
    '<aside class="toc-drawer no-toc">': '<aside class="toc-drawer no-toc" aria-label="On this page">',
    '<div class="table-wrapper ': '<div tabindex="0" class="table-wrapper ',
    '<th class="head"><p></p></th>': "<td></td>",
    "<pre>": '<pre tabindex="0">',
    '<div id="search-results">': '<h1>Search</h1><div  id="search-results">',
}


def finish(app, failed):
    """Mends the pages, and makes the first one what a browser opens that is given the folder."""
    if failed:
        return
    out = Path(app.outdir)
    for page in out.rglob("*.html"):
        text = before = page.read_text()
        for found, mended in MENDED.items():
            text = text.replace(found, mended)
        if text != before:
            page.write_text(text)
    (out / "index.html").write_bytes((out / "README.html").read_bytes())


def setup(app):
    app.connect("source-read", with_contents)
    app.connect("build-finished", finish)
