// @ts-check
// Joint angles in the data, within the limits of the robot.

import { chart } from "./drawing.js";
import { axis, categories, grid, rectangle, tooltip } from "./options.js";
import { fixed } from "./text.js";

/** @param {JointRange[]} ranges */
export function rangeChart(ranges) {
  /** @type {(range: number[], places: number) => string} */
  const span = ([low, high], places) => `${fixed(low, places)} to ${fixed(high, places)}`;
  /** @param {JointRange} r */
  const covered = (r) => `joint ${r.joint} ${span(r.identified_deg, 0)} deg of ${span(r.limits_deg, 0)}`;
  const label = `Joint angles covered: ${ranges.map(covered).join("; ")}`;
  /** @param {Item} item */
  const say = ({ dataIndex }) => {
    const { joint, identified_deg: seen, limits_deg: limits } = ranges[dataIndex];
    return `joint ${joint}\nseen ${span(seen, 1)} deg\nlimits ${span(limits, 1)} deg`;
  };
  return chart(label, 60 + 28 * ranges.length, (theme) => ({
    grid: grid(56, 16, 6, 44),
    tooltip: tooltip(theme, say),
    xAxis: axis(theme, "joint angle, deg", 27),
    yAxis: categories(
      ranges.map((r) => `joint ${r.joint}`),
      { color: theme.quiet, fontSize: 11 },
      { inverse: true },
    ),
    series: [
      {
        type: "custom",
        data: ranges.map((r, k) => [k, ...r.identified_deg, ...r.limits_deg]),
        encode: { y: 0, x: [1, 2, 3, 4] },
        renderItem: (/** @type {unknown} */ _, /** @type {Api} */ api) => {
          /** @type {(from: number, to: number, height: number, style: Option) => Shape} */
          const box = (from, to, height, style) => {
            const [left, y] = api.coord([from, api.value(0)]);
            const [right] = api.coord([to, api.value(0)]);
            return rectangle(left, y - height / 2, right - left, height, style);
          };
          const limits = { fill: "transparent", stroke: theme.noise, lineWidth: 1 };
          const seen = { fill: theme.residual, opacity: 0.8 };
          const bars = [box(api.value(3), api.value(4), 16, limits), box(api.value(1), api.value(2), 10, seen)];
          return { type: "group", children: bars };
        },
      },
    ],
  }));
}
