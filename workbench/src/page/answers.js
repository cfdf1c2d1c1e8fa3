// @ts-check
// What the program answers, laid out.

import { draw } from "calibench-report/drawing.js";
import { forget } from "calibench-report/drawn.js";
import { byId, element, present } from "calibench-report/elements.js";
import { render } from "calibench-report/render.js";
import { effectsListed, lookAtCandidate, mark } from "./candidates.js";
import { now, stairs } from "./figures.js";
import { ask, bench, given, sayError, setBusy } from "./state.js";

// The sections that are of the model; the others are of the data.
const OF_THE_MODEL = [
  "verdict",
  "told",
  "telling",
  "ladder",
  "by_pose",
  "accuracy",
  "workspace",
  "ranking",
  "residuals",
  "parameters",
];

/** @param {boolean} is */
function pending(is) {
  for (const id of OF_THE_MODEL) {
    byId(id).classList.toggle("pending", is);
    byId(id).toggleAttribute("aria-busy", is);
    if (is) byId(id).setAttribute("aria-busy", "true");
  }
}

// The part of the page above the report.
function layOutBench() {
  const { datasets, sites } = given(bench.live);
  forget(byId("stairs"));
  const chosen = datasets.filter((d) => d.chosen);
  byId("opened").textContent = chosen.map((d) => d.name).join(", ");
  byId("now").replaceChildren(...present(now()));
  byId("stairs").replaceChildren(...present(stairs()));
  effectsListed();
  byId("proposal").hidden = true;
  byId("bench").hidden = false;
  byId("choice").hidden = datasets.length < 2;
  const boxes = datasets.map((d, k) => {
    const box = element("input", { type: "checkbox", name: "dataset", value: d.name, id: `dataset-${k}` });
    box.checked = d.chosen;
    return element("label", {}, box, `${d.name} (${d.samples} samples)`);
  });
  byId("datasets").replaceChildren(...boxes);
  byId("sites").replaceChildren(...sites.map((site) => element("option", { value: site })));
  draw(byId("stairs"));
  setBusy(0);
}

// What is on the page belongs to a model that is no longer the one that was fitted.
export function unsettle() {
  bench.turn += 1;
  document.body.dataset.settled = "0";
  document.body.dataset.ahead = "0";
  return bench.turn;
}

/**
 * Lays out the answer to an action: the figures of the fit at once, the rest as it comes. What is judged already comes
 * at once.
 * @param {Answer} told
 */
export async function show(told) {
  bench.live = told.live;
  if (!told.moved) {
    effectsListed();
    return;
  }
  const then = unsettle();
  if (told.live.candidates) {
    const whole = await ask("document");
    if (then === bench.turn) {
      layOut(whole);
      see(then);
    }
    return;
  }
  const { before, after, added, removed } = told;
  bench.first = { before, after: { ...after, added, removed }, taken: added.length + removed.length > 0 };
  layOutBench();
  pending(true);
  follow(then);
}

/** @param {Answer} told */
export function layOut({ live, document: told }) {
  bench.first = null;
  bench.live = live;
  bench.report = told;
  layOutBench();
  render(told);
  pending(false);
}

/** @param {number} then */
async function follow(then) {
  try {
    const told = await ask("document");
    if (then !== bench.turn) return;
    layOut(told);
    await see(then);
  } catch (error) {
    if (then === bench.turn) sayError(error);
  }
}

/**
 * What is said of every sample, then the candidates that are listed, so that looking at one is a look-up.
 * @param {number} then
 */
export async function see(then) {
  const report = given(bench.report);
  try {
    const views = await ask("views");
    if (then !== bench.turn) return;
    Object.assign(report, views);
    const shown = report.telling?.candidate;
    mark(typeof shown === "number" ? report.candidates[shown].effect : undefined);
    // The maps of the workspace share their colours with those of the samples.
    render(report, ["workspace", "telling", "residuals"]);
  } catch (error) {
    if (then === bench.turn) sayError(error);
  }
  if (then !== bench.turn) return;
  document.body.dataset.settled = "1";
  for (const effect of bench.candidates) {
    if (then !== bench.turn) return;
    // One that cannot be fitted says so when it is looked at.
    await lookAtCandidate(effect).catch(() => false);
  }
  if (then === bench.turn) document.body.dataset.ahead = "1";
}
