// @ts-check
// How space is seen from one place.

/** @typedef {[x: number, y: number, depth: number, near: number]} Seen px, how far in front, and px a mm there */
/** @typedef {(point: number[]) => Seen} Eye */

/**
 * Views by a button: azimuth and elevation of the eye, rad.
 * @type {Record<string, [azimuth: number, elevation: number]>}
 */
export const VIEWS = {
  Oblique: [-0.9, 0.42],
  Front: [0, 0],
  Side: [-Math.PI / 2, 0],
  Above: [-Math.PI / 2, Math.PI / 2],
};

// How far the eye is away, in radii of what is seen.
const AWAY = 5;

/**
 * Pixels a mm of what fills a picture.
 * @type {(width: number, height: number, radius: number) => number}
 */
export const filling = (width, height, radius) => (0.6 * Math.min(0.9 * width, height)) / radius;

/**
 * The eye that looks at `centre` in the middle of a picture.
 * @param {{ width: number, height: number, centre: number[], radius: number }} of px and mm
 * @param {{ azimuth: number, elevation: number, zoom: number }} view
 * @returns {Eye}
 */
export function eyeOn({ width, height, centre, radius }, { azimuth, elevation, zoom }) {
  const unit = filling(width, height, radius);
  const [ca, sa] = [Math.cos(azimuth), Math.sin(azimuth)];
  const [ce, se] = [Math.cos(elevation), Math.sin(elevation)];
  return (point) => {
    const [x, y, z] = point.map((v, k) => v - centre[k]);
    const [forward, right] = [x * ca + y * sa, -x * sa + y * ca];
    const depth = (forward * ce + z * se) / radius;
    const near = (unit * zoom * AWAY) / (AWAY - depth);
    return [width / 2 + right * near, height / 2 - (z * ce - forward * se) * near, depth, near];
  };
}
