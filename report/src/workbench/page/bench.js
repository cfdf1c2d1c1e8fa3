"use strict";
// The workbench: what the user does is sent to the program, and what it answers is laid out. Nothing is computed here.
//
// The program is reached through `backend`, which the script before this one defines:
//   ask(what, body)  answers, or throws an error with the field of the page in error;
//   follow(tell)     tells what is being done until the function that it returns is called;
//   can_cancel(what) is true if a question can be cancelled;
//   cancel           ends the action that is waited for, whose question then throws;
//   saved(answer)    does what remains to be done with files that were written;
//   begin(open)      calls `open` whenever other data are open.

const bench = {
  report: null,
  live: null,
  // Counts what was laid out: an answer that comes after the next one was laid out is of no use.
  turn: 0,
  // Actions are sent one after the other.
  queue: Promise.resolve(),
  queued: 0,
  hovering: null,
  // The figures of the fit before the last switch and after it, while the rest is being computed.
  first: null,
};

// The sections that are of the model; the others are of the data.
const OF_THE_MODEL = ["verdict", "told", "telling", "ladder", "by_pose", "accuracy", "workspace", "ranking", "residuals", "parameters"];

// Number of candidates that are listed.
const LISTED = 8;

const by_id = (id) => document.getElementById(id);

async function ask(what, body) {
  const told = await backend.ask(what, body);
  // Asked too late: whoever switched asks for the new model.
  if (told.changed) throw new Error("The model was changed in another page; load this one anew.");
  return told;
}

function say(text, failed = false) {
  const status = by_id("status");
  status.classList.toggle("failed", failed);
  status.replaceChildren(...sentence(text));
}

const unbroken = (part) => percent(part).replaceAll(" ", "\u00a0");

const seconds = (ms) => (ms < 1000 ? `${Math.round(ms)} ms` : `${(ms / 1000).toFixed(1)} s`);

function set_busy(change) {
  bench.queued += change;
  document.body.setAttribute("aria-busy", bench.queued > 0);
  by_id("undo").disabled = !bench.live?.can_undo;
  by_id("redo").disabled = !bench.live?.can_redo;
}

// `before` and `after` say what is done, `act` does it once everything before it is done; a mistake stands at its field.
function act(before, path, body, after, mistake = (error) => say(error.message, true)) {
  // What is asked of these data is not done to others.
  if (document.body.dataset.opening) {
    say("Other data are being opened; cancel that, or wait.", true);
    return bench.queue;
  }
  set_busy(1);
  bench.queue = bench.queue.then(async () => {
    say(before);
    const began = performance.now();
    const still = backend.follow(say);
    by_id("cancel").hidden = !backend.can_cancel(path);
    const done = () => { still(); by_id("cancel").hidden = true; };
    try {
      const told = await ask(path, body);
      done();
      if (told.live) await show(told);
      if (told.saved) backend.saved(told);
      set_busy(-1);
      say(after({ ...told, took_ms: performance.now() - began }));
    } catch (error) {
      done();
      set_busy(-1);
      say("Not done.", true);
      if (bench.report) effects_listed();
      mistake(error);
    }
  });
  return bench.queue;
}

function at_field(form, fallback) {
  return (error) => {
    const field = form.elements.namedItem(error.field ?? fallback) ?? form.elements.namedItem(fallback);
    say(error.message, true);
    if (!field) return;
    field.setAttribute("aria-invalid", "true");
    by_id(`${field.id}-error`).replaceChildren(...sentence(error.message));
    field.focus();
  };
}

function without_mistakes() {
  for (const field of document.querySelectorAll("#bench [aria-invalid]")) field.removeAttribute("aria-invalid");
  for (const text of document.querySelectorAll("#bench .error")) text.textContent = "";
  by_id("refused").hidden = true;
}

// A switch that was turned, or refused: then it can be turned all the same.
function turned(told, again) {
  const { accepted, added, removed, objections, before, after, took_ms } = told;
  if (added.length + removed.length === 0) return "This is so already.";
  const said = [added.length && `on ${listed(added)}`, removed.length && `off ${listed(removed)}`].filter(Boolean).join(" and ");
  if (accepted) {
    return `Switched ${said} in ${seconds(took_ms)}: ${bench.report.names.cross_validated} ${millimetres(before.cv_rms_mm)} to ${millimetres(after.cv_rms_mm)} mm.`;
  }
  const notice = by_id("refused");
  const force = element("button", { type: "button" }, "Switch it on all the same");
  force.addEventListener("click", again);
  notice.replaceChildren(element("p", {}, `Against switching ${said}: ${objections.join("; ")}.`), force);
  notice.hidden = false;
  notice.focus();
  return `Not switched ${said}: there is evidence against it, and the model is as it was.`;
}

