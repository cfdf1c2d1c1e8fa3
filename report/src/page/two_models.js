// @ts-check
// Pictures of two models.

import { scatter } from "./charts.js";
import { chart } from "./drawing.js";
import { element, figure, quiet, title } from "./elements.js";
import { axis, grid, legend, plain, residualPoints, tooltip, zero } from "./options.js";
import { largest, roundUp, ticks } from "./scales.js";
import { digits, thousandths } from "./text.js";

/**
 * The error at every pose that was not fitted, A against B: a pose under the line is better with B.
 * @param {Against} it
 * @param {Paired} p
 */
export function pairedChart({ names: [a, b] }, p) {
  const [max, interval] = ticks(Math.max(...p.a_mm, ...p.b_mm));
  const scale = { min: 0, max, interval, scale: false };
  const label =
    `Position error at ${p.poses} poses that were not fitted, ${b} against ${a}: ` +
    `at ${p.better_at} of them ${b} is nearer.`;
  const poseByPose = chart(label, 360, (theme) => ({
    grid: grid(62, 20, 34, 44),
    tooltip: tooltip(theme, ({ value }) => `${a}: ${thousandths(value[0])} mm\n${b}: ${thousandths(value[1])} mm`),
    xAxis: axis(theme, `error of ${a}, mm`, 27, scale),
    yAxis: axis(theme, `error of ${b}, mm`, 46, scale),
    series: [
      {
        type: "line",
        silent: true,
        showSymbol: false,
        data: [0, max].map((mm) => [mm, mm]),
        lineStyle: { color: theme.noise, width: 1.5 },
      },
      {
        ...residualPoints(
          theme,
          p.a_mm.map((x, k) => [x, p.b_mm[k]]),
        ),
        name: "pose",
        itemStyle: { color: theme.measured, opacity: 0.6 },
      },
    ],
  }));
  const chosen = p.a_mm.length < p.poses ? ` Of ${p.poses} poses ${p.a_mm.length} are drawn, evenly.` : "";
  const told =
    `One mark a pose that was not fitted: under the line ${b} is nearer. ` +
    `That is so at ${p.better_at} of ${p.poses} poses.${chosen}`;
  const sorted = "Each curve is sorted separately: the error that so many of the poses do not exceed.";
  return element("div", { class: "pair" }, figure(poseByPose, told), figure(shares([a, b], p, scale), sorted));
}

/**
 * The errors of both, sorted.
 * @param {string[]} names
 * @param {Paired} p
 * @param {Option} scale
 */
function shares([a, b], p, scale) {
  /** @type {(values: number[]) => [number, number][]} */
  const sorted = (values) => [...values].sort((x, y) => x - y).map((mm, k) => [(100 * (k + 0.5)) / values.length, mm]);
  /** @param {number[]} values */
  const median = (values) => thousandths(sorted(values)[Math.floor(p.a_mm.length / 2)][1]);
  /** @type {(name: string, values: number[], color: string, type: string) => Option} */
  const curve = (name, values, color, type) => ({
    name,
    type: "line",
    showSymbol: false,
    symbol: "none",
    itemStyle: { color },
    lineStyle: { color, width: 2.4, type },
    data: sorted(values),
  });
  const label = `Sorted errors of both models: medians ${median(p.a_mm)} and ${median(p.b_mm)} mm.`;
  return chart(label, 360, (theme) => ({
    grid: grid(62, 20, 34, 44),
    legend: legend(theme, { left: 56, itemWidth: 18, itemHeight: 10 }),
    tooltip: tooltip(theme, ({ seriesName, value }) => `${seriesName}: ${thousandths(value[1])} mm`),
    xAxis: axis(theme, "share of the poses, %", 27, { min: 0, max: 100, ...plain }),
    yAxis: axis(theme, "position error, mm", 46, scale),
    series: [curve(`A: ${a}`, p.a_mm, theme.residual, "solid"), curve(`B: ${b}`, p.b_mm, theme.candidate, "dashed")],
  }));
}

/**
 * What the joints seem to err by under both models, over their own angles.
 * @param {Report} report
 * @param {Against} it
 */
export function bothViews({ residuals }, it) {
  if (!residuals) return null;
  const own = residuals.views.filter((v) => /^q\d/.test(v.against)).sort((x, y) => x.joint - y.joint);
  const both = own.flatMap((a) => {
    const b = it.views.find((w) => w.joint === a.joint && w.against === a.against);
    return b && a.bins.length ? [{ a, b }] : [];
  });
  if (!both.length) return null;
  const means = both.flatMap(({ a, b }) => [...a.bins, ...b.bins].map((bin) => bin.mean_urad));
  const limit = roundUp(1.1 * largest(means));
  const better = residuals.samples.filter((s, k) => it.residual_um[k] < s.length_um).length;
  return [
    element("h3", {}, "Residuals of both, joint by joint"),
    quiet(
      element("span", { class: "swatch a" }),
      ` A: ${it.names[0]}; `,
      element("span", { class: "swatch b" }),
      ` B: ${it.names[1]}, dashed. Means of bins of the fitted samples; of ${it.residual_um.length} samples drawn, ` +
        `${better} have a smaller residual with B. The arrows of both are in the view in space.`,
    ),
    element(
      "div",
      { class: "several" },
      both.map(({ a, b }) => panel(it.names, a, b, limit)),
    ),
  ];
}

/**
 * @param {string[]} names
 * @param {View} a
 * @param {View} b
 * @param {number} limit
 */
function panel(names, a, b, limit) {
  /** @param {View} view */
  const most = (view) => digits(largest(view.bins.map((bin) => bin.mean_urad)));
  const label =
    `Mean apparent error of joint ${a.joint} over its angle under both models; ` +
    `largest ${most(a)} and ${most(b)} µrad.`;
  /** @type {(name: string, view: View, color: string, symbol: string, type: string) => Option} */
  const line = (name, view, color, symbol, type) => ({
    name,
    type: "line",
    symbol,
    symbolSize: 7,
    itemStyle: { color },
    lineStyle: { color, width: 2, type },
    data: view.bins.map((bin) => [bin.x, bin.mean_urad]),
  });
  /** @param {Item} item */
  const say = ({ seriesName, value }) => `${seriesName}\n${digits(value[1])} µrad at ${digits(value[0], 4)} deg`;
  const host = chart(label, 215, (theme) => ({
    ...scatter(theme, { xName: "angle, deg", yName: "apparent error, µrad", unit: "µrad", limit, points: [] }),
    series: [
      { ...line(names[0], a, theme.residual, "circle", "solid"), markLine: zero(theme) },
      line(names[1], b, theme.candidate, "diamond", "dashed"),
    ],
    tooltip: tooltip(theme, say),
  }));
  return element("figure", {}, title(element("b", {}, `Joint ${a.joint}`)), host);
}
