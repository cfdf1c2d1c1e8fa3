// @ts-check
// The arm and its residuals in space, painted as they are seen from one place.

import { eyeOn, filling } from "./eye.js";
import { lookedAt } from "./linked.js";
import { roundUp, ticks } from "./scales.js";
import { AXES, digits } from "./text.js";

/** @typedef {[x: number, y: number]} Place on the screen, px */
/** @typedef {import("./eye.js").Seen} Seen */
/** @typedef {import("./eye.js").Eye} Eye */

// Number of colours of the arrows.
const SHADES = 12;

// Arrows of one colour, drawn at once: a thousand shapes of their own would turn with a stutter.
const Arrows = echarts.graphic.extendShape({
  type: "arrows",
  shape: { of: [], head: 4 },
  /** @type {(path: CanvasPath, shape: { of: Place[][], head: number }) => void} */
  buildPath(path, { of, head }) {
    for (const [[x1, y1], [x2, y2]] of of) {
      const length = Math.hypot(x2 - x1, y2 - y1);
      const [u, v] = length > 0.5 ? [(x2 - x1) / length, (y2 - y1) / length] : [1, 0];
      const size = Math.min(head, 0.6 * length);
      path.moveTo(x1, y1);
      path.lineTo(x2, y2);
      path.moveTo(x2 - size * (u + 0.5 * v), y2 - size * (v - 0.5 * u));
      path.lineTo(x2, y2);
      path.lineTo(x2 - size * (u - 0.5 * v), y2 - size * (v + 0.5 * u));
    }
  },
});

/**
 * A colour between two, both as #rrggbb.
 * @param {string} from
 * @param {string} to
 * @param {number} t
 */
function between(from, to, t) {
  /** @type {(hex: string, k: number) => number} */
  const part = (hex, k) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16);
  return `rgb(${[0, 1, 2].map((k) => Math.round(part(from, k) + (part(to, k) - part(from, k)) * t)).join(",")})`;
}

/** @param {number[]} v */
const length = (v) => Math.hypot(...v);

/**
 * On paper the picture is drawn in lines, otherwise in pixels: a thousand arrows turn smoothly.
 * @param {HTMLElement} host
 * @param {Theme} theme
 * @param {{ width: number, height: number, view: ViewInSpace, scene: Scene, balls: Ball[] }} of
 */
