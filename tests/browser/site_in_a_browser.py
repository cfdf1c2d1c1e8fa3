"""The site as a visitor meets it, served from its folder: nothing that axe-core finds, no error, no request elsewhere, at any width and in any light.

    site_in_a_browser.py SITE [--pictures FOLDER]

SITE is what `docs/site/make` wrote. Looks at the first page, at pages of the book and of the gallery, and opens the page in the browser where the site has it.
Ends with 1 and says why when something is not as it should be.
"""

import argparse
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from playwright.sync_api import sync_playwright

from report_in_a_browser import AXE, CHROMIUM, FLAGS

# How a page is looked at: name, width, light.
LOOKS = [("light", 1440, "light"), ("dark", 1440, "dark"), ("narrow", 390, "light"), ("narrow and dark", 390, "dark")]
FIRST = "index.html"
PAGES = [FIRST, "book/index.html", "book/docs/agents.html", "book/docs/install.html", "book/docs/gallery/README.html", "book/docs/gallery/hysteresis.html", "book/search.html"]
WORKBENCH = "browser/index.html"
# What of the first page is seen without scrolling on a laptop: how bad, how good, how to get it.
IN_VIEW = ["#title", ".rows", ".get pre"]
VIEW = 900
# Those further down are read only when they are near.
UNREAD = """() => Promise.all([...document.images].map(image => {
  image.loading = 'eager';
  return image.decode().then(() => null, () => image.src);
})).then(all => all.filter(Boolean))"""
PATIENCE = 120_000


class Quiet(SimpleHTTPRequestHandler):
    """Does not print what it is asked for."""

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        pass


def faults(browser, root, page_name, pictures):
    """Everything that is wrong with a page, in words."""
    found = []
    for name, width, light in LOOKS:
        context = browser.new_context(viewport={"width": width, "height": VIEW}, color_scheme=light)
        page = context.new_page()
        page.on("console", lambda m: m.type in ("error", "warning") and found.append(f"{name}: console says: {m.text}"))
        page.on("pageerror", lambda e: found.append(f"{name}: error: {e}"))
        page.on("request", lambda r: r.url.startswith((root, "data:", "blob:")) or found.append(f"{name}: asks for {r.url}"))
        page.on("response", lambda r: r.status < 400 or found.append(f"{name}: {r.url} is answered by {r.status}"))
        page.goto(f"{root}/{page_name}")
        if page_name == WORKBENCH:
            page.wait_for_selector("body[data-loaded='1']", timeout=PATIENCE)
        page.wait_for_timeout(200)
        if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"):
            found.append(f"{name}: the page is wider than {width} px")
        if page_name == FIRST:
            if width >= 1440:
                for place in IN_VIEW:
                    box = page.locator(place).first.bounding_box()
                    if box is None or box["y"] + box["height"] > VIEW:
                        found.append(f"{name}: {place} is not seen without scrolling")
            unread = page.evaluate(UNREAD)
            found += [f"{name}: no picture is read from {address}" for address in unread]
            if pictures:
                page.screenshot(path=pictures / f"site-{name.replace(' ', '-')}.png", full_page=True)
        # A test's own script; the page's policy is for what the page itself would load.
        page.evaluate(AXE.read_text(encoding="utf-8"))
        result = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
        for violation in result["violations"]:
            where = "; ".join(str(node["target"]) for node in violation["nodes"][:3])
            found.append(f"{name}: {violation['impact'] or 'minor'}: {violation['id']}: {violation['help']} ({where})")
        context.close()
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("site", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder for screenshots of the first page")
    arguments = parser.parse_args()
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=arguments.site))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    root = f"http://127.0.0.1:{server.server_address[1]}"
    pages = [*PAGES, *([WORKBENCH] if (arguments.site / WORKBENCH).is_file() else [])]
    found = []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        for name in pages:
            found += [f"{name}: {fault}" for fault in faults(browser, root, name, arguments.pictures)]
        browser.close()
    server.shutdown()
    print("\n".join(found) or f"{len(pages)} page(s) of the site: no fault")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
