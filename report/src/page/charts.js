"use strict";
// Charts: how each kind is drawn. What is drawn has been computed before; nothing here but ranges of axes.

const drawn = [];

function colours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "quiet", "paper", "panel", "rule", "grid", "residual", "candidate", "predicted", "measured", "other", "noise", "mean"];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

// A chart that `option(colours, width)` describes; `label` is what it says to those who do not see it. A height may depend on the width.
function chart(label, height, option) {
  const host = element("div", { class: "chart", role: "img", "aria-label": label });
  // A height that depends on the width is known once it is drawn; until then room is kept for it.
  host.style.height = `${typeof height === "number" ? height : 300}px`;
  drawn.push({ host, height, option, chart: null });
  return host;
}

function draw(within = document) {
  const [theme, fontFamily] = [colours(), getComputedStyle(document.body).fontFamily];
  for (const one of drawn) if (within === document || within.contains(one.host)) draw_one(one, theme, fontFamily);
}

// Those that are in sight at once, the others in slices in which the page still answers; `then` when all are drawn.
function draw_soon(parts, then) {
  const of_parts = drawn.filter((one) => parts.some((part) => part.contains(one.host)));
  const in_sight = ({ host }) => { const { top, bottom } = host.getBoundingClientRect(); return bottom > 0 && top < innerHeight; };
  const [theme, fontFamily] = [colours(), getComputedStyle(document.body).fontFamily];
  const first = new Set(of_parts.filter(in_sight));
  for (const one of first) draw_one(one, theme, fontFamily);
  // What has been drawn meanwhile, or is no longer on the page, is not drawn again.
  const later = of_parts.filter((one) => !first.has(one));
  const slice = () => {
    const until = performance.now() + SLICE;
    while (later.length && performance.now() < until) {
      const one = later.shift();
      if (!one.chart && drawn.includes(one)) draw_one(one, colours(), fontFamily);
    }
    if (later.length) setTimeout(slice);
    else then();
  };
  setTimeout(slice);
}

// How long a slice of drawing takes, ms.
const SLICE = 40;

function draw_one(one, theme, fontFamily) {
  one.chart?.dispose();
  one.chart = null;
  const width = one.host.clientWidth;
  if (!one.host.isConnected || width === 0) return;
  const height = typeof one.height === "number" ? one.height : one.height(width);
  one.host.style.height = `${height}px`;
  if (one.paint) {
    one.chart = one.paint(theme, width, height);
    return;
  }
  one.chart = echarts.init(one.host, null, { renderer: "svg", width, height });
  const option = one.option(theme, width);
  one.chart.setOption({ animation: false, textStyle: { fontFamily }, ...option });
  link(one, option);
}

function axis(theme, name, gap, more = {}) {
  return {
    type: "value", name, nameLocation: "middle", nameGap: gap, scale: true,
    nameTextStyle: { color: theme.quiet, fontSize: 12 },
    axisLine: { show: true, lineStyle: { color: theme.noise } },
    axisTick: { show: false },
    axisLabel: { color: theme.quiet, fontSize: 11, hideOverlap: true },
    splitLine: { lineStyle: { color: theme.grid } },
    splitNumber: 4,
    ...more,
  };
}

const tooltip = (theme, formatter) => ({
  trigger: "item", renderMode: "richText", confine: true, backgroundColor: theme.panel, borderColor: theme.rule,
  textStyle: { color: theme.ink, fontSize: 12 }, formatter,
});