export function paintSpace(host, theme, { width, height, view, scene, balls }) {
  const { graphic, zrender } = echarts;
  const paper = document.documentElement.hasAttribute("data-print");
  const renderer = zrender.init(host, { renderer: paper ? "svg" : "canvas", width, height });
  const root = new graphic.Group();
  renderer.add(root);
  const unit = filling(width, height, scene.radius);
  /** @type {Place[][]} */
  let tips = [];

  /** @type {(a: Seen, b: Seen, style: Option, z2: number) => void} */
  const line = (a, b, style, z2) => {
    const shape = { x1: a[0], y1: a[1], x2: b[0], y2: b[1] };
    root.add(new graphic.Line({ silent: true, z2, shape, style: { lineCap: "round", ...style } }));
  };
  /** @type {(a: number[], what: string, style?: Option) => void} */
  const text = ([x, y], what, style = {}) => {
    const look = { fill: theme.ink, stroke: theme.paper, lineWidth: 3, fontSize: 12 };
    const place = { align: "center", verticalAlign: "middle" };
    root.add(new graphic.Text({ silent: true, z2: 1e6, x, y, style: { text: what, ...look, ...place, ...style } }));
  };
  /** @type {(at: number[], r: number, style: Option, z2: number) => void} */
  const circle = ([cx, cy], r, style, z2) => {
    root.add(new graphic.Circle({ silent: true, z2, shape: { cx, cy, r }, style }));
  };
  /** @type {(of: Place[][], style: Option, z2: number, head?: number) => void} */
  const several = (of, style, z2, head = 6) => {
    root.add(new Arrows({ silent: true, z2, shape: { of, head }, style: { fill: "none", ...style } }));
  };

  /** @param {Eye} at */
  const floor = (at) => {
    const apart = ticks(2 * scene.radius)[1] / 2;
    const from = [0, 1].map((k) => Math.floor(scene.low[k] / apart) * apart);
    const to = [0, 1].map((k) => Math.ceil(scene.high[k] / apart) * apart);
    const style = { stroke: theme.grid, lineWidth: 1 };
    for (let x = from[0]; x <= to[0] + 1; x += apart) {
      line(at([x, from[1], scene.floor]), at([x, to[1], scene.floor]), style, -1e6);
    }
    for (let y = from[1]; y <= to[1] + 1; y += apart) {
      line(at([from[0], y, scene.floor]), at([to[0], y, scene.floor]), style, -1e6);
    }
    for (const [k, name] of AXES.entries()) {
      const end = [0, 0, 0].map((_, i) => (i === k ? 0.22 * scene.radius : 0));
      line(at([0, 0, 0]), at(end), { stroke: theme.quiet, lineWidth: 1.5 }, -1e5);
      text(at(end.map((v) => 1.15 * v)), name, { fill: theme.quiet });
    }
    return apart;
  };
  /** @type {(at: Eye, chain: number[][]) => void} */
  const arm = (at, chain) => {
    for (const [k, point] of chain.entries()) {
      if (k === 0) continue;
      const [a, b] = [at(chain[k - 1]), at(point)];
      const [c, d] = [chain[k - 1], point].map(([x, y]) => at([x, y, scene.floor]));
      const thick = Math.max(3, 0.055 * scene.radius * (1 - 0.55 * (k / chain.length)) * a[3]);
      line(c, d, { stroke: theme.noise, lineWidth: 0.8 * thick, opacity: 0.13 }, -9e5);
      const depth = (1000 * (a[2] + b[2])) / 2;
      line(a, b, { stroke: theme.ink, lineWidth: thick + 2, opacity: 0.75 }, depth);
      line(a, b, { stroke: between(theme.noise, theme.paper, 0.45), lineWidth: thick }, depth + 0.1);
      circle(a, 0.33 * thick + 1, { fill: theme.paper, stroke: theme.ink, lineWidth: 1 }, depth + 0.2);
    }
  };
  /** @param {Eye} at */
  const ballsOf = (at) => {
    for (const [k, ball] of scene.balls.entries()) {
      if (!ball) continue;
      const [x, y, depth] = at(ball);
      circle([x, y], 7, { fill: theme.paper, stroke: theme.other, lineWidth: 2 }, 1000 * depth);
      if (scene.balls.length <= 12) text([x, y + 16], balls[k].ball, { fill: theme.other });
    }
  };
  /**
   * Arrows but that of the sample shown: those behind the arm are drawn before it and paler, the longest last.
   * @type {(at: Eye, posed: number, opacity: number) => Place[][]}
   */
  const arrowsOf = (at, posed, opacity) => {
    const arrows = scene.arrows[view.model];
    const middle = scene.arms[posed].reduce((sum, point) => sum + at(point)[2], 0) / scene.arms[posed].length;
    /** @type {Place[][][][]} */
    const layers = [0, 1].map(() => Array.from({ length: SHADES }, () => []));
    const places = arrows.map((arrow, k) => {
      const from = scene.arms[k][scene.arms[k].length - 1];
      const [x1, y1, depth] = at(from);
      const [x2, y2] = at(from.map((v, i) => v + (arrow[i] / 1000) * view.enlarged));
      /** @type {Place[]} */
      const ends = [
        [x1, y1],
        [x2, y2],
      ];
      const shade = Math.min(SHADES - 1, Math.floor((length(arrow) / scene.longest) * SHADES));
      if (k !== posed) layers[depth > middle ? 1 : 0][shade].push(ends);
      return ends;
    });
    for (const [front, layer] of layers.entries()) {
      for (const [shade, of] of layer.entries()) {
        const stroke = between(theme.residual, theme.candidate, (shade + 0.5) / SHADES);
        const style = { stroke, lineWidth: 1.5, opacity: opacity * (front ? 0.95 : 0.7) };
        if (of.length) several(of, style, (front ? 2000 : -3000) + shade);
      }
    }
    return places;
  };
  // A round length to read the arrows by, and the distance of the lines on the floor.
  /** @param {number} apart */
  const measures = (apart) => {
    const micro = roundUp((0.12 * scene.radius * 1000) / view.enlarged);
    const long = (micro / 1000) * view.enlarged * unit * view.zoom;
    /** @type {Place[]} */
    const ruler = [
      [14, height - 16],
      [14 + long, height - 16],
    ];
    several([ruler], { stroke: theme.ink, lineWidth: 2 }, 1e6, 7);
    text([14, height - 32], `${digits(micro, 2)} µm`, { align: "left" });
    text([width - 8, height - 14], `grid ${digits(apart, 2)} mm`, { align: "right", fill: theme.quiet });
  };
  const paint = () => {
    root.removeAll();
    const at = eyeOn({ ...scene, width, height }, view);
    const arrows = scene.arrows[view.model];
    const marked = scene.ids.findIndex((id) => id === lookedAt.id);
    const largest = arrows.reduce((most, a, k) => (length(a) > length(arrows[most]) ? k : most), 0);
    const posed = marked >= 0 ? marked : largest;
    const apart = floor(at);
    arm(at, scene.arms[posed]);
    ballsOf(at);
    tips = arrowsOf(at, posed, marked >= 0 ? 0.7 : 1);
    const [a, b] = tips[posed];
    const bright = marked >= 0 ? theme.ink : theme.candidate;
    several([[a, b]], { stroke: bright, lineWidth: 3.4 }, 9e5, 9);
    circle(a, 4, { fill: bright }, 9e5);
    text([b[0], b[1] - 18], scene.ids[posed], { fontWeight: 600 });
    measures(apart);
  };
  /**
   * The sample whose arrow is next to a place.
   * @param {number} x px
   * @param {number} y px
   * @returns {string | null}
   */
  const nearest = (x, y) => {
    let best = 10;
    let id = null;
    for (const [k, [[x1, y1], [x2, y2]]] of tips.entries()) {
      const square = (x2 - x1) ** 2 + (y2 - y1) ** 2;
      const along = ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / square;
      const t = square ? Math.max(0, Math.min(1, along)) : 0;
      const off = Math.hypot(x - x1 - t * (x2 - x1), y - y1 - t * (y2 - y1));
      if (off < best) [best, id] = [off, scene.ids[k]];
    }
    return id;
  };
  return { paint, nearest, dispose: () => renderer.dispose() };
}
