"""The workbench without a server, in a browser: the page as a file, on simulated and real measurements.

    page_in_a_browser.py PROGRAM PAGE DATA [--pictures FOLDER]

PAGE is what `calibench workbench --static` wrote, DATA a folder of datasets and tables that `tests/browser/run` made.

Opens the page as a double click does. Drops datasets, and holds what the page says against what the program prints; drops wrong files, which get the
sentence of the command line; drops a long file, which is refused at once; climbs the ladder and cancels it; measures a simulated robot with an error that is
hidden in it, and finds it; saves. No request leaves the page, and its policy allows none. Ends with 1 and says why when something is not as it should be.
Prints how long things took.
"""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from playwright.sync_api import sync_playwright

from report_in_a_browser import AXE, CHROMIUM, FLAGS
from workbench_in_a_browser import PATIENCE, Faults, looked_at, printed, settled

# Numbers of the page and of the program: the same arithmetic, with other sines and other sums of products. Where quantiles are taken of draws, another draw
# may be the one that is taken.
ALIKE = 2e-4

# What a section says, without its charts: the words and every digit that is printed.
TEXT = """id => {
  const section = document.getElementById(id).cloneNode(true);
  for (const chart of section.querySelectorAll('.chart')) chart.remove();
  return section.textContent.replace(/\\s+/g, ' ').trim();
}"""
SECTIONS = ["verdict", "accuracy", "workspace", "by_pose", "parameters", "provenance"]

# Parts of a document that are of the model alone, without the way that led to it.
PARTS = ["verdict", "figures", "calibration", "drawn", "validation", "workspace", "comparison", "residuals", "telling"]


def differences(name, page, program, found):
    """What a page says otherwise than the program: words are the same, numbers to a millionth."""
    if isinstance(program, dict) and isinstance(page, dict):
        for key in program.keys() | page.keys():
            differences(f"{name}.{key}", page.get(key), program.get(key), found)
    elif isinstance(program, list) and isinstance(page, list) and len(program) == len(page):
        for k, (one, other) in enumerate(zip(page, program)):
            differences(f"{name}[{k}]", one, other, found)
    elif isinstance(program, (int, float)) and isinstance(page, (int, float)) and not isinstance(program, bool):
        if not math.isclose(page, program, rel_tol=ALIKE, abs_tol=ALIKE):
            found.append(f"{name}: the page has {page}, the program {program}")
    elif page != program:
        found.append(f"{name}: the page says {page!r}, the program {program!r}")


def processor_s():
    """Seconds of processor time of the browser so far, all its processes together: on a busy machine the clock says little."""
    parents, used = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            parents[int(entry.name)] = int(fields[1])
            used[int(entry.name)] = int(fields[11]) + int(fields[12])

    def is_ours(pid):
        while pid > 1:
            if pid == os.getpid():
                return True
            pid = parents.get(pid, 0)
        return False

    return sum(ticks for pid, ticks in used.items() if is_ours(pid)) / os.sysconf("SC_CLK_TCK")


class Took(list):
    """How long things took: seconds of the clock, and of the browser's processors."""

    def __call__(self, name, act):
        clock, processor = time.monotonic(), processor_s()
        result = act()
        self.append((name, time.monotonic() - clock, processor_s() - processor))
        return result


def refused(program, folder, *arguments):
    """The sentence with which the program refuses."""
    done = subprocess.run([program, *arguments], capture_output=True, text=True, cwd=folder)
    if done.returncode != 2:
        raise SystemExit(f"{arguments} is not refused: {done.returncode} {done.stdout} {done.stderr}")
    return done.stderr.strip().splitlines()[-1].removeprefix("calibench: ")


