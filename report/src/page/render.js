// @ts-check
// The report of calibench: one document, laid out. Called again with another document, it lays out that.

import { accuracy } from "./accuracy.js";
import { against } from "./against.js";
import { ranking } from "./candidates.js";
import { centring } from "./centring.js";
import { contents } from "./contents.js";
import { draw, drawSoon } from "./drawing.js";
import { forget } from "./drawn.js";
import { byId, present } from "./elements.js";
import { ladder } from "./falling.js";
import { parameters } from "./parameters.js";
import { byPose } from "./poses.js";
import { cell, provenance } from "./provenance.js";
import { residuals } from "./residuals.js";
import { space } from "./space.js";
import { telling } from "./telling.js";
import { told } from "./told.js";
import { verdict } from "./verdict.js";
import { workspace } from "./workspace.js";

/**
 * What fills each section, by its id; null hides it.
 * @type {Record<string, (report: Report) => Child[] | null>}
 */
const SECTIONS = {
  told,
  telling,
  ladder,
  against,
  by_pose: byPose,
  accuracy,
  workspace,
  space,
  ranking,
  residuals,
  parameters,
  cell,
  centring,
  provenance,
};

/**
 * The samples in space that are drawn: what does not change keeps its view.
 * @type {Space | null}
 */
let drawnInSpace = null;

/**
 * @param {Report} report
 * @param {string[]} ids names the sections that have changed
 */
export function render(report, ids = Object.keys(SECTIONS)) {
  const inSpace = report.residuals?.space ?? null;
  if (ids.includes("residuals") && !ids.includes("space") && inSpace !== drawnInSpace) ids = [...ids, "space"];
  if (ids.includes("space")) drawnInSpace = inSpace;
  delete document.body.dataset.ready;
  const parts = ids.map((id) => byId(id));
  forget(...parts);
  document.title = `${report.title}: ${report.verdict.headline}`;
  byId("verdict").replaceChildren(...present(verdict(report)));
  for (const [k, id] of ids.entries()) {
    const filled = SECTIONS[id](report);
    parts[k].replaceChildren(...present([parts[k].querySelector("h2"), filled]));
    parts[k].hidden = filled === null;
  }
  contents();
  for (const part of parts) {
    for (const unfolded of part.querySelectorAll("details")) {
      unfolded.addEventListener("toggle", () => unfolded.open && draw(unfolded));
    }
  }
  drawSoon(parts, () => {
    document.body.dataset.ready = "1";
  });
}
