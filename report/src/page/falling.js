// @ts-check
// The error falling, by model.

import { chart } from "./drawing.js";
import { element, figure, inWords, list, quiet, table, unfold, withId, worded } from "./elements.js";
import { models } from "./models.js";
import { axis, grid, legend, plain, shortNumber, stroke, tooltip } from "./options.js";
import { ticks } from "./scales.js";
import { digits, millimetres, thousandths } from "./text.js";

/** @typedef {"fit" | "cv" | "expected" | "measured"} Figure */
/** @typedef {[figure: Figure, what: string, symbol: string, colour: keyof Theme, range?: "band" | "reach"]} Kind */

/** @param {unknown} x */
const isNumber = (x) => typeof x === "number" && Number.isFinite(x);

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function ladder(report) {
  const { ladder: it, names, diagnosis } = report;
  const rows = models(report);
  const fitted = diagnosis.fitted.map((id) => inWords(report, [id])).join(" + ");
  const told =
    "Each line is a model, with what it leaves; bars are the 10 to 90 % band of what is expected and two standard " +
    `errors of a measured mean, as of independent poses. Dashes: ${names.noise_left}. The calibrated model ` +
    `holds ${fitted}.`;
  /** @param {{ effect: string, objections: string[] }} tried */
  const against = ({ effect, objections }) => worded(report, objections.join("; "), new Set([effect]));
  const refused = it.stopped?.tried?.map((t) => [withId(report, t.effect), ": ", against(t)]) ?? [];
  const next = !it.complete && it.command;
  return [
    figure(picture(report, rows), told),
    it.step && step(report, it.step, against),
    refused.length > 0 && unfold("Steps that were refused", list(refused)),
    next && quiet("This is the next step alone. ", element("code", {}, next), " runs to the end."),
    unfold("The numbers of the ladder", numbers(report, rows)),
  ];
}

/**
 * @param {Report} report
 * @param {{ effect: string, objections: string[] }} step
 * @param {(step: { effect: string, objections: string[] }) => Child} against
 */
function step(report, step, against) {
  const effect = withId(report, step.effect);
  if (step.objections.length) return element("p", {}, "Against adding ", effect, ": ", against(step), ".");
  const because = `blocks that were not fitted are predicted better, and the error ${report.names.workspace} falls.`;
  return element("p", {}, "Nothing speaks against adding ", effect, `: ${because}`);
}

/**
 * @param {Report} report
 * @param {ModelRow[]} rows
 */
function numbers({ names }, rows) {
  /** @param {ModelRow} r */
  const expected = (r) => {
    if (!r.band) return "–";
    return `${thousandths(r.expected)} (${thousandths(r.band[0])} to ${thousandths(r.band[1])})`;
  };
  /** @type {Column<ModelRow>[]} */
  const columns = [
    ["model", (r) => r.name, "words"],
    [`${names.residual}, mm`, (r) => millimetres(r.fit)],
    [`${names.cross_validated}, mm`, (r) => millimetres(r.cv)],
    [`${names.workspace}, mm`, expected],
    [`${names.not_fitted}, mean, mm`, (r) => thousandths(r.measured)],
    [`${names.not_fitted}, max, mm`, (r) => thousandths(r.largest)],
    [`${names.noise_left}, mm`, (r) => millimetres(r.noise)],
    ["χ²/dof", (r) => digits(r.chi2)],
  ];
  const measured = rows.some((r) => isNumber(r.measured));
  const known = columns.filter(([heading]) => measured || !heading.startsWith(names.not_fitted));
  return table("Errors by model", known, rows);
}

/**
 * @param {Report} report
 * @param {ModelRow[]} rows
 */
