"""The workbench in a browser, on real measurements: what a user does, in order, with the real program behind it.

    workbench_in_a_browser.py PROGRAM DATASET [--page PAGE] [--pictures FOLDER] [--effect EFFECT]

What it needs is made by `tests/browser/run`. With PAGE, which `calibench workbench --static` wrote, the same is done without a server: the program in the page
answers, and files are downloads.

Reads the verdict, switches the first finding on, sees the error fall to what the command line prints, switches others on and off in other
orders, takes steps back and forward, slips in an expression, writes it right, loads the page again, saves. Ends with 1 and says why when
something is not as it should be. Prints how long the actions took, from the click to the figures on the page.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from report_in_a_browser import AXE, CHROMIUM, FLAGS, OVERLAPS

# Charts that are to be seen, and have nothing in them.
EMPTY = "[...document.querySelectorAll('.chart')].filter(c => c.clientWidth && !c.querySelector('svg path')).map(c => c.getAttribute('aria-label'))"

# An action on 12,000 samples, unoptimised, on a busy machine, ms.
PATIENCE = 180_000


class Faults(list):
    def unless(self, holds, words):
        if not holds:
            self.append(words)


def printed(program, *arguments):
    """What a verb prints, as JSON; 1 is a step that is refused."""
    done = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{arguments}: {done.stderr}")
    return json.loads(done.stdout)


def shown(mm):
    """A length as the page prints it."""
    return f"{mm:.4f}" if abs(mm) < 0.1 else f"{mm:.3f}"


def settled(page):
    """Waits until the last action was answered and every sample looked at."""
    # By selectors: the page's policy forbids the scripts of text that other waits are made of.
    page.wait_for_selector("body[aria-busy='false'][data-settled='1']", timeout=PATIENCE)
    painted(page)


def painted(page):
    """Waits until every chart that is to be seen has something in it: a busy machine takes its time."""
    for _ in range(100):
        page.wait_for_timeout(150)
        if not page.evaluate(EMPTY):
            return


def looked_at(page, name, pictures, found, axe=True):
    """What is wrong with the page as it stands: texts upon each other, too wide, or hard to read by ear."""
    painted(page)
    if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"):
        found.append(f"{name}: the page is wider than the window")
    found += [f"{name}: nothing is drawn of: {label}" for label in page.evaluate(EMPTY)[:5]]
    found += [f"{name}: {what}" for what in page.evaluate(OVERLAPS)[:5]]
    if pictures:
        page.evaluate("scrollTo(0, 0)")
        page.screenshot(path=pictures / f"workbench-{name}-first.png")
        if page.is_visible("#bench"):
            page.locator("#bench").screenshot(path=pictures / f"workbench-{name}-bench.png")
        painted(page)
        page.screenshot(path=pictures / f"workbench-{name}.png", full_page=True)
        painted(page)
    if axe:
        result = page.evaluate("axe.run({ exclude: ['.chart svg'] }, { resultTypes: ['violations'] })")
        for violation in result["violations"]:
            weight = violation["impact"] or "minor"
            where = "; ".join(str(node["target"]) for node in violation["nodes"][:3])
            found.append(f"{name}: {weight}: {violation['id']}: {violation['help']} ({where})")


def drive(play, program, dataset, keep, pictures, url, effect):
    found, took = Faults(), []
    browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
    context = browser.new_context(viewport={"width": 1280, "height": 900}, color_scheme="light")
    page = context.new_page()
    served = url.startswith("http")
    own = url.split("/?")[0] + "/" if served else (url, "blob:")
    expected_refusals = []

    def heard(message):
        # A mistake of the user is answered with 422, which the browser writes down by itself.
        if message.type in ("error", "warning") and not (expected_refusals and "422" in message.text):
            found.append(f"console says: {message.text}")

    page.on("console", heard)
    page.on("pageerror", lambda e: found.append(f"error: {e}"))
    allowed = (own, "data:") if served else (*own, "data:")
    page.on("request", lambda r: r.url.startswith(allowed) or found.append(f"asks for {r.url}"))

    def timed(name, act):
        began = time.monotonic()
        act()
        page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
        took.append((name, time.monotonic() - began))
        settled(page)

    def tile(k):
        return page.locator("#now .value").nth(k).inner_text()

    def switch(effect):
        return page.locator(f"#candidates li[data-effect='{effect}'] .switch")

    def turned(effect, name):
        """Turns a switch; the figures of the fit stand before the rest is computed, which is marked until then."""
        began = time.monotonic()
        switch(effect).click()
        page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
        took.append((name, time.monotonic() - began))
        if page.is_visible("#refused"):
            page.click("#refused button")
            page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
        first = page.evaluate("[...document.querySelectorAll('#now > div')].map(d => [d.className, d.querySelector('.value').textContent])")
        waits = page.evaluate("[...document.querySelectorAll('section.pending')].map(s => s.id)")
        found.unless(not waits or any(kind == "waits" for kind, _ in first), f"{name}: sections are pending, and no figure is marked")
        settled(page)
        left = page.evaluate("document.querySelectorAll('.pending, #now .waits').length")
        found.unless(not left, f"{name}: {left} parts are still pending")
        for kind, text in first:
            if kind != "waits":
                found.unless(any(text == tile(k) for k in range(page.locator("#now .value").count())), f"{name}: {text} was another figure later")

    def saved(button, name):
        """The file that a button saves, as text."""
        if served:
            timed(button, lambda: page.click(f"#{button}"))
            return (keep / name).read_text(encoding="utf-8")
        with page.expect_download(timeout=PATIENCE) as download:
            timed(button, lambda: page.click(f"#{button}"))
        found.unless(download.value.suggested_filename == name, f"{button} saves {download.value.suggested_filename}")
        return Path(download.value.path()).read_text(encoding="utf-8")

    def figures():
        """The figures as they stand, without those before."""
        return page.evaluate("[...document.querySelectorAll('#now .value')].map(v => v.lastChild.textContent)")

    # The verdict.
    began = time.monotonic()
    page.goto(url)
    if not served:
        page.wait_for_selector("body[data-loaded='1']", timeout=PATIENCE)
        page.set_input_files("#files", [str(dataset / name) for name in ("dataset.toml", "samples.csv")])
        page.click("#open-files")
    page.wait_for_selector("#bench:not([hidden])", timeout=PATIENCE)
    took.append(("open", time.monotonic() - began))
    settled(page)
    took.append(("open, with every sample", time.monotonic() - began))
    # A test's own script; the page's policy is for what the page itself would load.
    page.evaluate(AXE.read_text(encoding="utf-8"))
    diagnosis = printed(program, "diagnose", str(dataset))
    first = page.locator("#candidates li:not(.model)").first.get_attribute("data-effect")
    headline = page.locator("h1").inner_text()
    if diagnosis["verdict"] == "identified":
        words = page.locator("#candidates li:not(.model) .switch").first.inner_text()
        found.unless(words in headline, f"the verdict reads '{headline}'")
        found.unless(first == diagnosis["findings"][0]["in_model"], f"the first candidate is {first}")
    found.unless(shown(diagnosis["residual_mm"]) in tile(0), f"the fit leaves {tile(0)}, diagnose prints {diagnosis['residual_mm']}")
    looked_at(page, "opened", pictures, found)

    # A candidate's curve: computed ahead, it is a look-up.
    page.wait_for_selector("body[data-ahead='1']", timeout=PATIENCE)
    offered = page.locator("#candidates li:not(.model)")
    name = offered.nth(1).get_attribute("data-effect")
    words = offered.nth(1).locator(".switch").inner_text()
    began = time.monotonic()
    offered.nth(1).hover()
    page.wait_for_selector(f"#candidates li.shown[data-effect='{name}']", timeout=PATIENCE)
    took.append(("hover", time.monotonic() - began))
    painted(page)
    found.unless(words in page.locator("#telling").inner_text(), f"the picture does not show {words}")
    if pictures:
        page.screenshot(path=pictures / "workbench-hovered.png")

    # The ladder, cancelled as soon as it can be: everything is as it was, and what was asked for before is still there.
    before = figures()
    page.click("#recommend")
    timed("cancel the ladder", lambda: page.click("#cancel"))
    status = page.locator("#status").inner_text()
    found.unless(status.startswith("Cancelled"), f"cancelled, the page says '{status}'")
    found.unless(page.is_hidden("#cancel") and page.is_disabled("#undo"), "cancelled, the workbench is not as it was")
    found.unless(figures() == before, f"cancelled, the page shows {figures()}, not {before}")

    # A step down.
    step = printed(program, "add", effect or first, str(dataset))
    if effect:
        page.fill("#effect", effect)
        timed("switch on", lambda: page.click("#other button"))
    else:
        turned(first, "switch on")
    added = effect or first
    found.unless(step["accepted"], f"{added} is refused by add")
    for k, key in enumerate(["residual_mm", "cross_validated_mm"]):
        before, after = shown(step["before"][key]), shown(step["after"][key])
        found.unless(tile(k).split() == [before, "→", after, "mm"], f"{key}: the page shows {tile(k)}, add prints {before} and {after}")
    found.unless(step["after"]["residual_mm"] < step["before"]["residual_mm"], "the error does not fall")
    found.unless(switch(added).get_attribute("aria-pressed") == "true", f"{added} is not on")
    looked_at(page, "added", pictures, found)
    alone = figures()

    # Another one on, by keyboard; the first off and on again: the same set has the same figures.
    page.wait_for_selector("body[data-ahead='1']", timeout=PATIENCE)
    other = page.locator("#candidates li:not(.model)").first.get_attribute("data-effect")
    switch(other).focus()
    page.keyboard.press("Space")
    page.wait_for_selector("body[aria-busy='false']", timeout=PATIENCE)
    settled(page)
    if page.is_visible("#refused"):
        looked_at(page, "refused", pictures, found)
        timed("anyway", lambda: page.click("#refused button"))
    both = figures()
    found.unless(page.evaluate("document.activeElement?.closest('li')?.dataset.effect") == other or effect, "the switch has lost the focus")
    turned(added, "switch off")
    found.unless(switch(added).get_attribute("aria-pressed") == "false" and switch(other).get_attribute("aria-pressed") == "true", "off and on is not what it shows")
    turned(added, "switch on again")
    found.unless(figures() == both, f"the same set shows {figures()}, not {both}")
    turned(other, "switch off again")
    found.unless(figures() == alone, f"the first alone shows {figures()}, not {alone}")

    # Loaded again.
    if served:
        page.reload()
        settled(page)
        page.evaluate(AXE.read_text(encoding="utf-8"))
    found.unless(shown(step["after"]["residual_mm"]) in tile(0), f"loaded again, the page shows {tile(0)}")

    # Taken back, and forward.
    for _ in range(4):
        timed("undo", lambda: page.click("#undo"))
    found.unless(switch(other).get_attribute("aria-pressed") == "false", "undo leaves the last step")
    timed("redo", lambda: page.click("#redo"))
    found.unless(figures() == both, "redo does not lead to the same figures")
    timed("undo", lambda: page.click("#undo"))
    timed("undo", lambda: page.click("#undo"))
    found.unless(tile(0) == f"{shown(step['before']['residual_mm'])} mm", f"taken back, the page shows {tile(0)}")
    found.unless(page.is_disabled("#undo"), "there is still something to undo")

    # An expression with a slip, then without.
    page.click("#own-effect summary")
    page.fill("#site", "theta:2")
    page.fill("#expressions", "sin(17*q2)\ncos(17*q9)")
    expected_refusals.append(1)
    timed("slip", lambda: page.click("#own button"))
    expected_refusals.clear()
    told = page.locator("#expressions-error").inner_text()
    found.unless("line 2" in told and "q9" in told, f"of the slip is told: '{told}'")
    found.unless(page.get_attribute("#expressions", "aria-invalid") == "true", "the field is not marked")
    found.unless(page.evaluate("document.activeElement.id") == "expressions", "the field is not where one types")
    looked_at(page, "slip", pictures, found)
    page.fill("#expressions", "sin(17*q2)\ncos(17*q2)")
    timed("own expression", lambda: page.click("#own button"))
    if page.is_visible("#refused"):
        looked_at(page, "refused", pictures, found)
        timed("own expression, anyway", lambda: page.click("#refused button"))
    found.unless("+ ripple" in page.locator("#stairs .chart").get_attribute("aria-label") or "ripple" in page.locator("#ladder").inner_text(), "the expression is no step")

    # Saved where it may be.
    found.unless("ripple" in saved("save-model", "model.toml"), "the model that was saved does not hold the expression")
    found.unless("ripple" in saved("save-calibration", "calibration.toml"), "the calibration that was saved does not hold the expression")
    found.unless("<robot" in saved("save-urdf", "calibrated.urdf"), "the URDF that was saved is none")
    found.unless(len(saved("save-report", "report.html")) > 1_000_000, "the report that was saved is no page")

    # The next experiment.
    timed("next experiment", lambda: page.click("#next"))
    found.unless(page.is_visible("#proposal li"), f"nothing is proposed: {page.locator('#status').inner_text()}")
    looked_at(page, "next", pictures, found)
    if served:
        timed("save plan", lambda: page.click("#save-plan"))
        found.unless(any((keep / name).is_file() for name in ("plan.toml", "plan.points.csv")), "the plan is not saved")
    else:
        with page.expect_download(timeout=PATIENCE) as download:
            timed("save plan", lambda: page.click("#save-plan"))
        found.unless(download.value.suggested_filename.startswith("plan."), f"the plan is saved as {download.value.suggested_filename}")

    # In other lights.
    for name, width, light in [("dark", 1280, "dark"), ("narrow", 390, "light")]:
        page.set_viewport_size({"width": width, "height": 900})
        page.emulate_media(color_scheme=light)
        page.wait_for_timeout(400)
        painted(page)
        looked_at(page, name, pictures, found)
    browser.close()
    return found, took


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--page", type=Path, help="the page without a server")
    parser.add_argument("--effect", help="effect to add in place of the first candidate")
    parser.add_argument("--pictures", type=Path, help="folder for screenshots")
    arguments = parser.parse_args()
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
    program = str(arguments.program.resolve())
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        keep = Path(folder) / "kept"
        if arguments.page:
            url = arguments.page.resolve().as_uri()
            found, took = drive(play, program, arguments.dataset, keep, arguments.pictures, url, arguments.effect)
            return told(found, took)
        command = [program, "workbench", str(arguments.dataset), "--save-to", str(keep)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as bench:
            try:
                url = bench.stdout.readline().strip()
                found, took = drive(play, program, arguments.dataset, keep, arguments.pictures, url, arguments.effect)
            finally:
                bench.send_signal(signal.SIGINT)
            if bench.wait(10) != 0:
                found.append("it does not end when it is interrupted")
    return told(found, took)


def told(found, took):
    """Prints what was found; the exit code."""
    print("\n".join(f"{name}: {seconds:.2f} s" for name, seconds in took))
    print("\n".join(found) or "no fault")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
