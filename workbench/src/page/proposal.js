// @ts-check
// The next experiment.

import { byId, element, list, present, quiet, sentence, table, unfold } from "calibench-report/elements.js";
import { fixed, millimetres, percent } from "calibench-report/text.js";
import { act } from "./actions.js";
import { seconds } from "./state.js";

// Writes the poses that are proposed.
function savesPlan() {
  const button = element("button", { type: "button", id: "save-plan" }, "Save plan.toml");
  button.addEventListener("click", () => act("Saving …", "save-plan", {}, ({ saved }) => `Saved: ${saved}.`));
  return button;
}

/** @typedef {{ name: string, step: Step }} Row */

/** @type {Column<Row>[]} */
const COLUMNS = [
  ["what to measure", (r) => r.name, "words"],
  ["how many", ({ step }) => String(step.measurements)],
  ["minutes", ({ step }) => fixed(step.minutes, 0)],
  ["the truth gets", ({ step: { probability_of_truth: p } }) => (p === null ? "–" : percent(p))],
  ["error then, mm", ({ step }) => millimetres(step.workspace_error_mm)],
];

/**
 * What `plan next` proposes.
 * @param {Answer} told
 */
export function proposed({ next, tookMs }) {
  const { best } = next;
  const rows = next.actions.flatMap((a) => a.steps.map((step) => ({ name: a.action, step })));
  const not = next.not_offered.map((n) => `${n.action}: ${n.because}`);
  const unknown = "Nothing but robot and balls is known to be in the cell: inspect every pose before it is driven.";
  const content = [
    element("h3", {}, "The next experiment"),
    list(next.sentences.map(sentence)),
    rows.length > 0 && unfold("What each would tell", table("Actions", COLUMNS, rows)),
    not.length > 0 && unfold("Not offered", list(not)),
    !next.cell_known && quiet(unknown),
    best && savesPlan(),
  ];
  byId("proposal").replaceChildren(...present(content));
  byId("proposal").hidden = false;
  byId("proposal").focus();
  const said = best ? `Best: ${best.measurements} ${best.action}` : "No measurement on offer would help";
  return `${said} (${seconds(tookMs)}).`;
}
