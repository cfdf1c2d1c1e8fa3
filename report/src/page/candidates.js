// @ts-check
// What may be missing: the candidates of the diagnosis.

import { contributionChart } from "./contributions.js";
import { element, named, quiet, share, table, unfold, withId, worded } from "./elements.js";
import { heatMap } from "./heat_map.js";
import { capital, digits, percent, printed } from "./text.js";

// Rows that are read at once; the rest is folded away.
const FIRST_CANDIDATES = 6;

const LEGEND =
  "Explains: share of the residual sum of squares that it absorbs. Visible: share of the effect that shows in " +
  "these residuals at all; the rest hides in wrong parameters and comes out elsewhere. Gain: how much the residual " +
  "of blocks that were not fitted falls (cross-validation).";

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function ranking(report) {
  const { diagnosis: d } = report;
  /** @type {Column<Finding>[]} */
  const columns = [
    ["effect", (f) => [name(report, f), doubts(report, f)], "words wide"],
    ["probability", (f) => share(f.probability)],
    ["explains", (f) => share(f.explains)],
    ["visible", (f) => share(f.visible)],
    ["gain", (f) => percent(f.cv_gain)],
    ["as it would be fitted", (f) => size(f, 2), "words"],
  ];
  /** @param {Finding} f */
  const rivals = (f) => f.rivals.map((id) => named(report, id)).join("; ") || "–";
  /** @type {Column<Finding>[]} */
  const more = [
    ["effect", (f) => name(report, f), "words"],
    ["what it is", (f) => report.meanings[f.in_model]?.what, "words"],
    ["what to do", (f) => toDo(report, f), "words"],
    ["in these data the same as", rivals, "words"],
    ["as it would be fitted", (f) => size(f, 3), "words"],
  ];
  /** @param {Finding} f */
  const credible = (f) => (d.set95.includes(f.effect) ? "emphasis" : null);
  const [first, rest] = [d.findings.slice(0, FIRST_CANDIDATES), d.findings.slice(FIRST_CANDIDATES)];
  const contributions = d.contributions.slice(0, 10);
  const nothing = percent(d.nothing_probability);
  const set = d.set95.flatMap((id, k) => [k ? "; " : "", ...withId(report, id)]);
  return [
    element(
      "p",
      {},
      `Probability that nothing is missing beyond the usual model discrepancy: ${nothing}.`,
      set.length > 0 && [" In the 95 % credible set: ", set, "."],
    ),
    first.length > 0 && table("Effects of the catalogue, most credible first", columns, first, credible),
    quiet(LEGEND),
    rest.length > 0 &&
      unfold(`${rest.length} less credible candidates`, table("Less credible candidates", columns, rest, credible)),
    d.findings.length > 0 &&
      unfold(
        "What each of them is, where to look, and what imitates it",
        table("The candidates", more, d.findings, credible),
        true,
      ),
    contributions.length > 0 && [
      element("h3", {}, "What contributes most when everything is fitted at once"),
      element("figure", {}, contributionChart(report, contributions)),
    ],
    heatMap(report),
  ];
}

/**
 * @param {Report} report
 * @param {Finding} f
 */
const name = (report, f) => [capital(named(report, f.in_model)), " ", element("code", {}, f.in_model)];

/**
 * Parameters as they would be fitted, `most` of them.
 * @param {Finding} f
 * @param {number} most
 */
function size(f, most) {
  const shown = f.parameters.slice(0, most);
  const alike = shown.every((p) => p.unit === shown[0].unit);
  /** @param {Estimate} p */
  const one = (p) => `${p.name} ${digits(p.value)} ± ${digits(p.sigma, 2)}${alike ? "" : ` ${printed(p.unit)}`}`;
  const more = f.parameters.length > most ? `, and ${f.parameters.length - most} more` : "";
  return shown.map(one).join(", ") + (alike && shown.length ? ` ${printed(shown[0].unit)}` : "") + more;
}

/**
 * Why a finding is not to be believed as it stands.
 * @param {Report} report
 * @param {Finding} f
 */
function doubts(report, f) {
  const implausible = report.diagnosis.not_believable?.some((u) => u.effect === f.effect);
  const impossible = report.calibration.parameters.filter((p) => p.warning).map((p) => p.name);
  const symptoms = report.candidates?.find((c) => c.effect === f.in_model)?.symptoms ?? [];
  const fresh = symptoms.filter((s) => !impossible.includes(s.parameter));
  const lines = fresh.map((s) => `In the model with it, ${s.words}`);
  if (implausible) lines.unshift(`${digits(f.size_plausible, 2)} times its plausible size: not believable`);
  return lines.map((text) => element("div", { class: "warning flag" }, worded(report, capital(text))));
}

/**
 * @param {Report} report
 * @param {Finding} f
 */
function toDo(report, f) {
  const meaning = report.meanings[f.in_model];
  const sentences = (meaning?.to_do ?? []).map((text) => element("div", {}, text));
  return [...sentences, meaning?.gallery && element("div", { class: "quiet" }, `picture in ${meaning.gallery}`)];
}
