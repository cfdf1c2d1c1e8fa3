// @ts-check
// What the report says before all else.

import { element, scrolling, sentence, worded } from "./elements.js";
import { capital, millimetres, thousandths } from "./text.js";

/**
 * How good it is now, and how bad it was; then what causes it, where that is true, and what to do.
 * @param {Report} report
 * @returns {Child[]}
 */
export function verdict(report) {
  const { verdict: said, title, robot, question, figures, judgement } = report;
  return [
    element("p", { class: "eyebrow" }, `calibench report · ${title} · ${robot}`),
    element(
      "div",
      { class: "first" },
      element("div", {}, now(report), states(report)),
      element(
        "div",
        {},
        element("h1", {}, said.headline),
        said.effects.length > 0 &&
          element(
            "p",
            { class: "ids" },
            said.effects.map((id) => element("code", {}, id)),
          ),
        element("p", { class: "means" }, said.means),
        report.misfit && element("p", { class: "warning" }, report.misfit),
        report.masses && element("p", { class: "quiet" }, report.masses),
        question && element("p", { class: "quiet" }, `Question: ${question}`),
        judgement && next(judgement.next),
      ),
    ),
    element("dl", { class: "figures" }, tiles(report)),
    said.symptoms.length > 0 && flags(report, said.symptoms),
    figures.disagreement && element("p", { class: "warning" }, sentence(figures.disagreement)),
  ];
}

/**
 * What to do, in order.
 * @param {string[]} steps
 */
function next(steps) {
  return element(
    "ol",
    { class: "next" },
    steps.map((step) => element("li", {}, sentence(`${capital(step)}.`))),
  );
}

/**
 * The states of the robot that have errors, in their order.
 * @param {States} of
 * @returns {[string, string, StateErrors][]}
 */
function inOrder(of) {
  /** @type {[string, string, StateErrors][]} */
  const rows = [
    ["as delivered", "as commanded or stated", of.as_delivered],
    ["nominal", "base and free tool fitted", of.nominal],
    ["calibrated", "", of.calibrated],
  ];
  return typeof of.recommended.mean_mm === "number" ? [...rows, ["recommended", "", of.recommended]] : rows;
}

/**
 * The error as it is now, and what it was before.
 * @param {Report} report
 */
function now({ states: of, names }) {
  if (!of) return false;
  const known = inOrder(of).filter(([, , errors]) => typeof errors.mean_mm === "number");
  const [was, is] = [known[0], known[known.length - 1]];
  if (!was || !is || was === is) return false;
  const figure = of.held_out ? names.not_fitted : names.residual;
  const before = `${figure}, mean of ${of.judged} poses; was ${thousandths(was[2].mean_mm)} (${was[0]})`;
  return element(
    "p",
    { class: "now" },
    element("b", {}, `${thousandths(is[2].mean_mm)} mm`),
    element("span", {}, before),
  );
}

/**
 * How bad it was, and how good it is now: at the same poses, by the same statistic.
 * @param {Report} report
 */
function states({ states: of, names, judgement }) {
  if (!of) return false;
  const rows = inOrder(of);
  const tolerance = judgement?.tolerance_mm;
  const head = [`${of.held_out ? names.not_fitted : names.residual}, mm`, "mean", "95 %", "max", ""];
  /** @param {StateErrors} errors */
  const met = (errors) =>
    typeof tolerance === "number" && typeof errors.met === "number"
      ? `${thousandths(tolerance)} met by ${errors.met} of ${of.judged}`
      : "";
  /** @param {[string, string, StateErrors]} row */
  const line = ([name, remark, errors]) => {
    const figures = [errors.mean_mm, errors.p95_mm, errors.max_mm];
    const cells = figures.map((mm) => element("td", {}, typeof mm === "number" ? thousandths(mm) : "–"));
    const said = errors.absent ?? (met(errors) || remark);
    const named = element("th", { scope: "row" }, name, histogram(errors, of.classes_to_mm ?? 0));
    return element("tr", {}, named, cells, element("td", { class: "said" }, said));
  };
  const header = element(
    "tr",
    {},
    head.map((text) => (text ? element("th", { scope: "col" }, text) : element("td", {}))),
  );
  const table = element(
    "table",
    { class: "states" },
    element("thead", {}, header),
    element("tbody", {}, rows.map(line)),
  );
  const drawn = `Bars: poses by their error, from 0 to ${thousandths(of.classes_to_mm)} mm in each row; line: mean.`;
  return [
    scrolling("Errors before and after", table),
    typeof of.classes_to_mm === "number" && element("p", { class: "quiet" }, drawn),
    typeof of.orientation === "string" && element("p", {}, of.orientation),
  ];
}

/**
 * How many poses err by how much, on the axis of all states.
 * @param {StateErrors} errors
 * @param {number} upTo mm
 */
function histogram({ counts, mean_mm: mean }, upTo) {
  if (!counts?.length || typeof mean !== "number") return false;
  const most = Math.max(...counts);
  const column = (/** @type {number} */ count) => element("i", { style: `height: ${(100 * count) / most}%` });
  const line = element("b", { style: `left: ${(100 * mean) / upTo}%` });
  return element("span", { class: "histogram", "aria-hidden": "true" }, counts.map(column), line);
}

/** @param {Report} report */
function tiles({ figures, names, judgement }) {
  const { expected } = figures;
  /** @type {(name: string, mm: string, beside: string) => HTMLElement} */
  const tile = (name, mm, beside) => {
    const said = [element("div", { class: "value" }, mm), element("div", { class: "beside" }, beside)];
    return element("div", {}, element("dt", {}, capital(name)), element("dd", {}, said));
  };
  /** @type {(name: string, expected: Expected) => HTMLElement} */
  const expectation = (name, { mean_mm: mean, mean_band_mm: band, max_mm: most, at_least: least }) => {
    const [low, high] = band.map(thousandths);
    const beside = `${low} to ${high} mm; largest ${thousandths(most)} mm`;
    return tile(`${name}, mean`, `${least ? "at least " : ""}${thousandths(mean)} mm`, beside);
  };
  const shown = [];
  if (judgement) {
    const { inside, over_limits: over } = judgement.expected;
    if (inside) shown.push(expectation(names.inside, inside));
    if (over) shown.push(expectation(names.over_limits, over));
  } else if (expected) {
    shown.push(expectation(names.workspace, expected));
  }
  const noise = figures.noise_stated ? names.noise_left : "the best explanation would leave";
  const left = `${figures.samples} samples; ${noise} ${millimetres(figures.noise_left_mm)} mm`;
  shown.push(tile(`${names.residual}, rms`, `${millimetres(figures.residual_mm)} mm`, left));
  return shown;
}

/**
 * Parameters outside the range that physics leaves them: nothing that follows is to be read without that.
 * @param {Report} report
 * @param {string[]} symptoms
 */
function flags(report, symptoms) {
  const count = symptoms.length;
  const heading =
    count === 1 ? "A parameter is outside its physical range" : `${count} parameters are outside their physical range`;
  const lines = symptoms.map((text) => element("p", {}, worded(report, text)));
  return element("div", { class: "warning", role: "note" }, element("b", {}, heading), lines);
}
