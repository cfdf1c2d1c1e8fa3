// @ts-check
// What the report says before all else.

import { element, scrolling, sentence, worded } from "./elements.js";
import { capital, millimetres, thousandths } from "./text.js";

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function verdict(report) {
  const { verdict: said, title, robot, question, figures } = report;
  return [
    element("p", { class: "eyebrow" }, `calibench report · ${title} · ${robot}`),
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
    states(report),
    element("dl", { class: "figures" }, tiles(report)),
    said.symptoms.length > 0 && flags(report, said.symptoms),
    figures.disagreement && element("p", { class: "warning" }, sentence(figures.disagreement)),
  ];
}

/**
 * How bad it was, and how good it is now: at the same poses, by the same statistic.
 * @param {Report} report
 */
function states({ states: of, names }) {
  if (!of) return false;
  /** @type {[string, string, StateErrors][]} */
  const rows = [
    ["as delivered", "as commanded or stated", of.as_delivered],
    ["nominal", "base and free tool fitted", of.nominal],
    ["calibrated", "", of.calibrated],
  ];
  const head = [`${of.held_out ? names.not_fitted : names.residual}, mm`, "mean", "95 %", "max", ""];
  /** @param {[string, string, StateErrors]} row */
  const line = ([name, remark, errors]) => {
    const figures = [errors.mean_mm, errors.p95_mm, errors.max_mm];
    const cells = figures.map((mm) => element("td", {}, typeof mm === "number" ? thousandths(mm) : "–"));
    return element("tr", {}, element("th", { scope: "row" }, name), cells, element("td", {}, errors.absent ?? remark));
  };
  const header = element(
    "tr",
    {},
    head.map((text) => (text ? element("th", { scope: "col" }, text) : element("td", {}))),
  );
  return scrolling(
    "Errors before and after",
    element("table", { class: "states" }, element("thead", {}, header), element("tbody", {}, rows.map(line))),
  );
}

/** @param {Report} report */
function tiles({ figures, names }) {
  const { expected, validation } = figures;
  /** @type {(name: string, mm: string, beside: string) => HTMLElement} */
  const tile = (name, mm, beside) => {
    const said = [element("div", { class: "value" }, `${mm} mm`), element("div", { class: "beside" }, beside)];
    return element("div", {}, element("dt", {}, capital(name)), element("dd", {}, said));
  };
  const noise = figures.noise_stated ? names.noise_left : "the best explanation would leave";
  const left = `${figures.samples} samples; ${noise} ${millimetres(figures.noise_left_mm)} mm`;
  const shown = [tile(`${names.residual}, rms`, millimetres(figures.residual_mm), left)];
  if (expected) {
    const [low, high] = expected.mean_band_mm.map(thousandths);
    const beside = `${low} to ${high} mm; largest ${thousandths(expected.max_mm)} mm`;
    shown.push(tile(`${names.workspace}, mean`, thousandths(expected.mean_mm), beside));
  }
  if (validation) {
    const { samples, max_mm: most, refitted } = validation;
    const first = refitted.length ? `; ${refitted.length} numbers of the set-up were fitted to them first` : "";
    const beside = `${samples} poses; largest ${thousandths(most)} mm${first}`;
    shown.push(tile(`${names.not_fitted}, mean`, thousandths(validation.mean_mm), beside));
  }
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
