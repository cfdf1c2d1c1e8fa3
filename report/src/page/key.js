// @ts-check
// What marks mean: drawn as they are in the charts.

import { element } from "./elements.js";

/** @type {Record<string, [tag: string, attributes: Record<string, string | number>][]>} */
const SHAPES = {
  residual: [["circle", { cx: 12, cy: 7, r: 4, style: "fill: var(--residual)" }]],
  diamond: [["path", { d: "M12 1 18 7 12 13 6 7Z", style: "fill: none; stroke: var(--candidate); stroke-width: 2" }]],
  line: [["path", { d: "M1 9 C8 1 14 14 23 5", style: "fill: none; stroke: var(--candidate); stroke-width: 2.5" }]],
  mean: [
    ["path", { d: "M12 0V14", style: "stroke: var(--mean); stroke-width: 1.5" }],
    ["rect", { x: 9, y: 4, width: 6, height: 6, style: "fill: var(--mean)" }],
  ],
};

/** @param {string} kind */
function mark(kind) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 14");
  svg.setAttribute("aria-hidden", "true");
  for (const [tag, attributes] of SHAPES[kind] ?? []) {
    const shape = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) shape.setAttribute(name, String(value));
    svg.append(shape);
  }
  return svg;
}

/** @param {([kind: string, text: string] | null | undefined | false)[]} kinds */
export function key(...kinds) {
  const items = kinds.flatMap((of) => (of ? [element("li", {}, mark(of[0]), of[1])] : []));
  return element("ul", { class: "key" }, items);
}

// Where samples are looked at only after all else has been said.
export const awaited = () => [element("p", { class: "quiet" }, "Looking at every sample …")];
