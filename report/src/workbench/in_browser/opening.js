"use strict";
// What is done before there is a workbench: files are chosen or dropped, or a robot is simulated.

// Longest file that is read, bytes: a table of two hundred thousand rows, which take minutes. Of half a million, the memory is not enough.
const LONGEST_FILE = 24 << 20;

const opening = { files: [], play: null, refused: null };

const choices = (select, options) => select.append(...options.map(([value, words]) => element("option", { value }, words)));

// Forgets what was refused, and why.
function without_error() {
  for (const text of document.querySelectorAll("#open .error")) text.textContent = "";
  for (const guessed of document.querySelectorAll("#open .guessed")) guessed.remove();
  by_id("all-the-same").hidden = true;
  by_id("files").removeAttribute("aria-invalid");
}

// Everything that is done here takes the place of what is open, and is waited for with a bar of its own.
async function opens(what, body, files, error_at) {
  without_error();
  set_busy(1);
  const buttons = document.querySelectorAll("#open button");
  for (const button of buttons) button.disabled = true;
  say("Opening …");
  document.body.dataset.opening = "1";
  // What was asked of the data that are open is done to them first.
  await bench.queue;
  const still = backend.follow(say);
  by_id("cancel").hidden = false;
  const began = performance.now();
  try {
    const { opened, shown } = await backend.open(what, body, files);
    document.body.classList.add("opened");
    by_id("ways").open = false;
    tell_opened(opened);
    await shown;
    document.body.dataset.verdict_ms = String(Math.round(performance.now() - began));
    return true;
  } catch (error) {
    show_error(error_at, error.message);
    // What was guessed of a table that is refused: the map can be corrected, and dropped beside it.
    if (error.told?.guess) by_id(error_at).after(element("div", { class: "guessed" }, ...told_guess(error.told.guess)));
    if (error_at === "open-error" && !error.cancelled) by_id("files").setAttribute("aria-invalid", "true");
    by_id("all-the-same").hidden = error.field !== "misfit";
    // What was refused is what is opened all the same, whatever is chosen meanwhile.
    opening.refused = { body, files };
    if (error.field === "robot") by_id("robot").focus();
    return false;
  } finally {
    still();
    by_id("cancel").hidden = true;
    for (const button of buttons) button.disabled = false;
    delete document.body.dataset.opening;
    set_busy(-1);
  }
}

function show_error(at, message) {
  by_id(at).replaceChildren(...sentence(message));
  say(message, true);
}

const list = (lines) => element("ul", {}, lines.map((line) => element("li", {}, sentence(line))));

// How a table was understood.
const told_guess = ({ reasons, rows, map }, nominal = []) => [
  unfold("How the table was understood, and why", element("div", {}, list(reasons), element("p", {}, "The first rows are understood as"), list(rows), nominal.length ? list(nominal) : null)),
  unfold("The column map", element("pre", { tabindex: "0" }, map)),
];

// What was understood of the files, or measured.
function tell_opened(opened) {
  const { guess, scenario, effect, times, hidden, samples, validation, robot, nominal, misfit, warnings } = opened;
  const count = `Opened: ${samples} samples of ${robot}${validation ? `, ${validation} of them for validation` : ""}.`;
  by_id("understood").replaceChildren(...[
    element("p", {}, element("b", {}, count)),
    misfit && element("p", { class: "warning" }, sentence(misfit)),
    warnings.length ? list(warnings.map((line) => `warning: ${line}`)) : null,
    ...(guess ? told_guess(guess, nominal) : []),
    opened.import ? unfold("What was imported", element("pre", { tabindex: "0" }, opened.import)) : null,
    scenario && (opening.told
      ? element("p", {}, hidden ? `Hidden: ${hidden} (`: "Nothing was hidden.", hidden ? element("code", {}, effect) : null, hidden ? `), ${times} times its plausible size. Which candidate is it? Switch it on, and watch the error fall.` : null)
      : unfold("What was hidden", element("p", {}, hidden ? `${hidden} (${effect}), ${times} times its plausible size` : "nothing"))),
    scenario && unfold("The same on the command line", element("div", {},
      element("p", {}, "Save this as simulated.toml in the folder scenarios of calibench, which holds the file that it extends, and measure there: ", element("code", {}, "calibench measure simulated.toml -o simulated")),
      element("pre", { tabindex: "0" }, scenario))),
  ].filter(Boolean));
  by_id("understood").hidden = false;
}