class Page:
    """The page, and what a visitor does with it."""

    def __init__(self, context, url, found):
        self.page = context.new_page()
        self.found = found
        self.page.on("console", lambda m: m.type in ("error", "warning") and found.append(f"console says: {m.text}"))
        self.page.on("pageerror", lambda e: found.append(f"error: {e}"))
        self.page.on("request", lambda r: r.url.startswith((url, "data:", "blob:")) or found.append(f"asks for {r.url}"))
        self.page.goto(url)
        self.page.wait_for_selector("body[data-loaded='1']", timeout=PATIENCE)

    def opens(self, files, robot=""):
        """Chooses files, and opens them; waits for the verdict, or the error."""
        self.unfolds()
        self.page.set_input_files("#files", [str(f) for f in files])
        self.page.select_option("#robot", robot)
        self.waits("#open-files")

    def drops(self, folder, names):
        """Opens the files of these datasets as a drop of their folders does."""
        self.unfolds()
        files = [(f"{name}/{n}", (folder / name / n).read_text(encoding="utf-8")) for name in names for n in ("dataset.toml", "samples.csv")]
        self.page.evaluate("""files => {
          calibench.open(files.map(([path, text]) => ({ path, file: new File([text], path.split("/").pop()) })));
        }""", files)
        self.page.wait_for_selector("body:not([data-opening])[aria-busy='false']", timeout=PATIENCE)

    def unfolds(self):
        self.page.evaluate("document.getElementById('ways').open = true")

    def waits(self, button):
        self.page.click(button)
        self.page.wait_for_selector("body:not([data-opening])[aria-busy='false']", timeout=PATIENCE)

    def error(self, at="open-error"):
        return self.page.locator(f"#{at}").inner_text()

    def asks(self, what):
        return self.page.evaluate("what => calibench.ask(what)", what)


def held_against(program, page, folder, scratch, found, took):
    """A dataset: the page's document and the program's, and what both print."""
    name = folder.name
    # Files that are chosen one by one have no folder; the page calls it so.
    shutil.rmtree(scratch / "dataset", ignore_errors=True)
    shutil.copytree(folder, scratch / "dataset")
    files = [folder / n for n in ("dataset.toml", "samples.csv", "robot.toml") if (folder / n).is_file()]
    took(f"{name}: verdict", lambda: page.opens(files))
    if page.error():
        found.append(f"{name}: {page.error()}")
        return
    subprocess.run([program, "report", "dataset", "--output", "report.html"], capture_output=True, cwd=scratch, check=True)
    other = page.page.context.new_page()
    other.goto((scratch / "report.html").as_uri())
    other.wait_for_selector("body[data-ready='1']", timeout=PATIENCE)
    report = other.evaluate("JSON.parse(document.getElementById('data').textContent)")
    document, views = page.asks("document")["document"], took(f"{name}: samples", lambda: page.asks("views"))
    page.page.wait_for_selector("body[data-settled='1']", timeout=PATIENCE)
    for section in SECTIONS:
        ours, theirs = page.page.evaluate(TEXT, section), other.evaluate(TEXT, section)
        if ours != theirs:
            at = next((k for k, (a, b) in enumerate(zip(ours, theirs)) if a != b), min(len(ours), len(theirs)))
            found.append(f"{name}: {section}: the page prints '{ours[max(0, at - 30) : at + 30]}', the program '{theirs[max(0, at - 30) : at + 30]}'")
    found.unless(document["diagnosis"]["sentences"] == report["diagnosis"]["sentences"], f"{name}: the sentences differ")
    other.close()
    said = {**document, **views}
    differing = Faults()
    for part in PARTS:
        differences(f"{name}: {part}", said.get(part), report.get(part), differing)
    found += differing[:5]


def meanwhile(page, ripple, ur5, found):
    """While other data are being opened, nothing is done to them in the name of those that are shown; what was asked before is done first."""
    page.opens([ripple / "dataset.toml", ripple / "samples.csv"])
    settled(page.page)
    page.unfolds()
    page.page.set_input_files("#files", [str(ur5 / n) for n in ("dataset.toml", "samples.csv")])
    said = page.page.evaluate("""() => new Promise((done) => {
      for (const button of [...document.querySelectorAll('#candidates .switch')].slice(-2)) button.click();
      document.getElementById('open-files').click();
      const wait = setInterval(() => {
        if (document.getElementById('cancel').hidden || !document.getElementById('status').textContent.match(/Reading|Checking|Fitting the model …|Judging/)) return;
        clearInterval(wait);
        document.getElementById('save-calibration').click();
        done(document.getElementById('status').textContent);
      }, 5);
    })""")
    found.unless("being opened" in said, f"saving while opening: the page says '{said}'")
    page.page.wait_for_selector("body:not([data-opening])[aria-busy='false']", timeout=PATIENCE)
    settled(page.page)
    with page.page.expect_download(timeout=PATIENCE) as download:
        page.page.click("#save-calibration")
    text = Path(download.value.path()).read_text(encoding="utf-8")
    found.unless('robot = "ur5"' in text, "the saved calibration is not that of the data that are open")


