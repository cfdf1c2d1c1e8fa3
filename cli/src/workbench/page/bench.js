"use strict";
// The workbench: what the user does is sent to the program, and what it answers is laid out. Nothing is computed here.

const bench = {
  token: new URLSearchParams(location.search).get("token") ?? "",
  report: null,
  live: null,
  // Counts what was laid out: an answer that comes after the next one was laid out is of no use.
  turn: 0,
  busy: false,
  hovering: null,
};

const by_id = (id) => document.getElementById(id);

async function ask(path, body) {
  const headers = { "X-Calibench-Token": bench.token };
  if (body) headers["Content-Type"] = "application/json";
  const answer = await fetch(`/api/${path}`, { method: body ? "POST" : "GET", headers, body: body && JSON.stringify(body) });
  const told = await answer.json();
  // 422: what was asked for cannot be done, and why.
  if (!answer.ok) throw Object.assign(new Error(told.error), { field: told.field });
  return told;
}

function say(text, failed = false) {
  const status = by_id("status");
  status.classList.toggle("failed", failed);
  status.replaceChildren(...sentence(text));
}

const unbroken = (part) => percent(part).replaceAll(" ", "\u00a0");

const seconds = (ms) => (ms < 1000 ? `${ms} ms` : `${(ms / 1000).toFixed(1)} s`);

function set_busy(busy) {
  bench.busy = busy;
  document.body.setAttribute("aria-busy", busy);
  for (const button of document.querySelectorAll("#bar button, #bench button")) button.disabled = busy;
  by_id("undo").disabled = busy || !bench.live?.can_undo;
}

