#!/usr/bin/env python3
"""The first page of the site and llms.txt: docs/site/fill.py SITE. Called by docs/site/make.

Figures and sentences come from where tests hold them true: the block and the command to install from README.md, which docs/calibrate.md and the program
agree with, the sentence under the picture from the picture, the limits from cli/README.md, the pages from docs/README.md. What is missing there ends the work.
"""

import html
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
# Pictures of the gallery that show most by themselves: a periodic error, a slope, a step of the side, a drift.
SIGNATURES = ["harmonic1", "joint_compliance", "hysteresis", "thermal_growth"]
NAMES = {
    "as delivered": "what the controller reaches",
    "nominal": "the arm alone, base and tool fitted",
    "calibrated": "links and compliance identified",
    "recommended": "with the effects that were found",
}


def text_of(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


def found(pattern: str, text: str, what: str, flags: int = 0) -> str:
    """The one group of the first match."""
    match = re.search(pattern, text, flags)
    if match is None:
        sys.exit(f"docs/site/fill.py: found no {what}")
    return match[1]


def readme_block() -> str:
    """The block of the first screen, as it is printed."""
    return found(r"<!-- block:.*?-->\n```console\n(.*?)```\n<!-- end -->", text_of("README.md"), "block between `<!-- block: -->` and `<!-- end -->` in README.md", re.DOTALL)


def rows(block: str) -> tuple[str, str, str]:
    """The table of errors, how many poses were judged, and the tolerance."""
    lines = re.findall(r"^│ ([a-z ]+?) +┆ +([\d.]+) ┆.*┆ +([\d.]+) met by (\d+) of (\d+) │$", block, re.MULTILINE)
    if [name for name, *_ in lines] != list(NAMES):
        sys.exit(f"docs/site/fill.py: the block has other rows than {', '.join(NAMES)}")
    most = max(float(mean) for _, mean, *_ in lines)
    made = []
    for name, mean, _, met, judged in lines:
        last = ' class="last"' if name == lines[-1][0] else ""
        bar = f'<svg viewBox="0 0 100 2" preserveAspectRatio="none" aria-hidden="true"><rect width="{100 * float(mean) / most:.2f}" height="2"></rect></svg>'
        made.append(f'<tr{last}><th scope="row">{name}<small>{NAMES[name]}</small>{bar}</th><td>{mean}</td><td>{met} of {judged}</td></tr>')
    return "\n".join(made), lines[0][4], lines[0][2]


def sentence(block: str, first: str) -> str:
    """A sentence of the block, which may be wrapped."""
    return " ".join(found(rf"^({first}.*?)\n(?! )", block, f"sentence '{first}' in the block", re.DOTALL | re.MULTILINE).split())


def marked(text: str) -> str:
    """A line of Markdown without emphasis, links, and brackets that hold but a link."""
    text = re.sub(r" \(\[[^\]]+\]\([^)]*\)\)", "", text)
    return html.escape(re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", text).replace("**", "").replace("`", ""))


def gallery(site: Path) -> str:
    made = []
    for name in SIGNATURES:
        title = found(r"^# (.+)$", text_of(f"docs/gallery/{name}.md"), f"title of docs/gallery/{name}.md", re.MULTILINE)
        shutil.copy(ROOT / f"docs/gallery/{name}.svg", site / "pictures")
        picture = f'<img src="pictures/{name}.svg" width="560" height="330" alt="" loading="lazy">'
        made.append(f'<li><a href="book/docs/gallery/{name}.html">{picture}<span>{marked(title)}</span></a></li>')
    return "\n".join(made)


def llms(summary: str) -> str:
    """The pages of the book by the parts of docs/README.md, as https://llmstxt.org has it."""
    lines = ["# calibench", "", f"> {summary}", "", "- [A skill for agents](agents.md): calibrate a robot that you have never seen, by this page alone"]
    listed = {"docs/agents"}
    for part in re.split(r"^## ", text_of("docs/README.md"), flags=re.MULTILINE)[1:]:
        lines += ["", f"## {part.splitlines()[0]}", ""]
        for said, page in re.findall(r"\[([^\]]+)\]\(([\w./-]+)\.md\)", part):
            target = Path("docs", page)
            # A page above docs, or one in it.
            inside = str(target).replace("docs/../", "")
            if inside not in listed:
                listed.add(inside)
                lines.append(f"- [{said}](book/{inside}.html)")
    return "\n".join([*lines, ""])


def main() -> None:
    site = Path(sys.argv[1])
    (site / "pictures").mkdir(parents=True, exist_ok=True)
    readme, block = text_of("README.md"), readme_block()
    table, judged, tolerance = rows(block)
    lead = " ".join(found(r"^# calibench\n\n(.*?)\n\n", readme, "first paragraph of README.md", re.DOTALL).split())
    install = found(r"## Install\n.*?```console\n\$ (.*?)\n```\n\n(?:.*?)", readme, "command to install in README.md", re.DOTALL)
    remark = found(r"## Install\n.*?```\n\n(.*?);", readme, "remark on the first build in README.md", re.DOTALL)
    limits = re.findall(r"^\* ([^[].*?\.)$", found(r"## Limits\n\n(.*?)\n\n", text_of("cli/README.md"), "limits in cli/README.md", re.DOTALL), re.MULTILINE)
    limits.append(found(r"^(Rewritten programs have never run on a controller: .*)$", text_of("docs/programs.md"), "warning in docs/programs.md", re.MULTILINE))
    tried = found(r"## What was tried\n(.*)", text_of("docs/agents.md"), "tasks in docs/agents.md", re.DOTALL)
    filled = {
        "LEAD": html.escape(lead),
        "BLOCK": html.escape(block.rstrip("\n"), quote=False),
        "ROWS": table,
        "JUDGED": judged,
        "TOLERANCE": tolerance,
        "EXPECTED": html.escape(sentence(block, "Expected inside")),
        "CAUSE": html.escape(sentence(block, "Cause:")),
        "FALL": html.escape(found(r"<title[^>]*>(.*?)</title>", text_of("docs/pictures/fall.svg"), "title of docs/pictures/fall.svg")),
        "GALLERY": gallery(site),
        "INSTALL": html.escape(install),
        "INSTALL_REMARK": f"{html.escape(remark)}.",
        "LIMITS": "\n".join(f"<li>{marked(line)}</li>" for line in limits),
        "TASKS": str(len(re.findall(r"^\| \d+ \| ", tried, re.MULTILINE))),
        "VERSION": found(r'^version = "(.+)"', text_of("Cargo.toml"), "version in Cargo.toml", re.MULTILINE),
        "REPOSITORY": found(r'^repository = "(.+)"', text_of("Cargo.toml"), "repository in Cargo.toml", re.MULTILINE),
    }
    page = text_of("docs/site/index.html")
    if (holes := set(re.findall(r"\{\{(\w+)\}\}", page))) != set(filled):
        sys.exit(f"docs/site/fill.py: docs/site/index.html and this script differ in {', '.join(sorted(holes ^ set(filled)))}")
    page = re.sub(r"\{\{(\w+)\}\}", lambda hole: filled[hole[1]], page)
    (site / "index.html").write_text(page, encoding="utf-8")
    (site / "llms.txt").write_text(llms(lead), encoding="utf-8")
    copies = {"docs/site/style.css": "style.css", "docs/pictures/fall.svg": "pictures/fall.svg", "report/src/page/icon.svg": "icon.svg", "docs/agents.md": "agents.md"}
    for source, target in copies.items():
        shutil.copy(ROOT / source, site / target)


if __name__ == "__main__":
    main()
