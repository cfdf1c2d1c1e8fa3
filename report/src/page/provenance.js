// @ts-check
// The cell, and where the report comes from.

import { element, figure, quiet, table } from "./elements.js";

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function cell({ pictures }) {
  if (!pictures?.length) return null;
  const shown = pictures.map(({ data, shows }) => figure(element("img", { src: data, alt: shows }), shows));
  return [element("div", { class: "pair" }, shown)];
}

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function provenance({ provenance: p, run, calibration }) {
  /** @type {[name: string, value: string | number | null | undefined][]} */
  const facts = [
    ["program", p.program],
    ["charts", p.charts],
    ["robot", calibration.robot],
    ["scenario", run?.scenario],
    ["seed", run?.seed],
    ["plant", run?.plant],
  ];
  const known = facts.flatMap(([name, value]) => (value || value === 0 ? [{ name, value: String(value) }] : []));
  /** @param {ReportedDataset} d */
  const stated = (d) =>
    Object.entries(d.stated)
      .map(([k, v]) => `${k} = ${v}`)
      .join(", ");
  /** @type {Column<ReportedDataset>[]} */
  const columns = [
    ["dataset", (d) => d.name, "words"],
    ["rows fitted", (d) => String(d.fit_rows)],
    ["rows judged on", (d) => String(d.validation_rows)],
    ["SHA-256 of its files", (d) => element("code", {}, d.sha256), "words"],
  ];
  if (p.datasets.some((d) => Object.keys(d.stated).length)) columns.push(["as stated", stated, "words"]);
  return [
    table(
      "What made this report",
      [
        ["what", (f) => f.name, "words"],
        ["which", (f) => f.value, "words"],
      ],
      known,
    ),
    table("Data", columns, p.datasets),
    quiet("The same run gives the same page, byte for byte."),
  ];
}
