// @ts-check
// The workbench as the page begins: what its buttons and forms do.

import { byId } from "calibench-report/elements.js";
import { redrawOnChange } from "calibench-report/redraw.js";
import { act, atField, own, recommend, turn, withoutMistakes } from "./actions.js";
import { layOut, see, unsettle } from "./answers.js";
import { proposed } from "./proposal.js";
import { ask, bench, say, sayError, seconds, setBusy } from "./state.js";

/** @type {("save-model" | "save-calibration" | "save-urdf" | "save-report")[]} */
const SAVES = ["save-model", "save-calibration", "save-urdf", "save-report"];

/** @param {Backend} backend */
export function startBench(backend) {
  bench.backend = backend;
  redrawOnChange();
  document.body.classList.add("workbench");
  // The picture stands beside the candidates that it shows.
  byId("picture").append(byId("telling"));
  byId("verdict").after(byId("bench"));
  wire(backend);
  backend.begin(openBench);
}

/** @param {Backend} backend */
function wire(backend) {
  byId("undo").addEventListener("click", () => {
    withoutMistakes();
    act("Undoing the last step …", "undo", {}, ({ tookMs }) => `Undone in ${seconds(tookMs)}.`);
  });
  byId("redo").addEventListener("click", () => {
    withoutMistakes();
    act("Redoing the step …", "redo", {}, ({ tookMs }) => `Redone in ${seconds(tookMs)}.`);
  });
  byId("recommend").addEventListener("click", recommend);
  byId("next").addEventListener("click", () =>
    act("Looking for the most informative measurements …", "next", {}, proposed),
  );
  byId("cancel").addEventListener("click", () => backend.cancel());
  for (const what of SAVES) {
    byId(what).addEventListener("click", () => act("Saving …", what, {}, ({ saved }) => `Saved ${saved}.`));
  }
  byId("candidates").addEventListener("click", ({ target }) => {
    const button = target instanceof Element ? target.closest(".switch") : null;
    const effect = button?.closest("li")?.dataset.effect;
    if (button && effect) turn(effect, button.getAttribute("aria-pressed") !== "true");
  });
  byId("other").addEventListener("submit", (event) => {
    event.preventDefault();
    turn(byId("effect").value.trim(), true, false, atField(byId("other"), "effect"));
  });
  byId("own").addEventListener("submit", (event) => {
    event.preventDefault();
    own();
  });
  byId("choice").addEventListener("submit", (event) => {
    event.preventDefault();
    withoutMistakes();
    const datasets = new FormData(byId("choice")).getAll("dataset");
    /** @param {Answer} told */
    const after = ({ tookMs }) => `Reloaded in ${seconds(tookMs)}.`;
    act("Fitting …", "choose", { datasets }, after, (error) => {
      byId("datasets-error").textContent = error.message;
    });
  });
}

// Lays out what is open now, and forgets what was open before.
async function openBench() {
  setBusy(1);
  const then = unsettle();
  Object.assign(bench, { report: null, live: null, first: null, candidates: [], lookedAt: null });
  withoutMistakes();
  try {
    const told = await ask("document");
    if (then !== bench.turn) return;
    // The actions that are always possible once something is open.
    byId("recommend").disabled = false;
    byId("next").disabled = false;
    for (const what of SAVES) byId(what).disabled = false;
    layOut(told);
    const on = told.live.switches.filter((s) => s.on);
    setBusy(-1);
    say(`Fitted. ${on.map((s) => s.words).join(" + ")}`);
    see(then);
  } catch (error) {
    setBusy(-1);
    sayError(error);
  }
}
