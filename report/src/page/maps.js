// @ts-check
// Mean residuals by region, where something was measured.

import { cells } from "./charts.js";
import { chart } from "./drawing.js";
import { element, quiet, table, title, unfold } from "./elements.js";
import { cividis } from "./scales.js";
import { fixed, millimetres } from "./text.js";

/**
 * The smallest and largest value of all maps of errors on the page: one colour means one error in all of them.
 * @param {Report} report
 */
export function errorRange(report) {
  const grids = [report.figures.expected?.map?.cells, report.workspace?.measured];
  const means = grids.flatMap((grid) => (grid ?? []).flat().flatMap((cell) => (cell ? [cell.mean_mm] : [])));
  const maps = [report.residuals?.space?.maps, report.against?.maps];
  const left = maps.flatMap((map) => (map ? [...map.side, ...map.top].map((cell) => cell[4]) : []));
  const all = [...means, ...left];
  return [Math.min(...all), Math.max(...all)];
}

/**
 * The colours of a map with their numbers.
 * @param {Report} report
 */
export function colourKey(report) {
  const [low, high] = errorRange(report).map(millimetres);
  const stops = [0, 1, 2, 3, 4, 5, 6].map((k) => cividis(k / 6)[0]).join(", ");
  const bar = element("span", { class: "gradient", "aria-hidden": "true" });
  bar.style.background = `linear-gradient(to right, ${stops})`;
  const same = " mm; the same colours in every map of this page.";
  return element("p", { class: "quiet scale" }, `${low} mm `, bar, ` ${high}${same}`);
}

/**
 * @param {Report} report
 * @param {Cell[]} rows
 * @param {{ name: string, xName: string, yName: string }} of
 */
function residualMap(report, rows, { name, xName, yName }) {
  const [low, high] = errorRange(report);
  const [x0, x1, y0, y1, mm, samples] = rows.reduce((a, b) => (b[4] > a[4] ? b : a), rows[0]);
  const place = `${fixed(x0, 0)} to ${fixed(x1, 0)} by ${fixed(y0, 0)} to ${fixed(y1, 0)} mm`;
  const most = `the largest mean residual ${millimetres(mm)} mm of ${samples} samples at ${place}`;
  const host = chart(`${name}: ${rows.length} regions, ${most}.`, 400, (theme, width) => {
    const said = { name: "mean residual", counts: true, unit: "samples" };
    return cells(theme, { xName, yName, rows, points: [], low, high, width, ...said });
  });
  return element("figure", {}, title(name), host);
}

/**
 * @param {Report} report
 * @param {Space} space
 * @returns {Child[]}
 */
export function residualMaps(report, { maps }) {
  if (!maps.side.length) return [];
  const { against } = report;
  /** @type {(which: Maps, name: string) => HTMLElement} */
  const pair = (which, name) => {
    const side = {
      name: `From the side${name}`,
      xName: "distance of the TCP from axis 1, mm",
      yName: "height of the TCP over the base, mm",
    };
    const top = { name: `From above${name}`, xName: "x of the base, mm", yName: "y of the base, mm" };
    const both = [residualMap(report, which.side, side), residualMap(report, which.top, top)];
    return element("div", { class: "pair" }, both);
  };
  const [a, b] = against?.names ?? [];
  return [
    element("h3", {}, "Mean residual by region, where something was measured"),
    colourKey(report),
    pair(maps, against?.maps && a ? `, ${a}` : ""),
    against?.maps && pair(against.maps, b ? `, ${b}` : ""),
    quiet(
      "Numbers are millimetres: the mean length of the residual of the fitted samples in a region, and under it how " +
        "many they are. Regions without a sample are left empty: nothing is known of them from these residuals.",
    ),
    unfold("The maps as a table", numbers(maps), true),
  ];
}

/** @param {Maps} maps */
function numbers(maps) {
  /** @type {(view: string) => (cell: Cell) => { view: string, cell: Cell }} */
  const seen = (view) => (cell) => ({ view, cell });
  const rows = [...maps.side.map(seen("side")), ...maps.top.map(seen("above"))];
  /** @type {(from: number, to: number) => string} */
  const range = (from, to) => `${fixed(from, 0)} to ${fixed(to, 0)}`;
  return table(
    "Mean residual by region",
    [
      ["seen from", (r) => r.view, "words"],
      ["distance or x, mm", ({ cell }) => range(cell[0], cell[1])],
      ["height or y, mm", ({ cell }) => range(cell[2], cell[3])],
      ["mean residual, mm", ({ cell }) => millimetres(cell[4])],
      ["samples", ({ cell }) => String(cell[5])],
    ],
    rows,
  );
}