// The files of a dataset that come without their folder get one.
function in_their_folder(files) {
  const of_dataset = ["dataset.toml", "samples.csv", "robot.toml", "campaign.journal", "iterations.csv", "probings.csv"];
  if (!files.some(({ path }) => path === of_dataset[0])) return files;
  return files.map(({ path, file }) => ({ path: of_dataset.includes(path) ? `dataset/${path}` : path, file }));
}

function open_files() {
  without_error();
  const files = in_their_folder(opening.files);
  if (files.filter(({ path }) => path === "dataset/dataset.toml").length > 1) {
    show_error("open-error", "Two of these files are called dataset.toml: drop the folders of the datasets instead, so that each keeps its files.");
    return Promise.resolve(false);
  }
  if (!files.length) {
    show_error("open-error", "Choose files, or drop them on this page.");
    by_id("files").focus();
    return Promise.resolve(false);
  }
  const long = files.find(({ file }) => file.size > LONGEST_FILE);
  if (long) {
    show_error("open-error", `${long.path}: is longer than ${LONGEST_FILE >> 20} MiB, and this page reads no longer ones; take a part of the rows, or use the program`);
    return Promise.resolve(false);
  }
  return opens("open", { files: files.map((f) => f.path), robot: by_id("robot").value || null, force: false }, files, "open-error");
}

// Files and, in folders, what is in them.
async function dropped(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const inside = async (entry) => {
    const path = entry.fullPath.replace(/^\//, "");
    if (entry.isFile) return [{ path, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) }];
    const reader = entry.createReader();
    const all = [];
    for (;;) {
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (!some.length) break;
      all.push(...some);
    }
    return (await Promise.all(all.filter((one) => !one.name.startsWith(".")).map(inside))).flat();
  };
  return (await Promise.all(entries.map(inside))).flat();
}

by_id("verdict").replaceChildren(element("p", { class: "eyebrow" }, "calibench, in the browser"), element("h1", {}, "What is wrong with this robot?"),
  element("p", { class: "means" }, "Measurements of a robot go in; its calibration comes out, with the name of the physical effect that its model lacks, and the error to expect where nobody measured."));
by_id("verdict").after(by_id("open"));
say("Loading …");

for (const event of ["dragenter", "dragover"]) {
  document.addEventListener(event, (dragged) => { dragged.preventDefault(); document.body.classList.add("dropping"); });
}
for (const event of ["dragleave", "drop"]) {
  document.addEventListener(event, () => document.body.classList.remove("dropping"));
}
document.addEventListener("drop", async (event) => {
  event.preventDefault();
  if (document.body.dataset.opening) return;
  opening.files = await dropped(event.dataTransfer);
  by_id("ways").open = true;
  if (opening.files.length) open_files();
});
by_id("files").addEventListener("change", () => {
  opening.files = [...by_id("files").files].map((file) => ({ path: file.name, file }));
});
by_id("drop").addEventListener("submit", (event) => { event.preventDefault(); open_files(); });
by_id("all-the-same").addEventListener("click", () => {
  const { body, files } = opening.refused;
  opens("open", { ...body, force: true }, files, "open-error");
});
by_id("play").addEventListener("submit", (event) => {
  event.preventDefault();
  const chosen = by_id("hidden").value;
  const all = opening.play.hidden;
  // A seed of its own each time that something is hidden from the visitor too.
  const any = chosen === "any";
  const drawn = crypto.getRandomValues(new Uint32Array(2));
  const effect = any ? all[drawn[0] % all.length].effect : chosen || null;
  opening.told = !any;
  opens("play", { effect, times: Number(by_id("times").value), seed: any ? 1 + (drawn[1] % 1000) : 1 }, [], "play-error");
});

set_busy(1);
backend.ask("choices").then(
  ({ robots, hidden, sizes }) => {
    opening.play = { hidden };
    choices(by_id("robot"), robots.map((r) => [r.name, `${r.name} (${r.joints} joints)`]));
    choices(by_id("hidden"), [...hidden.map((h) => [h.effect, capital(h.words)]), ["any", "Something, not told"], ["", "Nothing beyond what every robot has"]]);
    choices(by_id("times"), sizes.map((times) => [String(times), `${times} times its plausible size`]));
    by_id("times").selectedIndex = 1;
    set_busy(-1);
    for (const button of document.querySelectorAll("#open button")) button.disabled = false;
    say("Ready. Measure a simulated robot, or open your own measurements.");
    document.body.dataset.loaded = "1";
  },
  (error) => { set_busy(-1); say(`This browser cannot run the program: ${error.message}. It needs WebAssembly with SIMD.`, true); },
);
