// @ts-check
// Elements of the page. Text goes in as text, never as markup: names come from files that others wrote.

import { capital, percent } from "./text.js";

/**
 * @template {string} K
 * @param {K} id
 */
export const byId = (id) => /** @type {Named<K>} */ (document.getElementById(id));

/**
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, string | number | null | undefined>} attributes
 * @param {Child[]} children
 */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) made.setAttribute(name, String(value));
  }
  made.append(...present(children));
  return made;
}

/**
 * A button.
 * @param {string} name
 * @param {() => void} act
 * @param {string | null} title
 */
export function button(name, act, title = null) {
  const made = element("button", { type: "button", title, "aria-label": title }, name);
  made.addEventListener("click", act);
  return made;
}

/**
 * Children without those that are not there, one after the other.
 * @param {Child} children
 * @returns {(Node | string)[]}
 */
export function present(children) {
  if (children instanceof Node || typeof children === "string") return children === "" ? [] : [children];
  return children ? children.flatMap(present) : [];
}

/**
 * A sentence of the program, what stands between backticks as code.
 * @param {string} text
 */
export function sentence(text) {
  return text.split("`").map((part, k) => (k % 2 ? element("code", {}, part) : part));
}

/**
 * A sentence of the program with the effects in words: at the first mention, as `seen` knows it, the id stands beside.
 * @param {Report} report
 * @param {string} text
 * @param {Set<string>} seen
 * @returns {Child[]}
 */
export function worded(report, text, seen = new Set()) {
  const ids = Object.keys(report.meanings)
    .filter((id) => report.meanings[id].name !== id)
    .sort((a, b) => b.length - a.length);
  if (!ids.length) return sentence(text);
  const any = new RegExp(
    `(?<![\\w:@])(${ids.map((id) => id.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("|")})(?!\\w|[:@]\\w)`,
    "g",
  );
  /** @type {(part: string, first: boolean) => Child[]} */
  const plain = (part, first) =>
    part.split(any).flatMap((piece, k, pieces) => {
      if (k % 2 === 0) return piece;
      // Where words stand before the id already, it is the id beside them.
      if (pieces[k - 1].endsWith("(") && pieces[k + 1].startsWith(")")) return element("code", {}, piece);
      const begins = (first && k === 1 && pieces[0] === "") || /\. $/.test(pieces[k - 1]);
      const words = begins ? capital(named(report, piece)) : named(report, piece);
      if (seen.has(piece)) return words;
      seen.add(piece);
      return [words, " (", element("code", {}, piece), ")"];
    });
  return text.split("`").flatMap((part, k) => (k % 2 ? element("code", {}, part) : plain(part, k === 0)));
}

/**
 * A share as a number and a bar of that length.
 * @param {number} x
 */
export function share(x) {
  const bar = element("i");
  bar.style.width = `${Math.min(100, Math.max(0, 100 * x))}%`;
  return [percent(x), element("span", { class: "share", "aria-hidden": "true" }, bar)];
}

/**
 * What scrolls by itself where it is wider than the page.
 * @param {string} label
 * @param {Child} content
 */
export const scrolling = (label, content) =>
  element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label }, content);

/**
 * A table in a frame that scrolls by itself; the first column names the row.
 * @template R
 * @param {string} caption
 * @param {Column<R>[]} columns
 * @param {R[]} rows
 * @param {(row: R) => string | null} emphasis
 */
export function table(caption, columns, rows, emphasis = () => null) {
  const head = columns.map(([heading, , kind]) => element("th", { scope: "col", class: kind }, heading));
  /** @type {(row: R, column: Column<R>, k: number) => HTMLElement} */
  const cell = (row, [, of, kind], k) => element(k ? "td" : "th", { class: kind, scope: k ? null : "row" }, of(row));
  /** @type {(row: R) => HTMLElement[]} */
  const cells = (row) => columns.map((column, k) => cell(row, column, k));
  const body = rows.map((row) => element("tr", { class: emphasis(row) }, cells(row)));
  const parts = [element("thead", {}, element("tr", {}, head)), element("tbody", {}, body)];
  return scrolling(caption, element("table", {}, element("caption", {}, caption), parts));
}

/**
 * On paper it is open, unless it is `long`.
 * @param {string} summary
 * @param {Child} content
 */
export function unfold(summary, content, long = false) {
  return element("details", { "data-long": long ? "" : null }, element("summary", {}, summary), content);
}

/**
 * What is said in passing.
 * @param {Child[]} content
 */
export const quiet = (...content) => element("p", { class: "quiet" }, content);

/**
 * The title of a picture.
 * @param {Child[]} content
 */
export const title = (...content) => element("p", { class: "title" }, content);

/**
 * A list of lines.
 * @param {Child[]} lines
 */
export const list = (lines) =>
  element(
    "ul",
    {},
    lines.map((line) => element("li", {}, line)),
  );

/**
 * A figure: what it shows, and what is said of it.
 * @param {Child} picture
 * @param {Child} caption
 */
export const figure = (picture, caption) => element("figure", {}, picture, element("figcaption", {}, caption));

/**
 * An effect in words; of one that the page has no words for, its id.
 * @param {Worded} report
 * @param {string} effect
 */
export const named = (report, effect) => report.meanings[effect]?.name ?? effect;

/**
 * An effect in words, its id beside.
 * @param {Worded} report
 * @param {string} effect
 */
export const withId = (report, effect) => [named(report, effect), " ", element("code", {}, effect)];

/**
 * The effects added in one step, in words; if there are many, their number.
 * @param {Worded} report
 * @param {string[]} added
 */
export const inWords = (report, added) =>
  added.length > 3 ? `${added.length} effects at once` : added.map((effect) => named(report, effect)).join(" + ");
