"use strict";
// The arm and its residuals in space, drawn by the renderer of the charts. All positions come with the document, in the axes of the base.

// Views by a button: azimuth and elevation of the eye, rad.
const VIEWS = { Oblique: [-0.9, 0.42], Front: [0, 0], Side: [-Math.PI / 2, 0], Above: [-Math.PI / 2, Math.PI / 2] };

// How far the eye is away, in radii of the scene.
const EYE = 5;

function space(report) {
  if (!report.residuals) return awaited();
  const { samples, balls, space: given } = report.residuals;
  if (!given?.arms_mm.length) return null;
  const scene = scene_of(report);
  const lengths = samples.map((s) => s.length_um);
  const worst = lengths.indexOf(Math.max(...lengths));
  const view = { azimuth: VIEWS.Oblique[0], elevation: VIEWS.Oblique[1], zoom: 1, enlarged: 0, model: 0 };
  const p90 = [...lengths].sort((a, b) => a - b)[Math.floor(0.9 * (lengths.length - 1))] || 1;
  // At first a large arrow is a tenth of the scene.
  const usual = (0.1 * scene.radius * 1000) / p90;
  view.enlarged = usual;
  const host = element("div", { class: "space", tabindex: "0", role: "application", "aria-roledescription": "view in space",
    "aria-label": `The arm and ${samples.length} residuals in space: the largest is ${millimetres(lengths[worst] / 1000)} mm at ${samples[worst].id}. Arrow keys turn the view, plus and minus zoom, brackets go from sample to sample; all samples are in a table below the residuals.` });
  const told = element("p", { class: "quiet told-sample" });
  const one = { host, height: (width) => (width < 620 ? 360 : 540), paint: null, chart: null };
  let painter = null;
  one.paint = (theme, width, height) => {
    painter = paint_space(host, theme, { width, height, view, scene, report });
    painter.paint();
    return painter;
  };
  drawn.push(one);
  const at = () => Math.max(0, samples.findIndex((s) => s.id === (looked_at.id ?? samples[worst].id)));
  const tell = () => {
    const s = samples[at()];
    told.replaceChildren(element("b", {}, s.id), `${s.ball === null ? "" : `, ball ${balls[s.ball].ball}`}: residual ${digits(s.length_um)} µm; in the world x ${digits(s.residual_um[0])}, y ${digits(s.residual_um[1])}, z ${digits(s.residual_um[2])} µm`);
  };
  looked_at.watchers.clear();
  looked_at.watchers.add(() => { tell(); painter?.paint(); });
  const step = (by) => { const s = samples[(at() + by + samples.length) % samples.length]; look_at(s.id, `${s.id}: ${digits(s.length_um)} µm`); };
  const turn = (azimuth, elevation) => {
    view.azimuth += azimuth;
    view.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, view.elevation + elevation));
    painter?.paint();
  };
  const zoom = (by) => { view.zoom = Math.max(0.5, Math.min(12, view.zoom * by)); painter?.paint(); };
  const button = (name, act, title = null) => { const made = element("button", { type: "button", title, "aria-label": title }, name); made.addEventListener("click", act); return made; };
  const enlarge = element("input", { type: "range", min: "-1", max: "1", step: "0.05", value: "0", "aria-label": "Length of the arrows" });
  const factor = element("span", { class: "quiet" });
  const set_factor = () => {
    view.enlarged = round_near(usual * 10 ** Number(enlarge.value));
    factor.textContent = `drawn ${view.enlarged.toLocaleString("en")} times as long as they are`;
    painter?.paint();
  };
  enlarge.addEventListener("input", set_factor);
  set_factor();
  tell();
  const of_model = report.against && element("select", { "aria-label": "Arrows of" }, report.against.names.map((name, k) => element("option", { value: k }, `arrows of ${name}`)));
  of_model?.addEventListener("change", () => { view.model = Number(of_model.value); painter?.paint(); });
  handle(host, { turn, zoom, step, nearest: (x, y) => painter?.nearest(x, y) });
  const key_of_colours = element("p", { class: "quiet scale" }, "0 ", element("span", { class: "gradient arrows", "aria-hidden": "true" }), ` ${digits(scene.longest)} µm. An arrow goes from where the model puts the TCP to where it was measured.`,
    ` The arm stands as at the sample that is marked; the joints' frames are joined in order.${given.balls_mm.length ? " Circles are the balls." : ""}`,
    samples.length < report.residuals.of ? ` Of ${report.residuals.of} samples ${samples.length} are drawn, evenly.` : "");
  return [
    element("div", { class: "tools" },
      Object.keys(VIEWS).map((name) => button(name, () => go_to(view, VIEWS[name], () => painter?.paint()))),
      button("+", () => zoom(1.25), "Zoom in"), button("−", () => zoom(0.8), "Zoom out"),
      button("‹", () => step(-1), "Previous sample"), button("›", () => step(1), "Next sample"), button("Largest residual", () => look_at(samples[worst].id)),
      of_model, element("label", {}, "Arrows ", enlarge), factor),
    element("figure", {}, host, told, element("figcaption", {}, key_of_colours)),
    residual_maps(report),
  ];
}

