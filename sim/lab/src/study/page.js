// @ts-check
// The page of a study: response curves, quantiles, coverage. Every number comes from the document.

import { chart, draw } from "calibench-report/drawing.js";
import { byId, element, list, present, quiet, table, title } from "calibench-report/elements.js";
import { axis, edge, grid, plain, stroke, tooltip } from "calibench-report/options.js";
import { redrawOnChange } from "calibench-report/redraw.js";
import { digits, fixed, percent } from "calibench-report/text.js";

/** @typedef {StudyMethod["name"]} Name */
/** @typedef {[x: number, median: number, low: number, high: number, least: number, most: number]} Figures */
/** @typedef {{ figures: Figures, point: number }} Row of which point */

/** @type {Study} */
const study = JSON.parse(byId("data").textContent);
const points = study.points ?? [{ at: {}, methods: study.methods }];
const axes = study.axes ?? [];
const methods = points[0].methods.map((m) => m.name);

/** @type {Record<Name, { words: string, symbol: "circle" | "diamond", colour: "residual" | "candidate" }>} */
const LOOK = {
  trical: { words: "TriCal", symbol: "circle", colour: "residual" },
  tracker: { words: "laser tracker", symbol: "diamond", colour: "candidate" },
};

/** @type {[column: Quantity, name: string, divisor: number][]} */
const QUANTITIES = [
  ["mean_mm", "mean position error, mm", 1],
  ["max_mm", "largest position error, mm", 1],
  ["cell_s", "cell time, min", 60],
];

/**
 * @param {StudyMethod | undefined} method
 * @param {Quantity} column
 * @param {number} percent
 */
const quantile = (method, column, percent) => method?.[column]?.quantiles.find((q) => q.percent === percent);

/**
 * The settings of a point, but one.
 * @param {StudyPoint} point
 * @param {string} [but]
 */
function places(point, but) {
  return axes.flatMap((a) => (a === but ? [] : [`${a} = ${point.at[a]}`])).join(", ");
}

/**
 * The median of a quantity with the band that it is known in, and what nine trials of ten gave.
 * @param {StudyMethod | undefined} method
 * @param {Quantity} column
 * @param {number} x
 * @param {number} divisor
 * @returns {Figures[]}
 */
function figuresOf(method, column, x, divisor = 1) {
  const [median, low, high] = [50, 5, 95].map((q) => quantile(method, column, q));
  if (!median || !low || !high) return [];
  const { value } = median;
  const [a, b, c, d, e] = [value, low.value, high.value, median.low ?? value, median.high ?? value];
  return [[x, a / divisor, b / divisor, c / divisor, d / divisor, e / divisor]];
}

/**
 * What a tooltip says of a row.
 * @param {number[]} row
 */
function banded([, median, low, high, least, most], unit = "") {
  const known = `median ${digits(median, 4)}${unit} (${digits(least, 4)} to ${digits(most, 4)})`;
  return `${known}\n5 to 95 %: ${digits(low, 4)} to ${digits(high, 4)}`;
}

/**
 * Where a chart's axis has it: numbers at their place, by ratios where they span more than a factor of twenty; labels
 * in their order.
 * @param {string} along
 */
function scaleOf(along) {
  /** @type {string[]} */
  const none = [];
  const values = points.map((p) => p.at[along]);
  const numbers = values.filter((v) => typeof v === "number");
  if (numbers.length < values.length) {
    return { kind: "category", labels: [...new Set(values.map(String))], low: NaN, high: NaN, own: [] };
  }
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  const distinct = [...new Set(numbers)].toSorted((a, b) => a - b);
  // A few values are their own ticks.
  const own = distinct.length <= 8 ? distinct : [];
  return { kind: low > 0 && high / low > 20 ? "log" : "value", labels: none, low, high, own };
}

/**
 * The median with its band (thick), and what nine trials of ten gave (thin).
 * @param {Theme} theme
 * @param {Name} name
 * @param {number[][]} rows
 * @param {number} shift px
 * @returns {Option}
 */