def wrong_files(program, page, tables, scratch, found):
    """Files that are not as they must be."""
    good = (tables / "table.csv").read_text(encoding="utf-8").splitlines()
    cases = {
        "words.csv": "these,are,words\n" + "a,b,c\n" * 20,
        "empty.csv": "",
        "few.csv": "\n".join(line.split(",")[0] for line in good[:30]) + "\n",
        "nul.csv": "q1,q2\n\0\0,1\n",
        "broken.xlsx": "this is not a workbook",
    }
    for name, text in cases.items():
        (scratch / name).write_text(text, encoding="utf-8")
        expected = refused(program, scratch, "import", "guess", name, "--robot", "ur5", "-o", "map.toml")
        page.opens([scratch / name], "ur5")
        found.unless(page.error() == expected.replace("`", ""), f"{name}: the page says '{page.error()}', the program '{expected}'")
    (scratch / "arm.urdf").write_text("<robot name='x'><link name='a'/></robot>", encoding="utf-8")
    shutil.copy(tables / "table.csv", scratch / "measured.csv")
    expected = refused(program, scratch, "import", "guess", "measured.csv", "--robot", "arm.urdf", "-o", "map.toml")
    page.opens([scratch / "measured.csv", scratch / "arm.urdf"])
    found.unless(page.error() == expected.replace("`", ""), f"arm.urdf: the page says '{page.error()}', the program '{expected}'")
    # A dataset with a slip in a row.
    dataset = scratch / "slip" / "dataset"
    shutil.copytree(tables / "ripple", dataset)
    rows = (dataset / "samples.csv").read_text(encoding="utf-8").splitlines()
    rows[4] = rows[4].replace(".", "x", 1)
    (dataset / "samples.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    expected = refused(program, dataset.parent, "diagnose", "dataset")
    page.opens([dataset / "dataset.toml", dataset / "samples.csv"])
    found.unless(page.error() == expected.replace("`", ""), f"slip: the page says '{page.error()}', the program '{expected}'")
    # A calibration is neither a model nor a robot, and is left out; of two models, neither is taken.
    beside = [tables / "ripple" / "dataset.toml", tables / "ripple" / "samples.csv"]
    (scratch / "saved.toml").write_text('format = "calibench-calibration/1"\neffects = ["mdh"]\n', encoding="utf-8")
    page.opens([*beside, scratch / "saved.toml"])
    told = page.page.locator("#understood").inner_text()
    found.unless(not page.error() and "saved.toml: is a calibration" in told, f"saved.toml: the page says '{page.error()}' and '{told}'")
    for name in ("one.toml", "other.toml"):
        (scratch / name).write_text('# not a calibench-calibration/1\neffects = ["base_frame", "mdh"]\n', encoding="utf-8")
    page.opens([*beside, scratch / "one.toml", scratch / "other.toml"])
    found.unless("are both models" in page.error(), f"two models: the page says '{page.error()}'")
    # A table's name needs no extension.
    shutil.copy(tables / "table.csv", scratch / "plain")
    page.opens([scratch / "plain"], "ur5")
    found.unless(not page.error(), f"plain: the page says '{page.error()}'")
    # The robot of another maker.
    page.opens([tables / "table.csv"], "panda")
    found.unless(page.error(), "a UR5's table is taken for a Panda's")
    # A table given twice is refused, and what was open before stands as it stood.
    of_before = "document.title + document.getElementById('opened').textContent + document.getElementById('now').textContent"
    page.opens([tables / "ripple" / n for n in ("dataset.toml", "samples.csv", "probings.csv", "campaign.journal")])
    settled(page.page)
    before = page.page.evaluate(of_before)
    twice = scratch / "twice"
    for name in ("a", "b"):
        shutil.copytree(tables / "ripple", twice / name)
    page.drops(twice, ["a", "b"])
    found.unless("would count twice" in page.error(), f"twice: the page says '{page.error()}'")
    found.unless(page.page.evaluate(of_before) == before, f"twice: the page shows {page.page.evaluate(of_before)}, not {before}")
    # Exchanged columns: refused, opened anyway on request, with nothing that calls it noise; what is chosen meanwhile does not count.
    rows = [line.split(",") for line in good]
    swapped = [",".join([row[0], row[2], row[1], *row[3:]]) for row in rows[1:]]
    (scratch / "swapped.csv").write_text("\n".join([good[0], *swapped]) + "\n", encoding="utf-8")
    page.opens([scratch / "swapped.csv"], "ur5")
    found.unless(page.error() and page.page.is_visible("#continue-anyway"), f"swapped: the page says '{page.error()}'")
    # The guess stands beside the refusal, so that it can be corrected.
    found.unless(page.page.locator("#open .guessed pre").count() == 1, "swapped: the page does not show the map that it guessed")
    page.page.set_input_files("#files", [str(tables / "table.csv")])
    page.waits("#continue-anyway")
    settled(page.page)
    headline = page.page.locator("h1").inner_text()
    found.unless(headline == "These data do not fit this robot", f"swapped: the page says '{headline}'")
    found.unless("swapped" in page.page.title(), f"swapped: the page calls itself '{page.page.title()}'")
    drawn = page.page.evaluate("document.querySelectorAll('#residuals .chart').length")
    found.unless(drawn > 5, f"swapped: {drawn} pictures of the residuals are drawn")


# Stands between the two workers of the page, and counts what the second one computes for the first.
BETWEEN = """
const Channel = MessageChannel;
window.computed = 0;
window.MessageChannel = class {
  constructor() {
    const [asks, helps] = [new Channel(), new Channel()];
    [this.port1, this.port2] = [helps.port1, asks.port2];
    asks.port1.onmessage = ({ data }) => helps.port2.postMessage(data);
    helps.port2.onmessage = ({ data }) => {
      window.computed += data.result ? 1 : 0;
      asks.port1.postMessage(%s);
    };
  }
};"""
HELPERS = {
    "a helper": (BETWEEN % "data", True),
    "a helper that fails": (BETWEEN % "data.ready ? data : { result: null }", True),
    "no helper": ("delete WebAssembly.Suspending;", False),
}


def helped(browser, url, dataset, found):
    """The verdict is the same to the last bit, whether a second worker helps, fails, or is not there."""
    documents = {}
    for name, (script, computes) in HELPERS.items():
        context = browser.new_context()
        context.add_init_script(script)
        page = Page(context, url, found)
        # It gets ready first.
        page.page.wait_for_timeout(3000)
        page.opens([dataset / "dataset.toml", dataset / "samples.csv"])
        documents[name] = page.asks("document")["document"]
        computed = page.page.evaluate("window.computed ?? 0")
        found.unless((computed > 0) == computes, f"{name}: computes {computed} times")
        context.close()
    for name, document in documents.items():
        found.unless(document == documents["no helper"], f"{name}: another verdict than without")


# The directive by which the browser forbids a connection.
FORBIDDEN = """() => new Promise((done) => {
  document.addEventListener('securitypolicyviolation', (event) => done(event.effectiveDirective));
  fetch('http://127.0.0.1:9/').then(() => done('nothing'), () => setTimeout(() => done('nothing'), 1000));
})"""


class Silent(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def served_by_anybody(context, path, found):
    """Any file server hands the page out, and even then it may connect to nothing, its own server included."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Silent, directory=str(path.parent))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = context.new_page()
        page.goto(f"http://127.0.0.1:{server.server_port}/{path.name}")
        page.wait_for_selector("body[data-loaded='1']", timeout=PATIENCE)
        by = page.evaluate(FORBIDDEN)
        found.unless(by == "connect-src", f"a connection is forbidden by {by}")
        page.close()
        server.shutdown()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("page", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder for screenshots")
    parser.add_argument("--only", help="name of a part")
    arguments = parser.parse_args()
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
    program = str(arguments.program.resolve())
    found, took = Faults(), Took()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        context = browser.new_context(viewport={"width": 1280, "height": 900}, color_scheme="light", accept_downloads=True)
        page = took("load", lambda: Page(context, arguments.page.resolve().as_uri(), found))
        page.page.evaluate(AXE.read_text(encoding="utf-8"))
        looked_at(page.page, "static-start", arguments.pictures, found)
        parts = {
            "helper": lambda: helped(browser, arguments.page.resolve().as_uri(), arguments.data / "ripple", found),
            "cancel": lambda: cancelled_at_once(page, found),
            "cancel late": lambda: cancelled_late(page, arguments.data / "ripple", arguments.data / "ur10b", found),
            "meanwhile": lambda: meanwhile(page, arguments.data / "ripple", arguments.data / "ur5", found),
            "numbers": lambda: [held_against(program, page, d, Path(folder), found, took) for d in sorted(arguments.data.iterdir()) if (d / "dataset.toml").is_file()],
            "wrong": lambda: wrong_files(program, page, arguments.data, Path(folder), found),
            "play": lambda: plays(program, page, arguments.pictures, found, took),
            "served": lambda: served_by_anybody(context, arguments.page.resolve(), found),
            "long": lambda: long_file(page, Path(folder), found),
            "ladder": lambda: ladder(page, arguments.data / "ripple", found, took),
            "guess": lambda: guesses(program, page, arguments.data, Path(folder), found, took),
        }
        for name, part in parts.items():
            if arguments.only in (None, name):
                part()
        browser.close()
    print("\n".join(f"{name}: {clock:.2f} s, {processor:.2f} s of processor" for name, clock, processor in took))
    print("\n".join(found) or "no fault")
    return 1 if found else 0


def plays(program, page, pictures, found, took):
    """A simulated robot with gear ripple in its third joint: found by name, and switched on it is gone."""
    page.unfolds()
    page.page.select_option("#hidden", "harmonic:3:202")
    took("play: verdict", lambda: page.waits("#measure"))
    found.unless(not page.error("play-error"), f"play: {page.error('play-error')}")
    settled(page.page)
    headline = page.page.locator("h1").inner_text()
    found.unless("202" in headline, f"play: the verdict reads '{headline}'")
    looked_at(page.page, "static-played", pictures, found)
    tile = page.page.locator("#now .value").nth(0)
    before = float(tile.inner_text().split()[-2])
    took("play: switch on", lambda: page.waits("#candidates li[data-effect='harmonic:3:202'] .switch"))
    settled(page.page)
    after = float(tile.inner_text().split()[-2])
    found.unless(after < 0.5 * before, f"play: the error falls from {before} to {after} mm only")
    for what, name in [("save-model", "model.toml"), ("save-calibration", "calibration.toml"), ("save-urdf", "calibrated.urdf"), ("save-report", "report.html")]:
        with page.page.expect_download(timeout=PATIENCE) as download:
            page.page.click(f"#{what}")
        text = Path(download.value.path()).read_text(encoding="utf-8")
        found.unless(download.value.suggested_filename == name, f"{what} saves {download.value.suggested_filename}")
        mark = {"model.toml": "harmonic:3:202", "calibration.toml": "harmonic:3:202", "calibrated.urdf": "<robot", "report.html": "calibench-report/2"}[name]
        found.unless(mark in text, f"{name} does not hold '{mark}'")
    for name, width, light in [("dark", 1280, "dark"), ("narrow", 390, "light")]:
        page.page.set_viewport_size({"width": width, "height": 900})
        page.page.emulate_media(color_scheme=light)
        page.page.wait_for_timeout(400)
        looked_at(page.page, f"static-{name}", pictures, found)
    page.page.set_viewport_size({"width": 1280, "height": 900})
    page.page.emulate_media(color_scheme="light")


def cancelled_at_once(page, found):
    """The very first thing that is done can be cancelled, and the page is as it was."""
    page.page.click("#measure")
    page.page.click("#cancel")
    page.page.wait_for_selector("body:not([data-opening])[aria-busy='false']", timeout=PATIENCE)
    found.unless(page.error("play-error").startswith("Cancelled"), f"cancelled at once, the page says '{page.error('play-error')}'")
    found.unless(page.page.is_hidden("#bench") and page.page.is_hidden("#cancel"), "cancelled at once, something is open")


def cancelled_late(page, small, large, found):
    """While the model of other data is fitted and judged, it can be cancelled too: what was open before stands as it stood."""
    page.opens([small / "dataset.toml", small / "samples.csv"])
    settled(page.page)
    figures = "document.title + document.getElementById('now').textContent"
    before = page.page.evaluate(figures)
    page.unfolds()
    page.page.set_input_files("#files", [str(large / name) for name in ("dataset.toml", "samples.csv")])
    page.page.click("#open-files")
    page.page.wait_for_selector("#status:text-matches('Fitting|Judging')", timeout=PATIENCE)
    page.page.click("#cancel")
    page.page.wait_for_selector("body:not([data-opening])[aria-busy='false']", timeout=PATIENCE)
    found.unless(page.error().startswith("Cancelled"), f"cancelled late, the page says '{page.error()}'")
    settled(page.page)
    found.unless(page.page.evaluate(figures) == before, f"cancelled late, the page shows {page.page.evaluate(figures)}, not {before}")


def long_file(page, scratch, found):
    """100 MB of rows: refused at once, and the page goes on."""
    long = scratch / "long.csv"
    row = "0.1,0.2,0.3,0.4,0.5,0.6,100.1,200.2,300.3\n"
    long.write_text("q1,q2,q3,q4,q5,q6,x,y,z\n" + row * (100_000_000 // len(row)), encoding="utf-8")
    page.opens([long], "ur5")
    found.unless("is longer than 24 MiB" in page.error(), f"long: the page says '{page.error()}'")


def ladder(page, folder, found, took):
    """The ladder tells what it does; cancelled, it leaves the workbench as it was; then it leads where it should."""
    page.opens([folder / "dataset.toml", folder / "samples.csv"])
    settled(page.page)

    def effects():
        return page.asks("document")["live"]["effects"]

    before = effects()
    page.page.click("#recommend")
    page.page.wait_for_selector("#cancel:not([hidden])", timeout=PATIENCE)
    page.page.wait_for_timeout(200)
    page.page.click("#cancel")
    page.page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
    status = page.page.locator("#status").inner_text()
    found.unless(status.startswith("Cancelled"), f"cancelled, the page says '{status}'")
    found.unless(effects() == before and page.page.is_disabled("#undo"), "cancelled, the workbench is not as it was")
    took("ladder", lambda: page.waits("#recommend"))
    found.unless("harmonic:3:202" in effects(), f"the ladder leads to {effects()}")
    settled(page.page)
    after = page.page.evaluate("[...document.querySelectorAll('#now .value')].map(v => v.lastChild.textContent)")
    # What a cancelled action leaves is what was there, the model of the ladder included.
    page.page.click("#next")
    page.page.wait_for_timeout(100)
    page.page.click("#cancel")
    page.page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
    page.page.click("#undo")
    page.page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
    settled(page.page)
    page.page.click("#redo")
    page.page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
    settled(page.page)
    again = page.page.evaluate("[...document.querySelectorAll('#now .value')].map(v => v.lastChild.textContent)")
    found.unless(again == after, f"cancelled and back, the page shows {again}, not {after}")


def guesses(program, page, data, scratch, found, took):
    """A table: the column map is that of `import guess`, and the dataset that of `import generic`."""
    shutil.copy(data / "table.xlsx", scratch / "table.xlsx")
    subprocess.run([program, "import", "guess", "table.xlsx", "--robot", "ur5", "-o", "map.toml"], cwd=scratch, check=True, capture_output=True)
    subprocess.run([program, "import", "generic", "table.xlsx", "--map", "map.toml", "-o", "table"], cwd=scratch, check=True, capture_output=True)
    took("table: verdict", lambda: page.opens([scratch / "table.xlsx"], "ur5"))
    found.unless(not page.error(), f"table: {page.error()}")
    settled(page.page)
    shown = page.page.locator("#understood pre").first.text_content()
    found.unless(shown == (scratch / "map.toml").read_text(encoding="utf-8"), "the column map is not that of import guess")
    differing = Faults()
    diagnosis = printed(program, "diagnose", str(scratch / "table"))
    diagnosis.pop("advice")
    said = page.asks("document")["document"]["diagnosis"]
    for document in (said, diagnosis):
        # What takes nothing takes it in any order, and what cannot be seen is as probable as all else that cannot.
        document["contributions"] = {c["effect"]: c for c in document["contributions"]}
        document["findings"] = {f["effect"]: f for f in document["findings"]}
    # Few rows leave much open: which draws of what they leave are accepted hangs on last bits, and the expected error on the draws.
    for key in set(diagnosis) - {"sentences", "workspace"}:
        differences(f"table: {key}", said.get(key), diagnosis[key], differing)
    found += differing[:5]


if __name__ == "__main__":
    sys.exit(main())
