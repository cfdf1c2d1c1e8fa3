// @ts-check
// The identified robot.

import { matrix } from "./charts.js";
import { chart, wide } from "./drawing.js";
import { element, figure, list, named, scrolling, table, unfold, worded } from "./elements.js";
import { rangeChart } from "./ranges.js";
import { room } from "./scales.js";
import { digits, fixed, millimetres, printed, signed } from "./text.js";

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function parameters(report) {
  const { calibration: c } = report;
  const noise = c.noise_stated ? "as stated" : "as the residuals show it";
  const pairs = strongest(c);
  const correlations = c.parameters.length > 0 && c.parameters.length <= 60 && correlationChart(c, pairs[0]);
  return [
    element(
      "p",
      {},
      `${c.samples} samples, ${c.rank} independent parameters, ${c.dof} degrees of freedom; residual ` +
        `${millimetres(c.residual_mm)} mm rms (3-D), χ²/dof ${digits(c.chi2_per_dof)}. One sigma is of the noise ` +
        `${noise}; it knows nothing of effects that are not in the model.`,
    ),
    identified(report),
    c.stated_parameters.length > 0 &&
      unfold("Certified values, carried along with their uncertainty", certified(c.stated_parameters)),
    element("h3", {}, "How well the poses show them"),
    element("div", { class: "pair" }, [
      element("div", {}, observability(c), c.unresolved_sentences.length > 0 && unresolved(c.unresolved_sentences)),
      figure(
        rangeChart(c.joint_ranges),
        "Joint angles in the data (bars) within the limits of the robot (outlines). Outside the bars the calibration " +
          "is an extrapolation.",
      ),
    ]),
    element("h3", {}, "Correlations"),
    correlations &&
      figure(
        correlations,
        "Blue: −1, no colour: 0, orange: +1. Parameters that are strongly correlated are known in their combination " +
          "better than each alone.",
      ),
    unfold(
      "The strongest correlations as a table",
      table(
        "Strongest first",
        [
          ["parameter", (x) => x.a, "words"],
          ["with", (x) => x.b, "words"],
          ["correlation", (x) => fixed(x.r, 3)],
        ],
        pairs,
      ),
    ),
  ];
}

/** @param {Report} report */
function identified(report) {
  const { calibration: c, run } = report;
  const score = run?.methods?.find((m) => m.name === "trical")?.score ?? [];
  const truths = new Map(score.map((p) => [p.name, p.truth]));
  /** @param {Parameter} p */
  const places = (p) => Math.min(6, Math.max(3, 1 - Math.floor(Math.log10(p.sigma || 1))));
  /** @param {Parameter} p */
  const name = (p) =>
    p.warning ? [p.name, element("div", { class: "warning flag" }, worded(report, p.warning))] : p.name;
  /** @param {Parameter} p */
  const off = (p) => {
    const truth = truths.get(p.name);
    return truth === undefined ? "–" : signed(fixed((p.value - truth) / p.sigma, 1));
  };
  /** @type {Column<Parameter>[]} */
  const columns = [
    ["parameter", name, "words"],
    ["nominal", (p) => fixed(p.nominal, 3)],
    ["identified", (p) => fixed(p.value, places(p))],
    ["one sigma", (p) => fixed(p.sigma, places(p))],
    ["correction", (p) => signed(fixed(p.value - p.nominal, places(p)))],
    ["unit", (p) => printed(p.unit), "words"],
  ];
  if (truths.size) columns.push(["truth", (p) => fixed(truths.get(p.name), places(p))], ["off, in sigmas", off]);
  return table(`Parameters of: ${c.effects.map((id) => named(report, id)).join("; ")}`, columns, c.parameters);
}

/** @param {StatedParameter[]} rows */
const certified = (rows) =>
  table(
    "Certified values",
    [
      ["parameter", (p) => p.name, "words"],
      ["stated", (p) => fixed(p.nominal, 4)],
      ["one sigma", (p) => fixed(p.stated_sigma, 4)],
      ["found", (p) => fixed(p.value, 4)],
      ["one sigma after", (p) => fixed(p.sigma, 4)],
      ["unit", (p) => printed(p.unit), "words"],
    ],
    rows,
  );

/** @param {Calibration} c */
function observability({ observability: o, condition }) {
  const rows = [
    { name: "O1", what: "geometric mean of the singular values over the root of the number of poses", value: o.O1 },
    { name: "O2", what: "least over largest singular value", value: o.O2 },
    { name: "O3", what: "least singular value", value: o.O3 },
    { name: "O4", what: "least singular value squared over the largest", value: o.O4 },
    { name: "O5", what: "harmonic: one over the sum of the reciprocal singular values", value: o.O5 },
  ];
  return table(
    `Observability (SI units); condition of the scaled Jacobian ${digits(condition)}`,
    [
      ["index", (x) => x.name],
      ["value", (x) => digits(x.value)],
      ["what it is", (x) => x.what, "words"],
    ],
    rows,
  );
}

/** @param {string[]} sentences */
const unresolved = (sentences) => [
  element("p", {}, "Kept at their nominal values, because these data cannot distinguish them:"),
  list(sentences),
];

/**
 * The pairs of parameters that are correlated most.
 * @param {Calibration} c
 */
function strongest(c) {
  const names = c.parameters.map((p) => p.name);
  const all = names.flatMap((a, i) => names.slice(0, i).map((b, k) => ({ a, b, r: c.correlation[i][k] })));
  return all.sort((x, y) => Math.abs(y.r) - Math.abs(x.r)).slice(0, 12);
}

/**
 * @param {Calibration} c
 * @param {{ a: string, b: string, r: number } | undefined} most
 */
function correlationChart(c, most) {
  const names = c.parameters.map((p) => p.name);
  const side = Math.max(420, 30 + room(names, 9) + 15 * names.length);
  const said = most ? `${most.a} with ${most.b}, ${fixed(most.r, 2)}` : "none";
  const host = chart(`Correlations of ${names.length} parameters; strongest ${said}.`, side, (theme, width) =>
    matrix(
      theme,
      {
        columns: names,
        rows: names,
        labelSize: 9,
        columnsTurned: 90,
        low: -1,
        high: 1,
        colours: ["#0072b2", theme.paper, "#d55e00"],
        data: c.correlation.flatMap((row, i) => row.map((r, k) => [k, i, r])),
        say: ({ value }) => `${names[value[1]]} with ${names[value[0]]}\n${fixed(value[2], 3)}`,
      },
      width,
    ),
  );
  const frame = scrolling("Correlations", wide(host, side));
  frame.style.maxWidth = `${side + 140}px`;
  return frame;
}