function bars(theme, name, rows, shift) {
  const { words, symbol, colour } = LOOK[name];
  const corners = [
    [0, -6],
    [6, 0],
    [0, 6],
    [-6, 0],
  ];
  return {
    name: words,
    type: "custom",
    z: 3,
    data: rows,
    encode: { x: 0, y: [1, 2, 3, 4, 5] },
    renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
      /** @param {number} k */
      const at = (k) => api.coord([api.value(0), api.value(k)]);
      const [place, median] = at(1);
      const x = place + shift;
      /** @type {(from: number, to: number, lineWidth: number) => Shape} */
      const line = (from, to, lineWidth) =>
        stroke([x, at(from)[1]], [x, at(to)[1]], { stroke: theme[colour], lineWidth });
      const diamond = { type: "polygon", shape: { points: corners.map(([u, v]) => [x + u, median + v]) } };
      const circle = { type: "circle", shape: { cx: x, cy: median, r: 4 } };
      const mark = { ...(symbol === "circle" ? circle : diamond), style: { fill: theme[colour] } };
      return { type: "group", children: [line(2, 3, 1.2), line(4, 5, 4), mark] };
    },
  };
}

/**
 * How a quantity depends on a setting.
 * @param {string} along
 * @param {[column: Quantity, name: string, divisor: number]} quantity
 */
function response(along, [column, quantity, divisor]) {
  const scale = scaleOf(along);
  /** @param {StudyPoint} p */
  const place = (p) => (scale.kind === "category" ? scale.labels.indexOf(String(p.at[along])) : Number(p.at[along]));
  /** @type {(name: Name) => Row[]} */
  const ofMethod = (name) =>
    points.flatMap((p, k) => {
      const method = p.methods.find((m) => m.name === name);
      return figuresOf(method, column, place(p), divisor).map((figures) => ({ figures, point: k }));
    });
  const shown = methods.map((name) => ({ name, rows: ofMethod(name) })).filter(({ rows }) => rows.length);
  if (!shown.length) return null;
  const medians = shown.flatMap(({ rows }) => rows.map(({ figures: [, median] }) => median));
  // Lines are named where one other axis tells them apart, and they are few.
  const others = axes.filter((a) => a !== along);
  const lines = shown.map(({ name, rows }) => ({ name, groups: joined(rows, along) }));
  const count = lines[0].groups.length;
  const named = others.length === 1 && count > 1 && count <= 6;
  /** @param {Row[]} group */
  const nameOf = (group) => String(points[group[0].point].at[others[0]]);
  /** @param {Item} item */
  const say = ({ seriesName, value }) =>
    `${seriesName}${axes.length ? `\n${places(points[value[6]])}` : ""}\n${banded(value)}`;
  const host = chart(`${quantity} over ${along}`, 300, (theme, width) => {
    const right = named && width > 600 ? 150 : 26;
    const curves = lines.flatMap(({ name, groups }, k) =>
      groups.map((group) => ({
        type: "line",
        data: group.map(({ figures: [x, median] }) => [x, median]),
        showSymbol: false,
        silent: true,
        z: 2,
        lineStyle: { color: theme[LOOK[name].colour], width: 1.6, opacity: 0.7 },
        endLabel: {
          show: named && width > 600 && k === 0,
          formatter: () => nameOf(group),
          color: theme.quiet,
          fontSize: 11,
          lineHeight: 14,
          distance: 12,
          width: 130,
          overflow: "truncate",
        },
        labelLayout: { moveOverlap: "shiftY" },
      })),
    );
    const marks = shown.map(({ name, rows }, k) => {
      const values = rows.map(({ figures, point }) => [...figures, point]);
      return bars(theme, name, values, shown.length > 1 ? 8 * k - 4 : 0);
    });
    return {
      grid: grid(74, right, 12, width > 600 ? 58 : 84),
      tooltip: tooltip(theme, say),
      xAxis: settingAxis(theme, along, scale, width, right),
      yAxis: quantityAxis(theme, quantity, medians),
      series: [...curves, ...marks],
    };
  });
  return element("figure", {}, title(named ? `${quantity}; a line for each ${others[0]}` : quantity), host);
}

/**
 * Points that differ in nothing but one setting, in groups.
 * @param {Row[]} rows
 * @param {string} along
 */
function joined(rows, along) {
  const groups = Object.values(Object.groupBy(rows, (r) => places(points[r.point], along)));
  const several = groups.flatMap((group) => (group && group.length > 1 ? [group] : []));
  return several.map((group) => group.toSorted((a, b) => a.figures[0] - b.figures[0]));
}

