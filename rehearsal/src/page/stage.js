// @ts-check
// The arm among the bodies of the cell, painted as it stands in one picture of the film.

import { eyeOn } from "calibench-report/eye.js";

/** @typedef {import("../../../report/src/page/eye.js").Seen} Seen */
/** @typedef {{ fill: string, edge: string }} Colours */
/** @typedef {NonNullable<SolidBody["box"]>} Box */

// Numbers of a frame in a picture: origin and quaternion.
const FRAME = 7;
// Unit of the quaternions.
const UNIT = 1e-4;

// Corners of a box, and its faces.
const CORNERS = Array.from({ length: 8 }, (_, k) => [k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1]);
const FACES = [
  [0, 1, 3, 2],
  [4, 5, 7, 6],
  [0, 1, 5, 4],
  [2, 3, 7, 6],
  [0, 2, 6, 4],
  [1, 3, 7, 5],
];

/**
 * Moves points of a frame into the world.
 * @param {number[]} picture
 * @param {number | null} frame
 * @returns {(point: number[]) => number[]}
 */
function placer(picture, frame) {
  if (frame === null) return (point) => point;
  const [ox, oy, oz, ...turn] = picture.slice(FRAME * frame, FRAME * (frame + 1));
  const [w, i, j, k] = turn.map((v) => v * UNIT);
  return ([x, y, z]) => {
    // v + 2 w (u x v) + 2 u x (u x v)
    const [a, b, c] = [j * z - k * y, k * x - i * z, i * y - j * x];
    return [
      ox + x + 2 * (w * a + j * c - k * b),
      oy + y + 2 * (w * b + k * a - i * c),
      oz + z + 2 * (w * c + i * b - j * a),
    ];
  };
}

/**
 * What is seen: where its middle lies, and how far it reaches, mm.
 * @param {Rehearsal} rehearsal
 */
export function extent({ tcp_mm: tcp, pictures, bodies }) {
  const [first] = pictures;
  const origins = Array.from({ length: first.length / FRAME }, (_, k) => first.slice(FRAME * k, FRAME * k + 3));
  const balls = bodies.flatMap(({ frame, capsule }) => (frame === null && capsule ? capsule.ends : []));
  const points = [...tcp, ...origins, ...balls];
  const low = [0, 1, 2].map((k) => Math.min(...points.map((p) => p[k])));
  const high = [0, 1, 2].map((k) => Math.max(...points.map((p) => p[k])));
  const centre = low.map((v, k) => (v + high[k]) / 2);
  const away = points.map((point) => Math.hypot(...point.map((v, k) => v - centre[k])));
  // The bodies reach a little farther than these points.
  const radius = 1.15 * Math.max(1, ...away);
  return { centre, radius };
}

/**
 * On paper the picture is drawn in lines, otherwise in pixels.
 * @param {HTMLElement} host
 * @param {Theme} theme
 * @param {object} of
 * @param {number} of.width
 * @param {number} of.height
 * @param {{ azimuth: number, elevation: number, zoom: number }} of.view
 * @param {Rehearsal} of.rehearsal
 * @param {() => { picture: number, motion: Motion }} of.now what is shown
 */
