"""The report opens by itself: no error, no request, nothing that axe-core finds, at any width and in any light; and its pictures speak of the same sample.

    report_in_a_browser.py report.html [more.html ...] [--pictures FOLDER]

What it needs is made by `tests/browser/run`. Drives Debian's chromium (`apt-get install chromium`; another by CHROMIUM=PATH). Ends with 1 and says why when a page fails.
"""

import argparse
import os
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--disable-sync"]
AXE = Path(__file__).parent / "node_modules" / "axe-core" / "axe.min.js"

# How a page is looked at: name, width, light, paper.
LOOKS = [("light", 1280, "light", "screen"), ("dark", 1280, "dark", "screen"), ("narrow", 390, "light", "screen"), ("print", 794, "light", "print")]

# What is shown of a page in a document, px.
FIRST_VIEW = 1240

# Texts of one chart that lie upon each other by more than a pixel or two, and texts that stick out of it.
OVERLAPS = """() => {
  const found = [];
  for (const chart of document.querySelectorAll('.chart')) {
    const frame = chart.getBoundingClientRect();
    if (!frame.width) continue;
    const texts = [...chart.querySelectorAll('svg text')].filter(t => t.textContent.trim()).map(t => [t.textContent, t.getBoundingClientRect()]);
    const name = chart.getAttribute('aria-label').slice(0, 60);
    texts.forEach(([a, r], i) => {
      if (r.left < frame.left - 2 || r.right > frame.right + 2 || r.top < frame.top - 2 || r.bottom > frame.bottom + 2) found.push(`${name}: '${a}' sticks out`);
      texts.slice(0, i).forEach(([b, s]) => {
        const wide = Math.min(r.right, s.right) - Math.max(r.left, s.left), high = Math.min(r.bottom, s.bottom) - Math.max(r.top, s.top);
        if (wide > 2 && high > 3) found.push(`${name}: '${a}' lies upon '${b}'`);
      });
    });
  }
  return found;
}"""


# What can be done on a page, each as (what, script that tells whether it holds).
SAMPLE = "() => document.querySelector('.told-sample b')?.textContent"
RINGS = "() => document.querySelectorAll('.ring').length"
PICTURE = "() => document.querySelector('.space canvas').toDataURL()"


def deeds(page):
    """What a reader does with mouse and keys, and what does not follow from it, in words."""
    found = []

    def press(key):
        # Pictures follow in the next frame.
        page.keyboard.press(key)
        page.wait_for_timeout(120)

    def expect(holds, otherwise):
        if not holds:
            found.append(otherwise)

    current = "document.querySelector('#contents [aria-current]')?.textContent"
    page.evaluate("document.getElementById('parameters').scrollIntoView()")
    for _ in range(30):
        page.wait_for_timeout(100)
        if page.evaluate(current) == "Robot":
            break
    expect(page.evaluate(current) == "Robot", f"the contents mark '{page.evaluate(current)}' where the robot is read")
    paper = "getComputedStyle(document.documentElement).backgroundColor"
    light, before = page.evaluate(paper), page.evaluate("document.documentElement.dataset.theme")
    page.click("#theme")
    expect(page.evaluate(paper) != light and page.evaluate("document.documentElement.dataset.theme") != before, "the switch of light and dark changes nothing")
    page.click("#theme")
    expect(page.evaluate(paper) == light, "the switch of light and dark does not go back")
    page.wait_for_timeout(500)
    if page.evaluate("Boolean(JSON.parse(document.getElementById('data').textContent).against)"):
        expect(page.locator("#against table").first.is_visible() and page.locator("#against .chart svg").count() >= 2, "two models are not set side by side")
        shown = page.evaluate(PICTURE)
        page.select_option(".tools select", index=1)
        for _ in range(50):
            if page.evaluate(PICTURE) != shown:
                break
            page.wait_for_timeout(100)
        expect(page.evaluate(PICTURE) != shown, "the arrows are not those of the second model")
    if not page.query_selector(".space canvas"):
        return found + ["there is no view in space"]

    # From a chart into space, by keys.
    chart = page.locator("#residuals .chart[role='application']").first
    chart.scroll_into_view_if_needed()
    chart.focus()
    press("End")
    last = page.evaluate(SAMPLE)
    expect(page.evaluate(RINGS) >= 2, "a sample that is chosen in a chart is not marked in the others")
    press("ArrowLeft")
    expect(page.evaluate(SAMPLE) != last, "the view in space does not follow the keys in a chart")
    expect(page.inner_text("#spoken") != "", "what is chosen by keys is not read out")

    # By hovering: at the ring of that sample lies its point.
    chosen = page.evaluate(SAMPLE)
    ring = chart.locator(".ring").first
    ring.scroll_into_view_if_needed()
    box = ring.bounding_box()
    press("Escape")
    expect(page.evaluate(RINGS) == 0, "Escape leaves a sample marked")
    page.mouse.move(box["x"] - 60, box["y"] - 60)
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=4)
    page.wait_for_timeout(200)
    # Another point may lie upon it.
    expect(page.evaluate(RINGS) >= 2, f"a point that is hovered over ({chosen}) is not marked")

    # From space into the charts.
    space = page.locator(".space")
    space.scroll_into_view_if_needed()
    space.focus()
    before = page.evaluate(PICTURE)
    press("ArrowLeft")
    press("+")
    page.wait_for_timeout(100)
    expect(page.evaluate(PICTURE) != before, "the keys do not turn the view in space")
    before = page.evaluate(SAMPLE)
    press("]")
    expect(page.evaluate(SAMPLE) != before and page.evaluate(RINGS) >= 2, "the keys in space do not reach the charts")
    press("Escape")
    box = space.bounding_box()
    for k in range(1, 40):
        page.wait_for_timeout(40)
        page.mouse.move(box["x"] + box["width"] * (0.3 + 0.4 * (k * 0.618 % 1)), box["y"] + box["height"] * k / 40)
        if page.evaluate(RINGS):
            break
    expect(page.evaluate(RINGS) >= 2, "an arrow that is hovered over does not reach the charts")
    press("Escape")
    page.mouse.move(0, 0)
    return found