/**
 * By ratios where some medians are many times others; the least is then no zero.
 * @param {Theme} theme
 * @param {string} name
 * @param {number[]} medians
 */
function quantityAxis(theme, name, medians) {
  const [low, high] = [Math.min(...medians), Math.max(...medians)];
  const byRatios = low > 0 && high / low > 20;
  const range = byRatios ? { type: "log", min: 10 ** Math.floor(Math.log10(low)) } : { scale: false, min: 0 };
  return axis(theme, name, 52, { ...range, ...edge(theme) });
}

/**
 * @param {Theme} theme
 * @param {string} name
 * @param {ReturnType<typeof scaleOf>} scale
 * @param {number} width px
 * @param {number} right px
 */
function settingAxis(theme, name, { kind, labels, low, high, own }, width, right) {
  const look = { color: theme.quiet, fontSize: 11 };
  if (kind === "category") {
    const room = Math.max(30, (width - 74 - right) / labels.length - 8);
    const broken = { interval: 0, width: Math.min(130, room), overflow: "break", lineHeight: 13 };
    const axisLabel = { ...look, ...broken };
    return axis(theme, name, width > 600 ? 38 : 64, { type: "category", data: labels, axisLabel });
  }
  const margin = 0.06 * (high - low || 1);
  const range = kind === "log" ? { min: low / 1.3, max: high * 1.3 } : { min: low - margin, max: high + margin };
  const formatter = (/** @type {number} */ v) => (own.length ? String(v) : digits(v, 3));
  const ticks = own.length ? { customValues: own } : {};
  const axisLabel = { ...look, hideOverlap: true, formatter, ...ticks };
  return axis(theme, name, 27, { type: kind, ...plain, ...edge(theme), axisLabel, ...range });
}

// How the errors of a study at one point spread.
function spread() {
  /** @type {[column: Quantity, name: string][]} */
  const columns = [
    ["mean_mm", "mean"],
    ["rms_mm", "rms"],
    ["p95_mm", "95 % below"],
    ["max_mm", "largest"],
    ["std_mm", "standard deviation"],
  ];
  const names = columns.map(([, name]) => name);
  /** @param {StudyMethod} method */
  const rows = (method) => columns.flatMap(([column], k) => figuresOf(method, column, k));
  /** @param {Item} item */
  const say = ({ seriesName, value }) => `${seriesName}, ${names[value[0]]}\n${banded(value, " mm")}`;
  const host = chart("position errors of the trials", 300, (theme, width) => {
    const room = Math.min(110, (width - 100) / names.length - 6);
    const broken = { interval: 0, width: room, overflow: "break", lineHeight: 13 };
    const axisLabel = { color: theme.quiet, fontSize: 11, ...broken };
    return {
      grid: grid(74, 26, 12, 42),
      tooltip: tooltip(theme, say),
      xAxis: axis(theme, "", 30, { type: "category", data: names, axisLabel }),
      yAxis: axis(theme, "position error, mm", 52, { scale: false, min: 0 }),
      series: points[0].methods.map((m, k) => bars(theme, m.name, rows(m), 12 * k - 6)),
    };
  });
  return element("figure", {}, host);
}

/**
 * Shares of intervals that held the truth, parameter by parameter, of a study at one point.
 * @param {StudyMethod} method
 */
function coverage(method) {
  const rows = method.coverage;
  /** @param {Item} item */
  const say = ({ value: [k, share, low, high] }) =>
    `${rows[k].name}: ${percent(share)} (${percent(low)} to ${percent(high)}) of ${rows[k].of}`;
  const shares = rows.map((r, k) => [k, r.share, r.low, r.high, r.share, r.share]);
  const host = chart(`coverage by ${method.name}`, 280, (theme) => {
    const look = { color: theme.quiet, fontSize: 11 };
    const formatter = (/** @type {number} */ v) => `${fixed(100 * v, 0)} %`;
    return {
      grid: grid(74, 26, 12, 60),
      tooltip: tooltip(theme, say),
      xAxis: axis(theme, "", 40, {
        type: "category",
        data: rows.map((r) => r.name),
        axisLabel: { ...look, rotate: 60, interval: 0 },
      }),
      yAxis: axis(theme, "share of intervals", 52, { max: 1, axisLabel: { ...look, formatter } }),
      series: [
        {
          ...bars(theme, method.name, shares, 0),
          markLine: {
            silent: true,
            symbol: "none",
            label: { show: false },
            lineStyle: { color: theme.noise, type: "dashed" },
            data: [{ yAxis: 0.95 }],
          },
        },
      ],
    };
  });
  return element("figure", {}, title(LOOK[method.name].words), host);
}