export function paintStage(host, theme, { width, height, view, rehearsal, now }) {
  const { graphic, zrender } = echarts;
  const paper = document.documentElement.hasAttribute("data-print");
  const renderer = zrender.init(host, { renderer: paper ? "svg" : "canvas", width, height });
  const root = new graphic.Group();
  renderer.add(root);
  const seen = { ...extent(rehearsal), width, height };

  /** @type {(a: Seen, b: Seen, style: Option, z2: number) => void} */
  const line = (a, b, style, z2) => {
    const shape = { x1: a[0], y1: a[1], x2: b[0], y2: b[1] };
    root.add(new graphic.Line({ silent: true, z2, shape, style: { lineCap: "round", ...style } }));
  };
  /** @type {(a: Seen, b: Seen, thick: [a: number, b: number], colours: Colours, opacity: number) => void} */
  const rod = (a, b, [first, last], { fill, edge }, opacity) => {
    const depth = 1000 * ((a[2] + b[2]) / 2);
    const lineWidth = Math.max(1.5, first + last);
    // Lines of no length are not drawn.
    const end = /** @type {Seen} */ (Math.hypot(a[0] - b[0], a[1] - b[1]) < 0.1 ? [a[0] + 0.1, ...a.slice(1)] : b);
    line(a, end, { stroke: edge, lineWidth: lineWidth + 1.5, opacity }, depth);
    line(a, end, { stroke: fill, lineWidth, opacity }, depth + 0.1);
  };
  /** @type {(at: (point: number[]) => Seen, box: Box, colours: Colours, opacity: number) => void} */
  const cuboid = (at, { centre, half }, { fill, edge }, opacity) => {
    const corners = CORNERS.map((signs) => at(signs.map((sign, k) => centre[k] + sign * half[k])));
    for (const face of FACES) {
      const of = face.map((k) => corners[k]);
      const depth = of.reduce((sum, [, , d]) => sum + d, 0) / of.length;
      const shape = { points: of.map(([x, y]) => [x, y]) };
      const style = { fill, stroke: edge, lineWidth: 1, opacity };
      root.add(new graphic.Polygon({ silent: true, z2: 1000 * depth, shape, style }));
    }
  };
  const paint = () => {
    root.removeAll();
    const at = eyeOn(seen, view);
    const { picture, motion } = now();
    const shown = rehearsal.pictures[picture];
    /** @type {string[]} */
    const close = motion.gap_mm !== null && motion.gap_mm < 8 ? (motion.between ?? []) : [];
    for (const { name, frame, capsule, box } of rehearsal.bodies) {
      const place = placer(shown, frame);
      const isNear = close.includes(name);
      const plain = frame === null ? { fill: theme.rule, edge: theme.quiet } : { fill: theme.noise, edge: theme.ink };
      const look = isNear ? { fill: theme.candidate, edge: theme.ink } : plain;
      if (capsule) {
        const [a, b] = capsule.ends.map((end) => at(place(end)));
        rod(a, b, [capsule.radius * a[3], capsule.radius * b[3]], look, frame === null ? 0.9 : 0.8);
      }
      if (box) cuboid((point) => at(place(point)), box, look, frame === null ? 0.45 : 0.5);
    }
    if (rehearsal.is_bare) {
      const frames = Array.from({ length: shown.length / FRAME }, (_, k) => at(shown.slice(FRAME * k, FRAME * k + 3)));
      for (const [k, to] of frames.entries()) {
        if (k) rod(frames[k - 1], to, [3, 3], { fill: theme.noise, edge: theme.ink }, 0.9);
      }
    }
    // The path of the TCP: of the whole plan, and up to here.
    const path = rehearsal.tcp_mm.map((point) => at(point));
    const trace = { fill: "none", lineJoin: "round" };
    const lines = (/** @type {Seen[]} */ of, /** @type {Option} */ style, /** @type {number} */ z2) => {
      const shape = { points: of.map(([x, y]) => [x, y]) };
      if (of.length > 1) root.add(new graphic.Polyline({ silent: true, z2, shape, style: { ...trace, ...style } }));
    };
    lines(path, { stroke: theme.quiet, lineWidth: 0.7, opacity: 0.35 }, 2000);
    lines(path.slice(Math.max(0, picture - 40), picture + 1), { stroke: theme.predicted, lineWidth: 2 }, 2001);
    const [cx, cy] = path[picture];
    root.add(new graphic.Circle({ silent: true, z2: 2002, shape: { cx, cy, r: 4 }, style: { fill: theme.predicted } }));
  };
  return { paint, dispose: () => renderer.dispose() };
}
