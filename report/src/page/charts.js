// @ts-check
// Kinds of charts that several sections draw.

import {
  axis,
  candidatePoints,
  categories,
  edge,
  grid,
  plain,
  rectangle,
  residualPoints,
  stroke,
  tooltip,
  zero,
} from "./options.js";
import { cividis, room } from "./scales.js";
import { digits, fixed, millimetres } from "./text.js";

/**
 * Means with bars of one sigma.
 * @param {Theme} theme
 * @param {Bin[]} rows
 * @returns {Option}
 */
function means(theme, rows) {
  return {
    name: "mean",
    type: "custom",
    z: 3,
    silent: true,
    data: rows.map(({ x, mean, sigma }) => [x, mean, mean - sigma, mean + sigma]),
    encode: { x: 0, y: [1, 2, 3] },
    renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
      const [x, low] = api.coord([api.value(0), api.value(2)]);
      const [, high] = api.coord([api.value(0), api.value(3)]);
      const [, mean] = api.coord([api.value(0), api.value(1)]);
      const bar = stroke([x, low], [x, high], { stroke: theme.mean, lineWidth: 1.4 });
      return { type: "group", children: [bar, rectangle(x - 3, mean - 3, 6, 6, { fill: theme.mean })] };
    },
  };
}

/**
 * Points, means and a candidate over one variable.
 * @param {Theme} theme
 * @param {object} of
 * @param {string} of.xName
 * @param {string} of.yName
 * @param {string} of.unit of the heights
 * @param {number} of.limit of the heights, on both sides of zero
 * @param {unknown[]} of.points
 * @param {unknown[] | null} [of.candidate]
 * @param {unknown[]} [of.line]
 * @param {Bin[]} [of.bins]
 * @param {Option} [of.xAxis]
 * @param {boolean} [of.spacious]
 * @param {number} [of.bottom]
 * @returns {Option}
 */
export function scatter(theme, of) {
  const { xName, yName, points, candidate, line, bins, limit, xAxis, spacious, unit, bottom = 44 } = of;
  /** @param {Item} item */
  const say = ({ seriesName, value }) => {
    const what = seriesName === "candidate" ? "the candidate explains" : "residual";
    return `${value[2] ?? ""}\n${what} ${digits(value[1])} ${unit}\nat ${digits(value[0], 4)}`;
  };
  /** @type {Option[]} */
  const series = [{ ...residualPoints(theme, points, spacious ? 7 : 5), markLine: zero(theme) }];
  if (bins) series.push(means(theme, bins));
  const curve = {
    type: "line",
    showSymbol: false,
    z: 4,
    lineStyle: { color: theme.candidate, width: 2.4 },
    silent: true,
  };
  if (line) series.push({ name: "candidate", data: line, ...curve });
  if (candidate) series.push(candidatePoints(theme, candidate, spacious ? 10 : 7));
  // Room for the longest label of the axis.
  const label = 7 * Math.max(...[limit, limit / 2].map((x) => x.toLocaleString("en").length)) + 10;
  return {
    grid: grid(label + 24, 26, 12, bottom),
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, xName, bottom - 17, { ...plain, ...edge(theme), ...xAxis }),
    yAxis: axis(theme, yName, label + 6, { min: -limit, max: limit, interval: limit / 2, ...edge(theme) }),
    series,
  };
}

/**
 * Rectangles over two lengths, each with its number and a colour of its own scale.
 * @param {Theme} theme
 * @param {object} of
 * @param {string} of.xName
 * @param {string} of.yName
 * @param {Cell[]} of.rows
 * @param {number[][]} of.points
 * @param {string} of.name
 * @param {number} of.low
 * @param {number} of.high
 * @param {boolean} [of.counts]
 * @param {string} [of.unit]
 * @param {number} [of.width] of the chart, px
 * @returns {Option}
 */
