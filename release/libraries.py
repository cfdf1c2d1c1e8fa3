"""What the program is made of: the packages that are linked into it, their licences with their texts, and the list that scanners read (CycloneDX)."""

import html
import json
import re
import subprocess
import tomllib
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

ROOT = Path(__file__).resolve().parent.parent
CHARTS = "report/src/page/echarts"

# At the top of a package. What is longer is a page about licences, with pictures or scripts.
NAMES_OF_TEXTS = re.compile(r"(licen[cs]es?|copying|copyright|notice|unlicense)\b", re.IGNORECASE)
MOST_BYTES = 200_000


@dataclass(frozen=True)
class Library:
    name: str
    version: str
    # An SPDX expression.
    licence: str
    # Where its source is.
    source: str
    purl: str
    texts: tuple[Path, ...]
    # False for what runs only while the program is compiled: macros and build scripts.
    is_linked: bool = True
    sha256: str = ""
    uses: tuple[str, ...] = ()
    authors: tuple[str, ...] = ()
    repository: str = ""


def cargo(*arguments: str) -> str:
    return subprocess.run(["cargo", *arguments], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def expression(licence: str) -> str:
    """The old way of writing a choice is not SPDX."""
    return re.sub(r"\s*/\s*", " OR ", licence)


def texts_in(folder: Path) -> Iterator[Path]:
    """Files that hold a licence or a notice, at the top of a package or in its folder of licences."""
    for path in sorted(folder.iterdir()):
        if NAMES_OF_TEXTS.match(path.name) and path.suffix not in (".rs", ".html"):
            if path.is_dir():
                yield from (inner for inner in sorted(path.rglob("*")) if inner.is_file() and inner.stat().st_size < MOST_BYTES)
            elif path.stat().st_size < MOST_BYTES:
                yield path


def tree(target: str, edges: str) -> set[tuple[str, str]]:
    """Names and versions of the packages of the program."""
    found = cargo("tree", "--locked", "--package", "calibench-cli", "--edges", edges, "--target", target, "--prefix", "none", "--format", "{p}")
    return {(name, version) for name, version in re.findall(r"^(\S+) v(\S+)", found, re.MULTILINE)}


def charts() -> Library:
    """The code of others that is in the repository."""
    folder = ROOT / CHARTS
    version = re.search(r'\bversion="(\d+\.\d+\.\d+)"', (folder / "echarts.min.js").read_text(encoding="utf-8"))
    if not version:
        raise SystemExit(f"release/make: {CHARTS}/echarts.min.js does not say its version")
    licence = "Apache-2.0 AND BSD-3-Clause"
    purl = f"pkg:npm/echarts@{version[1]}"
    return Library("echarts", version[1], licence, "https://echarts.apache.org", purl, tuple(texts_in(folder)))


def standard_library() -> Library:
    """Rust's own. Its notices come with the compiler, as a page."""
    def rustc(*arguments: str) -> str:
        return subprocess.run(["rustc", *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()

    version = rustc("--version").split()[1]
    notices = Path(rustc("--print", "sysroot"), "share/doc/rust/COPYRIGHT-library.html")
    texts = (notices,) if notices.is_file() else ()
    return Library("rust-std", version, "MIT OR Apache-2.0", "https://github.com/rust-lang/rust", f"pkg:github/rust-lang/rust@{version}", texts)


def linker(venv: Path) -> Library:
    """What zig adds to a program that it links: its own arithmetic, and the unwinding of LLVM."""
    folder, = venv.glob("lib/python*/site-packages/ziglang")
    version = re.search(r"^ziglang==(\S+)", (ROOT / "release/requirements.txt").read_text(encoding="utf-8"), re.MULTILINE)
    assert version, "the linker is pinned"
    texts = (folder / "LICENSE", folder / "lib/libunwind/LICENSE.TXT")
    return Library("zig", version[1], "MIT AND Apache-2.0 WITH LLVM-exception", "https://ziglang.org", f"pkg:pypi/ziglang@{version[1]}", texts)


def libraries(target: str, venv: Path | None) -> list[Library]:
    """All of them, by name; the program itself first. `venv` holds the linker, if that is zig."""
    metadata = json.loads(cargo("metadata", "--locked", "--format-version", "1", "--filter-platform", target))
    linked = tree(target, "normal,no-proc-macro")
    compiled = tree(target, "normal,build")
    locked = tomllib.loads((ROOT / "Cargo.lock").read_text(encoding="utf-8"))["package"]
    sums = {(package["name"], package["version"]): package.get("checksum", "") for package in locked}
    packages: dict[str, dict[str, Any]] = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}

    def key(identity: str) -> tuple[str, str]:
        return packages[identity]["name"], packages[identity]["version"]

    def purl(identity: str) -> str:
        name, version = key(identity)
        return f"pkg:cargo/{name}@{quote(version)}"

    found = []
    for identity, package in packages.items():
        if key(identity) not in compiled:
            continue
        if not package["license"]:
            raise SystemExit(f"release/make: {package['name']} {package['version']} states no licence")
        folder = Path(package["manifest_path"]).parent
        ours = package["source"] is None
        # The licence of this workspace is beside this list.
        texts = () if ours else tuple(texts_in(folder))
        source = package["repository"] if ours else f"https://crates.io/crates/{package['name']}/{package['version']}"
        uses = sorted({purl(used["pkg"]) for used in nodes[identity]["deps"] if key(used["pkg"]) in compiled and is_needed(used)})
        found.append(
            Library(
                package["name"], package["version"], expression(package["license"]), source, purl(identity), texts,
                key(identity) in linked, sums[key(identity)], tuple(uses), tuple(package["authors"]), package["repository"] or source,
            )
        )
    missing = compiled - {(library.name, library.version) for library in found}
    if missing:
        raise SystemExit(f"release/make: cargo knows nothing of {sorted(missing)}")
    found += [charts(), standard_library()] + ([linker(venv)] if venv else [])
    return sorted(found, key=lambda library: (library.name != "calibench-cli", library.name, library.version))


def words_of(path: Path) -> str:
    """A text; of a page, what is read."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix == ".html":
        text = html.unescape(re.sub(r"<[^>]*>", "", text.split("<body>")[-1]))
        text = re.sub(r"\n\s*\n", "\n\n", "\n".join(line.strip() for line in text.splitlines()))
    return text.strip()


def is_needed(used: dict[str, Any]) -> bool:
    """A dependency that is not of tests alone."""
    return any(kind["kind"] != "dev" for kind in used["dep_kinds"])


def licences(found: list[Library], program: str) -> str:
    """Licences of what is linked: a table, then each text once."""
    numbers: dict[str, int] = {}
    texts: list[str] = []
    rows = []
    without = []
    for library in (library for library in found if library.is_linked and not library.name.startswith("calibench")):
        of_it = []
        for path in library.texts:
            text = words_of(path)
            same = " ".join(text.split())
            if same not in numbers:
                texts.append(text)
                numbers[same] = len(texts)
            of_it.append(numbers[same])
        said = ", ".join(str(number) for number in sorted(set(of_it))) or "see below"
        without += [] if of_it else [f"{library.name} {library.version}: by {', '.join(library.authors) or 'the authors of ' + library.repository}"]
        rows.append((library.name, library.version, library.licence, said, library.source))
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    lines = [
        f"{program} contains these libraries, unchanged, each under its own licence.",
        "Their sources are at the addresses; those of serialport, which is under MPL-2.0, too.",
        "The numbers are those of the texts below.",
        "",
        *("  ".join([*(cell.ljust(width) for cell, width in zip(row, widths)), row[4]]) for row in rows),
        "",
        "These state their licence by its name alone, and hold no text of it:",
        "",
        *without,
    ]
    for number, text in enumerate(texts, 1):
        lines += ["", "=" * 100, f"Text {number}", "=" * 100, "", text]
    return "\n".join(lines) + "\n"


def component(library: Library, kind: str = "library") -> dict[str, Any]:
    described: dict[str, Any] = {
        "type": kind,
        "bom-ref": library.purl,
        "name": library.name,
        "version": library.version,
        "scope": "required" if library.is_linked else "excluded",
        "licenses": [{"expression": library.licence}],
        "purl": library.purl,
        "externalReferences": [{"type": "distribution" if "crates.io" in library.source else "website", "url": library.source}],
    }
    if library.sha256:
        described["hashes"] = [{"alg": "SHA-256", "content": library.sha256}]
    return described


def cyclonedx(found: list[Library], target: str, epoch: int) -> str:
    """The list in CycloneDX 1.5. What runs only while the program is compiled has the scope `excluded`."""
    program, *others = found
    application = component(program, "application") | {"properties": [{"name": "cargo:target", "value": target}]}
    extra = [library.purl for library in others if not library.purl.startswith("pkg:cargo/")]
    uses = {library.purl: list(library.uses) for library in found}
    uses[program.purl] = sorted([*uses[program.purl], *extra])
    bom = {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, f'{program.source}/{program.version}/{target}/{epoch}')}",
        "version": 1,
        "metadata": {
            "timestamp": datetime.fromtimestamp(epoch, UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "tools": {"components": [{"type": "application", "name": "release/make", "version": program.version}]},
            "component": application,
        },
        "components": [component(library) for library in others],
        "dependencies": [{"ref": purl, "dependsOn": used} for purl, used in sorted(uses.items())],
    }
    return json.dumps(bom, indent=1, ensure_ascii=False) + "\n"
