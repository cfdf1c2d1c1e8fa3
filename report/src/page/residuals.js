// @ts-check
// Residuals from every side, with what a candidate would take of them.

import { draw } from "./drawing.js";
import { forget } from "./drawn.js";
import { element, list, named, present, table, unfold, worded } from "./elements.js";
import { awaited, key } from "./key.js";
import { ballPanels, timePanels, viewPanels } from "./panels.js";
import { digits, fixed } from "./text.js";

/** @typedef {[against: string, heading: string]} Kind */

/** @type {Kind[]} */
const FIRST = [
  ["q", "Joints, against their own angle"],
  ["tau", "Joints, against the torque of gravity on them"],
];

/** @type {Kind[]} */
const FURTHER = [
  ["qcmd", "Joints, against commanded minus reported angle"],
  ["approach", "Joints, against the side from which they came"],
  ["payload", "Joints, against the payload"],
  ["time", "Joints, over time"],
  ["temp", "Joints, against the temperature"],
];

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function residuals(report) {
  const { residuals: shown, candidates, comparison, telling: first } = report;
  if (!shown) return awaited();
  const whole = { ...report, residuals: shown };
  const { samples, of } = shown;
  const panels = element("div");
  const chosen = first?.candidate ?? (candidates.length ? 0 : -1);
  fill(panels, whole, candidates[chosen] ?? null);
  /** @type {(c: Candidate, k: number) => HTMLElement} */
  const option = (c, k) => {
    const input = element("input", { type: "radio", name: "candidate", value: k });
    input.checked = k === (first?.candidate ?? 0);
    input.addEventListener("change", () => {
      fill(panels, whole, c);
      draw(panels);
    });
    return element("label", {}, input, named(report, c.effect), " ", element("code", {}, c.effect));
  };
  const legend = element("legend", {}, "Candidate drawn over the residuals");
  const mentioned = new Set();
  const all = samples.length < of ? `${samples.length} of the ${of} samples` : `All ${of} samples`;
  return [
    element(
      "p",
      {},
      "A residual is measured minus predicted. What a joint seems to err by is the turn of it, actual minus " +
        "reported, that would absorb most of a residual; samples in which it has less than a fifth of its " +
        "longest lever are not drawn. A residual after a fit is not the error: the fit has bent the model to the data.",
      samples.length < of ? ` Of ${of} samples ${samples.length} are drawn, evenly; means are of all.` : "",
    ),
    candidates.length > 1 && element("fieldset", {}, legend, candidates.map(option)),
    panels,
    element("h3", {}, "What is significant, in words"),
    list(comparison.sentences.map((text) => worded(report, text, mentioned))),
    unfold("The samples that fit worst", worst(comparison.worst.slice(0, 10))),
    unfold(`${all} as a table`, every(shown), true),
  ];
}

/**
 * Lays out the pictures, with this candidate in them.
 * @param {HTMLElement} panels
 * @param {WholeReport} report
 * @param {Candidate | null} candidate
 */
function fill(panels, report, candidate) {
  const { views, balls } = report.residuals;
  /** @param {Kind} kind */
  const shown = ([kind, heading]) => {
    const alike = views.filter((v) => v.against.startsWith(kind)).sort((a, b) => a.joint - b.joint);
    const own = alike.filter((v) => !v.against.startsWith("qcmd") || kind === "qcmd");
    return own.length ? [element("h3", {}, heading), viewPanels(report, own, candidate)] : [];
  };
  forget(panels);
  const more = FURTHER.flatMap(shown);
  const folded = more.length ? unfold("Further views: side of approach, payload, time, temperature", more, true) : null;
  folded?.addEventListener("toggle", () => folded.open && draw(folded));
  const name = candidate && named(report, candidate.effect);
  const content = [
    key(
      ["residual", "a sample"],
      ["mean", "mean of a bin or ball, one sigma"],
      candidate && ["line", `explained by ${name}, mean of a bin`],
      candidate && ["diamond", "the same of a sample"],
    ),
    balls.length > 0 && [element("h3", {}, "By ball"), ballPanels(report, candidate, 215)],
    FIRST.map(shown),
    element("h3", {}, "Over time"),
    timePanels(report, candidate),
    folded,
  ];
  panels.replaceChildren(...present(content));
}

/** @param {WorstSample[]} rows */
const worst = (rows) =>
  table(
    "Worst first",
    [
      ["sample", (w) => w.id, "words"],
      ["x, µm", (w) => digits(w.residual_um[0])],
      ["y, µm", (w) => digits(w.residual_um[1])],
      ["z, µm", (w) => digits(w.residual_um[2])],
      ["length, µm", (w) => digits(w.norm_um)],
      ["in units of noise", (w) => digits(w.normalised)],
      ["special", (w) => w.special.join("; "), "words"],
    ],
    rows,
  );

/** @param {Residuals} shown */
const every = ({ samples, balls }) =>
  table(
    "Residuals",
    [
      ["sample", (s) => s.id, "words"],
      ["ball", (s) => (s.ball === null ? "–" : balls[s.ball].ball), "words"],
      ["time, s", (s) => fixed(s.time_s, 0)],
      ["x, µm", (s) => digits(s.residual_um[0])],
      ["y, µm", (s) => digits(s.residual_um[1])],
      ["z, µm", (s) => digits(s.residual_um[2])],
    ],
    samples,
  );
