// @ts-check
// Numbers and words as people read them.

export const AXES = ["x", "y", "z"];

/**
 * A unit as people read it: files write micro as u.
 * @param {string} unit
 */
export function printed(unit) {
  return unit.replace(/^u(?=m|rad)/, "µ");
}

/**
 * Significant digits, without exponents where people do not expect them.
 * @param {number | null | undefined} x
 */
export function digits(x, count = 3) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size < 1e-4 || size >= 1e7) return x.toExponential(1).replace("-", "−");
  return fixed(x, Math.max(0, count - 1 - Math.floor(Math.log10(size))));
}

/**
 * @param {number | null | undefined} x
 * @param {number} places
 */
export function fixed(x, places) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  const text = x.toFixed(Math.min(places, 10));
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** @param {number | null | undefined} x */
export function millimetres(x) {
  return fixed(x, x !== null && Math.abs(x ?? NaN) < 0.1 ? 4 : 3);
}

/**
 * A position error, as the paper prints it.
 * @param {number | null | undefined} x
 */
export function thousandths(x) {
  return fixed(x, 3);
}

/** @param {number} share */
export function percent(share) {
  const of100 = 100 * share;
  if (of100 > 0 && of100 < 0.1) return "< 0.1 %";
  return of100 > 0 && of100 < 1 ? `${of100.toFixed(1)} %` : `${fixed(of100, 0)} %`;
}

/** @param {string} text */
export function signed(text) {
  return text === "–" || text.startsWith("−") ? text : `+${text}`;
}

/**
 * The same with an initial capital.
 * @param {string} text
 */
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
