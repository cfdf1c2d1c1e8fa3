"use strict";
// The page of a study: response curves, quantiles, coverage. Every number comes from the document.

const study = JSON.parse(document.getElementById("data").textContent);
const LOOK = { trical: ["TriCal", "circle", "residual"], tracker: ["laser tracker", "diamond", "candidate"] };
const QUANTITIES = [["mean_mm", "mean position error, mm", 1], ["max_mm", "largest position error, mm", 1], ["cell_s", "cell time, min", 60]];
const points = study.points ?? [{ at: {}, methods: study.methods }];
const axes = study.axes ?? [];
const methods = points[0].methods.map((m) => m.name);
const quantile = (method, column, percent) => method[column]?.quantiles.find((q) => q.percent === percent);
const of = (point, name) => point.methods.find((m) => m.name === name);
const places = (point, but) => axes.filter((a) => a !== but).map((a) => `${a} = ${point.at[a]}`).join(", ");

// Where a chart's axis has it: numbers at their place, by ratios where they span more than a factor of twenty; labels in their order.
function along(axis) {
  const values = points.map((p) => p.at[axis]);
  if (!values.every((v) => typeof v === "number")) return { kind: "category", labels: [...new Set(values.map(String))] };
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const distinct = [...new Set(values)].toSorted((a, b) => a - b);
  // A few values are their own ticks.
  const ticks = distinct.length <= 8 ? { customValues: distinct } : {};
  return { kind: low > 0 && high / low > 20 ? "log" : "value", low, high, ticks };
}

// The median with the band that it is known in (thick), and what nine trials of ten gave (thin).
function bars(theme, name, rows, shift) {
  const colour = theme[LOOK[name][2]];
  return {
    name: LOOK[name][0], type: "custom", z: 3, data: rows, encode: { x: 0, y: [1, 2, 3, 4, 5] },
    renderItem: (_, api) => {
      const at = (k) => api.coord([api.value(0), api.value(k)]);
      const [x, median] = at(1);
      const line = (k, l, lineWidth) => ({ type: "line", shape: { x1: x + shift, y1: at(k)[1], x2: x + shift, y2: at(l)[1] }, style: { stroke: colour, lineWidth } });
      const mark = LOOK[name][1] === "circle"
        ? { type: "circle", shape: { cx: x + shift, cy: median, r: 4 } }
        : { type: "polygon", shape: { points: [[0, -6], [6, 0], [0, 6], [-6, 0]].map(([u, v]) => [x + shift + u, median + v]) } };
      return { type: "group", children: [line(2, 3, 1.2), line(4, 5, 4), { ...mark, style: { fill: colour } }] };
    },
  };
}

