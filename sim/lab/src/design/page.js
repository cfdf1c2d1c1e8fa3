// @ts-check
// The page of a design: the layout from above, the map or the front, and the numbers. Every number comes from the
// document.

import { chart, draw } from "calibench-report/drawing.js";
import { byId, element, present, quiet, table, title } from "calibench-report/elements.js";
import { axis, grid, legend, tooltip } from "calibench-report/options.js";
import { redrawOnChange } from "calibench-report/redraw.js";
import { cividis } from "calibench-report/scales.js";
import { fixed, percent } from "calibench-report/text.js";

/** @type {Design} */
const design = JSON.parse(byId("data").textContent);
const { best, compared, front, map } = design;

/** @typedef {{ called: string, judged: Judged }} Row */

/** @param {number | null | undefined} v */
const um = (v) => fixed(v, 1);

/** @param {Judged} judged */
const size = ({ size_mm: mm }) => mm.map((v) => fixed(v, 0)).join(" × ");

/** @param {Predicted} of */
const held = ({ measured_um: measured, band_um: [low, high] }) => `${um(measured)} (${um(low)} to ${um(high)})`;

/** @param {number[]} values */
const ascending = (values) => values.toSorted((a, b) => a - b);

// Balls from above: x towards the right, y upwards, the height beside each.
function layout() {
  const symbols = ["circle", "diamond", "rect"];
  /** @param {Item} item */
  const say = ({ seriesName, data: [x, y, z, id] }) =>
    `${seriesName}, ball ${id}\nx ${fixed(x, 0)}, y ${fixed(y, 0)}, z ${fixed(z, 0)} mm`;
  const host = chart("the balls from above", 380, (theme) => {
    const colours = [theme.residual, theme.candidate, theme.quiet];
    return {
      grid: grid(74, 26, 34, 52),
      legend: legend(theme, { textStyle: { color: theme.quiet } }),
      tooltip: tooltip(theme, say),
      xAxis: axis(theme, "x, mm", 27),
      yAxis: axis(theme, "y, mm", 52),
      series: [best, ...compared].map((judged, k) => ({
        name: judged.name,
        type: "scatter",
        symbol: symbols[k % 3],
        symbolSize: 12,
        itemStyle: { color: colours[k % 3] },
        data: judged.balls.map(([id, [x, y, z]]) => [x, y, z, id]),
        label: {
          show: k === 0,
          position: "right",
          color: theme.quiet,
          formatter: (/** @type {Item} */ { data }) => `z ${fixed(data[2], 0)}`,
        },
      })),
    };
  });
  return element("figure", {}, host);
}

/**
 * Worst one-sigma with the ball at each place, the best of its heights.
 * @param {NonNullable<Design["map"]>} map
 */
function where(map) {
  /** @param {number} i */
  const distinct = (i) => ascending([...new Set(map.map((m) => m.centre_mm[i]))]);
  const [xs, ys] = [distinct(0), distinct(1)];
  /** @type {Map<string, { worst: number, x: number, y: number, z: number }>} */
  const least = new Map();
  for (const place of map) {
    const [x, y, z] = place.centre_mm;
    const { worst_um: worst } = place;
    const known = least.get(`${x} ${y}`)?.worst ?? Infinity;
    if (worst !== null && worst < known) least.set(`${x} ${y}`, { worst, x, y, z });
  }
  const cells = [...least.values()];
  const values = ascending(cells.map((c) => c.worst));
  /** @param {Item} item */
  const say = ({ data: [x, y, worst, z] }) =>
    `x ${fixed(xs[x], 0)}, y ${fixed(ys[y], 0)}, z ${fixed(z, 0)} mm\nworst ${um(worst)} µm`;
  const host = chart("the ball at every place", 420, (theme) => ({
    grid: grid(74, 26, 12, 92),
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, "x, mm", 27, { type: "category", data: xs.map((x) => fixed(x, 0)) }),
    yAxis: axis(theme, "y, mm", 52, { type: "category", data: ys.map((y) => fixed(y, 0)) }),
    visualMap: {
      min: values[0],
      max: values[values.length - 1],
      dimension: 2,
      orient: "horizontal",
      left: "center",
      bottom: 4,
      precision: 1,
      textStyle: { color: theme.quiet },
      inRange: { color: [0, 0.25, 0.5, 0.75, 1].map((t) => cividis(t)[0]) },
    },
    series: [
      {
        type: "heatmap",
        data: cells.map((c) => [xs.indexOf(c.x), ys.indexOf(c.y), c.worst, c.z]),
        label: {
          show: true,
          fontSize: 10,
          textBorderColor: "#16191d",
          textBorderWidth: 2,
          color: "#ffffff",
          formatter: (/** @type {Item} */ { data }) => um(data[2]),
        },
      },
    ],
  }));
  return element("figure", {}, title("worst one-sigma, µm, with the ball there; the best of the heights"), host);
}

