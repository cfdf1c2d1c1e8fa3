// @ts-check
// Position errors on poses that were not fitted.

import { bars } from "./charts.js";
import { chart } from "./drawing.js";
import { element, quiet, table, title, unfold } from "./elements.js";
import { ticks } from "./scales.js";
import { digits, millimetres, thousandths } from "./text.js";

/** @typedef {JudgedErrors & { name: string, paper?: PaperErrors | null }} Method */

/** @type {Record<string, string>} */
const TITLES = { trical: "TriCal", tracker: "laser tracker" };

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function accuracy(report) {
  const { run, validation } = report;
  /** @type {Method[]} */
  const methods = validation ? [{ name: "calibrated", ...validation }] : [];
  if (run?.methods?.length) {
    const ofRun = run.methods.map((m) => ({
      name: `calibrated by ${TITLES[m.name] ?? m.name}`,
      paper: run.paper?.[m.name],
      ...m.validation,
    }));
    methods.splice(0, 1, ...ofRun);
  }
  if (!methods.length) return null;
  return [
    numbers(report, methods),
    setUpAnew(methods[methods.length - 1]),
    histograms(methods),
    quiet("Lengths of measured minus predicted positions; they hold the noise of the instrument that measured them."),
    expected(run),
  ];
}

/**
 * @param {Report} report
 * @param {Method[]} methods
 */
function numbers({ drawn: asDrawn }, methods) {
  /** @type {(Partial<JudgedErrors> & { name: string, kind?: string })[]} */
  const rows = methods.flatMap((m) => [
    { ...m, kind: "emphasis" },
    ...(m.paper ? [{ name: "the paper's, on its robot", ...m.paper, kind: "beside" }] : []),
  ]);
  if (asDrawn.on === "validation" && asDrawn.errors) rows.unshift({ name: asDrawn.name, ...asDrawn.errors });
  const paper = methods.some((m) => m.paper)
    ? "; beside each method the paper's Table 9 (500 poses of a real KR6)"
    : "";
  return table(
    `On ${methods[0].samples} poses${paper}`,
    [
      ["position error, mm", (r) => r.name, "words"],
      ["mean", (r) => thousandths(r.mean_mm)],
      ["max", (r) => thousandths(r.max_mm)],
      ["std", (r) => thousandths(r.std_mm)],
      ["rms", (r) => thousandths(r.rms_mm)],
      ["median", (r) => thousandths(r.quantiles_mm?.["50"])],
      ["95 %", (r) => thousandths(r.quantiles_mm?.["95"])],
    ],
    rows,
    (r) => r.kind ?? null,
  );
}

/** @param {Method[]} methods */
function histograms(methods) {
  const most = ticks(Math.max(...methods.flatMap((m) => [m.max_mm, 1.15 * (m.paper?.mean_mm ?? 0)])));
  const highest = ticks(Math.max(...methods.flatMap((m) => m.histogram.map((b) => b.count))));
  /** @param {Method} m */
  const histogram = (m) => {
    const said = `mean ${millimetres(m.mean_mm)} mm, largest ${millimetres(m.max_mm)} mm`;
    const marks = [{ at: m.mean_mm, text: `mean ${thousandths(m.mean_mm)}`, type: "solid" }];
    const paper = m.paper?.mean_mm;
    if (paper !== undefined) marks.push({ at: paper, text: `the paper's ${thousandths(paper)}`, type: "dashed" });
    const rows = m.histogram.map((b) => [b.from_mm, b.to_mm, b.count]);
    const host = chart(`Histogram of the position errors, ${m.name}: ${said}.`, 250, (theme) =>
      bars(theme, { rows, xName: "position error, mm", most, highest, colour: theme.measured, marks }),
    );
    return element("figure", {}, title(m.name), host);
  };
  return element("div", { class: "pair" }, methods.map(histogram));
}

/** @param {Run | null | undefined} run */
function expected(run) {
  if (!run?.expect?.checks?.length) return null;
  const checks = table(
    "Expected and found",
    [
      ["quantity", (c) => c.name, "words"],
      ["found", (c) => digits(c.value, 4)],
      ["band", (c) => `${c.band[0]} to ${c.band[1]}`],
      ["met", (c) => (c.met ? "met" : "not met"), "words"],
    ],
    run.expect.checks,
  );
  return unfold(`What the scenario expects: ${run.expect.met ? "met" : "NOT MET"}`, checks);
}

/**
 * What was fitted to the judged poses themselves is not judged by them.
 * @param {Method} method
 */
function setUpAnew({ refitted, from_fit_rows: fromFitRows }) {
  /** @param {string[]} list */
  const named = (list) => list.slice(0, 6).join(", ") + (list.length > 6 ? ` and ${list.length - 6} more` : "");
  const first =
    refitted?.length &&
    `Not known from the fit, so fitted to these very poses first: ${named(refitted)}. ` +
      "The residual is the spread about that, smaller than the error.";
  const ofFit =
    fromFitRows?.length && `Not in the calibration, so fitted to rows of set ‘fit’ first: ${named(fromFitRows)}.`;
  return [first ? element("p", { class: "warning" }, first) : null, ofFit ? quiet(ofFit) : null];
}