function picture({ names }, rows) {
  /** @type {Kind[]} */
  const every = [
    ["fit", `${names.residual}, rms`, "circle", "residual"],
    ["cv", `${names.cross_validated}, rms`, "triangle", "other"],
    ["expected", `${names.workspace}, mean`, "diamond", "predicted", "band"],
    ["measured", `${names.not_fitted}, mean`, "rect", "measured", "reach"],
  ];
  const kinds = every.filter(([name]) => rows.some((row) => isNumber(row[name])));
  /** @param {ModelRow} r */
  const said = (r) => {
    const known = kinds.filter(([name]) => isNumber(r[name]));
    return `${r.name}: ${known.map(([name, what]) => `${what} ${millimetres(r[name])}`).join(", ")}`;
  };
  const last = lastTick(rows);
  // On a phone the name of a model stands over its line, not beside it.
  const isNarrow = (/** @type {number} */ width) => width < 620;
  // Names of figures that would not stand in one line stand under each other.
  const isStacked = (/** @type {number} */ width) => width < 240 + 190 * kinds.length;
  const above = (/** @type {number} */ width) => (isStacked(width) ? 20 * kinds.length + 4 : 44);
  const height = (/** @type {number} */ width) => above(width) + 52 + (isNarrow(width) ? 74 : 48) * rows.length;
  /** @param {Item} item */
  const say = ({ value, seriesName }) => {
    const row = rows[Math.round(value[1])];
    const [, , , , reach] = kinds.find(([, what]) => what === seriesName) ?? [];
    const range = reach && row[reach];
    const between = range ? `\n${millimetres(range[0])} to ${millimetres(range[1])} mm` : "";
    return `${row.name}\n${seriesName}: ${millimetres(value[0])} mm${between}`;
  };
  return chart(`Errors by model, mm: ${rows.map(said).join("; ")}`, height, (theme, width) => {
    const [narrow, stacked] = [isNarrow(width), isStacked(width)];
    const left = narrow ? 10 : 240;
    const place = {
      left: narrow ? 0 : left - 5,
      orient: stacked ? "vertical" : "horizontal",
      itemGap: stacked ? 2 : 14,
    };
    /** @param {number} k */
    const spread = (k) => (k - (kinds.length - 1) / 2) * (narrow ? 0.14 : 0.18) + (narrow ? 0.12 : 0);
    const [end, interval] = last;
    return {
      grid: grid(left, 20, above(width), 44),
      legend: legend(theme, place),
      tooltip: tooltip(theme, say),
      xAxis: axis(theme, "error, mm", 27, {
        min: 0,
        max: end,
        interval,
        splitLine: { show: true, lineStyle: { color: theme.grid } },
        axisLabel: { color: theme.quiet, fontSize: 11, formatter: shortNumber },
      }),
      yAxis: {
        type: "value",
        inverse: true,
        min: -0.5,
        max: rows.length - 0.5,
        interval: 1,
        axisTick: { show: false },
        axisLine: { show: false },
        axisLabel: { show: false },
        ...plain,
      },
      series: [
        lines(theme, rows, kinds, { end, left, narrow, spread }),
        ...kinds.map(([name, what, symbol, colour], k) => ({
          name: what,
          type: "scatter",
          symbol,
          symbolSize: 11,
          itemStyle: { color: theme[colour] },
          z: 4,
          data: rows.map((row, r) => [row[name], r + spread(k)]).filter(([x]) => isNumber(x) && Number(x) <= end),
        })),
      ],
    };
  });
}

/**
 * The last tick of the axis, and the distance of its ticks.
 * @param {ModelRow[]} rows
 */
function lastTick(rows) {
  /** @param {ModelRow} r */
  const ofRow = (r) => {
    const all = [r.fit, r.cv, r.expected, r.measured, r.noise, ...(r.band ?? []), ...(r.reach ?? [])];
    return all.filter(isNumber).map(Number);
  };
  // The nominal robot would leave no room for the rest: what lies beyond the axis is told in figures.
  const most = Math.max(...rows.filter((r) => !r.nominal).flatMap(ofRow));
  const all = Math.max(...rows.flatMap(ofRow));
  return ticks(all < 2.5 * most ? all : 1.15 * most);
}

/**
 * The line of each model: its name, ranges, what lies beyond the axis, and its noise.
 * @param {Theme} theme
 * @param {ModelRow[]} rows
 * @param {Kind[]} kinds
 * @param {{ end: number, left: number, narrow: boolean, spread: (k: number) => number }} layout
 * @returns {Option}
 */
function lines(theme, rows, kinds, { end, left, narrow, spread }) {
  /** @type {(row: ModelRow, y: number, x: number, width: number) => Option} */
  const name = ({ name: text }, y, x, width) => {
    const look = { text, fill: theme.ink, fontSize: 12 };
    if (narrow) {
      const over = { x, y: y - 22, width, align: "left", verticalAlign: "bottom", overflow: "truncate" };
      return { ...look, ...over, fontWeight: 600 };
    }
    const beside = { x: left - 12, y, width: left - 14, align: "right", verticalAlign: "middle", overflow: "break" };
    return { ...look, ...beside, lineHeight: 15 };
  };
  /** @type {(mm: number, x: number, y: number, colour: string) => Shape} */
  const beyond = (mm, x, y, colour) => {
    const place = { x, y, align: "right", verticalAlign: "middle" };
    const look = { fill: colour, fontSize: 12, fontWeight: 600, stroke: theme.paper, lineWidth: 3 };
    return { type: "text", style: { text: `${millimetres(mm)} mm →`, ...place, ...look } };
  };
  return {
    type: "custom",
    silent: true,
    data: rows.map((_, k) => [k]),
    encode: { x: -1, y: 0 },
    renderItem: (/** @type {RowAt} */ { coordSys: { x, width }, dataIndex }, /** @type {Api} */ api) => {
      const row = rows[dataIndex];
      /** @param {number} mm */
      const at = (mm) => api.coord([Math.min(mm, end), 0])[0];
      const [, y] = api.coord([1, dataIndex]);
      const children = [
        stroke([x, y], [x + width, y], { stroke: theme.grid, lineWidth: 1 }),
        { type: "text", style: name(row, y, x, width) },
      ];
      for (const [k, [figure, , , colour, reach]] of kinds.entries()) {
        const [, high] = api.coord([1, dataIndex + spread(k)]);
        const [range, value] = [reach && row[reach], row[figure]];
        const look = { stroke: theme[colour], lineWidth: 3, opacity: 0.5 };
        if (range) children.push(stroke([at(range[0]), high], [at(range[1]), high], look));
        if (isNumber(value) && Number(value) > end) {
          children.push(beyond(Number(value), x + width - 2, high, theme[colour]));
        }
      }
      if (row.noise) {
        const n = at(row.noise);
        children.push(stroke([n, y - 13], [n, y + 13], { stroke: theme.noise, lineWidth: 2, lineDash: [3, 3] }));
      }
      return { type: "group", children };
    },
  };
}
