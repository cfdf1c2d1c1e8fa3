// @ts-check
// The page without a server, as it begins: files are chosen or dropped, or a robot is simulated.

import { byId, element, present, sentence } from "calibench-report/elements.js";
import { capital } from "calibench-report/text.js";
import { startBench } from "calibench-workbench/bench.js";
import { bench, say, setBusy } from "calibench-workbench/state.js";
import { backend, open } from "./backend.js";
import { dropped, inTheirFolder, objection } from "./files.js";
import { tellOpened, toldGuess } from "./understood.js";

/**
 * What was chosen; what was refused, to be opened anyway; and whether what was hidden is told.
 * @type {{
 *   files: NamedFile[],
 *   hidden: { effect: string, words: string }[],
 *   refused: { body: object, files: NamedFile[] } | null,
 *   isTold: boolean,
 * }}
 */
const opening = { files: [], hidden: [], refused: null, isTold: false };

/** @returns {NodeListOf<HTMLButtonElement>} */
const buttons = () => document.querySelectorAll("#open button");

/**
 * @param {HTMLSelectElement} select
 * @param {[value: string, words: string][]} options
 */
const offer = (select, options) =>
  select.append(...options.map(([value, words]) => element("option", { value }, words)));

// Forgets what was refused, and why.
function withoutError() {
  for (const text of document.querySelectorAll("#open .error")) text.textContent = "";
  for (const guessed of document.querySelectorAll("#open .guessed")) guessed.remove();
  byId("continue-anyway").hidden = true;
  byId("files").removeAttribute("aria-invalid");
}

/**
 * Everything that is done here takes the place of what is open, and is waited for with a bar of its own.
 * @param {string} what
 * @param {object} body
 * @param {NamedFile[]} files
 * @param {string} errorAt
 */
async function opens(what, body, files, errorAt) {
  withoutError();
  setBusy(1);
  for (const button of buttons()) button.disabled = true;
  say("Opening …");
  document.body.dataset.opening = "1";
  // What was asked of the data that are open is done to them first.
  await bench.queue;
  const still = backend.follow(say);
  byId("cancel").hidden = false;
  const began = performance.now();
  try {
    const { opened, shown } = await open(what, body, files);
    document.body.classList.add("opened");
    byId("ways").open = false;
    tellOpened(opened, opening.isTold);
    await shown;
    document.body.dataset.verdict_ms = String(Math.round(performance.now() - began));
  } catch (error) {
    refuse(/** @type {Mistake} */ (error), errorAt);
    // What was refused is what is opened anyway, whatever is chosen meanwhile.
    opening.refused = { body, files };
  } finally {
    still();
    byId("cancel").hidden = true;
    for (const button of buttons()) button.disabled = false;
    delete document.body.dataset.opening;
    setBusy(-1);
  }
}

/**
 * @param {Mistake} error
 * @param {string} errorAt
 */
function refuse(error, errorAt) {
  showError(errorAt, error.message);
  const guess = error.told?.guess;
  // What was guessed of a table that is refused: the map can be corrected, and dropped beside it.
  if (guess) byId(errorAt).after(element("div", { class: "guessed" }, toldGuess(guess)));
  if (errorAt === "open-error" && !error.cancelled) byId("files").setAttribute("aria-invalid", "true");
  byId("continue-anyway").hidden = error.field !== "misfit";
  if (error.field === "robot") byId("robot").focus();
}

/**
 * @param {string} at
 * @param {string} message
 */
function showError(at, message) {
  byId(at).replaceChildren(...sentence(message));
  say(message, true);
}

/** @returns {Promise<void>} */
function openFiles() {
  withoutError();
  const files = inTheirFolder(opening.files);
  const because = objection(files);
  if (because) {
    showError("open-error", because);
    if (!files.length) byId("files").focus();
    return Promise.resolve();
  }
  const body = { files: files.map((f) => f.path), robot: byId("robot").value || null, force: false };
  return opens("open", body, files, "open-error");
}

/** @returns {Promise<void>} */
function play() {
  const chosen = byId("hidden").value;
  // A seed of its own each time that something is hidden from the visitor too.
  const any = chosen === "any";
  const [which, seed] = crypto.getRandomValues(new Uint32Array(2));
  const effect = any ? opening.hidden[which % opening.hidden.length].effect : chosen || null;
  opening.isTold = !any;
  const body = { effect, times: Number(byId("times").value), seed: any ? 1 + (seed % 1000) : 1 };
  return opens("play", body, [], "play-error");
}

function layOut() {
  const headline = [
    element("p", { class: "eyebrow" }, "calibench, in the browser"),
    element("h1", {}, "What is wrong with this robot?"),
    element(
      "p",
      { class: "means" },
      "Measurements of a robot go in; its calibration comes out, with the name of the physical effect that its model " +
        "lacks, and the error to expect where nobody measured.",
    ),
  ];
  byId("verdict").replaceChildren(...present(headline));
  byId("verdict").after(byId("open"));
}

function wire() {
  for (const event of /** @type {const} */ (["dragenter", "dragover"])) {
    document.addEventListener(event, (dragged) => {
      dragged.preventDefault();
      document.body.classList.add("dropping");
    });
  }
  for (const event of ["dragleave", "drop"]) {
    document.addEventListener(event, () => document.body.classList.remove("dropping"));
  }
  document.addEventListener("drop", async (event) => {
    event.preventDefault();
    if (document.body.dataset.opening || !event.dataTransfer) return;
    opening.files = await dropped(event.dataTransfer);
    byId("ways").open = true;
    if (opening.files.length) openFiles();
  });
  byId("files").addEventListener("change", () => {
    opening.files = [...(byId("files").files ?? [])].map((file) => ({ path: file.name, file }));
  });
  byId("drop").addEventListener("submit", (event) => {
    event.preventDefault();
    openFiles();
  });
  byId("continue-anyway").addEventListener("click", () => {
    const { refused } = opening;
    if (refused) opens("open", { ...refused.body, force: true }, refused.files, "open-error");
  });
  byId("play").addEventListener("submit", (event) => {
    event.preventDefault();
    play();
  });
}

/** @param {Answer} choices */
function begin({ robots, hidden, sizes }) {
  opening.hidden = hidden;
  offer(
    byId("robot"),
    robots.map((r) => [r.name, `${r.name} (${r.joints} joints)`]),
  );
  offer(byId("hidden"), [
    ...hidden.map((h) => /** @type {[string, string]} */ ([h.effect, capital(h.words)])),
    ["any", "Something, not disclosed"],
    ["", "Nothing beyond what every robot has"],
  ]);
  offer(
    byId("times"),
    sizes.map((times) => [String(times), `${times} times its plausible size`]),
  );
  byId("times").selectedIndex = 1;
  setBusy(-1);
  for (const button of buttons()) button.disabled = false;
  say("Ready. Measure a simulated robot, or open your own measurements.");
  document.body.dataset.loaded = "1";
}

/** @param {Error} error */
function cannot(error) {
  setBusy(-1);
  say(`This browser cannot run the program: ${error.message}. It needs WebAssembly with SIMD.`, true);
}

startBench(backend);
layOut();
say("Loading …");
wire();
setBusy(1);
backend.ask("choices").then(begin, cannot);

// For whoever drives the page by a script.
Object.assign(globalThis, {
  calibench: {
    ask: backend.ask,
    /** @param {NamedFile[]} files as they would be dropped */
    open: (files) => {
      opening.files = files;
      return openFiles();
    },
  },
});