const listed = (words) => (words.length > 3 ? `${words.length} effects` : words.join(" and "));

function turn(effect, on, force = false, mistake = undefined) {
  without_mistakes();
  const row = row_of(effect)?.querySelector(".switch");
  row?.setAttribute("aria-busy", "true");
  // The notice with the evidence against it is gone, and the focus with it.
  if (force) row?.focus();
  const words = bench.report ? named(bench.report, effect) : effect;
  return act(on ? `Fitting the model with ${words} …` : `Fitting the model without ${words} …`, "switch", { effect, on, force },
    (told) => turned(told, () => turn(effect, on, true)), mistake);
}

function recommend() {
  without_mistakes();
  const after = ({ added, advice, took_ms }) => `${added.length ? "Taken" : "Nothing to add"} (${seconds(took_ms)}). ${advice}`;
  return act("Climbing the ladder, and holding its steps against the error curves of all joints …", "recommend", {}, after);
}

function own(force = false) {
  without_mistakes();
  const form = by_id("own");
  const { name, unit, site, expressions } = Object.fromEntries(new FormData(form));
  return act("Fitting the model with your expression …", "own", { name, unit, site, expressions, force }, (told) => turned(told, () => own(true)), at_field(form, "expressions"));
}

// The steps that are shown: those of the document, and the present one while no more than its fit is known.
function rungs() {
  const { rungs: known } = bench.report.ladder;
  if (!bench.first) return known;
  return bench.first.taken ? [bench.first.before, bench.first.after] : [bench.first.after];
}

// The figures by which the model is judged, each beside its value before the last switch.
function now() {
  const { names, figures } = bench.report;
  // Of other data, the samples are counted once the model is judged.
  const counted = !bench.first || bench.first.taken;
  const [before, last] = [rungs().at(-2), rungs().at(-1)];
  const tile = (name, of, beside) => {
    const [value, from] = [of(last), before && of(before)];
    const title = element("dt", {}, capital(name));
    if (!Number.isFinite(value)) {
      // Not known yet, or not at all.
      return bench.first ? element("div", { class: "waits" }, title, element("dd", {}, element("div", { class: "value waiting" }, "…"), element("div", { class: "beside" }, "being computed"))) : null;
    }
    const percents = Number.isFinite(from) && from > 0 ? 100 * (value / from - 1) : null;
    const moved = percents === null ? null : Math.abs(percents) < 0.05 ? "unchanged by the last switch" : `${signed(fixed(percents, 1))} % by the last switch`;
    const text = [moved, beside(last)].filter(Boolean).join("; ");
    return element("div", {}, title, element("dd", {},
      element("div", { class: "value" }, Number.isFinite(from) ? element("span", { class: "from" }, `${millimetres(from)} → `) : null, `${millimetres(value)} mm`), element("div", { class: "beside" }, text)));
  };
  const band = (r) => r.workspace?.mean_band_mm && `${millimetres(r.workspace.mean_band_mm[0])} to ${millimetres(r.workspace.mean_band_mm[1])} mm`;
  return [
    tile(`${names.residual}, rms`, (r) => r.fit_rms_mm, () => (counted ? `${figures.samples} samples` : null)),
    tile(`${names.cross_validated}, rms`, (r) => r.cv_rms_mm, () => "blocks that were not fitted"),
    bench.report.validation && tile(`${names.not_fitted}, rms`, (r) => r.validation?.rms_mm, (r) => `${r.validation.samples} poses`),
    tile(`${names.workspace}, mean`, (r) => r.workspace?.mean_mm, band),
    tile(`${names.noise_left}, rms`, (r) => r.noise_mm, () => (figures.noise_stated ? "as stated" : "as the best explanation leaves it")),
  ].filter(Boolean);
}

const step_name = (r, k) => (k === 0 ? "to begin with" : r.removed?.length ? `− ${in_words(bench.report, r.removed)}` : `+ ${in_words(bench.report, r.added ?? [])}`);

