// @ts-check
// What does not change while one looks at the arm in space.

/** @param {number[]} v */
const length = (v) => Math.hypot(...v);

/**
 * Positions in mm, arrows in µm.
 * @param {WholeReport} report
 * @param {Space} given
 * @returns {Scene}
 */
export function sceneOf(report, given) {
  const arms = given.arms_mm.map((flat) =>
    Array.from({ length: flat.length / 3 }, (_, k) => flat.slice(3 * k, 3 * k + 3)),
  );
  const points = arms.flat();
  const axes = [0, 1, 2];
  const low = axes.map((k) => points.reduce((least, point) => Math.min(least, point[k]), 0));
  const high = axes.map((k) => points.reduce((most, point) => Math.max(most, point[k]), 0));
  const centre = axes.map((k) => points.reduce((sum, point) => sum + point[k], 0) / points.length);
  const radius = Math.max(1, ...points.map((point) => length(point.map((x, k) => x - centre[k]))));
  const arrows = [given.arrows_um];
  if (report.against?.arrows_um) arrows.push(report.against.arrows_um);
  const longest = Math.max(1e-9, ...arrows.flat().map(length));
  const ids = report.residuals.samples.map((s) => s.id);
  return { arms, arrows, longest, centre, radius, floor: Math.min(0, low[2]), low, high, ids, balls: given.balls_mm };
}
