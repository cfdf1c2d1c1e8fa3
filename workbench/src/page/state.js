// @ts-check
// The workbench: what the user does is sent to the program, and what it answers is laid out. Nothing is computed here.

import { byId, sentence } from "calibench-report/elements.js";
import { percent } from "calibench-report/text.js";

/**
 * The figures of the fit before the last switch and after it.
 * @typedef {{ before: Rung, after: Rung, taken: boolean }} First
 */

/**
 * What is shown, and what is being done.
 * @type {{
 *   backend: Backend | null,
 *   report: Report | null,
 *   live: Live | null,
 *   candidates: string[],
 *   turn: number,
 *   queue: Promise<void>,
 *   queued: number,
 *   lookedAt: string | null,
 *   hovering: number | undefined,
 *   later: number | undefined,
 *   first: First | null,
 * }}
 */
export const bench = {
  backend: null,
  report: null,
  live: null,
  candidates: [],
  // Counts what was laid out: an answer that comes after the next one was laid out is of no use.
  turn: 0,
  // Actions are sent one after the other.
  queue: Promise.resolve(),
  queued: 0,
  lookedAt: null,
  hovering: undefined,
  later: undefined,
  // While the rest is being computed.
  first: null,
};

/**
 * What there is once the workbench has begun, or a document is laid out.
 * @template T
 * @param {T | null} part
 * @returns {T}
 */
export function given(part) {
  if (part === null) throw new Error("nothing is open yet");
  return part;
}

/**
 * @param {string} what
 * @param {object} [body]
 */
export async function ask(what, body) {
  const told = await given(bench.backend).ask(what, body);
  // Asked too late: whoever switched asks for the new model.
  if (told.changed) throw new Error("The model was changed in another page; reload this one.");
  return told;
}

/** @param {string} text */
export function say(text, failed = false) {
  const status = byId("status");
  status.classList.toggle("failed", failed);
  status.replaceChildren(...sentence(text));
}

/** @param {unknown} error */
export const sayError = (error) => say(/** @type {Error} */ (error).message, true);

/** @param {number} part */
export const unbroken = (part) => percent(part).replaceAll(" ", "\u00a0");

/** @param {number} ms */
export const seconds = (ms) => (ms < 1000 ? `${Math.round(ms)} ms` : `${(ms / 1000).toFixed(1)} s`);

/** @param {number} change of the number of things that are waited for */
export function setBusy(change) {
  bench.queued += change;
  document.body.setAttribute("aria-busy", String(bench.queued > 0));
  byId("undo").disabled = !bench.live?.can_undo;
  byId("redo").disabled = !bench.live?.can_redo;
}
