// @ts-check
// Where in the workspace the error is to be expected.

import { cells } from "./charts.js";
import { chart } from "./drawing.js";
import { element, quiet, table, title, unfold } from "./elements.js";
import { colourKey, errorRange } from "./maps.js";
import { millimetres, thousandths } from "./text.js";

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function workspace(report) {
  const { workspace: it, figures, names } = report;
  const map = figures.expected?.map;
  if (!it || !map) return null;
  const ofPredicted = `${names.workspace}, from the fitted rows alone`;
  const ofMeasured = `${names.not_fitted}, ${figures.validation?.samples ?? ""} poses`;
  const pictures = [picture(report, it, "predicted", rows(map, map.cells), it.measured && ofPredicted)];
  if (it.measured) pictures.push(picture(report, it, "measured", rows(map, it.measured), ofMeasured));
  return [
    element("p", {}, report.verdict.expected),
    colourKey(report),
    element("div", { class: "pair" }, pictures),
    quiet(
      "Numbers are millimetres: the mean over the poses (dots) of a cell. Yellow is worse. The prediction carries " +
        "every effect of the catalogue, at every size that these data allow, to these poses.",
      it.measured ? " What was measured holds the noise of the instrument too." : "",
    ),
    unfold("The map as a table", numbers(map)),
  ];
}

/**
 * The cells of a grid that hold poses.
 * @param {ErrorMap} map
 * @param {ErrorMap["cells"]} grid
 * @returns {Cell[]}
 */
function rows({ radius_mm: r, height_mm: h }, grid) {
  return grid.flatMap((row, k) =>
    row.flatMap((cell, c) => {
      /** @type {Cell[]} */
      const here = cell ? [[r[c], r[c + 1], h[k], h[k + 1], cell.mean_mm, cell.poses]] : [];
      return here;
    }),
  );
}

/**
 * @param {Report} report
 * @param {Workspace} it
 * @param {string} name
 * @param {Cell[]} rows
 * @param {Child} heading
 */
function picture(report, it, name, rows, heading) {
  const [low, high] = errorRange(report);
  const errors = rows.map((c) => c[4]);
  const range = `${millimetres(Math.min(...errors))} to ${millimetres(Math.max(...errors))} mm`;
  const label = `Position error ${name} by distance from axis 1 and height over the base: ${range}.`;
  const host = chart(label, 400, (theme) =>
    cells(theme, {
      xName: "distance of the TCP from axis 1, mm",
      yName: "height of the TCP over the base, mm",
      rows,
      name,
      low,
      high,
      points: it.radius_mm.map((x, k) => [x, it.height_mm[k]]),
    }),
  );
  return element("figure", {}, heading ? title(heading) : null, host);
}

/** @param {ErrorMap} map */
function numbers({ radius_mm: r, height_mm: h, cells: grid }) {
  const heights = grid.map((row, k) => ({ name: `${h[k].toFixed(0)} to ${h[k + 1].toFixed(0)}`, row })).reverse();
  /** @typedef {typeof heights[0]} Row */
  /** @type {(from: number, c: number) => Column<Row>} */
  const column = (from, c) => [
    `${from.toFixed(0)} to ${r[c + 1].toFixed(0)}`,
    ({ row }) => {
      const cell = row[c];
      return cell && thousandths(cell.mean_mm);
    },
  ];
  /** @type {Column<Row>[]} */
  const columns = [["height, mm", (x) => x.name], ...r.slice(0, -1).map(column)];
  return table("Expected error, mm; columns are distances from axis 1, mm", columns, heights);
}