// The same over the steps.
function stairs() {
  const { names, ladder } = bench.report;
  const steps = bench.first ? [...(bench.first.taken ? ladder.rungs : []), bench.first.after] : ladder.rungs;
  if (steps.length < 2) return [];
  const titles = steps.map(step_name);
  const lines = [
    [names.residual, (r) => r.fit_rms_mm, "residual", "circle"], [names.cross_validated, (r) => r.cv_rms_mm, "other", "triangle"],
    [names.not_fitted, (r) => r.validation?.rms_mm, "measured", "rect"], [`${names.workspace}, mean`, (r) => r.workspace?.mean_mm, "predicted", "diamond"], [names.noise_left, (r) => r.noise_mm, "noise", "none"],
  ].filter(([, of]) => steps.some((r) => Number.isFinite(of(r))));
  const values = (of) => steps.map((r) => (Number.isFinite(of(r)) ? millimetres(of(r)) : "pending")).join(", ");
  const label = "The error by step: " + lines.map(([name, of]) => `${name} ${values(of)} mm`).join("; ");
  return [element("figure", {}, chart(label, 240, (theme, width) => ({
    grid: { left: 62, right: 24, top: width < 620 ? 24 * lines.length + 10 : 34, bottom: 34, outerBoundsMode: "none" },
    legend: { top: 0, left: width < 620 ? 0 : 56, orient: width < 620 ? "vertical" : "horizontal", itemGap: width < 620 ? 7 : 14, itemWidth: 16, itemHeight: 9, textStyle: { color: theme.ink, fontSize: 12 }, selectedMode: false },
    tooltip: tooltip(theme, ({ seriesName, dataIndex, value }) => `${titles[dataIndex]}\n${seriesName}: ${millimetres(value)} mm`),
    xAxis: { type: "category", data: titles, axisTick: { show: false }, axisLine: { lineStyle: { color: theme.noise } },
      axisLabel: { color: theme.ink, fontSize: 11, interval: 0, hideOverlap: true, width: Math.max(40, (width - 90) / titles.length - 8), overflow: "truncate" } },
    yAxis: axis(theme, "error, mm", 46, { min: 0, scale: false }),
    series: lines.map(([name, of, colour, symbol]) => ({
      name, type: "line", step: "middle", data: steps.map((r) => of(r) ?? null), symbol, symbolSize: 8,
      lineStyle: { color: theme[colour], width: 2, type: name === names.noise_left ? "dashed" : "solid" }, itemStyle: { color: theme[colour] },
    })),
  })))];
}

const row_of = (effect) => [...by_id("candidates").children].find((row) => row.dataset.effect === effect);

// Every effect as a switch: those of the model, then the candidates, then what was switched off.
function effects_listed() {
  const { diagnosis, meanings } = bench.report;
  // A curve has the id by which it was asked for; in a model it has a name.
  const switches = bench.live.switches.map((s) => ({ ...s, effect: s.asked }));
  const offered = (bench.live.candidates ?? bench.candidates ?? []).slice(0, LISTED);
  bench.candidates = offered;
  const is_on = (effect) => switches.some((s) => s.on && s.effect === effect);
  const fresh = offered.filter((effect) => !is_on(effect)).map((effect) => ({ effect, words: named(bench.report, effect), on: false, offered: true, flags: [] }));
  const off = switches.filter((s) => !s.on && !fresh.some((f) => f.effect === s.effect));
  const focused = document.activeElement?.closest?.("#candidates li")?.dataset.effect;
  const shown = by_id("candidates").querySelector(".shown")?.dataset.effect;
  by_id("candidates").replaceChildren(...[...switches.filter((s) => s.on), ...fresh, ...off].map((s) => row(s, diagnosis, meanings)));
  if (shown) mark(shown);
  if (focused) row_of(focused)?.querySelector(".switch").focus();
}

function row({ effect, words, on, offered, initial, flags }, diagnosis, meanings) {
  const found = offered && diagnosis.findings.find((f) => f.in_model === effect);
  const curve = offered && effect.startsWith("curve:") ? "the curve that this joint’s error follows, whatever its shape" : null;
  const said = found ? `probability ${unbroken(found.probability)}, explains ${unbroken(found.explains)}; ${meanings[effect]?.what ?? ""}` : curve ?? (on ? (initial ? "of the initial model" : "switched on") : "switched off");
  const button = element("button", { type: "button", class: "switch", "aria-pressed": String(on) }, element("i", { "aria-hidden": "true" }), words);
  button.addEventListener("click", () => turn(effect, !on));
  const waits = bench.first && offered;
  const made = element("li", { "data-effect": effect, class: on ? "model" : null }, button,
    element("div", { class: `beside${waits ? " pending" : ""}` }, words === effect ? null : element("code", {}, effect), " ", element("span", { class: "quiet" }, said)),
    flags.map((text) => element("p", { class: "warning" }, sentence(text))));
  if (offered) {
    made.addEventListener("pointerenter", () => hover(effect));
    made.addEventListener("focusin", () => hover(effect));
  }
  return made;
}