// The next larger number whose half is round too.
function round_up(x) {
  if (!(x > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(x));
  return power * [1, 1.2, 1.6, 2, 3, 4, 5, 6, 8, 10].find((step) => step * power >= x * 0.999999);
}

// Round ticks from zero to no less than `x`: [the last, the distance].
function ticks(x) {
  const power = 10 ** Math.floor(Math.log10(x / 4 || 1));
  const distance = power * [1, 2, 2.5, 5, 10].find((step) => step * power >= x / 5);
  return [distance * Math.ceil((x * 0.999999) / distance), distance];
}

function largest(values) {
  return values.reduce((most, x) => (x === null || x === undefined ? most : Math.max(most, Math.abs(x))), 0);
}

// Marks of the two kinds of points: what is left, and what a candidate would take of it.
const residual_points = (theme, data, size = 5) => ({
  name: "residual", type: "scatter", symbol: "circle", symbolSize: size, data,
  itemStyle: { color: theme.residual, opacity: 0.65 },
});

const candidate_points = (theme, data, size = 8) => ({
  name: "candidate", type: "scatter", symbol: "diamond", symbolSize: size, data, z: 4,
  itemStyle: { color: "transparent", borderColor: theme.candidate, borderWidth: 1.6 },
});

// Means with bars of one sigma.
function means(theme, rows) {
  return {
    name: "mean", type: "custom", z: 3, silent: true, data: rows.map(({ x, mean, sigma }) => [x, mean, mean - sigma, mean + sigma]),
    encode: { x: 0, y: [1, 2, 3] },
    renderItem: (_, api) => {
      const [x, low] = api.coord([api.value(0), api.value(2)]);
      const [, high] = api.coord([api.value(0), api.value(3)]);
      const [, mean] = api.coord([api.value(0), api.value(1)]);
      const stroke = { stroke: theme.mean, lineWidth: 1.4 };
      return { type: "group", children: [
        { type: "line", shape: { x1: x, y1: low, x2: x, y2: high }, style: stroke },
        { type: "rect", shape: { x: x - 3, y: mean - 3, width: 6, height: 6 }, style: { fill: theme.mean } },
      ] };
    },
  };
}

const pairs = (xs, ys, ids) => xs.map((x, k) => [x, ys[k], ids?.[k]]).filter(([x, y]) => x !== null && y !== null);

// Points, means and a candidate over one variable.
function scatter(theme, { x_name, y_name, points, candidate, line, bins, limit, x_axis, spacious, unit, bottom = 44 }) {
  const size = spacious ? 7 : 5;
  const say = ({ seriesName, value }) =>
    `${value[2] ?? ""}\n${seriesName === "candidate" ? "the candidate takes" : "residual"} ${digits(value[1])} ${unit}\nat ${digits(value[0], 4)}`;
  const series = [{ ...residual_points(theme, points, size), markLine: zero(theme) }];
  if (bins) series.push(means(theme, bins));
  if (line) series.push({ name: "candidate", type: "line", data: line, showSymbol: false, z: 4, lineStyle: { color: theme.candidate, width: 2.4 }, silent: true });
  if (candidate) series.push(candidate_points(theme, candidate, spacious ? 10 : 7));
  // Room for the longest label of the axis.
  const label = 7 * Math.max(...[limit, limit / 2].map((x) => x.toLocaleString("en").length)) + 10;
  return {
    grid: { left: label + 24, right: 26, top: 12, bottom, outerBoundsMode: "none" },
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, x_name, bottom - 17, { splitLine: { show: false }, axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } }, ...x_axis }),
    yAxis: axis(theme, y_name, label + 6, { min: -limit, max: limit, interval: limit / 2, axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } } }),
    series,
  };
}

const zero = (theme) => ({
  silent: true, symbol: "none", label: { show: false }, lineStyle: { color: theme.noise, type: "solid", width: 1 }, data: [{ yAxis: 0 }],
});

// Rectangles over two lengths, each with its number and a colour of its own scale; `cells` are [x0, x1, y0, y1, value, poses].
function cells(theme, { x_name, y_name, rows, points, name, low, high, counts = false, unit = "poses", width = 600 }) {
  // Labels of the heights may be as long as "-1,000".
  const label = 7 * Math.max(...rows.flatMap((row) => [row[2], row[3]]).map((y) => Math.round(y).toLocaleString("en").length)) + 8;
  const scale = (x) => cividis((x - low) / (high - low || 1));
  return {
    grid: { left: label + 24, right: 26, top: 12, bottom: 44, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ value }) => `${name} ${digits(value[4])} mm\nmean of ${value[5]} ${unit}`),
    xAxis: axis(theme, x_name, 27, { splitLine: { show: false }, axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } } }),
    yAxis: axis(theme, y_name, label + 6, { splitLine: { show: false }, axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } } }),
    series: [
      {
        type: "custom", data: rows, encode: { x: [0, 1], y: [2, 3] }, clip: true,
        renderItem: (_, api) => {
          const [left, bottom] = api.coord([api.value(0), api.value(2)]);
          const [right, top] = api.coord([api.value(1), api.value(3)]);
          return {
            type: "rect", shape: { x: left, y: top, width: right - left, height: bottom - top },
            style: { fill: scale(api.value(4))[0], stroke: theme.paper, lineWidth: 1 },
          };
        },
      },
      { type: "scatter", data: points, symbolSize: 2.5, silent: true, itemStyle: { color: theme.paper, opacity: 0.5 } },
      {
        type: "custom", data: rows, encode: { x: [0, 1], y: [2, 3] }, silent: true, z: 5,
        renderItem: (_, api) => {
          const [x, y] = api.coord([(api.value(0) + api.value(1)) / 2, (api.value(2) + api.value(3)) / 2]);
          const [colour, ink] = scale(api.value(4));
          return { type: "text", style: { text: counts ? `${fixed(api.value(4), 3)}\n${api.value(5)}` : fixed(api.value(4), 3), x, y, align: "center", verticalAlign: "middle", fill: ink, stroke: colour, lineWidth: 3, fontSize: width < 420 ? 10 : 12, lineHeight: width < 420 ? 12 : 15, fontWeight: 600 } };
        },
      },
    ],
  };
}

