// @ts-check
// The arm and its residuals in space, drawn by the renderer of the charts. All positions come with the document, in the
// axes of the base.

import { drawn } from "./drawn.js";
import { button, element } from "./elements.js";
import { VIEWS } from "./eye.js";
import { goTo, handle, moved, spaceHost } from "./handling.js";
import { awaited } from "./key.js";
import { lookAt, lookedAt } from "./linked.js";
import { residualMaps } from "./maps.js";
import { paintSpace } from "./painting.js";
import { sceneOf } from "./scene.js";
import { digits, millimetres } from "./text.js";

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function space(report) {
  const { residuals, against } = report;
  if (!residuals) return awaited();
  const { samples, balls, space: given } = residuals;
  if (!given?.arms_mm.length) return null;
  const whole = { ...report, residuals };
  const scene = sceneOf(whole, given);
  const lengths = samples.map((s) => s.length_um);
  const worst = lengths.indexOf(Math.max(...lengths));
  const p90 = [...lengths].sort((a, b) => a - b)[Math.floor(0.9 * (lengths.length - 1))] || 1;
  // At first a large arrow is a tenth of the scene.
  const usual = (0.1 * scene.radius * 1000) / p90;
  const [azimuth, elevation] = VIEWS.Oblique;
  /** @type {ViewInSpace} */
  const view = { azimuth, elevation, zoom: 1, enlarged: usual, model: 0 };
  const host = spaceHost(
    `The arm and ${samples.length} residuals in space: the largest is ${millimetres(lengths[worst] / 1000)} mm at ` +
      `${samples[worst].id}. Arrow keys turn the view, plus and minus zoom, brackets go from sample to sample; ` +
      "all samples are in a table below the residuals.",
  );
  const told = element("p", { class: "quiet told-sample" });
  /** @type {ReturnType<typeof paintSpace> | null} */
  let painter = null;
  const paint = () => painter?.paint();
  drawn.push({
    host,
    height: (width) => (width < 620 ? 360 : 540),
    chart: null,
    paint: (theme, width, height) => {
      painter = paintSpace(host, theme, { width, height, view, scene, balls });
      painter.paint();
      return painter;
    },
  });
  const at = () => {
    const id = lookedAt.id ?? samples[worst].id;
    return Math.max(
      0,
      samples.findIndex((s) => s.id === id),
    );
  };
  const tell = () => {
    const s = samples[at()];
    const ball = s.ball === null ? "" : `, ball ${balls[s.ball].ball}`;
    const [x, y, z] = s.residual_um.map((um) => digits(um));
    const lies = `: residual ${digits(s.length_um)} µm; in the world x ${x}, y ${y}, z ${z} µm`;
    told.replaceChildren(element("b", {}, s.id), ball + lies);
  };
  lookedAt.watchers.clear();
  lookedAt.watchers.add(() => {
    tell();
    paint();
  });
  /** @param {number} by */
  const step = (by) => {
    const s = samples[(at() + by + samples.length) % samples.length];
    lookAt(s.id, `${s.id}: ${digits(s.length_um)} µm`);
  };
  const { turn, zoom } = moved(view, paint);
  /** @param {string | null} id */
  const mark = (id) => lookAt(id, id === null ? "no sample marked" : null);
  tell();
  handle(host, { turn, zoom, step, nearest: (x, y) => painter?.nearest(x, y) ?? null, mark });
  const tools = [
    Object.keys(VIEWS).map((name) => button(name, () => goTo(view, VIEWS[name], paint))),
    button("+", () => zoom(1.25), "Zoom in"),
    button("−", () => zoom(0.8), "Zoom out"),
    button("‹", () => step(-1), "Previous sample"),
    button("›", () => step(1), "Next sample"),
    button("Largest residual", () => lookAt(samples[worst].id)),
    against && chooser(against.names, view, paint),
    enlarger(usual, view, paint),
  ];
  return [
    element("div", { class: "tools" }, tools),
    element("figure", {}, host, told, element("figcaption", {}, colours(residuals, given, scene))),
    residualMaps(report, given),
  ];
}

/**
 * Chooses the model of which the arrows are.
 * @param {string[]} names
 * @param {ViewInSpace} view
 * @param {() => void} paint
 */
function chooser(names, view, paint) {
  const options = names.map((name, k) => element("option", { value: k }, `arrows of ${name}`));
  const made = element("select", { "aria-label": "Arrows of" }, options);
  made.addEventListener("change", () => {
    view.model = Number(made.value);
    paint();
  });
  return made;
}

/**
 * Sets the length of the arrows.
 * @param {number} usual
 * @param {ViewInSpace} view
 * @param {() => void} paint
 */
function enlarger(usual, view, paint) {
  const range = { type: "range", min: "-1", max: "1", step: "0.05", value: "0" };
  const input = element("input", { ...range, "aria-label": "Length of the arrows" });
  const factor = element("span", { class: "quiet" });
  const set = () => {
    const exact = usual * 10 ** Number(input.value);
    view.enlarged = Number(exact.toPrecision(exact > 100 ? 2 : 1));
    factor.textContent = `magnified ${view.enlarged.toLocaleString("en")}×`;
    paint();
  };
  input.addEventListener("input", set);
  set();
  return [element("label", {}, "Arrows ", input), factor];
}

/**
 * What the colours mean, and what is drawn.
 * @param {Residuals} residuals
 * @param {Space} given
 * @param {Scene} scene
 */
function colours({ samples, of }, given, scene) {
  return element(
    "p",
    { class: "quiet scale" },
    "0 ",
    element("span", { class: "gradient arrows", "aria-hidden": "true" }),
    ` ${digits(scene.longest)} µm. An arrow goes from where the model puts the TCP to where it was measured.`,
    " The arm stands as at the sample that is marked; the joints' frames are joined in order.",
    given.balls_mm.length ? " Circles are the balls." : "",
    samples.length < of ? ` Of ${of} samples ${samples.length} are drawn, evenly.` : "",
  );
}