// One thing at a time: `before` and `after` say what is done, `act` does it, a mistake stands at its field.
async function act(before, path, body, after, mistake = (error) => say(error.message, true)) {
  if (bench.busy) return;
  say(before);
  set_busy(true);
  try {
    const told = await ask(path, body);
    if (told.document) show(told);
    set_busy(false);
    say(after(told));
  } catch (error) {
    set_busy(false);
    say("Not done.", true);
    mistake(error);
  }
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

// A step that was taken, or refused: then it can be taken all the same.
function stepped(told, again) {
  const { step, took_ms } = told;
  const name = step.after.added_words;
  const [before, after] = [step.before.cv_rms_mm, step.after.cv_rms_mm];
  if (step.accepted) return `Added ${name} in ${seconds(took_ms)}: cross-validated ${millimetres(before)} to ${millimetres(after)} mm.`;
  const notice = by_id("refused");
  const force = element("button", { type: "button" }, "Add it all the same");
  force.addEventListener("click", again);
  notice.replaceChildren(element("p", {}, "Against adding ", element("code", {}, name), `: ${step.objections.join("; ")}.`), force);
  notice.hidden = false;
  notice.focus();
  return `${name} is refused; the model is as it was.`;
}

function add(effect, force = false, mistake = undefined) {
  without_mistakes();
  return act(`Fitting the model with ${effect} …`, "add", { effect, force }, (told) => stepped(told, () => add(effect, true)), mistake);
}

function recommend() {
  without_mistakes();
  const after = ({ step, advice, took_ms }) => `${step ? "Taken" : "Nothing to add"} (${seconds(took_ms)}). ${advice}`;
  return act("Climbing the ladder, and holding its steps against the error curves of all joints …", "recommend", {}, after);
}

function own(force = false) {
  without_mistakes();
  const form = by_id("own");
  const { name, unit, site, expressions } = Object.fromEntries(new FormData(form));
  return act("Fitting the model with your expression …", "own", { name, unit, site, expressions, force }, (told) => stepped(told, () => own(true)), at_field(form, "expressions"));
}

// The four numbers that fall, with those of the step before.
function now() {
  const { rungs } = bench.report.ladder;
  const [last, before] = [rungs.at(-1), rungs.at(-2)];
  const tile = (name, of, beside) => {
    const [value, from] = [of(last), before && of(before)];
    if (!Number.isFinite(value)) return null;
    const percents = Number.isFinite(from) && from > 0 ? 100 * (value / from - 1) : null;
    const moved = percents === null ? beside : Math.abs(percents) < 0.05 ? "unchanged by the last step" : `${signed(fixed(percents, 1))} % by the last step`;
    return element("div", {}, element("dt", {}, name), element("dd", {},
      element("div", { class: "value" }, Number.isFinite(from) ? element("span", { class: "from" }, `${millimetres(from)} → `) : null, `${millimetres(value)} mm`), element("div", { class: "beside" }, moved)));
  };
  const expected = (r) => r.workspace?.mean_mm;
  return [
    tile("Residual of the fit, rms", (r) => r.fit_rms_mm, `${bench.report.figures.samples} samples`),
    tile("Cross-validated, rms", (r) => r.cv_rms_mm, "blocks that were not fitted"),
    tile("Measured on other poses, rms", (r) => r.validation?.rms_mm, "rows kept for validation") ?? tile("Predicted over the workspace", expected, "mean; no rows are kept for validation"),
    tile("Floor: noise alone", (r) => r.noise_mm, bench.report.figures.noise_stated ? "as stated" : "as the best explanation leaves it"),
  ].filter(Boolean);
}

// The same over the steps.
function stairs() {
  const { rungs } = bench.report.ladder;
  if (rungs.length < 2) return [];
  const names = rungs.map((r, k) => (k ? `+ ${r.added_words}` : "to begin with"));
  const lines = [
    ["fit", (r) => r.fit_rms_mm, "residual", "circle"], ["cross-validated", (r) => r.cv_rms_mm, "other", "triangle"],
    ["measured on other poses", (r) => r.validation?.rms_mm, "measured", "rect"], ["predicted, mean", (r) => r.workspace?.mean_mm, "predicted", "diamond"], ["floor", (r) => r.noise_mm, "noise", "none"],
  ].filter(([, of]) => rungs.some((r) => Number.isFinite(of(r))));
  const label = "The error by step: " + lines.map(([name, of]) => `${name} ${rungs.map((r) => millimetres(of(r))).join(", ")} mm`).join("; ");
  return [element("figure", {}, chart(label, 210, (theme, width) => ({
    grid: { left: 62, right: 24, top: 34, bottom: 34, outerBoundsMode: "none" },
    legend: { top: 0, left: 56, itemWidth: 16, itemHeight: 9, textStyle: { color: theme.ink, fontSize: 12 }, selectedMode: false },
    tooltip: tooltip(theme, ({ seriesName, dataIndex, value }) => `${names[dataIndex]}\n${seriesName}: ${millimetres(value)} mm`),
    xAxis: { type: "category", data: names, axisTick: { show: false }, axisLine: { lineStyle: { color: theme.noise } },
      axisLabel: { color: theme.ink, fontSize: 11, interval: 0, hideOverlap: true, width: Math.max(40, (width - 90) / names.length - 8), overflow: "truncate" } },
    yAxis: axis(theme, "error, mm", 46, { min: 0, scale: false }),
    series: lines.map(([name, of, colour, symbol]) => ({
      name, type: "line", step: "middle", data: rungs.map((r) => of(r) ?? null), symbol, symbolSize: 8,
      lineStyle: { color: theme[colour], width: 2, type: name === "floor" ? "dashed" : "solid" }, itemStyle: { color: theme[colour] },
    })),
  })))];
}

function candidates() {
  const { diagnosis, meanings } = bench.report;
  return bench.live.candidates.slice(0, 8).map((effect) => {
    const found = diagnosis.findings.find((f) => f.in_model === effect);
    const said = found ? `${meanings[effect]?.what ?? ""}; probability ${unbroken(found.probability)}, explains ${unbroken(found.explains)}` : "the curve that this joint’s error follows, whatever its shape";
    const button = element("button", { type: "button", "aria-label": `Add ${effect}` }, "Add");
    button.addEventListener("click", () => add(effect));
    const row = element("li", { "data-effect": effect }, element("div", {}, element("code", {}, effect), element("div", { class: "quiet" }, said)), button);
    row.addEventListener("pointerenter", () => hover(effect));
    row.addEventListener("focusin", () => hover(effect));
    return row;
  });
}

// Draws a candidate over the residuals, when the pointer has come to rest on it.
function hover(effect) {
  clearTimeout(bench.hovering);
  bench.hovering = setTimeout(() => show_candidate(effect), 120);
}

async function show_candidate(effect) {
  const { turn, report } = bench;
  if (!report.telling || bench.busy || by_id("candidates").querySelector(".shown")?.dataset.effect === effect) return;
  try {
    let at = report.candidates.findIndex((c) => c.effect === effect);
    if (at < 0 || !report.candidates[at].telling) {
      const { candidate, telling } = await ask("candidate", { effect });
      if (turn !== bench.turn) return;
      at = report.candidates.findIndex((c) => c.effect === effect);
      if (at < 0) at = report.candidates.length;
      report.candidates[at] = { ...candidate, telling };
    }
    report.telling = { ...report.candidates[at].telling, candidate: at };
    mark(effect);
    render(report, ["telling", "residuals"]);
  } catch (error) {
    if (turn === bench.turn) say(error.message, true);
  }
}

function mark(effect) {
  for (const row of by_id("candidates").children) row.classList.toggle("shown", row.dataset.effect === effect);
}

// Lays out an answer at once; what is said of every sample follows.
async function show({ live, document: told }) {
  bench.turn += 1;
  const { turn } = bench;
  document.body.dataset.settled = "0";
  bench.live = live;
  bench.report = told;
  for (let i = drawn.length - 1; i >= 0; i -= 1) if (by_id("stairs").contains(drawn[i].host)) drawn.splice(i, 1)[0].chart?.dispose();
  by_id("opened").textContent = live.datasets.filter((d) => d.chosen).map((d) => d.name).join(", ");
  by_id("now").replaceChildren(...now());
  by_id("stairs").replaceChildren(...stairs());
  by_id("candidates").replaceChildren(...candidates());
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
  render(told);
  try {
    const views = await ask("views");
    if (turn !== bench.turn) return;
    Object.assign(told, views);
    mark(told.candidates[told.telling.candidate]?.effect);
    render(told, ["telling", "residuals"]);
  } catch (error) {
    if (turn === bench.turn) say(error.message, true);
  }
  if (turn === bench.turn) document.body.dataset.settled = "1";
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
by_id("recommend").addEventListener("click", recommend);
by_id("next").addEventListener("click", () => act("Looking for the measurements that would tell most …", "next", {}, proposed));
for (const what of ["save-model", "save-report"]) {
  by_id(what).addEventListener("click", () => act("Saving …", what, {}, ({ saved }) => `Saved ${saved}.`));
}
by_id("other").addEventListener("submit", (event) => {
  event.preventDefault();
  const effect = by_id("effect").value.trim();
  add(effect, false, at_field(event.target, "effect"));
});
by_id("own").addEventListener("submit", (event) => { event.preventDefault(); own(); });
by_id("choice").addEventListener("submit", (event) => {
  event.preventDefault();
  without_mistakes();
  const datasets = new FormData(event.target).getAll("dataset");
  act("Fitting …", "choose", { datasets }, ({ took_ms }) => `Begun anew in ${seconds(took_ms)}.`, (error) => { by_id("datasets-error").textContent = error.message; });
});

set_busy(true);
ask("document").then(
  (told) => { show(told); set_busy(false); say(`Fitted. ${told.live.effects.join(" + ")}`); },
  (error) => say(error.message, true),
);