// The scale cividis (Nunez, Anderton and Renslow 2018), which reads alike with any colour vision, in seven stops; and the ink on it.
function cividis(t) {
  const stops = [[0, 34, 78], [43, 63, 110], [87, 92, 109], [124, 123, 120], [165, 156, 116], [209, 193, 93], [254, 232, 56]];
  const at = Math.min(0.9999, Math.max(0, t)) * (stops.length - 1);
  const [low, high, rest] = [stops[Math.floor(at)], stops[Math.floor(at) + 1], at % 1];
  const rgb = low.map((x, k) => Math.round(x + (high[k] - x) * rest));
  return [`rgb(${rgb.join(",")})`, 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2] > 125 ? "#16191d" : "#ffffff"];
}

// Bars between edges, in mm; lines where something stands.
function bars(theme, { rows, x_name, most: [most, apart], highest: [highest, above], marks, colour }) {
  const label = 7 * highest.toLocaleString("en").length + 8;
  return {
    grid: { left: label + 24, right: 26, top: 40, bottom: 44, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ value }) => `${millimetres(value[0])} to ${millimetres(value[1])} mm\n${value[2]} poses`),
    xAxis: axis(theme, x_name, 27, { min: 0, max: most, interval: apart, splitLine: { show: false } }),
    yAxis: axis(theme, "poses", label + 4, { min: 0, max: highest, interval: above }),
    series: [{
      type: "custom", data: rows, encode: { x: [0, 1], y: 2 },
      renderItem: (_, api) => {
        const [left, top] = api.coord([api.value(0), api.value(2)]);
        const [right, bottom] = api.coord([api.value(1), 0]);
        return { type: "rect", shape: { x: left + 0.5, y: top, width: Math.max(1, right - left - 1), height: bottom - top }, style: { fill: colour, opacity: 0.8 } };
      },
      markLine: {
        silent: true, symbol: "none", lineStyle: { width: 1.5 },
        data: marks.map(({ at, text, type }, k) => ({
          xAxis: at, lineStyle: { color: theme.ink, type },
          label: { formatter: () => text, color: theme.ink, fontSize: 11, position: "end", align: at > 0.55 * most ? "right" : "left", offset: [0, -14 * k] },
        })),
      },
    }],
  };
}

// Pixels that the longest of some labels takes.
const room = (labels, size) => Math.min(165, 14 + 0.64 * size * Math.max(...labels.map((text) => text.length)));

// Cells of rows by columns, each with a value; `ink` says what is written in it.
function matrix(theme, { columns, rows, data, low, high, colours: scale, text, say, label_size = 11, columns_turned = 0 }, width) {
  const left = room(rows, label_size);
  // Where names would run into each other some are left out.
  const interval = (width - left - 10) / columns.length < label_size + 2 ? "auto" : 0;
  return {
    grid: { left, right: 10, top: 6, bottom: columns_turned ? room(columns, label_size) : 26, outerBoundsMode: "none" },
    tooltip: tooltip(theme, say),
    xAxis: { type: "category", data: columns, axisLabel: { color: theme.quiet, fontSize: label_size, interval, rotate: columns_turned, width: 150, overflow: "truncate" }, axisTick: { show: false }, axisLine: { show: false } },
    yAxis: { type: "category", data: rows, inverse: true, axisLabel: { color: theme.quiet, fontSize: label_size, interval: 0, width: 150, overflow: "truncate" }, axisTick: { show: false }, axisLine: { show: false } },
    visualMap: { show: false, min: low, max: high, inRange: { color: scale }, dimension: 2 },
    series: [{ type: "heatmap", data, itemStyle: { borderColor: theme.paper, borderWidth: 1 }, label: { show: Boolean(text), fontSize: 11, formatter: text } }],
  };
}