// A number of one or two digits near another.
const round_near = (x) => Number(x.toPrecision(x > 100 ? 2 : 1));

// What does not change while one looks: positions in mm, arrows in µm.
function scene_of(report) {
  const { space: given, samples } = report.residuals;
  const arms = given.arms_mm.map((flat) => Array.from({ length: flat.length / 3 }, (_, k) => flat.slice(3 * k, 3 * k + 3)));
  const [low, high] = [[0, 0, 0], [0, 0, 0]];
  for (const point of arms.flat()) for (const k of [0, 1, 2]) { low[k] = Math.min(low[k], point[k]); high[k] = Math.max(high[k], point[k]); }
  const points = arms.flat();
  const centre = [0, 1, 2].map((k) => points.reduce((sum, point) => sum + point[k], 0) / points.length);
  const radius = Math.max(1, ...points.map((point) => Math.hypot(...point.map((x, k) => x - centre[k]))));
  const arrows = [given.arrows_um, report.against?.arrows_um].filter(Boolean);
  const longest = Math.max(1e-9, ...arrows.flat().map((a) => Math.hypot(...a)));
  const floor = Math.min(0, low[2]);
  return { arms, arrows, longest, centre, radius, floor, low, high, ids: samples.map((s) => s.id), balls: given.balls_mm };
}

// From where one looks to another view; at once for those who do not want motion.
function go_to(view, [azimuth, elevation], paint) {
  const from = [view.azimuth, view.elevation];
  view.zoom = 1;
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const [begun, lasts] = [performance.now(), still ? 0 : 350];
  const frame = (now) => {
    const t = lasts ? Math.min(1, Math.max(0, (now - begun) / lasts)) : 1;
    const eased = t * t * (3 - 2 * t);
    view.azimuth = from[0] + (azimuth - from[0]) * eased;
    view.elevation = from[1] + (elevation - from[1]) * eased;
    paint();
    if (t < 1) requestAnimationFrame(frame);
  };
  if (still) frame(begun);
  else requestAnimationFrame(frame);
}

