// @ts-check
// Residuals in small pictures beside each other, with what a candidate would take of them.

import { scatter } from "./charts.js";
import { chart } from "./drawing.js";
import { element, title } from "./elements.js";
import { largest, pairs, room, roundUp } from "./scales.js";
import { AXES, digits, percent } from "./text.js";

/** @param {Child} panels */
const several = (panels) => element("div", { class: "several" }, panels);

/**
 * By ball, in each axis of the world.
 * @param {WholeReport} report
 * @param {Candidate | null} candidate
 * @param {number} plainHeight of a panel with short names, px
 */
export function ballPanels(report, candidate, plainHeight) {
  const { samples, balls } = report.residuals;
  const ofSeveral = new Set(balls.map((b) => b.dataset)).size > 1;
  const names = balls.map((b) => (ofSeveral ? `${b.dataset}/${b.ball}` : b.ball));
  // Beside each other, not on top of each other.
  /** @param {number} k */
  const beside = (k) => (((k * 0.618) % 1) - 0.5) * 0.5;
  const onBall = samples.flatMap((s, k) => (s.ball === null ? [] : [{ s, k, x: s.ball + beside(k) }]));
  const limit = roundUp(1.05 * largest(onBall.flatMap(({ s }) => s.residual_um)));
  // Names that would not stand side by side stand upright.
  const turned = names.join("  ").length > 24;
  const cut = names.map((name) => name.slice(0, 14));
  const bottom = turned ? room(cut, 11) + 26 : 44;
  const upright = { rotate: 90, hideOverlap: false, width: bottom - 38 };
  const side = turned ? upright : { rotate: 0, hideOverlap: true, width: 90 };
  const axisLabel = {
    interval: 0,
    overflow: "truncate",
    ...side,
    fontSize: 11,
    customValues: names.map((_, k) => k),
    formatter: (/** @type {number} */ x) => names[Math.round(x)] ?? "",
  };
  /** @type {(axis: string, a: number) => HTMLElement} */
  const panel = (axis, a) => {
    const said = balls.map((b, k) => `${names[k]} mean ${digits(b.mean_um[a])} µm`).join(", ");
    const host = chart(`Residuals in ${axis} by ball: ${said}`, plainHeight + bottom - 44, (theme) =>
      scatter(theme, {
        xName: "ball",
        yName: `residual in ${axis}, µm`,
        unit: "µm",
        limit,
        xAxis: {
          min: -0.5,
          max: balls.length - 0.5,
          interval: 1,
          axisLabel: { ...axisLabel, color: theme.quiet },
        },
        bottom,
        points: onBall.map(({ s, x }) => [x, s.residual_um[a], s.id]),
        candidate: candidate && onBall.map(({ s, k, x }) => [x, candidate.takes_um[k][a], s.id]),
        bins: balls.map((b, k) => ({ x: k - 0.34, mean: b.mean_um[a], sigma: b.sigma_um[a] })),
      }),
    );
    return element("figure", {}, title(`${axis} of the world`), host);
  };
  return several(AXES.map(panel));
}

/**
 * Names of axes under a panel that says its joint above, by what the variable begins with.
 * @type {[kind: string, name: string][]}
 */
const SHORT_NAMES = [
  ["qcmd", "commanded minus reported, deg"],
  ["q", "angle, deg"],
  ["tau", "gravity torque, N·m"],
  ["approach", "side from which it came"],
  ["payload", "payload, kg"],
  ["time", "time, s"],
  ["temp", "temperature, °C"],
];

/**
 * By variable.
 * @param {WholeReport} report
 * @param {View[]} views
 * @param {Candidate | null} candidate
 */
export function viewPanels(report, views, candidate) {
  const { samples, angles_urad: anglesUrad } = report.residuals;
  const ids = samples.map((s) => s.id);
  // A joint whose axis goes through the TCP turns nothing that is measured.
  const readOff = views.filter(({ joint }) => anglesUrad[joint - 1].some((x) => x !== null));
  /** @param {View} view */
  const panel = (view) => {
    const { joint, against, what, unit, x, bins, test } = view;
    const takes = candidate?.of_views_urad[report.residuals.views.indexOf(view)];
    const limit = roundUp(largest([...anglesUrad[joint - 1], ...(candidate?.angles_urad[joint - 1] ?? [])]));
    const significance = test.p_family < 0.01 ? ` is significant: ${percent(test.explains)} of the squares` : "";
    const host = chart(`Apparent error of joint ${joint} against ${what}.${significance}`, 215, (theme) =>
      scatter(theme, {
        xName: SHORT_NAMES.find(([kind]) => against.startsWith(kind))?.[1] ?? `${against}, ${unit}`,
        yName: "apparent error, µrad",
        unit: "µrad",
        limit,
        points: pairs(x, anglesUrad[joint - 1], ids),
        bins: bins.map((b) => ({ x: b.x, mean: b.mean_urad, sigma: b.sigma_urad })),
        line: takes && bins.map((b, k) => [b.x, takes[k]]),
        xAxis: against.startsWith("approach") ? { min: -1.5, max: 1.5, interval: 1 } : {},
      }),
    );
    const heading = title(element("b", {}, `Joint ${joint}`), element("span", { class: "out" }, significance));
    return element("figure", {}, heading, host);
  };
  return several(readOff.map(panel));
}

/**
 * Over time, in each axis of the world.
 * @param {WholeReport} report
 * @param {Candidate | null} candidate
 */
export function timePanels(report, candidate) {
  const { samples } = report.residuals;
  const timed = samples.every((s) => s.time_s !== null);
  const x = samples.map((s) => (timed ? Number(s.time_s) / 60 : s.number));
  const limit = roundUp(1.05 * largest(samples.flatMap((s) => s.residual_um)));
  /** @type {(axis: string, a: number) => HTMLElement} */
  const panel = (axis, a) => {
    const host = chart(`Residuals in ${axis} over time.`, 215, (theme) =>
      scatter(theme, {
        xName: timed ? "time, min" : "sample, as measured",
        yName: `residual in ${axis}, µm`,
        unit: "µm",
        limit,
        points: samples.map((s, k) => [x[k], s.residual_um[a], s.id]),
        candidate: candidate && samples.map((s, k) => [x[k], candidate.takes_um[k][a], s.id]),
      }),
    );
    return element("figure", {}, title(`${axis} of the world`), host);
  };
  return several(AXES.map(panel));
}
