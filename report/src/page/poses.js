// @ts-check
// Before and after, pose by pose.

import { chart } from "./drawing.js";
import { figure } from "./elements.js";
import { axis, grid, legend, plain, stroke, tooltip } from "./options.js";
import { ticks } from "./scales.js";
import { fixed, thousandths } from "./text.js";

// Few enough poses are drawn one by one.
const MOST_POSES = 120;

/** @typedef {{ before: number, after: number }} Pose */

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function byPose(report) {
  const { by_pose: it, on, name } = report.drawn;
  if (!it?.before_mm?.length) return null;
  const poses = it.before_mm.map((before, k) => ({ before, after: it.after_mm[k] }));
  poses.sort((a, b) => a.before - b.before);
  const better = poses.filter((p) => p.after < p.before).length;
  const worse = poses.length - better;
  const few = poses.length <= MOST_POSES;
  const of = `${poses.length} ${on === "validation" ? "poses that were not fitted" : "fitted poses"}`;
  const label = `Position error of ${of}, before and after: ${better} of them are better after the calibration.`;
  const told = [
    `${better} of ${of} are nearer to where they should be after the calibration`,
    worse ? `, ${worse} are farther` : "",
    few ? "." : ". Each curve is sorted separately: the error that so many of the poses do not exceed.",
    poses.length < it.of ? ` Of ${it.of} poses ${poses.length} are drawn, evenly.` : "",
  ];
  return [
    figure(
      chart(label, 300, (theme) => option(theme, poses, few, name)),
      told.join(""),
    ),
  ];
}

/**
 * @param {Theme} theme
 * @param {Pose[]} poses
 * @param {boolean} few
 * @param {string} name of what was before
 * @returns {Option}
 */
function option(theme, poses, few, name) {
  /** @param {Item} item */
  const say = ({ seriesName, value }) => {
    const share = few ? "" : `\nat most, in ${fixed(value[0], 0)} % of the poses`;
    return `${seriesName}: ${thousandths(value[1])} mm${share}`;
  };
  /** @param {number} k */
  const share = (k) => (100 * (k + 0.5)) / poses.length;
  const [max, interval] = ticks(Math.max(...poses.flatMap((p) => [p.before, p.after])));
  const after = poses.map((p) => p.after);
  if (!few) after.sort((a, b) => a - b);
  /** @type {(series: string, values: number[], symbol: string, colour: string) => Option} */
  const points = (series, values, symbol, color) => ({
    name: series,
    type: few ? "scatter" : "line",
    symbol,
    symbolSize: 6,
    showSymbol: few,
    itemStyle: { color },
    lineStyle: { color, width: 2.4 },
    data: values.map((mm, k) => [few ? k + 1 : share(k), mm]),
  });
  return {
    grid: grid(62, 20, 34, 44),
    legend: legend(theme, { left: 56 }),
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, few ? "poses, by their error before" : "share of the poses, %", 27, {
      min: 0,
      max: few ? poses.length + 1 : 100,
      ...plain,
      ...(few && { axisLabel: { show: false } }),
    }),
    yAxis: axis(theme, "position error, mm", 46, { min: 0, max, interval, scale: false }),
    series: [
      ...(few ? [moves(theme, poses)] : []),
      points(
        `before (${name})`,
        poses.map((p) => p.before),
        "circle",
        theme.other,
      ),
      points("after (calibrated)", after, "rect", theme.measured),
    ],
  };
}

/**
 * Lines from before to after.
 * @param {Theme} theme
 * @param {Pose[]} poses
 * @returns {Option}
 */
const moves = (theme, poses) => ({
  type: "custom",
  silent: true,
  data: poses.map((p, k) => [k + 1, p.before, p.after]),
  encode: { x: 0, y: [1, 2] },
  renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
    const [x, before] = api.coord([api.value(0), api.value(1)]);
    const [, after] = api.coord([api.value(0), api.value(2)]);
    const worse = api.value(2) > api.value(1);
    return stroke([x, before], [x, after], { stroke: worse ? theme.candidate : theme.rule, lineWidth: 2 });
  },
});