/**
 * Accuracy against the length of the artifact.
 * @param {{ scale: number, judged: Judged }[]} boxes
 */
function curve(boxes) {
  const points = boxes.map((box) => ({ ...box, length: Math.hypot(...box.judged.size_mm) }));
  points.sort((a, b) => a.length - b.length);
  /** @type {(name: string, color: string, symbol: string, of: (judged: Judged) => number) => Option} */
  const line = (name, color, symbol, of) => ({
    name,
    type: "line",
    symbol,
    symbolSize: 8,
    data: points.map((p) => [p.length, of(p.judged), p]),
    itemStyle: { color },
    lineStyle: { color, width: 1.6 },
  });
  /** @param {Item} item */
  const say = ({ value: [, , { scale, judged }] }) => {
    const box = `box ${percent(scale)}: ${size(judged)} mm, ${fixed(judged.mass_kg, 1)} kg`;
    return `${box}\nworst ${um(judged.worst_um)}, mean ${um(judged.mean_um)} µm`;
  };
  const host = chart("accuracy against size", 340, (theme) => ({
    grid: grid(74, 26, 34, 52),
    legend: legend(theme, { textStyle: { color: theme.quiet } }),
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, "diagonal of the artifact, mm", 27),
    yAxis: axis(theme, "one-sigma, µm", 52, { scale: false, min: 0 }),
    series: [
      line("worst pose", theme.residual, "circle", (j) => j.worst_um),
      line("mean", theme.candidate, "diamond", (j) => j.mean_um),
    ],
  }));
  return element("figure", {}, host);
}

/**
 * @param {string} caption
 * @param {Row[]} rows
 * @param {string} name
 */
const numbers = (caption, rows, name) =>
  table(
    caption,
    [
      [name, (r) => r.called, "words"],
      ["balls", (r) => String(r.judged.balls.length)],
      ["probings", (r) => String(r.judged.probings)],
      ["worst, µm", (r) => um(r.judged.worst_um)],
      ["mean, µm", (r) => um(r.judged.mean_um)],
      ["mass, kg", (r) => fixed(r.judged.mass_kg, 1)],
      ["size, mm", (r) => size(r.judged)],
    ],
    rows,
  );

/** @param {{ called: string, verified: Verified }[]} rows */
const predicted = (rows) =>
  table(
    "Predicted and measured",
    [
      ["artifact", (r) => r.called, "words"],
      ["trials", ({ verified }) => String(verified.trials)],
      ["all poses, predicted", ({ verified }) => um(verified.rms.predicted_um)],
      ["measured", ({ verified }) => held(verified.rms)],
      ["worst pose, predicted", ({ verified }) => um(verified.worst.predicted_um)],
      ["measured", ({ verified }) => held(verified.worst)],
    ],
    rows,
  );

/**
 * @param {string} heading
 * @param {Child[]} content
 */
const section = (heading, ...content) => element("section", {}, element("h2", {}, heading), content);

const all = [best, ...compared].map((judged) => ({ called: judged.name, judged }));
const tried = all.flatMap(({ called, judged: { verified } }) => (verified ? [{ called, verified }] : []));
const boxes = front.flatMap(({ scale, judged }) => (judged ? [{ scale, judged }] : []));
const sizes = boxes.map(({ scale, judged }) => ({ called: percent(scale), judged }));

redrawOnChange();
byId("head").append(
  element("p", { class: "eyebrow" }, `design ${design.name}`),
  element("h1", {}, design.question),
  element(
    "p",
    { class: "means" },
    `${um(best.worst_um)} µm at the worst of ${design.workspace_poses} poses of the workspace, ` +
      `${um(best.mean_um)} µm on average (one-sigma of the calibrated TCP, from noise alone); ` +
      `${fixed(best.mass_kg, 1)} kg, ${size(best)} mm. ${design.places[1]} places tried, seed ${design.seed}.`,
  ),
);
const sections = [
  section("Where the balls stand", layout(), numbers("Against others", all, "artifact")),
  map && section("The ball at every place", where(map)),
  front.length > 0 && section("Accuracy against size", curve(boxes), numbers("The best of each size", sizes, "box")),
  tried.length > 0 &&
    section(
      "Tried on the simulated cell",
      quiet(
        "Distance of the calibrated TCP from the true one, rms, µm, with 95 % bands. What the encoders do not see at " +
          "that moment is in both.",
      ),
      predicted(tried),
    ),
];
byId("main").append(...present(sections));
draw();
document.body.dataset.ready = "1";
