// The workbench in Firefox, served and without a server: firefox.mjs PROGRAM DATASET [PAGE]. PROGRAM is the built
// `calibench`; with PAGE, which `calibench workbench --static` wrote, the program in the page answers, else PROGRAM
// serves.
//
// What hangs on the browser and not on the back end is done here: the page loads and computes, says what the program
// says, switches an effect on, is drawn, and can be read by ear. The whole of a user's deeds is done in Chromium
// (workbench_in_a_browser.py). Driven by WebDriver BiDi, which Firefox speaks itself.
// Ends with 1 and says why when something is not as it should be.

import { execFile, spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";
import { promisify } from "node:util";

import puppeteer from "puppeteer-core";

const FIREFOX = process.env.FIREFOX ?? "/usr/bin/firefox-esr";
const PATIENCE = { timeout: 180_000 };
const SETTLED = "body[aria-busy='false'][data-settled='1']";

const [program, dataset, still] = process.argv.slice(2).map((path) => resolve(path));
const found = [];
const unless = (holds, words) => holds || found.push(words);

/** What a verb prints, as JSON; 1 is a step that is refused. */
async function printed(...words) {
  const done = await promisify(execFile)(program, [...words, "--json"], { maxBuffer: 1 << 28 }).catch((e) =>
    e.code === 1 ? e : Promise.reject(e),
  );
  return JSON.parse(done.stdout);
}

/** A length as the page prints it. */
const shown = (mm) => (Math.abs(mm) < 0.1 ? mm.toFixed(4) : mm.toFixed(3));

async function lookedAt(page, name) {
  const wider = await page.evaluate(
    () => document.documentElement.scrollWidth > document.documentElement.clientWidth + 1,
  );
  unless(!wider, `${name}: the page is wider than the window`);
  const empty = await page.evaluate(() =>
    [...document.querySelectorAll(".chart")]
      .filter((c) => c.clientWidth && !c.querySelector("svg path"))
      .map((c) => c.getAttribute("aria-label")),
  );
  empty.slice(0, 5).forEach((label) => found.push(`${name}: nothing is drawn of: ${label}`));
  const { violations } = await page.evaluate(() =>
    window.axe.run({ exclude: [".chart svg"] }, { resultTypes: ["violations"] }),
  );
  violations.forEach((v) => found.push(`${name}: ${v.impact}: ${v.id}: ${v.help} (${v.nodes[0]?.target})`));
}

async function drive(page, url) {
  page.on("pageerror", (e) => found.push(`error: ${e.message}`));
  page.on("console", (m) => ["error", "warn"].includes(m.type()) && found.push(`console says: ${m.text()}`));
  const began = performance.now();
  await page.goto(url);
  if (still) {
    await page.waitForSelector("body[data-loaded='1']", PATIENCE);
    const files = await page.$("#files");
    await files.uploadFile(join(dataset, "dataset.toml"), join(dataset, "samples.csv"));
    await page.evaluate(() => document.getElementById("open-files").click());
  }
  await page.waitForSelector("#bench:not([hidden])", PATIENCE);
  console.log(`open: ${((performance.now() - began) / 1000).toFixed(2)} s`);
  await page.waitForSelector(SETTLED, PATIENCE);
  await new Promise((done) => setTimeout(done, 1500));
  await page.evaluate(readFileSync(new URL("node_modules/axe-core/axe.min.js", import.meta.url), "utf8"));
  const tile = (k) => page.$$eval("#now .value", (values, k) => values[k].innerText, k);
  const diagnosis = await printed("diagnose", dataset);
  const headline = await page.$eval("h1", (h) => h.innerText);
  const first = await page.$eval("#candidates li:not(.model)", (li) => li.dataset.effect);
  const words = await page.$eval("#candidates li:not(.model) .switch", (s) => s.innerText);
  unless(headline.toLowerCase().includes(words.toLowerCase()), `the verdict reads '${headline}'`);
  if (diagnosis.verdict === "identified")
    unless(first === diagnosis.findings[0].in_model, `the first candidate is ${first}`);
  unless(
    (await tile(0)).includes(shown(diagnosis.residual_mm)),
    `the fit leaves ${await tile(0)}, diagnose prints ${diagnosis.residual_mm}`,
  );
  await lookedAt(page, "opened");

  const step = await printed("add", first, dataset);
  await page.click(`#candidates li[data-effect='${first}'] .switch`);
  await page.waitForSelector(`#candidates li[data-effect='${first}'] .switch[aria-pressed='true']`, PATIENCE);
  await page.waitForSelector(SETTLED, PATIENCE);
  await new Promise((done) => setTimeout(done, 1500));
  const said = (await tile(0)).split(/\s+/);
  const expected = [shown(step.before.residual_mm), "→", shown(step.after.residual_mm), "mm"];
  unless(said.join() === expected.join(), `switched on, the page shows ${said}, add prints ${expected}`);
  await lookedAt(page, "added");
}

const profile = mkdtempSync(join(tmpdir(), "calibench-firefox-"));
const bench = still
  ? null
  : spawn(program, ["workbench", dataset, "--save-to", join(profile, "kept")], {
      stdio: ["ignore", "pipe", "inherit"],
    });
const ended = bench && once(bench, "exit");
try {
  const url = bench ? (await once(createInterface(bench.stdout), "line"))[0].trim() : pathToFileURL(still).href;
  const browser = await puppeteer.launch({
    browser: "firefox",
    executablePath: FIREFOX,
    headless: true,
    protocolTimeout: PATIENCE.timeout,
  });
  try {
    console.log(await browser.version());
    const page = await browser.newPage();
    await page.setViewport({ width: 1280, height: 900 });
    await drive(page, url);
  } finally {
    await browser.close();
  }
} finally {
  bench?.kill("SIGINT");
  const [code] = (await ended) ?? [0];
  unless(code === 0, `interrupted, the workbench ends with ${code}`);
  rmSync(profile, { recursive: true, force: true });
}
console.log(found.join("\n") || "no fault");
process.exitCode = found.length ? 1 : 0;
