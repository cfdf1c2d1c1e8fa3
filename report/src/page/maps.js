"use strict";
// Mean residuals by region, where something was measured.

// The smallest and largest value of all maps of errors on the page: one colour means one error in all of them.
function error_range(report) {
  const expected = (report.figures.expected?.map?.cells ?? []).flat().filter(Boolean).map((cell) => cell.mean_mm);
  const measured = (report.workspace?.measured ?? []).flat().filter(Boolean).map((cell) => cell.mean_mm);
  const of_maps = (maps) => (maps ? [...maps.side, ...maps.top].map((cell) => cell[4]) : []);
  const all = [...expected, ...measured, ...of_maps(report.residuals?.space?.maps), ...of_maps(report.against?.maps)];
  return [Math.min(...all), Math.max(...all)];
}

// The colours of a map with their numbers.
function colour_key(report) {
  const [low, high] = error_range(report);
  const stops = [0, 1, 2, 3, 4, 5, 6].map((k) => cividis(k / 6)[0]).join(", ");
  const bar = element("span", { class: "gradient", "aria-hidden": "true" });
  bar.style.background = `linear-gradient(to right, ${stops})`;
  return element("p", { class: "quiet scale" }, `${millimetres(low)} mm `, bar, ` ${millimetres(high)} mm; the same colours in every map of this page.`);
}

function residual_map(report, rows, { title, x_name, y_name }) {
  const [low, high] = error_range(report);
  const most = rows.reduce((a, b) => (b[4] > a[4] ? b : a), rows[0]);
  const label = `${title}: ${rows.length} regions, the largest mean residual ${millimetres(most[4])} mm of ${most[5]} samples at ${fixed(most[0], 0)} to ${fixed(most[1], 0)} by ${fixed(most[2], 0)} to ${fixed(most[3], 0)} mm.`;
  return element("figure", {}, element("p", { class: "title" }, title),
    chart(label, 400, (theme, width) => cells(theme, { x_name, y_name, rows, points: [], name: "mean residual", low, high, counts: true, unit: "samples", width })));
}

const FROM_THE_SIDE = { x_name: "distance of the TCP from axis 1, mm", y_name: "height of the TCP over the base, mm" };
const FROM_ABOVE = { x_name: "x of the base, mm", y_name: "y of the base, mm" };

function residual_maps(report) {
  const maps = report.residuals.space.maps;
  if (!maps.side.length) return [];
  const other = report.against?.maps;
  const [a, b] = report.against?.names ?? [];
  const of = (name) => (name ? `, ${name}` : "");
  const pair = (which, name) => element("div", { class: "pair" },
    residual_map(report, which.side, { title: `From the side${of(name)}`, ...FROM_THE_SIDE }), residual_map(report, which.top, { title: `From above${of(name)}`, ...FROM_ABOVE }));
  const rows = maps.side.map((c) => ({ view: "side", c })).concat(maps.top.map((c) => ({ view: "above", c })));
  return [
    element("h3", {}, "Mean residual by region, where something was measured"),
    colour_key(report),
    pair(maps, other ? a : null), other ? pair(other, b) : null,
    element("p", { class: "quiet" }, "Numbers are millimetres: the mean length of the residual of the fitted samples in a region, and under it how many they are. Regions without a sample are left empty: nothing is known of them from these residuals."),
    unfold("The maps as a table", table("Mean residual by region", [["seen from", (r) => r.view, "words"], ["distance or x, mm", (r) => `${fixed(r.c[0], 0)} to ${fixed(r.c[1], 0)}`], ["height or y, mm", (r) => `${fixed(r.c[2], 0)} to ${fixed(r.c[3], 0)}`], ["mean residual, mm", (r) => millimetres(r.c[4])], ["samples", (r) => String(r.c[5])]], rows), true),
  ];
}
