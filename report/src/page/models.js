// @ts-check
// The models of the page, and what each of them leaves.

import { inWords } from "./elements.js";

/**
 * Two standard errors about a mean over poses.
 * @param {Errors} errors
 * @returns {[low: number, high: number]}
 */
function twoErrors(errors) {
  const half = (2 * errors.std_mm) / Math.sqrt(errors.samples);
  return [Math.max(0, errors.mean_mm - half), errors.mean_mm + half];
}

/**
 * @param {Rung} r
 * @param {string} name
 * @returns {ModelRow}
 */
const row = (r, name) => ({
  name,
  fit: r.residual_mm,
  cv: r.cross_validated_mm,
  expected: r.workspace?.mean_mm,
  band: r.workspace?.mean_band_mm,
  measured: r.validation?.mean_mm,
  reach: r.validation && twoErrors(r.validation),
  largest: r.validation?.max_mm,
  noise: r.noise_left_mm,
  chi2: r.chi2_per_dof,
});

/**
 * The models, from the nominal one to the last.
 * @param {Report} report
 */
export function models(report) {
  const { ladder: it, drawn: asDrawn, against } = report;
  const first = against ? `A: ${against.names[0]}` : "calibrated";
  /** @param {Rung} r */
  const changed = (r) =>
    r.removed?.length ? `− ${inWords(report, r.removed)}` : `+ ${inWords(report, r.added ?? [])}`;
  const rows = it.rungs.map((r, k) => row(r, k ? changed(r) : first));
  if (against) rows.push(row(against.rung, `B: ${against.names[1]}`));
  if (it.other) {
    const count = it.other.added?.length;
    rows.push(row(it.other, `+ ${it.recommended?.kind.replaceAll("_", " ")} (${count})`));
  }
  const { errors } = asDrawn;
  if (!errors) return rows;
  const fitted = { name: asDrawn.name, nominal: true, fit: errors.rms_mm };
  const { mean_mm: measured, max_mm: largest } = errors;
  const measuredRow = { name: asDrawn.name, nominal: true, measured, reach: twoErrors(errors), largest };
  return [asDrawn.on === "validation" ? measuredRow : fitted, ...rows];
}
