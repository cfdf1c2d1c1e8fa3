// @ts-check
// Two models of the same data: the one of the page, A, and another, B.

import { element, list, quiet, sentence, table, unfold, worded } from "./elements.js";
import { digits, fixed, millimetres, printed, signed, thousandths } from "./text.js";
import { bothViews, pairedChart } from "./two_models.js";

/** @typedef {[low: number, high: number]} Band */

/**
 * @typedef {object} Row
 * @property {string} name
 * @property {boolean} [isMean] over poses
 * @property {number} a
 * @property {number} b
 * @property {Band} [bandA]
 * @property {Band} [bandB]
 * @property {number} [reach] of the difference
 * @property {string} beyond
 * @property {"emphasis"} [kind]
 */

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function against(report) {
  const { against: it, names } = report;
  if (!it) return null;
  const flagged = it.parameters.filter((p) => p.warning);
  const warnings = flagged.map((p) => element("p", {}, worded(report, p.warning ?? "")));
  const heading = element("b", {}, `In ${it.names[1]}, outside the physical range:`);
  return [
    element("p", { class: it.paired?.better ? "means" : "warning" }, sentence(it.sentence)),
    effects(it),
    figures(report, it),
    quiet(
      "In brackets the 10 to 90 % band of what is expected, and two standard errors of a measured mean. " +
        `The ${names.residual} favours neither: a model with more parameters always leaves less.`,
    ),
    warnings.length > 0 && element("div", { class: "warning" }, heading, warnings),
    it.paired && pairedChart(it, it.paired),
    bothViews(report, it),
    unfold("The parameters of both models", parametersOfTwo(report, it), true),
  ];
}

/**
 * The effects that only one of them holds.
 * @param {Against} it
 */
function effects(it) {
  /** @param {string[]} ids */
  const words = (ids) => ids.map((id, k) => [k ? "; " : "", it.in_words[id] ?? id, " ", element("code", {}, id)]);
  const [a, b] = it.effects;
  const only = [a.filter((id) => !b.includes(id)), b.filter((id) => !a.includes(id))];
  const lines = only.flatMap((ids, k) => (ids.length ? [[`only ${it.names[k]} holds `, words(ids)]] : []));
  return lines.length ? list(lines) : element("p", {}, "Both models hold the same effects.");
}

/**
 * @param {Report} report
 * @param {Against} it
 */
function figures(report, it) {
  const [a, b] = it.names;
  /** @type {(x: number, band: Band | undefined, row: Row) => string} */
  const shown = (x, band, row) => {
    if (!row.isMean) return millimetres(x);
    return `${thousandths(x)}${band ? ` (${thousandths(band[0])} to ${thousandths(band[1])})` : ""}`;
  };
  /** @param {Row} r */
  const difference = (r) => signed(fixed(r.b - r.a, 4)) + (r.reach ? ` ± ${fixed(r.reach, 4)}` : "");
  /** @type {Column<Row>[]} */
  const columns = [
    ["figure", (r) => r.name, "words"],
    [`A: ${a}`, (r) => shown(r.a, r.bandA, r)],
    [`B: ${b}`, (r) => shown(r.b, r.bandB, r)],
    ["difference", difference],
    ["beyond its error", (r) => r.beyond, "words"],
  ];
  const rows = figuresOfTwo(report, it);
  return table("Every headline figure of both, mm; B minus A", columns, rows, (r) => r.kind ?? null);
}

/**
 * A row for every figure that both have.
 * @param {Report} report
 * @param {Against} it
 */
function figuresOfTwo({ figures: ofA, ladder, names }, it) {
  const { paired, figures: ofB, rung: rungB } = it;
  const [rungA] = ladder.rungs;
  /** @type {Row[]} */
  const rows = [];
  /** @type {(name: string, a: number | null | undefined, b: number | null | undefined, more?: Partial<Row>) => void} */
  const add = (name, a, b, more = {}) => {
    if (typeof a === "number" && typeof b === "number") rows.push({ name, a, b, beyond: "–", ...more });
  };
  if (ofA.validation && ofB.validation) {
    const [a, b] = [ofA.validation, ofB.validation];
    /** @type {(mean: number, k: number) => Band | undefined} */
    const about = (mean, k) =>
      paired ? [Math.max(0, mean - paired.mean_errors_mm[k]), mean + paired.mean_errors_mm[k]] : undefined;
    const better = paired?.better ? `yes: ${paired.better} is better` : "no: these poses do not tell";
    add(`${names.not_fitted}, mean`, a.mean_mm, b.mean_mm, {
      isMean: true,
      bandA: about(a.mean_mm, 0),
      bandB: about(b.mean_mm, 1),
      reach: paired?.two_errors_mm,
      beyond: paired ? better : "",
      kind: "emphasis",
    });
    add(`${names.not_fitted}, max`, a.max_mm, b.max_mm);
  }
  if (ofA.expected && ofB.expected) {
    const [a, b] = [ofA.expected, ofB.expected];
    const [bandA, bandB] = [a.mean_band_mm, b.mean_band_mm];
    const apart = bandA[0] > bandB[1] || bandB[0] > bandA[1];
    const beyond = apart ? "the bands are apart" : "no: the bands overlap";
    add(`${names.workspace}, mean`, a.mean_mm, b.mean_mm, { isMean: true, bandA, bandB, beyond });
  }
  add(`${names.cross_validated}, rms`, rungA.cross_validated_mm, rungB.cross_validated_mm);
  add(`${names.residual}, rms`, ofA.residual_mm, ofB.residual_mm, { beyond: "favours neither" });
  add(names.noise_left, ofA.noise_left_mm, ofB.noise_left_mm, { beyond: "" });
  add(names.unexplained, ofA.unexplained_mm, ofB.unexplained_mm, { beyond: "" });
  return rows;
}

/**
 * @param {Report} report
 * @param {Against} it
 */
function parametersOfTwo(report, it) {
  /** @param {Parameter[]} list */
  const byName = (list) => new Map(list.map((p) => [p.name, p]));
  const [ofA, ofB] = [byName(report.calibration.parameters), byName(it.parameters)];
  const rows = [...new Set([...ofA.keys(), ...ofB.keys()])].map((name) => {
    const [a, b] = [ofA.get(name), ofB.get(name)];
    return { name, a, b, unit: (a ?? b)?.unit ?? "" };
  });
  /** @param {Parameter | undefined} p */
  const value = (p) => (p ? `${fixed(p.value, 3)} ± ${digits(p.sigma, 2)}` : "–");
  /** @type {Column<typeof rows[0]>[]} */
  const columns = [
    ["parameter", (r) => r.name, "words"],
    [`A: ${it.names[0]}`, (r) => value(r.a)],
    [`B: ${it.names[1]}`, (r) => value(r.b)],
    ["difference", (r) => (r.a && r.b ? signed(fixed(r.b.value - r.a.value, 3)) : "–")],
    ["unit", (r) => printed(r.unit), "words"],
  ];
  return table("Identified values, one sigma", columns, rows);
}
