"""The watch page of a measurement in a browser, with the real program and the served cell behind it.

    watch_in_a_browser.py PROGRAM SCENARIO DATASET PLAN [--pictures FOLDER]

What it needs is made by `tests/browser/run`. Follows a measurement until some probings are done, in a wide and a narrow window, light and dark; presses the
stop, and sees the program end as `measure` says that it does. Ends with 1 and says why when something is not as it should be.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from report_in_a_browser import AXE, CHROMIUM, FLAGS

# Probings to be seen before the stop.
SEEN = 5
# A motion on a busy machine, ms.
PATIENCE = 180_000


def cell(folder, dataset, addresses):
    indicators = "".join(f'[[indicator]]\naxis = "{axis}"\naddress = "{at}"\n' for axis, at in zip("xyz", addresses["indicators"], strict=True))
    path = folder / "cell.toml"
    path.write_text(
        f'format = "calibench-cell/1"\ndataset = "{dataset}/dataset.toml"\n[robot]\naddress = "{addresses["robot"]}"\nspeed_percent = 100\nflange.b_deg = 180\n'
        f"patience.settle_s = 0\n{indicators}"
    )
    return path


def follow(play, url, pictures):
    found = []
    browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.on("console", lambda m: m.type in ("error", "warning") and found.append(f"console says: {m.text}"))
    page.on("pageerror", lambda e: found.append(f"error: {e}"))
    page.on("request", lambda r: r.url.startswith((url.split("/?")[0] + "/", "data:")) or found.append(f"asks for {r.url}"))
    page.goto(url)
    page.wait_for_selector(f"#rows tr:nth-child({SEEN})", timeout=PATIENCE)
    page.evaluate(Path(AXE).read_text())
    for width, scheme in ((1280, "light"), (390, "dark")):
        page.set_viewport_size({"width": width, "height": 900})
        page.emulate_media(color_scheme=scheme)
        if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"):
            found.append(f"{width}: the page is wider than the window")
        result = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
        found += [f"{width}: {v['id']}: {v['help']} ({v['nodes'][0]['target']})" for v in result["violations"]]
        if pictures:
            page.screenshot(path=pictures / f"watch-{width}.png", full_page=True)
    state = page.inner_text("#state")
    if not re.match(r"\d+ of \d+ probings\. Now: ", state):
        found.append(f"the page says: {state}")
    bars = page.locator("#off-chart rect").count()
    if bars < SEEN:
        found.append(f"{bars} bars of {SEEN} measurements")
    if "off by" not in page.inner_text("#off") or page.locator("#centring-chart .limit").count() != 1:
        found.append("a chart lacks its words or its limit")
    # By the keyboard, as somebody in a hurry.
    page.focus("#stop")
    page.keyboard.press("Enter")
    page.wait_for_selector("#stop:disabled")
    browser.close()
    return found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("scenario", type=Path)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("plan", type=Path)
    parser.add_argument("--pictures", type=Path)
    given = parser.parse_args()
    serve = [given.program, "sim", "serve", given.scenario, "--indicator-port", "0", "--time-scale", "40"]
    with tempfile.TemporaryDirectory() as scratch, subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as served:
        folder = Path(scratch)
        try:
            file = cell(folder, given.dataset.resolve(), json.loads(served.stdout.readline()))
            measure = [given.program, "measure", "--cell", file, "--plan", given.plan, "--yes", "--watch", "-o", folder / "dataset"]
            with subprocess.Popen(measure, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
                announced = next((line for line in process.stderr if "http://" in line), "")
                if not announced:
                    raise SystemExit("the page was not announced")
                with sync_playwright() as play:
                    found = follow(play, "http://" + announced.strip().split("http://")[1], given.pictures)
                said = process.stderr.read()
            if process.returncode != 3 or "--resume" not in said:
                found.append(f"the stopped measurement ends with {process.returncode}: {said}")
        finally:
            served.terminate()
    for fault in found:
        print(f"watch page: {fault}", file=sys.stderr)
    print("the watch page: no fault" if not found else f"{len(found)} faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
