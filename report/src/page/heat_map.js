// @ts-check
// Which joint's error follows which variable.

import { matrix } from "./charts.js";
import { chart, wide } from "./drawing.js";
import { element, figure, scrolling } from "./elements.js";
import { fixed } from "./text.js";

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function heatMap({ diagnosis }) {
  const { cells, best } = diagnosis.heat_map;
  if (!cells.length) return [];
  /** @param {string} variable */
  const plain = (variable) => variable.replace(/[() ]/g, "");
  const variables = [...new Set(cells.map((c) => plain(c.against)))];
  const joints = [...new Set(cells.map((c) => c.joint))];
  const most = Math.max(3, ...cells.map((c) => c.ln_evidence_against_background));
  const found = best ? `joint ${best.joint} follows ${best.against}` : "none";
  const label = `Evidence that the error of a joint follows a variable; best: ${found}.`;
  /** @type {(theme: Theme, c: HeatCell) => object} */
  const cell = (theme, { against, joint, ln_evidence_against_background: evidence }) => ({
    value: [variables.indexOf(plain(against)), joints.indexOf(joint), evidence],
    label: { color: evidence > 0.6 * most ? theme.paper : theme.ink },
  });
  /** @param {Item} item */
  const say = ({ value: [variable, joint, evidence] }) =>
    `joint ${joints[joint]} follows ${variables[variable]}\nln evidence ${fixed(evidence, 1)}`;
  const host = chart(label, 40 + 30 * joints.length, (theme, width) =>
    matrix(
      theme,
      {
        columns: variables,
        rows: joints.map((j) => `joint ${j}`),
        low: 0,
        high: most,
        colours: [theme.panel, theme.residual],
        data: cells.map((c) => cell(theme, c)),
        text: ({ value }) => fixed(value[2], 1),
        say,
      },
      width,
    ),
  );
  return [
    element("h3", {}, "Which joint’s error follows what, whatever its shape"),
    figure(
      scrolling("Map of joints and variables", wide(host, 560)),
      "Log evidence vs. the usual model discrepancy of a robot: above 3 is worth a look, far below 0 is nothing.",
    ),
  ];
}
