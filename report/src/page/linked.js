// @ts-check
// A sample that is looked at in one picture is marked in all of them: with a ring in the charts, as an arrow with the
// arm in space.

import { drawn } from "./drawn.js";
import { byId, element } from "./elements.js";
import { digits } from "./text.js";

/** @type {{ id: string | null, watchers: Set<(id: string | null) => void>, frame: number | null }} */
export const lookedAt = { id: null, watchers: new Set(), frame: null };

/**
 * @param {string | null} id
 * @param {string | null} said is read out to those who do not see the rings
 */
export function lookAt(id, said = null) {
  const spoken = byId("spoken");
  if (said && spoken) spoken.textContent = said;
  if (lookedAt.id === id) return;
  lookedAt.id = id;
  // Once a frame, however fast the pointer runs over the points.
  lookedAt.frame ??= requestAnimationFrame(() => {
    lookedAt.frame = null;
    for (const one of drawn) ring(one);
    for (const watcher of lookedAt.watchers) watcher(lookedAt.id);
  });
}

/**
 * The samples of a chart, by their id: where they stand.
 * @param {Option} option
 * @returns {Map<string, Point[]>}
 */
function pointsOf(option) {
  const points = new Map();
  for (const { type, data, name } of [option.series ?? []].flat()) {
    if (type !== "scatter") continue;
    for (const item of data ?? []) {
      const value = item?.value ?? item;
      if (typeof value?.[2] !== "string") continue;
      points.set(value[2], [...(points.get(value[2]) ?? []), { x: value[0], y: value[1], name }]);
    }
  }
  return points;
}

/**
 * Rings around the sample that is looked at.
 * @param {Drawn} one
 */
function ring(one) {
  for (const old of one.rings ?? []) old.remove();
  one.rings = [];
  const points = lookedAt.id === null ? null : one.points?.get(lookedAt.id);
  if (!points || !one.chart?.convertToPixel) return;
  for (const { x, y } of points) {
    const [left, top] = one.chart.convertToPixel({ xAxisIndex: 0, yAxisIndex: 0 }, [x, y]);
    const mark = element("span", { class: "ring" });
    mark.style.left = `${left}px`;
    mark.style.top = `${top}px`;
    one.host.append(mark);
    one.rings.push(mark);
  }
}

/**
 * Links a drawn chart with the other pictures, if it shows samples.
 * @param {Drawn} one
 * @param {Chart} drawing
 * @param {Option} option
 */
export function link(one, drawing, option) {
  const { host } = one;
  one.points = pointsOf(option);
  if (!one.points.size) return;
  drawing.on("mouseover", ({ value }) => typeof value?.[2] === "string" && lookAt(value[2]));
  ring(one);
  if (host.tabIndex === 0) return;
  host.tabIndex = 0;
  host.setAttribute("role", "application");
  host.setAttribute("aria-roledescription", "chart: arrow keys go from sample to sample");
  host.addEventListener("keydown", (event) => {
    if (step(one.points ?? new Map(), event.key)) event.preventDefault();
  });
}

/**
 * Goes to another sample; false if the key leads nowhere.
 * @param {Map<string, Point[]>} points
 * @param {string} key
 */
function step(points, key) {
  if (key === "Escape") {
    lookAt(null, "no sample marked");
    return true;
  }
  const order = [...points].filter(([, of]) => of[0].x !== null).sort(([, a], [, b]) => a[0].x - b[0].x);
  const at = order.findIndex(([id]) => id === lookedAt.id);
  /** @type {Record<string, number | undefined>} */
  const leads = { ArrowRight: at + 1, ArrowLeft: at < 0 ? 0 : at - 1, Home: 0, End: order.length - 1 };
  const next = leads[key];
  if (next === undefined) return false;
  const [id, places] = order[Math.min(order.length - 1, Math.max(0, next))];
  /** @type {(place: Point) => string} */
  const said = ({ x, y, name }) =>
    `${id}: ${name === "candidate" ? "the candidate explains " : ""}${digits(y)} at ${digits(x, 4)}`;
  lookAt(id, places.map(said).join("; "));
  return true;
}
