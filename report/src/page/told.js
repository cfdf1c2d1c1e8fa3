// @ts-check
// What was seen, what it means, what to do; and what these data cannot tell.

import { element, unfold, worded } from "./elements.js";
import { capital } from "./text.js";

// What a sentence of the program begins with.
const BEGINS =
  /^(Saw|Means|Do|Verify|If nothing is done|Not tested|Order|Repeats|WARNING|Not believable at this size): (.*)$/s;

const OF_THE_FIT = "Residual of the fit ";

/** @type {[word: string, of: RegExp][]} */
const BY_WHAT = [
  ["Explained", /explains \d+ % of the squares/],
  ["Look at", /^Look at /],
];

/**
 * What a sentence is about, before it: a word of its own, or one by what it says.
 * @param {string} text
 * @returns {[word: string, rest: string]}
 */
function labelled(text) {
  const [, word, rest] = text.match(BEGINS) ?? [null, null, text];
  if (word === "Not believable at this size") return ["Beware", `Not believable at this size: ${rest}`];
  if (word === "If nothing is done") return ["If not", capital(rest)];
  if (text.startsWith(OF_THE_FIT)) return ["Residual", text.slice(OF_THE_FIT.length)];
  if (word) return [word === "WARNING" ? "Warning" : word, /^[a-z]+[ ,]/.test(rest) ? capital(rest) : rest];
  return [BY_WHAT.find(([, of]) => of.test(text))?.[0] ?? "Noted", text];
}

/**
 * @param {Report} report
 * @returns {Child[]}
 */
export function told(report) {
  const { verdict: said, diagnosis, commands_from: commandsFrom } = report;
  const seen = new Set();
  // A curve drawn in letters stands beside the picture of it; the verdict is the heading of the page.
  const sentences = diagnosis.sentences.filter((text) => !text.startsWith("Verdict:"));
  const lines = sentences.map((text) => labelled(text.replace(/[▁-█]{5,} */, "")));
  const tested = lines.filter(([word]) => word !== "Not tested");
  const untested = lines.filter(([word]) => word === "Not tested");
  /** @type {(line: [string, string]) => HTMLElement} */
  const line = ([word, rest]) =>
    element("li", {}, element("b", {}, word), element("span", {}, worded(report, rest, seen)));
  const told = tested.map(line);
  const not = untested.map(([, rest]) => element("li", {}, worded(report, rest, seen)));
  const outside = said.warning && element("p", {}, capital(said.warning.replace(/^warning: /, "")));
  return [
    element("ul", { class: "told" }, told),
    report.ladder?.advice && element("p", { class: "advice" }, worded(report, report.ladder.advice, seen)),
    commandsFrom && element("p", { class: "quiet" }, `Commands are to be given in ${commandsFrom}.`),
    not.length > 0 && unfold("What these data cannot test", element("ul", {}, not)),
    outside && unfold("Poses outside the range that was seen", outside),
  ];
}
