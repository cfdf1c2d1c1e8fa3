"use strict";
// Elements of the page. Text goes in as text, never as markup: names come from files that others wrote.

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return made;
}

// A sentence of the program, what stands between backticks as code.
function sentence(text) {
  return text.split("`").map((part, k) => (k % 2 ? element("code", {}, part) : part));
}

// A sentence of the program with the effects in words: at the first mention, as `seen` knows it, the id stands beside.
function worded(report, text, seen = new Set()) {
  const ids = Object.keys(report.meanings).filter((id) => report.meanings[id].name !== id).sort((a, b) => b.length - a.length);
  if (!ids.length) return sentence(text);
  const any = new RegExp(`(?<![\\w:@])(${ids.map((id) => id.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("|")})(?!\\w|[:@]\\w)`, "g");
  const plain = (part, first) => part.split(any).flatMap((piece, k, pieces) => {
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

// A unit as people read it: files write micro as u.
function printed(unit) {
  return unit.replace(/^u(?=m|rad)/, "µ");
}

// Significant digits, without exponents where people do not expect them.
function digits(x, count = 3) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size < 1e-4 || size >= 1e7) return x.toExponential(1).replace("-", "−");
  return fixed(x, Math.max(0, count - 1 - Math.floor(Math.log10(size))));
}

function fixed(x, places) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  const text = x.toFixed(Math.min(places, 10));
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

function millimetres(x) {
  return fixed(x, x !== null && Math.abs(x) < 0.1 ? 4 : 3);
}

// A position error, as the paper prints it.
function thousandths(x) {
  return fixed(x, 3);
}

function percent(share) {
  const of100 = 100 * share;
  if (of100 > 0 && of100 < 0.1) return "< 0.1 %";
  return of100 > 0 && of100 < 1 ? `${of100.toFixed(1)} %` : `${fixed(of100, 0)} %`;
}

function signed(text) {
  return text === "–" || text.startsWith("−") ? text : `+${text}`;
}

// A share as a number and a bar of that length.
function share(x) {
  const bar = element("i");
  bar.style.width = `${Math.min(100, Math.max(0, 100 * x))}%`;
  return [percent(x), element("span", { class: "share", "aria-hidden": "true" }, bar)];
}

// A table in a frame that scrolls by itself. A column is [heading, cell of a row, class]; the first names the row.
function table(caption, columns, rows, emphasis = () => null) {
  const head = element("tr", {}, columns.map(([heading, , kind]) => element("th", { scope: "col", class: kind }, heading)));
  const cell = (row, [, of, kind], k) => element(k ? "td" : "th", { class: kind, scope: k ? null : "row" }, of(row));
  const body = rows.map((row) => element("tr", { class: emphasis(row) }, columns.map((column, k) => cell(row, column, k))));
  const made = element("table", {}, element("caption", {}, caption), element("thead", {}, head), element("tbody", {}, body));
  return element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": caption }, made);
}

// On paper it is open, unless it is `long`.
function unfold(summary, content, long = false) {
  return element("details", { "data-long": long ? "" : null }, element("summary", {}, summary), content);
}

// The same with an initial capital.
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// An effect in words; of one that the page has no words for, its id.
const named = (report, effect) => report.meanings[effect]?.name ?? effect;

// An effect in words, its id beside.
const with_id = (report, effect) => [named(report, effect), " ", element("code", {}, effect)];

// The effects added in one step, in words; if there are many, their number.
const in_words = (report, added) => (added.length > 3 ? `${added.length} effects at once` : added.map((effect) => named(report, effect)).join(" + "));
