// @ts-check
// Effects as switches, and candidates as pictures.

import { byId, element, named, sentence } from "calibench-report/elements.js";
import { render } from "calibench-report/render.js";
import { ask, bench, given, sayError, unbroken } from "./state.js";

// Number of candidates that are listed.
const LISTED = 8;

const rows = () => /** @type {HTMLElement[]} */ ([...byId("candidates").children]);

const shownRow = () => rows().find((row) => row.classList.contains("shown"));

/**
 * The switch of an effect that is listed.
 * @param {string} effect
 * @returns {HTMLButtonElement | null | undefined}
 */
export const switchOf = (effect) =>
  rows()
    .find((row) => row.dataset.effect === effect)
    ?.querySelector(".switch");

// Every effect as a switch: those of the model, then the candidates, then what was switched off.
export function effectsListed() {
  const [report, live] = [given(bench.report), given(bench.live)];
  // A curve has the id by which it was asked for; in a model it has a name.
  /** @type {Listed[]} */
  const switches = live.switches.map((s) => ({ ...s, effect: s.asked }));
  bench.candidates = (live.candidates ?? bench.candidates).slice(0, LISTED);
  const on = switches.filter((s) => s.on);
  const fresh = bench.candidates.filter((effect) => !on.some((s) => s.effect === effect));
  const offered = fresh.map((effect) => ({
    effect,
    words: named(report, effect),
    on: false,
    offered: true,
    flags: [],
  }));
  const off = switches.filter((s) => !s.on && !fresh.includes(s.effect));
  const focused = rows().find((row) => row.contains(document.activeElement))?.dataset.effect;
  const shown = shownRow()?.dataset.effect;
  byId("candidates").replaceChildren(...[...on, ...offered, ...off].map((s) => row(report, s)));
  if (shown) mark(shown);
  if (focused) switchOf(focused)?.focus();
}

/**
 * @param {Report} report
 * @param {Listed} of
 */
function said({ diagnosis, meanings }, { effect, on, initial, offered }) {
  const found = offered && diagnosis.findings.find((f) => f.in_model === effect);
  if (found) {
    const [probability, explains] = [found.probability, found.explains].map(unbroken);
    return `probability ${probability}, explains ${explains}; ${meanings[effect]?.what ?? ""}`;
  }
  if (offered && effect.startsWith("curve:")) return "the curve that this joint’s error follows, whatever its shape";
  if (!on) return "switched off";
  return initial ? "of the initial model" : "switched on";
}

/**
 * @param {Report} report
 * @param {Listed} of
 */
function row(report, of) {
  const { effect, words, on, offered, flags } = of;
  const pressed = { type: "button", class: "switch", "aria-pressed": String(on) };
  const button = element("button", pressed, element("i", { "aria-hidden": "true" }), words);
  const waits = bench.first && offered;
  const beside = element(
    "div",
    { class: `beside${waits ? " pending" : ""}` },
    words === effect ? null : element("code", {}, effect),
    " ",
    element("span", { class: "quiet" }, said(report, of)),
  );
  const warnings = flags.map((text) => element("p", { class: "warning" }, sentence(text)));
  const made = element("li", { "data-effect": effect, class: on ? "model" : null }, button, beside, warnings);
  if (offered) {
    made.addEventListener("pointerenter", () => hover(effect));
    made.addEventListener("focusin", () => hover(effect));
  }
  return made;
}

/**
 * Draws a candidate over the residuals, when the pointer has come to rest on it.
 * @param {string} effect
 */
function hover(effect) {
  clearTimeout(bench.hovering);
  bench.hovering = setTimeout(() => showCandidate(effect), 40);
}

/**
 * Asks for a candidate, unless it is known; true if the page is still the same.
 * @param {string} effect
 */
export async function lookAtCandidate(effect) {
  const then = bench.turn;
  const { candidates } = given(bench.report);
  const at = () => candidates.findIndex((c) => c.effect === effect);
  if (candidates[at()]?.telling) return true;
  const { candidate, telling } = await ask("candidate", { effect });
  if (then !== bench.turn) return false;
  candidates[at() < 0 ? candidates.length : at()] = { ...candidate, telling };
  return true;
}

/** @param {string} effect */
async function showCandidate(effect) {
  const { turn: then, report } = bench;
  if (bench.first || !report?.telling || shownRow()?.dataset.effect === effect) return;
  bench.lookedAt = effect;
  try {
    if (!(await lookAtCandidate(effect)) || bench.lookedAt !== effect) return;
    const at = report.candidates.findIndex((c) => c.effect === effect);
    const { telling } = report.candidates[at];
    if (!telling) return;
    report.telling = { ...telling, candidate: at };
    mark(effect);
    render(report, ["telling"]);
    // The picture first, the views of all joints when there is time.
    clearTimeout(bench.later);
    bench.later = setTimeout(() => then === bench.turn && render(report, ["residuals"]), 150);
  } catch (error) {
    if (then === bench.turn) sayError(error);
  }
}

/**
 * Marks the candidate that is drawn.
 * @param {string | undefined} effect
 */
export function mark(effect) {
  for (const one of rows()) one.classList.toggle("shown", one.dataset.effect === effect);
}