// Draws a candidate over the residuals, when the pointer has come to rest on it.
function hover(effect) {
  clearTimeout(bench.hovering);
  bench.hovering = setTimeout(() => show_candidate(effect), 40);
}

// Asks for a candidate, unless it is known; true if the page is still the same.
async function look_at(effect) {
  const { turn: then, report } = bench;
  const at = report.candidates.findIndex((c) => c.effect === effect);
  if (report.candidates[at]?.telling) return true;
  const { candidate, telling } = await ask("candidate", { effect });
  if (then !== bench.turn) return false;
  const place = report.candidates.findIndex((c) => c.effect === effect);
  report.candidates[place < 0 ? report.candidates.length : place] = { ...candidate, telling };
  return true;
}

async function show_candidate(effect) {
  const { turn: then, report } = bench;
  if (bench.first || !report?.telling || by_id("candidates").querySelector(".shown")?.dataset.effect === effect) return;
  bench.looked_at = effect;
  try {
    if (!(await look_at(effect)) || bench.looked_at !== effect) return;
    const at = report.candidates.findIndex((c) => c.effect === effect);
    report.telling = { ...report.candidates[at].telling, candidate: at };
    mark(effect);
    render(report, ["telling"]);
    // The picture first, the views of all joints when there is time.
    clearTimeout(bench.later);
    bench.later = setTimeout(() => then === bench.turn && render(report, ["residuals"]), 150);
  } catch (error) {
    if (then === bench.turn) say(error.message, true);
  }
}

function mark(effect) {
  for (const one of by_id("candidates").children) one.classList.toggle("shown", one.dataset.effect === effect);
}

function pending(is) {
  for (const id of OF_THE_MODEL) {
    by_id(id).classList.toggle("pending", is);
    by_id(id).toggleAttribute("aria-busy", is);
    if (is) by_id(id).setAttribute("aria-busy", "true");
  }
}

// The part of the page above the report.
function lay_out_bench() {
  const { live } = bench;
  for (let i = drawn.length - 1; i >= 0; i -= 1) if (by_id("stairs").contains(drawn[i].host)) drawn.splice(i, 1)[0].chart?.dispose();
  by_id("opened").textContent = live.datasets.filter((d) => d.chosen).map((d) => d.name).join(", ");
  by_id("now").replaceChildren(...now());
  by_id("stairs").replaceChildren(...stairs());
  effects_listed();
  by_id("proposal").hidden = true;
  by_id("bench").hidden = false;
  by_id("choice").hidden = live.datasets.length < 2;
  by_id("datasets").replaceChildren(...live.datasets.map((d, k) => {
    const box = element("input", { type: "checkbox", name: "dataset", value: d.name, id: `dataset-${k}` });
    box.checked = d.chosen;
    return element("label", {}, box, `${d.name} (${d.samples} samples)`);
  }));
  by_id("sites").replaceChildren(...live.sites.map((site) => element("option", { value: site })));
  draw(by_id("stairs"));
  set_busy(0);
}

// Lays out the answer to an action: the figures of the fit at once, the rest as it comes. What is judged already comes at once.
async function show(told) {
  if (!told.moved) {
    bench.live = told.live;
    effects_listed();
    return;
  }
  bench.turn += 1;
  document.body.dataset.settled = "0";
  document.body.dataset.ahead = "0";
  bench.live = told.live;
  if (told.live.candidates) {
    const { turn: then } = bench;
    const document_of = await ask("document");
    if (then === bench.turn) { lay_out(document_of); see(then); }
    return;
  }
  bench.first = { before: told.before, after: { ...told.after, added: told.added, removed: told.removed }, taken: told.added.length + told.removed.length > 0 };
  lay_out_bench();
  pending(true);
  follow(bench.turn);
}

function lay_out({ live, document: told }) {
  bench.first = null;
  bench.live = live;
  bench.report = told;
  lay_out_bench();
  render(told);
  pending(false);
}

async function follow(then) {
  try {
    const told = await ask("document");
    if (then !== bench.turn) return;
    lay_out(told);
    await see(then);
  } catch (error) {
    if (then === bench.turn) say(error.message, true);
  }
}

// What is said of every sample, then the candidates that are listed, so that looking at one is a look-up.
async function see(then) {
  const { report } = bench;
  try {
    const views = await ask("views");
    if (then !== bench.turn) return;
    Object.assign(report, views);
    mark(report.candidates[report.telling.candidate]?.effect);
    // The maps of the workspace share their colours with those of the samples.
    render(report, ["workspace", "telling", "residuals"]);
  } catch (error) {
    if (then === bench.turn) say(error.message, true);
  }
  if (then !== bench.turn) return;
  document.body.dataset.settled = "1";
  for (const effect of bench.candidates) {
    if (then !== bench.turn) return;
    // One that cannot be fitted says so when it is looked at.
    await look_at(effect).catch(() => false);
  }
  if (then === bench.turn) document.body.dataset.ahead = "1";
}

