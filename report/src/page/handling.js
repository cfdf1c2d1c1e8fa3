// @ts-check
// A view in space in the hand: mouse, touch and keys.

import { element } from "./elements.js";

/**
 * From where one looks to another view; at once for those who do not want motion.
 * @param {{ azimuth: number, elevation: number, zoom: number }} view
 * @param {number[]} to azimuth and elevation, rad
 * @param {() => void} paint
 */
export function goTo(view, [azimuth, elevation], paint) {
  const from = [view.azimuth, view.elevation];
  view.zoom = 1;
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const [begun, lasts] = [performance.now(), still ? 0 : 350];
  /** @param {number} now */
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

/**
 * The element of a view in space.
 * @param {string} label what it shows, and what its keys do
 */
export const spaceHost = (label) =>
  element("div", {
    class: "space",
    tabindex: "0",
    role: "application",
    "aria-roledescription": "view in space",
    "aria-label": label,
  });

/**
 * What turns a view and brings it nearer.
 * @param {{ azimuth: number, elevation: number, zoom: number }} view
 * @param {() => void} paint
 */
export const moved = (view, paint) => ({
  /** @type {(azimuth: number, elevation: number) => void} */
  turn(azimuth, elevation) {
    view.azimuth += azimuth;
    view.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, view.elevation + elevation));
    paint();
  },
  /** @param {number} by */
  zoom(by) {
    view.zoom = Math.max(0.5, Math.min(12, view.zoom * by));
    paint();
  },
});

/**
 * One finger turns sideways and leaves the page its scrolling; two fingers zoom.
 * @param {HTMLElement} host
 * @param {object} acts
 * @param {(azimuth: number, elevation: number) => void} acts.turn by so much, rad
 * @param {(by: number) => void} acts.zoom
 * @param {(by: number) => void} acts.step from sample to sample
 * @param {(x: number, y: number) => string | null} acts.nearest the sample at a place
 * @param {(id: string | null) => void} acts.mark a sample, or none
 */
export function handle(host, { turn, zoom, step, nearest, mark }) {
  /** @type {Map<number, [x: number, y: number]>} */
  const held = new Map();
  let spread = 0;
  const apart = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  /** @param {MouseEvent} event */
  const point = (event) => {
    const { left, top } = host.getBoundingClientRect();
    const id = nearest(event.clientX - left, event.clientY - top);
    if (id) mark(id);
  };
  host.addEventListener("pointerdown", (event) => {
    held.set(event.pointerId, [event.clientX, event.clientY]);
    host.setPointerCapture(event.pointerId);
    if (held.size === 2) spread = apart();
  });
  host.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) {
      point(event);
      return;
    }
    held.set(event.pointerId, [event.clientX, event.clientY]);
    if (held.size === 2) {
      const now = apart();
      zoom(now / (spread || now));
      spread = now;
      return;
    }
    turn(-(event.clientX - before[0]) * 0.008, (event.clientY - before[1]) * 0.008);
  });
  /** @param {PointerEvent} event */
  const release = (event) => held.delete(event.pointerId);
  host.addEventListener("pointerup", release);
  host.addEventListener("pointercancel", release);
  host.addEventListener("click", point);
  /** @param {WheelEvent} event */
  const wheel = (event) => {
    // The wheel belongs to the page until the view has been chosen.
    if (!event.ctrlKey && document.activeElement !== host) return;
    zoom(event.deltaY < 0 ? 1.1 : 1 / 1.1);
    event.preventDefault();
  };
  host.addEventListener("wheel", wheel, { passive: false });
  /** @type {Record<string, () => void>} */
  const keys = {
    ArrowLeft: () => turn(0.12, 0),
    ArrowRight: () => turn(-0.12, 0),
    ArrowUp: () => turn(0, 0.12),
    ArrowDown: () => turn(0, -0.12),
    "+": () => zoom(1.15),
    "=": () => zoom(1.15),
    "-": () => zoom(1 / 1.15),
    "]": () => step(1),
    "[": () => step(-1),
    Escape: () => mark(null),
  };
  host.addEventListener("keydown", (event) => {
    const act = event.ctrlKey || event.metaKey || event.altKey ? null : keys[event.key];
    if (!act) return;
    act();
    event.preventDefault();
  });
}
