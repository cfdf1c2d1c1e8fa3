// @ts-check
// What the user does.

import { byId, element, named, sentence } from "calibench-report/elements.js";
import { millimetres } from "calibench-report/text.js";
import { show } from "./answers.js";
import { effectsListed, switchOf } from "./candidates.js";
import { ask, bench, given, say, sayError, seconds, setBusy } from "./state.js";

/**
 * Does something once everything before it is done.
 * @param {string} before says what is done
 * @param {string} path
 * @param {object} body
 * @param {(told: Answer) => string} after says what was done
 * @param {(error: Mistake) => void} mistake stands at its field
 */
export function act(before, path, body, after, mistake = sayError) {
  // What is asked of these data is not done to others.
  if (document.body.dataset.opening) {
    say("Other data are being opened; cancel that, or wait.", true);
    return bench.queue;
  }
  const backend = given(bench.backend);
  setBusy(1);
  bench.queue = bench.queue.then(async () => {
    say(before);
    const began = performance.now();
    const still = backend.follow(say);
    byId("cancel").hidden = !backend.canCancel(path);
    const done = () => {
      still();
      byId("cancel").hidden = true;
    };
    try {
      const told = await ask(path, body);
      done();
      if (told.live) await show(told);
      if (told.saved) backend.saved(told);
      setBusy(-1);
      say(after({ ...told, tookMs: performance.now() - began }));
    } catch (error) {
      done();
      setBusy(-1);
      say("Not done.", true);
      if (bench.report) effectsListed();
      mistake(/** @type {Mistake} */ (error));
    }
  });
  return bench.queue;
}

/**
 * Shows a mistake at its field.
 * @param {HTMLFormElement} form
 * @param {string} fallback
 * @returns {(error: Mistake) => void}
 */
export function atField(form, fallback) {
  return (error) => {
    const field = form.elements.namedItem(error.field ?? fallback) ?? form.elements.namedItem(fallback);
    sayError(error);
    if (!(field instanceof HTMLElement)) return;
    field.setAttribute("aria-invalid", "true");
    byId(`${field.id}-error`).replaceChildren(...sentence(error.message));
    field.focus();
  };
}

export function withoutMistakes() {
  for (const field of document.querySelectorAll("#bench [aria-invalid]")) field.removeAttribute("aria-invalid");
  for (const text of document.querySelectorAll("#bench .error")) text.textContent = "";
  byId("refused").hidden = true;
}

/** @param {string[]} words */
const listed = (words) => (words.length > 3 ? `${words.length} effects` : words.join(" and "));

/**
 * A switch that was turned, or refused: then it can be turned anyway.
 * @param {Answer} told
 * @param {() => void} again
 */
function turned(told, again) {
  const { accepted, added, removed, objections, before, after, tookMs } = told;
  if (added.length + removed.length === 0) return "No change.";
  const both = [added.length && `on ${listed(added)}`, removed.length && `off ${listed(removed)}`];
  const said = both.filter(Boolean).join(" and ");
  if (accepted) {
    const name = given(bench.report).names.cross_validated;
    const [from, to] = [before.cross_validated_mm, after.cross_validated_mm].map(millimetres);
    return `Switched ${said} in ${seconds(tookMs)}: ${name} ${from} to ${to} mm.`;
  }
  const notice = byId("refused");
  const force = element("button", { type: "button" }, "Switch on anyway");
  force.addEventListener("click", again);
  notice.replaceChildren(element("p", {}, `Against switching ${said}: ${objections.join("; ")}.`), force);
  notice.hidden = false;
  notice.focus();
  return `Not switched ${said}: there is evidence against it, and the model is as it was.`;
}

/**
 * @param {string} effect
 * @param {boolean} on
 * @param {boolean} force against the evidence
 * @param {(error: Mistake) => void} [mistake]
 * @returns {Promise<void>}
 */
export function turn(effect, on, force = false, mistake = undefined) {
  withoutMistakes();
  const button = switchOf(effect);
  button?.setAttribute("aria-busy", "true");
  // The notice with the evidence against it is gone, and the focus with it.
  if (force) button?.focus();
  const words = bench.report ? named(bench.report, effect) : effect;
  const before = on ? `Fitting the model with ${words} …` : `Fitting the model without ${words} …`;
  /** @param {Answer} told */
  const after = (told) => turned(told, () => turn(effect, on, true));
  return act(before, "switch", { effect, on, force }, after, mistake);
}

export function recommend() {
  withoutMistakes();
  /** @param {Answer} told */
  const after = ({ added, advice, tookMs }) =>
    `${added.length ? "Applied" : "Nothing to add"} (${seconds(tookMs)}). ${advice}`;
  const before = "Running the ladder, and comparing its steps with a field of joint errors …";
  return act(before, "recommend", {}, after);
}

/** @returns {Promise<void>} */
export function own(force = false) {
  withoutMistakes();
  const form = byId("own");
  const { name, unit, site, expressions } = Object.fromEntries(new FormData(form));
  const body = { name, unit, site, expressions, force };
  /** @param {Answer} told */
  const after = (told) => turned(told, () => own(true));
  return act("Fitting the model with your expression …", "own", body, after, atField(form, "expressions"));
}
