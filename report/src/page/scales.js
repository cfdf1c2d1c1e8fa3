// @ts-check
// Ranges of axes, and colours of values.

/**
 * The first step that is large enough.
 * @param {number[]} steps of which the last always is
 * @param {(step: number) => boolean} enough
 */
const first = (steps, enough) => steps.find(enough) ?? steps[steps.length - 1];

/**
 * The next larger number whose half is round too.
 * @param {number} x
 */
export function roundUp(x) {
  if (!(x > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(x));
  return power * first([1, 1.2, 1.6, 2, 3, 4, 5, 6, 8, 10], (step) => step * power >= x * 0.999999);
}

/**
 * Round ticks from zero to no less than `x`.
 * @param {number} x
 * @returns {[last: number, distance: number]}
 */
export function ticks(x) {
  const power = 10 ** Math.floor(Math.log10(x / 4 || 1));
  const distance = power * first([1, 2, 2.5, 5, 10], (step) => step * power >= x / 5);
  return [distance * Math.ceil((x * 0.999999) / distance), distance];
}

/** @param {(number | null | undefined)[]} values */
export function largest(values) {
  return values.reduce((/** @type {number} */ most, x) => Math.max(most, Math.abs(x ?? 0)), 0);
}

/**
 * Points of two lists, each with its id; without those of which a half is unknown.
 * @param {(number | null)[]} xs
 * @param {(number | null)[]} ys
 * @param {string[]} [ids]
 */
export const pairs = (xs, ys, ids) =>
  xs.map((x, k) => [x, ys[k], ids?.[k]]).filter(([x, y]) => x !== null && y !== null);

/**
 * The scale cividis (Nunez, Anderton and Renslow 2018), which reads alike with any colour vision, in seven stops.
 * @param {number} t from 0 to 1
 * @returns {[colour: string, ink: string]} the ink is legible on the colour
 */
export function cividis(t) {
  const stops = [
    [0, 34, 78],
    [43, 63, 110],
    [87, 92, 109],
    [124, 123, 120],
    [165, 156, 116],
    [209, 193, 93],
    [254, 232, 56],
  ];
  const at = Math.min(0.9999, Math.max(0, t)) * (stops.length - 1);
  const [low, high, rest] = [stops[Math.floor(at)], stops[Math.floor(at) + 1], at % 1];
  const rgb = low.map((x, k) => Math.round(x + (high[k] - x) * rest));
  return [`rgb(${rgb.join(",")})`, 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2] > 125 ? "#16191d" : "#ffffff"];
}

/**
 * Pixels that the longest of some labels takes.
 * @param {string[]} labels
 * @param {number} size of their letters, px
 */
export const room = (labels, size) => Math.min(165, 14 + 0.64 * size * Math.max(...labels.map((text) => text.length)));