// Writes the poses that are proposed.
function saves_plan() {
  const button = element("button", { type: "button", id: "save-plan" }, "Save plan.toml");
  button.addEventListener("click", () => act("Saving …", "save-plan", {}, ({ saved }) => `Saved: ${saved}.`));
  return button;
}

// What `next` proposes.
function proposed({ next, took_ms }) {
  const best = next.best;
  const step = (s) => [s.measurements, fixed(s.minutes, 0), s.probability_of_truth === null ? "–" : percent(s.probability_of_truth), millimetres(s.workspace_error_mm)];
  const rows = next.actions.flatMap((a) => a.steps.map((s) => ({ name: a.action, of: step(s) })));
  const columns = [["what to measure", (r) => r.name, "words"], ["how many", (r) => String(r.of[0])], ["minutes", (r) => r.of[1]], ["the truth gets", (r) => r.of[2]], ["error then, mm", (r) => r.of[3]]];
  by_id("proposal").replaceChildren(...[
    element("h3", {}, "The next experiment"),
    element("ul", {}, next.sentences.map((text) => element("li", {}, sentence(text)))),
    rows.length ? unfold("What each would tell", table("Actions", columns, rows)) : null,
    next.not_offered.length ? unfold("Not offered", element("ul", {}, next.not_offered.map((n) => element("li", {}, `${n.action}: ${n.because}`)))) : null,
    next.cell_known ? null : element("p", { class: "quiet" }, "Nothing but robot and balls is known to stand in the cell: look at every pose before it is driven."),
    best ? saves_plan() : null,
  ].filter(Boolean));
  by_id("proposal").hidden = false;
  by_id("proposal").focus();
  return `${best ? `Best: ${best.measurements} ${best.action}` : "No measurement on offer would help"} (${seconds(took_ms)}).`;
}

document.body.classList.add("workbench");
// The picture stands beside the candidates that it shows.
by_id("picture").append(by_id("telling"));
by_id("verdict").after(by_id("bench"));

by_id("undo").addEventListener("click", () => { without_mistakes(); act("Taking the last step back …", "undo", {}, ({ took_ms }) => `Taken back in ${seconds(took_ms)}.`); });
by_id("redo").addEventListener("click", () => { without_mistakes(); act("Taking the step again …", "redo", {}, ({ took_ms }) => `Taken again in ${seconds(took_ms)}.`); });
by_id("recommend").addEventListener("click", recommend);
by_id("next").addEventListener("click", () => act("Looking for the measurements that would tell most …", "next", {}, proposed));
by_id("cancel").addEventListener("click", () => backend.cancel());
for (const what of ["save-model", "save-calibration", "save-urdf", "save-report"]) {
  by_id(what).addEventListener("click", () => act("Saving …", what, {}, ({ saved }) => `Saved ${saved}.`));
}
by_id("other").addEventListener("submit", (event) => {
  event.preventDefault();
  turn(by_id("effect").value.trim(), true, false, at_field(event.target, "effect"));
});
by_id("own").addEventListener("submit", (event) => { event.preventDefault(); own(); });
by_id("choice").addEventListener("submit", (event) => {
  event.preventDefault();
  without_mistakes();
  const datasets = new FormData(event.target).getAll("dataset");
  act("Fitting …", "choose", { datasets }, ({ took_ms }) => `Begun anew in ${seconds(took_ms)}.`, (error) => { by_id("datasets-error").textContent = error.message; });
});

// The actions that are always possible once something is open.
const ACTIONS = ["recommend", "next", "save-model", "save-calibration", "save-urdf", "save-report"];

// Lays out what is open now, and forgets what was open before.
function open_bench() {
  set_busy(1);
  bench.turn += 1;
  const { turn: then } = bench;
  Object.assign(bench, { report: null, live: null, first: null, candidates: null, looked_at: null });
  without_mistakes();
  document.body.dataset.settled = "0";
  document.body.dataset.ahead = "0";
  return ask("document").then(
    (told) => {
      if (then !== bench.turn) return;
      for (const id of ACTIONS) by_id(id).disabled = false;
      lay_out(told);
      set_busy(-1);
      say(`Fitted. ${told.live.switches.filter((s) => s.on).map((s) => s.words).join(" + ")}`);
      see(then);
    },
    (error) => { set_busy(-1); say(error.message, true); },
  );
}

backend.begin(open_bench);
