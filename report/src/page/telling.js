// @ts-check
// The key residual plot.

import { scatter } from "./charts.js";
import { contributionChart } from "./contributions.js";
import { chart } from "./drawing.js";
import { element, figure, named, quiet } from "./elements.js";
import { awaited, key } from "./key.js";
import { axis, grid, plain, residualPoints, tooltip } from "./options.js";
import { ballPanels } from "./panels.js";
import { largest, pairs, roundUp } from "./scales.js";
import { AXES, digits, millimetres } from "./text.js";

const APPARENT =
  "The apparent error is the turn of the joint, actual minus reported, that would absorb most of a sample's " +
  "residual.";

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function telling(report) {
  const { telling: it, candidates, residuals } = report;
  if (!it || !residuals) return awaited();
  const candidate = it.candidate === null ? null : candidates[it.candidate];
  const shown = candidate && ofCandidate({ ...report, residuals }, it, candidate);
  if (shown) return shown;
  return it.kind === "contributions" ? contributions(report) : samples({ ...report, residuals }, it.sample, candidate);
}

/**
 * The picture of a candidate; null if it has none of its own.
 * @param {WholeReport} report
 * @param {Telling} it
 * @param {Candidate} candidate
 * @returns {Child[] | null}
 */
function ofCandidate(report, it, candidate) {
  const { views } = report.residuals;
  const name = named(report, candidate.effect);
  const leaves = left(report, candidate);
  const marks = [/** @type {[string, string]} */ (["residual", "residual"]), explainedBy(name)];
  if (it.kind === "phase" && candidate.phase) {
    const { joint, order, x_deg: xDeg } = candidate.phase;
    const within = `angle of joint ${joint} within a turn, deg`;
    const turn = order === 1 ? within : `${order} × angle of joint ${joint}, folded to a period, deg`;
    const picture = ofJoint(report, candidate, joint, xDeg, turn, { min: 0, max: 360, interval: 45 });
    return [key(...marks), figure(picture, `${leaves} ${APPARENT}`)];
  }
  if (it.kind === "view") {
    const { joint, against, what, unit, x, bins } = views[it.view];
    const means = bins.map((b) => ({ x: b.x, mean: b.mean_urad, sigma: b.sigma_urad }));
    const most = `Of all views the one in which most of ${name} is seen (joint ${joint} against ${against}).`;
    const picture = ofJoint(report, candidate, joint, x, `${what}, ${unit}`, {}, means);
    return [key(...marks, ["mean", "mean of a bin, one sigma"]), figure(picture, `${most} ${leaves} ${APPARENT}`)];
  }
  if (it.kind === "curve") {
    const points = it.x && ofJoint(report, candidate, it.joint, it.x, `${it.against}, ${it.unit}`, {});
    const absorbed =
      "The curve itself, with its band of one sigma: no shape was prescribed. What the fitted model has absorbed of " +
      "it is not in the points above.";
    const both = [figure(points, `${leaves} ${APPARENT}`), figure(curve(it), absorbed)];
    return [key(...marks), element("div", {}, both)];
  }
  if (it.kind === "agreement") {
    const told =
      `Every sample three times: x, y and z of the world. What ${name} explains wholly lies on the line; what it ` +
      `does not explain lies on the vertical through zero. ${leaves}`;
    return [figure(agreement(report, candidate), told)];
  }
  if (it.kind !== "balls") return null;
  const mean = /** @type {[string, string]} */ (["mean", "mean of a ball, one sigma"]);
  return [key(...marks, mean), ballPanels(report, candidate, 320), quiet(leaves)];
}

/**
 * @param {string} name
 * @returns {[kind: string, text: string]}
 */
const explainedBy = (name) => ["diamond", `explained by ${name}`];

/**
 * @param {Report} report
 * @param {Candidate} candidate
 */
function left(report, candidate) {
  const [after, before] = [candidate.rms_after_mm, report.figures.residual_mm].map(millimetres);
  const name = named(report, candidate.effect);
  return `With ${name} in the model and all else re-fitted, ${after} of ${before} mm would remain.`;
}

/**
 * The apparent error of a joint, and the part that a candidate explains.
 * @param {WholeReport} report
 * @param {Candidate} candidate
 * @param {number} joint
 * @param {(number | null)[]} x
 * @param {string} xName
 * @param {Option} xAxis
 * @param {Bin[]} [bins]
 */
function ofJoint(report, candidate, joint, x, xName, xAxis, bins) {
  const { samples, angles_urad: anglesUrad } = report.residuals;
  const ids = samples.map((s) => s.id);
  const name = named(report, candidate.effect);
  const [left, takes] = [anglesUrad[joint - 1], candidate.angles_urad[joint - 1]];
  const limit = roundUp(1.05 * Math.max(largest(left), largest(takes)));
  const what = `points of the residual and of the part explained by ${name}`;
  return chart(`Apparent error of joint ${joint} against ${xName}: ${what}.`, 380, (theme) =>
    scatter(theme, {
      xName,
      yName: `apparent error of joint ${joint}, µrad`,
      unit: "µrad",
      limit,
      xAxis,
      bins,
      spacious: true,
      points: pairs(x, left, ids),
      candidate: pairs(x, takes, ids),
    }),
  );
}