// Mouse, touch and keys. One finger turns sideways and leaves the page its scrolling; two fingers zoom.
function handle(host, { turn, zoom, step, nearest }) {
  const held = new Map();
  let spread = 0;
  const apart = () => { const [a, b] = [...held.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  host.addEventListener("pointerdown", (event) => {
    held.set(event.pointerId, [event.clientX, event.clientY]);
    host.setPointerCapture(event.pointerId);
    if (held.size === 2) spread = apart();
  });
  host.addEventListener("pointermove", (event) => {
    const { left, top } = host.getBoundingClientRect();
    const before = held.get(event.pointerId);
    if (!before) {
      const id = nearest(event.clientX - left, event.clientY - top);
      if (id) look_at(id);
      return;
    }
    held.set(event.pointerId, [event.clientX, event.clientY]);
    if (held.size === 2) { const now = apart(); zoom(now / (spread || now)); spread = now; return; }
    turn(-(event.clientX - before[0]) * 0.008, (event.clientY - before[1]) * 0.008);
  });
  for (const kind of ["pointerup", "pointercancel"]) host.addEventListener(kind, (event) => held.delete(event.pointerId));
  host.addEventListener("click", (event) => {
    const { left, top } = host.getBoundingClientRect();
    const id = nearest(event.clientX - left, event.clientY - top);
    if (id) look_at(id);
  });
  host.addEventListener("wheel", (event) => {
    // The wheel belongs to the page until the view has been chosen.
    if (!event.ctrlKey && document.activeElement !== host) return;
    zoom(event.deltaY < 0 ? 1.1 : 1 / 1.1);
    event.preventDefault();
  }, { passive: false });
  const keys = {
    ArrowLeft: () => turn(0.12, 0), ArrowRight: () => turn(-0.12, 0), ArrowUp: () => turn(0, 0.12), ArrowDown: () => turn(0, -0.12),
    "+": () => zoom(1.15), "=": () => zoom(1.15), "-": () => zoom(1 / 1.15), "]": () => step(1), "[": () => step(-1), Escape: () => look_at(null, "no sample marked"),
  };
  host.addEventListener("keydown", (event) => {
    const act = event.ctrlKey || event.metaKey || event.altKey ? null : keys[event.key];
    if (!act) return;
    act();
    event.preventDefault();
  });
}

// Arrows of one colour, drawn at once: a thousand shapes of their own would turn with a stutter.
const Arrows = echarts.graphic.extendShape({
  type: "arrows", shape: { of: [], head: 4 },
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

// Number of colours of the arrows.
const SHADES = 12;

// A colour between two, both as #rrggbb.
function between(from, to, t) {
  const part = (hex, k) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16);
  return `rgb(${[0, 1, 2].map((k) => Math.round(part(from, k) + (part(to, k) - part(from, k)) * t)).join(",")})`;
}

// On paper the picture is drawn in lines, otherwise in pixels: a thousand arrows turn smoothly.
function paint_space(host, theme, { width, height, view, scene, report }) {
  const { graphic, zrender } = echarts;
  const paper = document.documentElement.hasAttribute("data-print");
  const renderer = zrender.init(host, { renderer: paper ? "svg" : "canvas", width, height });
  const root = new graphic.Group();
  renderer.add(root);
  const unit = (0.6 * Math.min(0.9 * width, height)) / scene.radius;
  let tips = [];

  // Where a point is seen, px, and how far in front of the centre, in radii.
  const eye = () => {
    const [ca, sa, ce, se] = [Math.cos(view.azimuth), Math.sin(view.azimuth), Math.cos(view.elevation), Math.sin(view.elevation)];
    return (point) => {
      const [x, y, z] = point.map((v, k) => v - scene.centre[k]);
      const [forward, right] = [x * ca + y * sa, -x * sa + y * ca];
      const depth = (forward * ce + z * se) / scene.radius;
      const near = (unit * view.zoom * EYE) / (EYE - depth);
      return [width / 2 + right * near, height / 2 - (z * ce - forward * se) * near, depth, near];
    };
  };
  const line = (a, b, style, z2) => root.add(new graphic.Line({ silent: true, z2, shape: { x1: a[0], y1: a[1], x2: b[0], y2: b[1] }, style: { lineCap: "round", ...style } }));
  const text = (a, what, style = {}) => root.add(new graphic.Text({ silent: true, z2: 1e6, x: a[0], y: a[1], style: { text: what, fill: theme.ink, stroke: theme.paper, lineWidth: 3, fontSize: 12, align: "center", verticalAlign: "middle", ...style } }));

  const several = (of, style, z2, head = 6) => root.add(new Arrows({ silent: true, z2, shape: { of, head }, style: { fill: "none", ...style } }));

  const floor = (at) => {
    const apart = ticks(2 * scene.radius)[1] / 2;
    const [from, to] = [[0, 1].map((k) => Math.floor(scene.low[k] / apart) * apart), [0, 1].map((k) => Math.ceil(scene.high[k] / apart) * apart)];
    for (let x = from[0]; x <= to[0] + 1; x += apart) line(at([x, from[1], scene.floor]), at([x, to[1], scene.floor]), { stroke: theme.grid, lineWidth: 1 }, -1e6);
    for (let y = from[1]; y <= to[1] + 1; y += apart) line(at([from[0], y, scene.floor]), at([to[0], y, scene.floor]), { stroke: theme.grid, lineWidth: 1 }, -1e6);
    const axis_length = 0.22 * scene.radius;
    for (const [k, name] of AXES.entries()) {
      const end = [0, 0, 0].map((_, i) => (i === k ? axis_length : 0));
      line(at([0, 0, 0]), at(end), { stroke: theme.quiet, lineWidth: 1.5 }, -1e5);
      text(at(end.map((v) => 1.15 * v)), name, { fill: theme.quiet });
    }
    return apart;
  };
  const arm = (at, chain) => {
    for (const [k, point] of chain.entries()) {
      if (k === 0) continue;
      const [a, b] = [at(chain[k - 1]), at(point)];
      const [c, d] = [chain[k - 1], point].map(([x, y]) => at([x, y, scene.floor]));
      const thick = Math.max(3, 0.055 * scene.radius * (1 - 0.55 * (k / chain.length)) * a[3]);
      line(c, d, { stroke: theme.noise, lineWidth: 0.8 * thick, opacity: 0.13 }, -9e5);
      const depth = 1000 * (a[2] + b[2]) / 2;
      line(a, b, { stroke: theme.ink, lineWidth: thick + 2, opacity: 0.75 }, depth);
      line(a, b, { stroke: between(theme.noise, theme.paper, 0.45), lineWidth: thick }, depth + 0.1);
      root.add(new graphic.Circle({ silent: true, z2: depth + 0.2, shape: { cx: a[0], cy: a[1], r: 0.33 * thick + 1 }, style: { fill: theme.paper, stroke: theme.ink, lineWidth: 1 } }));
    }
  };
  const paint = () => {
    root.removeAll();
    const at = eye();
    const arrows = scene.arrows[view.model];
    const marked = Math.max(scene.ids.indexOf(looked_at.id), -1);
    const posed = marked >= 0 ? marked : arrows.reduce((most, a, k) => (Math.hypot(...a) > Math.hypot(...arrows[most]) ? k : most), 0);
    const apart = floor(at);
    arm(at, scene.arms[posed]);
    for (const [k, ball] of scene.balls.entries()) {
      if (!ball) continue;
      const [x, y, depth] = at(ball);
      root.add(new graphic.Circle({ silent: true, z2: 1000 * depth, shape: { cx: x, cy: y, r: 7 }, style: { fill: theme.paper, stroke: theme.other, lineWidth: 2 } }));
      if (scene.balls.length <= 12) text([x, y + 16], report.residuals.balls[k].ball, { fill: theme.other });
    }
    // Those behind the arm are drawn before it and paler, the longest last.
    const middle = scene.arms[posed].reduce((sum, point) => sum + at(point)[2], 0) / scene.arms[posed].length;
    const layers = [0, 1].map(() => Array.from({ length: SHADES }, () => []));
    tips = arrows.map((arrow, k) => {
      const from = scene.arms[k].at(-1);
      const [a, b] = [at(from), at(from.map((v, i) => v + (arrow[i] / 1000) * view.enlarged))];
      const share = Math.hypot(...arrow) / scene.longest;
      if (k !== posed) layers[a[2] > middle ? 1 : 0][Math.min(SHADES - 1, Math.floor(share * SHADES))].push([a, b]);
      return [a, b];
    });
    for (const [front, layer] of layers.entries()) {
      for (const [shade, of] of layer.entries()) {
        if (of.length) several(of, { stroke: between(theme.residual, theme.candidate, (shade + 0.5) / SHADES), lineWidth: 1.5, opacity: (marked >= 0 ? 0.7 : 1) * (front ? 0.95 : 0.7) }, (front ? 2000 : -3000) + shade);
      }
    }
    const [a, b] = tips[posed];
    const bright = marked >= 0 ? theme.ink : theme.candidate;
    several([[a, b]], { stroke: bright, lineWidth: 3.4 }, 9e5, 9);
    root.add(new graphic.Circle({ silent: true, z2: 9e5, shape: { cx: a[0], cy: a[1], r: 4 }, style: { fill: bright } }));
    text([b[0], b[1] - 18], scene.ids[posed], { fontWeight: 600 });
    // A round length to read the arrows by.
    const [micro] = [round_up((0.12 * scene.radius * 1000) / view.enlarged)];
    const long = (micro / 1000) * view.enlarged * unit * view.zoom;
    several([[[14, height - 16], [14 + long, height - 16]]], { stroke: theme.ink, lineWidth: 2 }, 1e6, 7);
    text([14, height - 32], `${digits(micro, 2)} µm`, { align: "left" });
    text([width - 8, height - 14], `grid ${digits(apart, 2)} mm`, { align: "right", fill: theme.quiet });
  };
  const nearest = (x, y) => {
    let [best, id] = [10, null];
    for (const [k, [[x1, y1], [x2, y2]]] of tips.entries()) {
      const square = (x2 - x1) ** 2 + (y2 - y1) ** 2;
      const t = square ? Math.max(0, Math.min(1, ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / square)) : 0;
      const off = Math.hypot(x - x1 - t * (x2 - x1), y - y1 - t * (y2 - y1));
      if (off < best) [best, id] = [off, scene.ids[k]];
    }
    return id;
  };
  return { paint, nearest, dispose: () => renderer.dispose() };
}