def film(page):
    """What a reader does with the film of a plan, and what does not follow from it, in words."""
    found = []

    def expect(holds, otherwise):
        if not holds:
            found.append(otherwise)

    narrowest, shown = page.evaluate(SAMPLE), page.evaluate(PICTURE)
    first = page.locator("main table button").first
    expect(narrowest.startswith(f"{first.inner_text()} of "), f"the film begins at {narrowest}, not at the least clearance")
    page.click("text='›'")
    page.wait_for_timeout(150)
    expect(page.evaluate(SAMPLE) != narrowest and page.evaluate(PICTURE) != shown, "the next motion is not shown")
    first.click()
    page.wait_for_timeout(150)
    expect(page.evaluate(SAMPLE) == narrowest and page.evaluate(PICTURE) == shown, "a motion of the table is not shown")
    page.fill(".tools input[type=range]", "0")
    expect(page.evaluate(SAMPLE).startswith("1 of "), "the slider does not lead to the first motion")
    page.click("text='Play'")
    for _ in range(100):
        page.wait_for_timeout(100)
        if not page.evaluate(SAMPLE).startswith("1 of "):
            break
    expect(not page.evaluate(SAMPLE).startswith("1 of "), "the film does not play")
    page.click("text='Pause'")
    page.wait_for_timeout(150)
    stopped = page.evaluate(PICTURE)
    page.wait_for_timeout(300)
    expect(page.evaluate(PICTURE) == stopped, "the film does not pause")
    page.locator(".space").focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(100)
    expect(page.evaluate(PICTURE) != stopped, "the keys do not turn the view")
    return found


def faults(browser, page_file, pictures):
    """Everything that is wrong with a page, in words."""
    found = []
    for name, width, light, medium in LOOKS:
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=light)
        page = context.new_page()
        page.on("console", lambda m: m.type in ("error", "warning") and found.append(f"{name}: console says: {m.text}"))
        page.on("pageerror", lambda e: found.append(f"{name}: error: {e}"))
        page.on("request", lambda r: r.url == page_file.as_uri() or r.url.startswith("data:") or found.append(f"{name}: asks for {r.url}"))
        page.on("dialog", lambda d: (found.append(f"{name}: a name in the data runs: {d.message}"), d.dismiss()))
        page.goto(page_file.as_uri())
        page.wait_for_selector("body[data-ready='1']", timeout=120_000)
        page.emulate_media(media=medium, color_scheme=light)
        if medium == "print":
            page.wait_for_selector("html[data-print]", timeout=120_000)
        page.wait_for_timeout(300)
        if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"):
            found.append(f"{name}: the page is wider than {width} px")
        if page.query_selector("img:not([src^='data:image/png;base64,']), iframe, object, embed, link"):
            found.append(f"{name}: a name in the data became markup")
        empty = page.evaluate("[...document.querySelectorAll('.chart')].filter(c => c.clientWidth && !c.querySelector('svg path')).map(c => c.getAttribute('aria-label'))")
        found += [f"{name}: nothing is drawn of: {label}" for label in empty]
        found += [f"{name}: {what}" for what in page.evaluate(OVERLAPS)]
        if pictures:
            if name == "light":
                page.set_viewport_size({"width": width, "height": FIRST_VIEW})
                page.wait_for_timeout(300)
                page.screenshot(path=pictures / f"{page_file.stem}-first.png")
            page.screenshot(path=pictures / f"{page_file.stem}-{name}.png", full_page=True)
        if medium == "print":
            if pictures:
                page.pdf(path=pictures / f"{page_file.stem}.pdf", prefer_css_page_size=True)
        else:
            page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
            page.wait_for_timeout(300)
            # A test's own script; the page's policy is for what the page itself would load.
            page.evaluate(AXE.read_text(encoding="utf-8"))
            result = page.evaluate("axe.run({ exclude: ['.chart svg'] }, { resultTypes: ['violations'] })")
            for violation in result["violations"]:
                where = "; ".join(str(node["target"]) for node in violation["nodes"][:3])
                found.append(f"{name}: {violation['impact'] or 'minor'}: {violation['id']}: {violation['help']} ({where})")
        if name == "light":
            does = film if page.evaluate("'tcp_mm' in JSON.parse(document.getElementById('data').textContent)") else deeds
            found += [f"{name}: {what}" for what in does(page)]
        context.close()
    return found


def shortened(found):
    """The first faults of each kind of look: one cause makes many."""
    shown = []
    for name, *_ in LOOKS:
        of_look = [fault for fault in found if fault.startswith(f"{name}: ")]
        shown += of_look[:5] + ([f"{name}: and {len(of_look) - 5} more"] if len(of_look) > 5 else [])
    return shown


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder for screenshots: light, dark, narrow, print")
    arguments = parser.parse_args()
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
    found = []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        for page in arguments.pages:
            found += [f"{page.name}: {fault}" for fault in shortened(faults(browser, page.resolve(), arguments.pictures))]
        browser.close()
    print("\n".join(found) or f"{len(arguments.pages)} page(s): no fault")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