export function cells(theme, of) {
  const { xName, yName, rows, points, name, low, high, counts = false, unit = "poses", width = 600 } = of;
  // Labels of the heights may be as long as "-1,000".
  const heights = rows.flatMap((row) => [row[2], row[3]]);
  const label = 7 * Math.max(...heights.map((y) => Math.round(y).toLocaleString("en").length)) + 8;
  /** @param {number} x */
  const scale = (x) => cividis((x - low) / (high - low || 1));
  const of4 = { type: "custom", data: rows, encode: { x: [0, 1], y: [2, 3] } };
  const letters = width < 420 ? { fontSize: 10, lineHeight: 12 } : { fontSize: 12, lineHeight: 15 };
  return {
    grid: grid(label + 24, 26, 12, 44),
    tooltip: tooltip(theme, ({ value }) => `${name} ${digits(value[4])} mm\nmean of ${value[5]} ${unit}`),
    xAxis: axis(theme, xName, 27, { ...plain, ...edge(theme) }),
    yAxis: axis(theme, yName, label + 6, { ...plain, ...edge(theme) }),
    series: [
      {
        ...of4,
        clip: true,
        renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
          const [left, bottom] = api.coord([api.value(0), api.value(2)]);
          const [right, top] = api.coord([api.value(1), api.value(3)]);
          const style = { fill: scale(api.value(4))[0], stroke: theme.paper, lineWidth: 1 };
          return rectangle(left, top, right - left, bottom - top, style);
        },
      },
      { type: "scatter", data: points, symbolSize: 2.5, silent: true, itemStyle: { color: theme.paper, opacity: 0.5 } },
      {
        ...of4,
        silent: true,
        z: 5,
        renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
          const [x, y] = api.coord([(api.value(0) + api.value(1)) / 2, (api.value(2) + api.value(3)) / 2]);
          const [colour, ink] = scale(api.value(4));
          const text = counts ? `${fixed(api.value(4), 3)}\n${api.value(5)}` : fixed(api.value(4), 3);
          const place = { x, y, align: "center", verticalAlign: "middle" };
          const look = { fill: ink, stroke: colour, lineWidth: 3, fontWeight: 600, ...letters };
          return { type: "text", style: { text, ...place, ...look } };
        },
      },
    ],
  };
}

/**
 * Bars between edges, in mm; lines where something stands.
 * @param {Theme} theme
 * @param {object} of
 * @param {number[][]} of.rows from, to, count
 * @param {string} of.xName
 * @param {[last: number, apart: number]} of.most
 * @param {[last: number, apart: number]} of.highest
 * @param {{ at: number, text: string, type: string }[]} of.marks
 * @param {string} of.colour
 * @returns {Option}
 */
export function bars(theme, { rows, xName, most: [most, apart], highest: [highest, above], marks, colour }) {
  const label = 7 * highest.toLocaleString("en").length + 8;
  /** @param {Item} item */
  const say = ({ value }) => `${millimetres(value[0])} to ${millimetres(value[1])} mm\n${value[2]} poses`;
  return {
    grid: grid(label + 24, 26, 40, 44),
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, xName, 27, { min: 0, max: most, interval: apart, ...plain }),
    yAxis: axis(theme, "poses", label + 4, { min: 0, max: highest, interval: above }),
    series: [
      {
        type: "custom",
        data: rows,
        encode: { x: [0, 1], y: 2 },
        renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
          const [left, top] = api.coord([api.value(0), api.value(2)]);
          const [right, bottom] = api.coord([api.value(1), 0]);
          const style = { fill: colour, opacity: 0.8 };
          return rectangle(left + 0.5, top, Math.max(1, right - left - 1), bottom - top, style);
        },
        markLine: {
          silent: true,
          symbol: "none",
          lineStyle: { width: 1.5 },
          data: marks.map(({ at, text, type }, k) => ({
            xAxis: at,
            lineStyle: { color: theme.ink, type },
            label: {
              formatter: () => text,
              color: theme.ink,
              fontSize: 11,
              position: "end",
              align: at > 0.55 * most ? "right" : "left",
              offset: [0, -14 * k],
            },
          })),
        },
      },
    ],
  };
}

/**
 * Cells of rows by columns, each with a value.
 * @param {Theme} theme
 * @param {object} of
 * @param {string[]} of.columns
 * @param {string[]} of.rows
 * @param {unknown[]} of.data
 * @param {number} of.low
 * @param {number} of.high
 * @param {string[]} of.colours from the lowest value to the highest
 * @param {(item: Item) => string} [of.text] what is written in a cell
 * @param {(item: Item) => string} of.say
 * @param {number} [of.labelSize] px
 * @param {number} [of.columnsTurned] deg
 * @param {number} width px
 * @returns {Option}
 */
export function matrix(theme, of, width) {
  const { columns, rows, data, low, high, colours, text, say, labelSize = 11, columnsTurned = 0 } = of;
  const left = room(rows, labelSize);
  // Where names would run into each other some are left out.
  const interval = (width - left - 10) / columns.length < labelSize + 2 ? "auto" : 0;
  const label = { color: theme.quiet, fontSize: labelSize, width: 150, overflow: "truncate" };
  return {
    grid: grid(left, 10, 6, columnsTurned ? room(columns, labelSize) : 26),
    tooltip: tooltip(theme, say),
    xAxis: categories(columns, { ...label, interval, rotate: columnsTurned }),
    yAxis: categories(rows, { ...label, interval: 0 }, { inverse: true }),
    visualMap: { show: false, min: low, max: high, inRange: { color: colours }, dimension: 2 },
    series: [
      {
        type: "heatmap",
        data,
        itemStyle: { borderColor: theme.paper, borderWidth: 1 },
        label: { show: Boolean(text), fontSize: 11, formatter: text },
      },
    ],
  };
}