function response(axis, [column, title, divisor]) {
  const scale = along(axis);
  const labels = (theme) => ({ color: theme.quiet, fontSize: 11, hideOverlap: true, formatter: (v) => (scale.ticks.customValues ? String(v) : digits(v, 3)), ...scale.ticks });
  const place = (p) => (scale.kind === "category" ? scale.labels.indexOf(String(p.at[axis])) : p.at[axis]);
  const rows = (name) => points.flatMap((p, k) => {
    const [median, low, high] = [50, 5, 95].map((q) => quantile(of(p, name), column, q));
    if (!median) return [];
    return [[place(p), median.value, low.value, high.value, median.low ?? median.value, median.high ?? median.value].map((v, i) => (i ? v / divisor : v)).concat(k)];
  });
  const shown = methods.filter((name) => rows(name).length);
  if (!shown.length) return null;
  const medians = shown.flatMap((name) => rows(name).map((row) => row[1]));
  // Points that differ in nothing else are joined.
  const joined = (name) => Object.values(Object.groupBy(rows(name), (row) => places(points[row[6]], axis)))
    .filter((group) => group.length > 1).map((group) => group.toSorted((a, b) => a[0] - b[0]));
  // Lines are named where one other axis tells them apart, and they are few.
  const others = axes.filter((a) => a !== axis);
  const lines_of = shown.map(joined);
  const named = others.length === 1 && lines_of[0].length > 1 && lines_of[0].length <= 6;
  const name_of = (group) => String(points[group[0][6]].at[others[0]]);
  const say = ({ seriesName, value }) =>
    `${seriesName}${axes.length ? `\n${places(points[value[6]])}` : ""}\nmedian ${digits(value[1], 4)} (${digits(value[4], 4)} to ${digits(value[5], 4)})\n5 to 95 %: ${digits(value[2], 4)} to ${digits(value[3], 4)}`;
  const option = (theme, width) => {
    const right = named && width > 600 ? 150 : 26;
    const label_width = Math.max(30, (width - 74 - right) / (scale.labels?.length ?? 1) - 8);
    // By ratios where some medians are many times others; the least is then no zero.
    const [low, high] = [Math.min(...medians), Math.max(...medians)];
    const height = low > 0 && high / low > 20 ? { type: "log", min: 10 ** Math.floor(Math.log10(low)) } : { scale: false, min: 0 };
    const y_axis = axis_of(theme, title, 52, { ...height, axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } } });
    const margin = 0.06 * (scale.high - scale.low || 1);
    const x = scale.kind === "category"
      ? { ...axis_of(theme, axis, width > 600 ? 38 : 64), type: "category", data: scale.labels, axisLabel: { color: theme.quiet, fontSize: 11, interval: 0, width: Math.min(130, label_width), overflow: "break", lineHeight: 13 } }
      : axis_of(theme, axis, 27, {
        type: scale.kind, splitLine: { show: false }, axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } }, axisLabel: labels(theme),
        ...(scale.kind === "log" ? { min: scale.low / 1.3, max: scale.high * 1.3 } : { min: scale.low - margin, max: scale.high + margin }),
      });
    const lines = shown.flatMap((name, k) => lines_of[k].map((group) => ({
      type: "line", data: group.map((row) => row.slice(0, 2)), showSymbol: false, silent: true, z: 2,
      lineStyle: { color: theme[LOOK[name][2]], width: 1.6, opacity: 0.7 },
      endLabel: { show: named && width > 600 && k === 0, formatter: () => name_of(group), color: theme.quiet, fontSize: 11, lineHeight: 14, distance: 12, width: 130, overflow: "truncate" },
      labelLayout: { moveOverlap: "shiftY" },
    })));
    return {
      grid: { left: 74, right, top: 12, bottom: width > 600 ? 58 : 84, outerBoundsMode: "none" },
      tooltip: tooltip(theme, say), xAxis: x, yAxis: y_axis,
      series: [...lines, ...shown.map((name, k) => bars(theme, name, rows(name), shown.length > 1 ? 8 * k - 4 : 0))],
    };
  };
  const told = named ? `${title}; a line for each ${others[0]}` : title;
  return element("figure", {}, element("p", { class: "title" }, told), chart(`${title} over ${axis}`, 300, option));
}

const axis_of = axis;

// How the errors of a study at one point spread.
function spread() {
  const columns = [["mean_mm", "mean"], ["rms_mm", "rms"], ["p95_mm", "95 % below"], ["max_mm", "largest"], ["std_mm", "standard deviation"]];
  const rows = (method) => columns.flatMap(([column], k) => {
    const [median, low, high] = [50, 5, 95].map((q) => quantile(method, column, q));
    return median ? [[k, median.value, low.value, high.value, median.low ?? median.value, median.high ?? median.value]] : [];
  });
  const option = (theme, width) => ({
    grid: { left: 74, right: 26, top: 12, bottom: 42, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ seriesName, value }) => `${seriesName}, ${columns[value[0]][1]}\nmedian ${digits(value[1], 4)} mm (${digits(value[4], 4)} to ${digits(value[5], 4)})\n5 to 95 %: ${digits(value[2], 4)} to ${digits(value[3], 4)}`),
    xAxis: { ...axis_of(theme, "", 30), type: "category", data: columns.map(([, name]) => name), axisLabel: { color: theme.quiet, fontSize: 11, interval: 0, width: Math.min(110, (width - 100) / columns.length - 6), overflow: "break", lineHeight: 13 } },
    yAxis: axis_of(theme, "position error, mm", 52, { scale: false, min: 0 }),
    series: points[0].methods.map((m, k) => bars(theme, m.name, rows(m), 12 * k - 6)),
  });
  return element("figure", {}, chart("position errors of the trials", 300, option));
}