/**
 * A curve with its band of one sigma, which lies under it.
 * @param {Curve} it
 */
function curve({ joint, against, unit, at, mean_urad: mean, sigma_urad: sigma }) {
  const limit = roundUp(1.05 * Math.max(...mean.map((m, k) => Math.abs(m) + sigma[k])));
  const [above, below] = [1, -1].map((side) => at.map((x, k) => [x, mean[k] + side * sigma[k]]));
  const border = [...above, ...below.reverse()];
  const label = `The curve that the error of joint ${joint} follows over ${against}, with its band of one sigma.`;
  return chart(label, 260, (theme) => {
    const option = scatter(theme, {
      xName: `${against}, ${unit}`,
      yName: "error about its mean, µrad",
      unit: "µrad",
      limit,
      points: [],
      line: at.map((x, k) => [x, mean[k]]),
    });
    const band = {
      type: "custom",
      silent: true,
      data: [0],
      encode: { x: -1, y: -1 },
      renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => ({
        type: "polygon",
        shape: { points: border.map((p) => api.coord(p)) },
        style: { fill: theme.candidate, opacity: 0.22 },
      }),
    };
    return { ...option, series: [band, ...option.series] };
  });
}

/**
 * The residual against the part that a candidate explains.
 * @param {WholeReport} report
 * @param {Candidate} candidate
 */
function agreement(report, candidate) {
  const { samples } = report.residuals;
  const name = named(report, candidate.effect);
  /** @type {(a: number) => [number, number, string][]} */
  const ofAxis = (a) => samples.map((s, k) => [candidate.takes_um[k][a], s.residual_um[a], s.id]);
  const points = AXES.flatMap((_, a) => ofAxis(a));
  const limit = roundUp(1.05 * largest(points.flatMap(([x, y]) => [x, y])));
  const corners = [-limit, limit].map((x) => [x, x]);
  return chart(`Residual against the part explained by ${name}.`, 400, (theme) =>
    scatter(theme, {
      xName: `explained by ${name}, µm`,
      yName: "residual, µm",
      unit: "µm",
      limit,
      spacious: true,
      points,
      line: corners,
      xAxis: { min: -limit, max: limit, interval: limit / 2 },
    }),
  );
}

/** @param {Report} report */
function contributions(report) {
  const told =
    "No single effect is significant. This is how the residual divides when the whole catalogue is fitted at once, " +
    "each effect held to its plausible size.";
  return [figure(contributionChart(report, report.diagnosis.contributions.slice(0, 12)), told)];
}

/**
 * The length of every residual; `sample` is the one that disagrees with all others, if there is one.
 * @param {WholeReport} report
 * @param {string | undefined} sample
 * @param {Candidate | null} candidate
 */
function samples(report, sample, candidate) {
  const { figures, residuals } = report;
  const noise = 1000 * figures.noise_left_mm;
  /** @type {(theme: Theme, s: Sample) => Option} */
  const marked = (theme, s) => ({
    symbol: "diamond",
    symbolSize: 14,
    itemStyle: { color: theme.candidate, opacity: 1 },
    label: {
      show: true,
      formatter: () => s.id,
      position: s.number > figures.samples / 2 ? "left" : "right",
      color: theme.ink,
    },
  });
  /** @type {(theme: Theme, s: Sample) => Option} */
  const point = (theme, s) => ({
    value: [s.number, s.length_um, s.id],
    ...(s.id === sample ? marked(theme, s) : {}),
  });
  const host = chart("Length of the residual of every sample, in the order of measurement.", 340, (theme) => ({
    grid: grid(62, 14, 16, 44),
    tooltip: tooltip(theme, ({ value }) => `${value[2]}\n${digits(value[1])} µm`),
    xAxis: axis(theme, "sample, in the order of measurement", 27, { ...plain, min: 0, max: figures.samples + 1 }),
    yAxis: axis(theme, "length of the residual, µm", 46, { min: 0 }),
    series: [
      {
        ...residualPoints(
          theme,
          residuals.samples.map((s) => point(theme, s)),
          7,
        ),
        markLine: {
          silent: true,
          symbol: "none",
          lineStyle: { color: theme.noise, type: "dashed" },
          data: [
            {
              yAxis: noise,
              label: {
                formatter: () => `noise alone, rms: ${digits(noise)} µm`,
                position: "insideEndTop",
                color: theme.ink,
                fontSize: 11,
                backgroundColor: theme.paper,
                padding: 2,
              },
            },
          ],
        },
      },
    ],
  }));
  const disagrees = residuals.samples.some((s) => s.id === sample);
  const told = disagrees
    ? `${sample} disagrees with all others. ${candidate && left(report, candidate)}`
    : "Every sample against what noise alone would leave. A residual as small as its noise does not prove accuracy " +
      "where nothing was measured.";
  return [figure(host, told)];
}
