// @ts-check
// Charts on the page: when they are drawn. What they show stands in options.js.

import { drawn } from "./drawn.js";
import { element } from "./elements.js";
import { link } from "./linked.js";

// How long a slice of drawing takes, ms.
const SLICE = 40;

/** @returns {Theme} */
function colours() {
  const style = getComputedStyle(document.documentElement);
  /** @type {(name: keyof Theme) => string} */
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  return {
    ink: of("ink"),
    quiet: of("quiet"),
    paper: of("paper"),
    panel: of("panel"),
    rule: of("rule"),
    grid: of("grid"),
    residual: of("residual"),
    candidate: of("candidate"),
    predicted: of("predicted"),
    measured: of("measured"),
    other: of("other"),
    noise: of("noise"),
    mean: of("mean"),
  };
}

const font = () => getComputedStyle(document.body).fontFamily;

/**
 * A chart that `option(colours, width)` describes; `label` is what it says to those who do not see it.
 * @param {string} label
 * @param {Drawn["height"]} height which may depend on the width, px
 * @param {NonNullable<Drawn["option"]>} option
 */
export function chart(label, height, option) {
  const host = element("div", { class: "chart", role: "img", "aria-label": label });
  // A height that depends on the width is known once it is drawn; until then room is kept for it.
  host.style.height = `${typeof height === "number" ? height : 300}px`;
  drawn.push({ host, height, option, chart: null });
  return host;
}

/** @param {Node} within */
export function draw(within = document) {
  const [theme, fontFamily] = [colours(), font()];
  for (const one of drawn) if (within === document || within.contains(one.host)) drawOne(one, theme, fontFamily);
}

/**
 * Draws those that are in sight at once, the others in slices in which the page still answers.
 * @param {Element[]} parts
 * @param {() => void} then is called when all are drawn
 */
export function drawSoon(parts, then) {
  const ofParts = drawn.filter((one) => parts.some((part) => part.contains(one.host)));
  /** @param {Drawn} one */
  const inSight = ({ host }) => {
    const { top, bottom } = host.getBoundingClientRect();
    return bottom > 0 && top < innerHeight;
  };
  const [theme, fontFamily] = [colours(), font()];
  const first = new Set(ofParts.filter(inSight));
  for (const one of first) drawOne(one, theme, fontFamily);
  const later = ofParts.filter((one) => !first.has(one));
  const slice = () => {
    const until = performance.now() + SLICE;
    for (let one; performance.now() < until && (one = later.shift());) {
      // What has been drawn meanwhile, or is no longer on the page, is not drawn again.
      if (!one.chart && drawn.includes(one)) drawOne(one, colours(), fontFamily);
    }
    if (later.length) setTimeout(slice);
    else then();
  };
  setTimeout(slice);
}

/**
 * @param {Drawn} one
 * @param {Theme} theme
 * @param {string} fontFamily
 */
function drawOne(one, theme, fontFamily) {
  one.chart?.dispose();
  one.chart = null;
  const width = one.host.clientWidth;
  if (!one.host.isConnected || width === 0) return;
  const height = typeof one.height === "number" ? one.height : one.height(width);
  one.host.style.height = `${height}px`;
  if (one.paint) one.chart = one.paint(theme, width, height);
  if (!one.option) return;
  const drawing = echarts.init(one.host, null, { renderer: "svg", width, height });
  const option = one.option(theme, width);
  drawing.setOption({ animation: false, textStyle: { fontFamily }, ...option });
  one.chart = drawing;
  link(one, drawing, option);
}

/**
 * A chart that needs so many pixels, and scrolls where there are fewer.
 * @param {HTMLElement} host
 * @param {number} pixels
 */
export function wide(host, pixels) {
  host.style.minWidth = `${pixels}px`;
  return host;
}