// Shares of intervals that held the truth, parameter by parameter, of a study at one point.
function coverage(method) {
  const rows = method.coverage;
  const option = (theme) => ({
    grid: { left: 74, right: 26, top: 12, bottom: 60, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ value }) => `${rows[value[0]].name}: ${percent(value[1])} (${percent(value[2])} to ${percent(value[3])}) of ${rows[value[0]].of}`),
    xAxis: { ...axis_of(theme, "", 40), type: "category", data: rows.map((r) => r.name), axisLabel: { color: theme.quiet, fontSize: 11, rotate: 60, interval: 0 } },
    yAxis: axis_of(theme, "share of intervals", 52, { max: 1, axisLabel: { color: theme.quiet, fontSize: 11, formatter: (v) => `${fixed(100 * v, 0)} %` } }),
    series: [{
      ...bars(theme, method.name, rows.map((r, k) => [k, r.share, r.low, r.high, r.share, r.share]), 0),
      markLine: { silent: true, symbol: "none", label: { show: false }, lineStyle: { color: theme.noise, type: "dashed" }, data: [{ yAxis: 0.95 }] },
    }],
  });
  return element("figure", {}, element("p", { class: "title" }, LOOK[method.name][0]), chart(`coverage by ${method.name}`, 280, option));
}

function marks() {
  const named = methods.map((name) => `${LOOK[name][1] === "circle" ? "●" : "◆"} ${LOOK[name][0]}`).join("   ");
  return element("p", { class: "quiet" }, `${named}.   Mark: median of the trials; thick bar: where endless trials would have it (95 % band); thin bar: nine trials of ten.`);
}

function numbers() {
  const rows = points.flatMap((point) => point.methods.map((method) => ({ point, method })));
  const banded = (method, column, divisor = 1) => {
    const q = quantile(method, column, 50);
    if (!q) return "–";
    const [v, low, high] = [q.value, q.low, q.high].map((x) => (x === null ? null : x / divisor));
    return low === null || high === null ? digits(v, 4) : `${digits(v, 4)} (${digits(low, 4)} to ${digits(high, 4)})`;
  };
  const all = (method) => method.coverage.reduce(([n, m], c) => [n + c.inside, m + c.of], [0, 0]);
  return table("Medians with their 95 % bands", [
    ...(axes.length ? axes.map((a) => [a, (r) => String(r.point.at[a]), "words"]) : []),
    ["method", (r) => LOOK[r.method.name][0], "words"],
    ["trials", (r) => String(r.method.done)],
    ["failed", (r) => String(Object.values(r.method.failed).reduce((a, b) => a + b, 0))],
    ["mean, mm", (r) => banded(r.method, "mean_mm")],
    ["max, mm", (r) => banded(r.method, "max_mm")],
    ["std, mm", (r) => banded(r.method, "std_mm")],
    ["as drawn, mean, mm", (r) => banded(r.method, "before_mean_mm")],
    ["cell time, min", (r) => banded(r.method, "cell_s", 60)],
    ["intervals that held the truth", (r) => { const [n, m] = all(r.method); return m ? percent(n / m) : "–"; }],
  ], rows);
}

const failures = points.flatMap((p) => Object.entries(p.methods[0].failed).map(([why, count]) => `${count} failed${axes.length ? ` at ${places(p)}` : ""}: ${why}`));
document.getElementById("head").append(
  element("p", { class: "eyebrow" }, `study ${study.study}`),
  element("h1", {}, study.question ?? study.study),
  element("p", { class: "means" }, `${study.trials} trials${axes.length ? ` at each of ${points.length} points` : ""}, seed ${study.seed}. A trial is the whole procedure, every error drawn anew.`),
);
const section = (title, ...content) => element("section", {}, element("h2", {}, title), ...content);
document.getElementById("main").append(
  ...(axes.length
    ? axes.map((a) => section(`How it depends on ${a}`, marks(), ...QUANTITIES.map((q) => response(a, q)).filter((f) => f)))
    : [
      section("Position errors on poses that were not fitted", marks(), spread()),
      section("How often an interval of 95 % held the truth", element("p", { class: "quiet" }, "Mark: share of the trials; bar: where endless trials would have it (95 % band, Wilson); dashes: the promise."), ...points[0].methods.filter((m) => m.coverage.length).map(coverage)),
    ]),
  section("The numbers", numbers()),
  ...(failures.length ? [section("What failed", element("ul", {}, failures.map((f) => element("li", {}, f))))] : []),
);
draw();
document.body.dataset.ready = "1";
