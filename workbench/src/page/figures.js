// @ts-check
// The figures by which the model is judged, now and step by step.

import { chart } from "calibench-report/drawing.js";
import { element, inWords } from "calibench-report/elements.js";
import { axis, categories, grid, legend, tooltip } from "calibench-report/options.js";
import { capital, fixed, millimetres, signed } from "calibench-report/text.js";
import { bench, given } from "./state.js";

/** @typedef {(r: Rung) => number | null | undefined} Figure */

/** @param {unknown} x */
const isNumber = (x) => typeof x === "number" && Number.isFinite(x);

/**
 * The steps that are shown: those of the document, and the present one while no more than its fit is known.
 * @returns {Rung[]}
 */
function rungs() {
  const { rungs: known } = given(bench.report).ladder;
  if (!bench.first) return known;
  return bench.first.taken ? [bench.first.before, bench.first.after] : [bench.first.after];
}

/**
 * @param {string} name
 * @param {Child} value
 * @param {string} beside
 */
function entry(name, value, beside, waits = false) {
  const said = [
    element("div", { class: waits ? "value waiting" : "value" }, value),
    element("div", { class: "beside" }, beside),
  ];
  return element("div", { class: waits ? "waits" : null }, element("dt", {}, capital(name)), element("dd", {}, said));
}

/**
 * A figure beside its value before the last switch.
 * @param {string} name
 * @param {Figure} of
 * @param {(r: Rung) => string | null | undefined} beside
 */
function tile(name, of, beside) {
  const [before, last] = [rungs().at(-2), given(rungs().at(-1) ?? null)];
  const [value, from] = [of(last), before && of(before)];
  if (!isNumber(value)) {
    // Not known yet, or not at all.
    return bench.first ? entry(name, "…", "being computed", true) : null;
  }
  const percents = from && from > 0 ? 100 * (Number(value) / from - 1) : null;
  const moved = percents === null ? null : change(percents);
  const earlier = isNumber(from) ? element("span", { class: "from" }, `${millimetres(from)} → `) : null;
  return entry(name, [earlier, `${millimetres(value)} mm`], [moved, beside(last)].filter(Boolean).join("; "));
}

/** @param {number} percents */
function change(percents) {
  if (Math.abs(percents) < 0.05) return "unchanged by the last switch";
  return `${signed(fixed(percents, 1))} % by the last switch`;
}

/** @returns {Child[]} */
export function now() {
  const { names, figures, validation } = given(bench.report);
  // Of other data, the samples are counted once the model is judged.
  const counted = !bench.first || bench.first.taken;
  /** @param {Rung} r */
  const band = ({ workspace }) => workspace?.mean_band_mm?.map(millimetres).join(" to ").concat(" mm");
  const noise = figures.noise_stated ? "as stated" : "as the best explanation leaves it";
  const samples = counted ? `${figures.samples} samples` : null;
  return [
    tile(
      `${names.residual}, rms`,
      (r) => r.residual_mm,
      () => samples,
    ),
    tile(
      `${names.cross_validated}, rms`,
      (r) => r.cross_validated_mm,
      () => "blocks that were not fitted",
    ),
    validation &&
      tile(
        `${names.not_fitted}, rms`,
        (r) => r.validation?.rms_mm,
        (r) => `${r.validation?.samples} poses`,
      ),
    tile(`${names.workspace}, mean`, (r) => r.workspace?.mean_mm, band),
    tile(
      `${names.noise_left}, rms`,
      (r) => r.noise_left_mm,
      () => noise,
    ),
  ];
}

/**
 * @param {Rung} r
 * @param {number} k
 */
function stepName(r, k) {
  if (k === 0) return "to begin with";
  const report = given(bench.report);
  return r.removed?.length ? `− ${inWords(report, r.removed)}` : `+ ${inWords(report, r.added ?? [])}`;
}

/**
 * The same over the steps.
 * @returns {Child[]}
 */
export function stairs() {
  const { names, ladder } = given(bench.report);
  const steps = bench.first ? [...(bench.first.taken ? ladder.rungs : []), bench.first.after] : ladder.rungs;
  if (steps.length < 2) return [];
  const titles = steps.map(stepName);
  /** @type {[name: string, of: Figure, colour: keyof Theme, symbol: string, type?: string][]} */
  const every = [
    [names.residual, (r) => r.residual_mm, "residual", "circle"],
    [names.cross_validated, (r) => r.cross_validated_mm, "other", "triangle"],
    [names.not_fitted, (r) => r.validation?.rms_mm, "measured", "rect"],
    [`${names.workspace}, mean`, (r) => r.workspace?.mean_mm, "predicted", "diamond"],
    [names.noise_left, (r) => r.noise_left_mm, "noise", "none", "dashed"],
  ];
  const lines = every.filter(([, of]) => steps.some((r) => isNumber(of(r))));
  /** @param {Figure} of */
  const values = (of) => steps.map((r) => (isNumber(of(r)) ? millimetres(of(r)) : "pending")).join(", ");
  const label = `The error by step: ${lines.map(([name, of]) => `${name} ${values(of)} mm`).join("; ")}`;
  /** @param {Item} item */
  const say = ({ seriesName, dataIndex, value }) =>
    `${titles[dataIndex]}\n${seriesName}: ${millimetres(/** @type {any} */ (value))} mm`;
  const host = chart(label, 240, (theme, width) => {
    const narrow = width < 620;
    const place = narrow
      ? { left: 0, orient: "vertical", itemGap: 7 }
      : { left: 56, orient: "horizontal", itemGap: 14 };
    const room = Math.max(40, (width - 90) / titles.length - 8);
    const axisLabel = {
      color: theme.ink,
      fontSize: 11,
      interval: 0,
      hideOverlap: true,
      width: room,
      overflow: "truncate",
    };
    return {
      grid: grid(62, 24, narrow ? 24 * lines.length + 10 : 34, 34),
      legend: legend(theme, { ...place, itemWidth: 16, itemHeight: 9 }),
      tooltip: tooltip(theme, say),
      xAxis: categories(titles, axisLabel, { axisLine: { lineStyle: { color: theme.noise } } }),
      yAxis: axis(theme, "error, mm", 46, { min: 0, scale: false }),
      series: lines.map(([name, of, colour, symbol, type = "solid"]) => ({
        name,
        type: "line",
        step: "middle",
        data: steps.map((r) => of(r) ?? null),
        symbol,
        symbolSize: 8,
        lineStyle: { color: theme[colour], width: 2, type },
        itemStyle: { color: theme[colour] },
      })),
    };
  });
  return [element("figure", {}, host)];
}