function marks() {
  const named = methods.map((name) => `${LOOK[name].symbol === "circle" ? "●" : "◆"} ${LOOK[name].words}`);
  return quiet(
    `${named.join("   ")}.   Mark: median of the trials; thick bar: where endless trials would have it (95 % band); ` +
      "thin bar: nine trials of ten.",
  );
}

function numbers() {
  const rows = points.flatMap((point) => point.methods.map((method) => ({ point, method })));
  /** @typedef {typeof rows[0]} Line */
  /** @type {(name: string, quantity: Quantity, divisor?: number) => Column<Line>} */
  const median = (name, quantity, divisor = 1) => [
    name,
    ({ method }) => {
      const q = quantile(method, quantity, 50);
      if (!q) return "–";
      const value = digits(q.value / divisor, 4);
      if (q.low === null || q.high === null) return value;
      return `${value} (${digits(q.low / divisor, 4)} to ${digits(q.high / divisor, 4)})`;
    },
  ];
  /** @param {Line} line */
  const held = ({ method }) => {
    const inside = method.coverage.reduce((n, c) => n + c.inside, 0);
    const all = method.coverage.reduce((n, c) => n + c.of, 0);
    return all ? percent(inside / all) : "–";
  };
  /** @param {Line} line */
  const failed = ({ method }) => String(Object.values(method.failed).reduce((a, b) => a + b, 0));
  /** @type {(setting: string) => Column<Line>} */
  const setting = (a) => [a, ({ point }) => String(point.at[a]), "words"];
  /** @type {Column<Line>[]} */
  const columns = [
    ...axes.map(setting),
    ["method", ({ method }) => LOOK[method.name].words, "words"],
    ["trials", ({ method }) => String(method.done)],
    ["failed", failed],
    median("mean, mm", "mean_mm"),
    median("max, mm", "max_mm"),
    median("std, mm", "std_mm"),
    median("uncalibrated, mean, mm", "before_mean_mm"),
    median("cell time, min", "cell_s", 60),
    ["intervals that held the truth", held],
  ];
  return table("Medians with their 95 % bands", columns, rows);
}

/**
 * @param {string} heading
 * @param {Child[]} content
 */
const section = (heading, ...content) => element("section", {}, element("h2", {}, heading), content);

// What a study at one point says.
const atOnePoint = () => [
  section("Position errors on poses that were not fitted", marks(), spread()),
  section(
    "How often an interval of 95 % held the truth",
    quiet(
      "Mark: share of the trials; bar: where endless trials would have it (95 % band, Wilson); dashes: the promise.",
    ),
    points[0].methods.filter((m) => m.coverage.length).map(coverage),
  ),
];

/** @param {string} along */
const dependence = (along) =>
  section(
    `How it depends on ${along}`,
    marks(),
    QUANTITIES.map((quantity) => response(along, quantity)),
  );

const failures = points.flatMap((p) => {
  const where = axes.length ? ` at ${places(p)}` : "";
  return Object.entries(p.methods[0].failed).map(([why, count]) => `${count} failed${where}: ${why}`);
});
const each = axes.length ? ` at each of ${points.length} points` : "";

redrawOnChange();
byId("head").append(
  element("p", { class: "eyebrow" }, `study ${study.study}`),
  element("h1", {}, study.question ?? study.study),
  element(
    "p",
    { class: "means" },
    `${study.trials} trials${each}, seed ${study.seed}. A trial is the whole procedure, every error sampled again.`,
  ),
);
const sections = [
  axes.length ? axes.map(dependence) : atOnePoint(),
  section("The numbers", numbers()),
  failures.length > 0 && section("What failed", list(failures)),
];
byId("main").append(...present(sections));
draw();
document.body.dataset.ready = "1";
